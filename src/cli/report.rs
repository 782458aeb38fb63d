//! `spikeloop report`.

use std::path::{Path, PathBuf};

use spikeloop::files;
use spikeloop::report::page::page;
use spikeloop::report::results::DriveResult;

use crate::cli::args::ReportArgs;
use crate::cli::output::{check_outputs, header, say};
use crate::cli::{Failure, Verdict, output};

pub(super) fn run(args: &ReportArgs) -> Result<Verdict, Failure> {
    check_outputs([&args.output], args.results.iter().map(PathBuf::as_path))?;
    let results: Vec<(String, DriveResult)> = args
        .results
        .iter()
        .map(|path| Ok((path.display().to_string(), read(path)?)))
        .collect::<Result<_, Failure>>()?;
    say(header(None, &maps(&results)))?;
    output::write(&args.output, page(&results).as_bytes())?;
    Ok(Verdict::Good)
}

fn read(path: &Path) -> Result<DriveResult, Failure> {
    Ok(DriveResult::from_json(&path.display().to_string(), &files::read_text(path)?)?)
}

/// Core maps of all results, each once.
fn maps(results: &[(String, DriveResult)]) -> Vec<(String, String)> {
    let drivers = results.iter().flat_map(|(_, result)| &result.drivers);
    let mut maps: Vec<_> =
        drivers.filter_map(|d| Some((d.label.clone(), d.map_digest.clone()?))).collect();
    maps.sort_unstable();
    maps.dedup();
    maps
}
