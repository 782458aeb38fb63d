//! `spikeloop thresholds`.

use std::path::Path;

use spikeloop::evaluate::Driver;
use spikeloop::net::{Controller, builtin};
use spikeloop::report::thresholds::{
    Thresholds, ThresholdsResult, thresholds_picture, thresholds_table,
};

use crate::cli::args::ThresholdsArgs;
use crate::cli::drivers::check_weights;
use crate::cli::output::{self, REVISION, check_outputs, header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &ThresholdsArgs) -> Result<Verdict, Failure> {
    let inputs = args.networks.iter().map(Path::new).chain(args.weights.as_deref());
    check_outputs(args.output.iter().chain(&args.json), inputs)?;
    check_weights(&args.networks, args.weights.as_deref())?;
    let networks: Vec<Thresholds> =
        args.networks.iter().map(|name| read(name, args)).collect::<Result<_, Failure>>()?;
    say(header(None, &[]))?;
    say(thresholds_table(&networks))?;
    if let Some(path) = &args.output {
        output::write(path, thresholds_picture(&networks).as_bytes())?;
    }
    if let Some(path) = &args.json {
        let result = ThresholdsResult { revision: REVISION.to_owned(), thresholds: networks };
        output::write(path, &serde_json::to_vec_pretty(&result)?)?;
    }
    Ok(Verdict::Good)
}

fn read(name: &str, args: &ThresholdsArgs) -> Result<Thresholds, Failure> {
    let weights = args.weights.as_deref().filter(|_| builtin::takes_weights(name));
    let network = builtin::open(name, weights)?;
    match &network {
        Controller::EemSan(moving) if moving.dynamic.is_some() => Err(format!(
            "{name}: dynamic thresholds (BDETT), one for each neuron and step and none for a layer; \
             leave it out"
        )
        .into()),
        _ => Ok(thresholds_of(name, &network)),
    }
}

/// Thresholds of a network; `name` is what it is called there.
pub(super) fn thresholds_of(name: &str, network: &Controller) -> Thresholds {
    let digest = Driver::controller(network).digest;
    Thresholds { network: name.to_owned(), digest, layers: network.thresholds() }
}
