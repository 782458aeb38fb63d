//! `spikeloop trace`.

use std::path::{Path, PathBuf};

use spikeloop::golden::{self, GoldenError};

use crate::cli::args::{TraceArgs, TraceVerb};
use crate::cli::output::{header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &TraceArgs) -> Result<Verdict, Failure> {
    say(header(None, &[]))?;
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
    each(paths, |file| {
        let changed = golden::record(file)?;
        let word = if changed { "changed  " } else { "unchanged" };
        Ok(format!("{word} {}", file.display()))
    })
}

fn check(paths: &[PathBuf]) -> Result<Verdict, Failure> {
    each(paths, |file| {
        let engines = golden::check(file)?;
        Ok(format!("same by {engines} engines  {}", file.display()))
    })
}

/// Says what `work` says of each file; a difference is told and does not stop the others.
fn each(
    paths: &[PathBuf],
    work: impl Fn(&Path) -> Result<String, GoldenError>,
) -> Result<Verdict, Failure> {
    let mut verdict = Verdict::Good;
    for file in files(paths)? {
        match work(&file) {
            Ok(line) => say(line)?,
            Err(GoldenError::Differs(mismatch)) => {
                say(mismatch)?;
                verdict = Verdict::Differs;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(verdict)
}
