//! Printing and writing, the same for every verb.

use std::io::IsTerminal;
use std::path::Path;

use clap::CommandFactory;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use spikeloop::files;

use crate::cli::{Args, Failure};

/// Revision of the source that this binary was built from.
pub(super) const REVISION: &str = env!("SPIKELOOP_REVISION");

/// First line of every run: what is needed to repeat it.
pub(super) fn print_header(seed: Option<u64>, maps: &[(String, String)]) {
    let seed = seed.map_or_else(|| "none".to_owned(), |seed| seed.to_string());
    let maps: Vec<String> = maps.iter().map(|(name, digest)| format!("{name} {digest}")).collect();
    let maps = if maps.is_empty() { "none".to_owned() } else { maps.join(", ") };
    println!("seed {seed} | revision {REVISION} | core map {maps}");
}

/// Writes a file whole or not at all, and says so.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::write_atomically(path, bytes)?;
    println!("wrote {}", path.display());
    Ok(())
}

/// A bar with time left on a terminal; nothing where nobody looks.
pub(super) fn progress(total: u64, label: &str) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let style =
        ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} [{elapsed}, {eta} left]")
            .expect("the template is well-formed");
    ProgressBar::with_draw_target(Some(total), target)
        .with_style(style)
        .with_message(label.to_owned())
}

/// Prints a completion script.
pub(super) fn completions(shell: clap_complete::Shell) {
    clap_complete::generate(shell, &mut Args::command(), "spikeloop", &mut std::io::stdout());
}
