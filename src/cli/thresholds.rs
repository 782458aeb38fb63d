//! `spikeloop thresholds`.

use std::path::Path;

use spikeloop::net::builtin;
use spikeloop::report::thresholds::{Thresholds, thresholds_picture, thresholds_table};

use crate::cli::args::ThresholdsArgs;
use crate::cli::output::{self, check_outputs, header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &ThresholdsArgs) -> Result<Verdict, Failure> {
    let inputs = args.networks.iter().map(Path::new).chain(args.weights.as_deref());
    check_outputs(&args.output, inputs)?;
    if let (Some(weights), false) =
        (&args.weights, args.networks.iter().any(|name| builtin::takes_weights(name)))
    {
        return Err(format!(
            "{}: weights are for networks with a description, and there is none; leave --weights \
             out",
            weights.display()
        )
        .into());
    }
    let networks: Vec<Thresholds> =
        args.networks.iter().map(|name| read(name, args)).collect::<Result<_, Failure>>()?;
    say(header(None, &[]))?;
    say(thresholds_table(&networks))?;
    if let Some(path) = &args.output {
        output::write(path, thresholds_picture(&networks).as_bytes())?;
    }
    Ok(Verdict::Good)
}

fn read(name: &str, args: &ThresholdsArgs) -> Result<Thresholds, Failure> {
    let weights = args.weights.as_deref().filter(|_| builtin::takes_weights(name));
    let layers = builtin::open(name, weights)?.thresholds();
    Ok(Thresholds { network: name.to_owned(), layers })
}
