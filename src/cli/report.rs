//! `spikeloop report`.

use std::path::Path;

use spikeloop::files;
use spikeloop::report::page::page;
use spikeloop::report::results::{DriveResult, RESULT_FORMAT};

use crate::cli::args::ReportArgs;
use crate::cli::{Failure, Verdict, output};

pub(super) fn run(args: &ReportArgs) -> Result<Verdict, Failure> {
    let results: Vec<(String, DriveResult)> = args
        .results
        .iter()
        .map(|path| Ok((path.display().to_string(), read(path)?)))
        .collect::<Result<_, Failure>>()?;
    output::write(&args.output, page(&results).as_bytes())?;
    Ok(Verdict::Good)
}

fn read(path: &Path) -> Result<DriveResult, Failure> {
    let file = path.display();
    let text = files::read_text(path)?;
    let result: DriveResult = serde_json::from_str(&text)
        .map_err(|e| format!("{file}: not a result of `spikeloop drive --json` ({e})"))?;
    if result.format != RESULT_FORMAT {
        return Err(format!(
            "{file}: format {} found, {RESULT_FORMAT} expected; drive again",
            result.format
        )
        .into());
    }
    Ok(result)
}
