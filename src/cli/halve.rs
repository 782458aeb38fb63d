//! `spikeloop halve`.

use std::path::Path;

use spikeloop::files;
use spikeloop::floats::halved;
use spikeloop::net::{EemSan, NetError};

use crate::cli::args::HalveArgs;
use crate::cli::output::{self, check_outputs, header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &HalveArgs) -> Result<Verdict, Failure> {
    let file = args.weights.display().to_string();
    check_outputs([&args.output], [args.weights.as_path()])?;
    let bytes = files::read_bytes(&args.weights)?;
    opens(&args.weights, &bytes)?;
    let half = halved(&file, &bytes)?;
    opens(&args.output, &half.bytes)?;
    say(header(None, &[]))?;
    say(format_args!(
        "{} weights of 16 bits, changed by at most {:.1e} of the largest of their layer; {} bytes, \
         {} before",
        half.numbers,
        half.change_max,
        half.bytes.len(),
        bytes.len()
    ))?;
    output::write(&args.output, &half.bytes)?;
    Ok(Verdict::Good)
}

/// Errs for an EEM-SAN's weights that make no network, before and after: a width may have become 0.
fn opens(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let file = path.display().to_string();
    match EemSan::from_bytes(&file, &file, bytes) {
        // Weights of a description, which says how they go together.
        Ok(_) | Err(NetError::NotEemSan { .. }) => Ok(()),
        Err(error) => Err(error.into()),
    }
}
