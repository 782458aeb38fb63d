//! `spikeloop report`.

use std::path::PathBuf;

use spikeloop::files;
use spikeloop::report::Report;
use spikeloop::report::page::page;
use spikeloop::report::replay::{Replay, frame_picture};

use crate::cli::args::ReportArgs;
use crate::cli::output::{REVISION, check_outputs, header, say};
use crate::cli::{Failure, Verdict, output};

pub(super) fn run(args: &ReportArgs) -> Result<Verdict, Failure> {
    let outputs = args.output.iter().chain(&args.json).chain(&args.picture);
    check_outputs(outputs, args.results.iter().map(PathBuf::as_path))?;
    let mut report = Report::new(REVISION);
    for path in &args.results {
        report.add(&path.display().to_string(), &files::read_text(path)?)?;
    }
    let picture =
        args.picture.as_ref().map(|path| still(&report, args.tick).map(|svg| (path, svg)));
    let picture = picture.transpose()?;
    say(header(None, &report.maps()))?;
    if let Some((path, svg)) = picture {
        output::write(path, svg.as_bytes())?;
    }
    write(&report, args.output.as_ref(), args.json.as_ref())?;
    Ok(Verdict::Good)
}

/// Writes page and data of a report, where they are wanted.
pub(super) fn write(
    report: &Report,
    html: Option<&PathBuf>,
    json: Option<&PathBuf>,
) -> Result<(), Failure> {
    if let Some(path) = html {
        output::write(path, page(report).as_bytes())?;
    }
    if let Some(path) = json {
        output::write(path, &serde_json::to_vec(report)?)?;
    }
    Ok(())
}

/// A still picture of the first trial of the first replay, at `tick` or in its middle.
fn still(report: &Report, tick: Option<usize>) -> Result<String, Failure> {
    let mut replays = report.replays().map(|(_, replay)| replay);
    let has_trials = |replay: &&Replay| !replay.episodes.is_empty();
    let replay = replays.find(has_trials).ok_or(
        "--picture: no replay among the results; give a file that `spikeloop drive --replay` wrote",
    )?;
    let ticks = replay.episodes[0].ticks.len();
    match tick.filter(|tick| *tick >= ticks) {
        Some(tick) => {
            Err(format!("--tick {tick}: the trial has {ticks} ticks; give one below that").into())
        }
        None => Ok(frame_picture(replay, 0, tick.unwrap_or(ticks / 2))),
    }
}
