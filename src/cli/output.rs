//! Printing and writing, the same for every verb.

use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::CommandFactory;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use spikeloop::world::arena::split_room;
use spikeloop::{files, net};

use crate::cli::drivers::network_of;
use crate::cli::{Args, Failure};

/// Revision of the source that this binary was built from.
pub(super) const REVISION: &str = env!("SPIKELOOP_REVISION");

/// Prints a line, or several.
///
/// When nobody reads any more (`| head -1`) the work goes on in silence: there may be files to
/// write. `println!` would panic there.
pub(super) fn say(text: impl Display) -> Result<(), Failure> {
    let (mut out, text) = (std::io::stdout().lock(), visible(text));
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(format!("standard output: cannot write: {error}").into())
        }
        _ => Ok(()),
    }
}

/// Text without control characters but ends of lines: names in files may hold what moves the cursor or
/// colours the terminal.
fn visible(text: impl Display) -> String {
    let shown = |c: char| if c.is_control() && c != '\n' { char::REPLACEMENT_CHARACTER } else { c };
    text.to_string().chars().map(shown).collect()
}

/// Prints an error where the user sees it.
pub(crate) fn complain(error: &Failure) {
    // Nothing to do when standard error is closed as well: the exit code says it.
    let _ = writeln!(std::io::stderr(), "error: {}", visible(error));
}

/// First line of every run: what is needed to repeat it.
pub(super) fn header(seed: Option<u64>, maps: &[(String, String)]) -> String {
    let seed = seed.map_or_else(|| "none".to_owned(), |seed| seed.to_string());
    let maps: Vec<String> = maps.iter().map(|(name, digest)| format!("{name} {digest}")).collect();
    let maps = if maps.is_empty() { "none".to_owned() } else { maps.join(", ") };
    format!("seed {seed} | revision {REVISION} | core map {maps}")
}

/// Errs now when any of the outputs could not be written at the end, or would replace an input or
/// another output.
pub(super) fn check_outputs<'a>(
    outputs: impl IntoIterator<Item = &'a PathBuf>,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let mut taken: Vec<PathBuf> = inputs.into_iter().flat_map(read_with).collect();
    for output in outputs {
        if taken.iter().any(|path| same_file(path, output)) {
            return Err(format!(
                "{}: is an input or another output as well; give the output a name of its own",
                output.display()
            )
            .into());
        }
        files::check_writable(output)?;
        taken.push(output.clone());
    }
    Ok(())
}

/// Makes a folder for pictures; errs when an output is of their kind and lies there, where one of
/// them could replace it.
pub(super) fn picture_folder<'a>(
    folder: &Path,
    kind: &str,
    outputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| format!("{}: cannot make the folder: {e}", folder.display()))?;
    let picture = folder.join("picture");
    for output in outputs {
        let is_picture = output.extension().is_some_and(|is| is.eq_ignore_ascii_case(kind));
        if is_picture && place(&output.with_file_name("picture")) == place(&picture) {
            return Err(format!(
                "{}: lies among the pictures of {}, which could replace it; write it elsewhere",
                output.display(),
                folder.display()
            )
            .into());
        }
    }
    Ok(())
}

/// An input and what is read with it; of a network to be compiled, the network, of a room of an
/// arena file, the file.
fn read_with(input: &Path) -> Vec<PathBuf> {
    let input = input.to_str().map_or(input, |name| Path::new(network_of(name)));
    let file = input.to_str().map(|name| PathBuf::from(split_room(name).0));
    [input.to_path_buf()].into_iter().chain(file).chain(net::weights_beside(input)).collect()
}

/// Whether two paths lead to one regular file, or to one place where nothing is yet.
fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b && a.is_file(),
        (Err(_), Err(_)) => place(a) == place(b),
        _ => false,
    }
}

/// Where a file that does not exist would be.
fn place(path: &Path) -> PathBuf {
    match (files::folder_of(path).canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

/// Writes a file whole or not at all, and says so.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::write_atomically(path, bytes)?;
    say(format_args!("wrote {}", path.display()))
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
pub(super) fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "spikeloop", &mut script);
    say(String::from_utf8_lossy(&script).trim_end())
}
