//! `spikeloop trace`.

use crate::cli::args::TraceArgs;
use crate::cli::{Failure, Verdict};

pub(super) fn run(_args: &TraceArgs) -> Result<Verdict, Failure> {
    Ok(Verdict::Good)
}
