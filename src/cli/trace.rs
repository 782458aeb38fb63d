//! `spikeloop trace`.

use std::path::PathBuf;

use spikeloop::golden::{self, GoldenError};

use crate::cli::args::{TraceArgs, TraceVerb};
use crate::cli::output::print_header;
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &TraceArgs) -> Result<Verdict, Failure> {
    print_header(None, &[]);
    match &args.verb {
        TraceVerb::Record { paths } => record(paths),
        TraceVerb::Check { paths } => check(paths),
    }
}

fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let default = [PathBuf::from("traces")];
    let paths = if paths.is_empty() { &default[..] } else { paths };
    let mut files = Vec::new();
    for path in paths {
        files.extend(golden::find(path)?);
    }
    Ok(files)
}

fn record(paths: &[PathBuf]) -> Result<Verdict, Failure> {
    for file in files(paths)? {
        let changed = golden::record(&file)?;
        println!("{} {}", if changed { "changed  " } else { "unchanged" }, file.display());
    }
    Ok(Verdict::Good)
}

fn check(paths: &[PathBuf]) -> Result<Verdict, Failure> {
    let mut verdict = Verdict::Good;
    for file in files(paths)? {
        match golden::check(&file) {
            Ok(engines) => println!("same by {engines} engines  {}", file.display()),
            Err(GoldenError::Differs(mismatch)) => {
                println!("{mismatch}");
                verdict = Verdict::Differs;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(verdict)
}
