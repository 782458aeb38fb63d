//! Golden traces of three kinds, told apart by their first line: a hand-written core map
//! (`chip ...`, see [`hw_model::trace`]), a compiled network (`network ...`) and a closed loop
//! (`loop ...`).
//!
//! A file holds input and expectation together; only what stands below the separator is ever
//! rewritten. `traces/README.md` has the grammar.

mod eem_san;
mod head;
mod network_loop;
mod small_eem_san;

use std::path::{Path, PathBuf};

use hw_model::trace::{Mismatch, SEPARATOR, Trace, TraceError};
use thiserror::Error;

use crate::compile::{ChipOpenError, CompileError};
use crate::files::{self, FileError};
use crate::net::NetError;
use crate::world::arena::ArenaError;
use head::Head;

/// Name of the extension of trace files.
const EXTENSION: &str = "trace";

/// A trace that cannot be run, or that came out differently.
#[derive(Debug, Error)]
pub enum GoldenError {
    /// Cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// Cannot be written.
    #[error(transparent)]
    Write(#[from] hw_model::error::ContainerError),
    /// A chip trace that is not well-formed.
    #[error(transparent)]
    Chip(#[from] TraceError),
    /// A line of a network or loop trace that is not well-formed.
    #[error("{file}:{line}: {found}; expected {expected}")]
    Line {
        /// The file.
        file: String,
        /// Line number from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// Neither of a chip nor of a network nor of a loop.
    #[error(
        "{file}: no line `chip NAME`, `network NAME` or `loop NAME`, one of which says what is traced; \
         see traces/README.md"
    )]
    NoKind {
        /// The file.
        file: String,
    },
    /// The network of a trace cannot be had.
    #[error("{file}: {source}")]
    Network {
        /// The file.
        file: String,
        /// The reason.
        source: Box<NetError>,
    },
    /// The network of a trace does not compile.
    #[error("{file}: {source}")]
    Compile {
        /// The file.
        file: String,
        /// The reason.
        source: Box<CompileError>,
    },
    /// The chip of a trace cannot be had.
    #[error("{file}: {source}")]
    ChipFile {
        /// The file.
        file: String,
        /// The reason.
        source: Box<ChipOpenError>,
    },
    /// The arena of a trace cannot be had.
    #[error("{file}: {source}")]
    Arena {
        /// The file.
        file: String,
        /// The reason.
        source: Box<ArenaError>,
    },
    /// Another setting of a loop is out of range.
    #[error("{file}: {message}")]
    Setting {
        /// The file.
        file: String,
        /// The reason.
        message: String,
    },
    /// No trace where one was asked for.
    #[error("{path}: no trace files (*.trace) there")]
    Nothing {
        /// The path.
        path: String,
    },
    /// An engine gives another result.
    #[error("{0}")]
    Differs(Box<Mismatch>),
}

/// Trace files at `path`: itself, or all below it in order.
///
/// Errors: nothing there, or a folder that cannot be read.
pub fn find(path: &Path) -> Result<Vec<PathBuf>, GoldenError> {
    let mut found = Vec::new();
    collect(path, &mut found)?;
    found.sort();
    if found.is_empty() {
        return Err(GoldenError::Nothing { path: path.display().to_string() });
    }
    Ok(found)
}

fn collect(path: &Path, found: &mut Vec<PathBuf>) -> Result<(), GoldenError> {
    let io = |source| FileError::Io { file: path.display().to_string(), source };
    if !path.is_dir() {
        path.metadata().map_err(io)?;
        found.push(path.to_path_buf());
        return Ok(());
    }
    for entry in std::fs::read_dir(path).map_err(io)? {
        let entry = entry.map_err(io)?.path();
        if entry.is_dir() {
            collect(&entry, found)?;
        } else if entry.extension().is_some_and(|extension| extension == EXTENSION) {
            found.push(entry);
        }
    }
    Ok(())
}

/// Runs a trace through every engine; returns how many agree: all.
///
/// Errors: a trace that cannot be run; [`GoldenError::Differs`] with the first difference.
pub fn check(path: &Path) -> Result<usize, GoldenError> {
    check_text(&path.display().to_string(), &files::read_text(path)?)
}

/// The same from memory; `file` is the name that errors mention.
pub fn check_text(file: &str, text: &str) -> Result<usize, GoldenError> {
    if first_word(text) == Some("chip") {
        return Trace::parse(file, text)?.check_all().map_err(GoldenError::Differs);
    }
    let (head, expected) = split(text);
    let head_lines = head.lines().count();
    let runs = network_loop::run_all(&Head::parse(file, &head)?)?;
    compare(file, head_lines + 2, &expected, &runs)
}

/// Writes the expectation anew; true when the file changed.
///
/// Errors: as [`check`], but only engines that differ from each other are a difference.
pub fn record(path: &Path) -> Result<bool, GoldenError> {
    let text = files::read_text(path)?;
    let updated = updated_text(&path.display().to_string(), &text)?;
    if updated != text {
        files::write_atomically(path, updated.as_bytes())?;
    }
    Ok(updated != text)
}

fn updated_text(file: &str, text: &str) -> Result<String, GoldenError> {
    if first_word(text) == Some("chip") {
        return Trace::parse(file, text)?.updated_text().map_err(GoldenError::Differs);
    }
    let (head, _) = split(text);
    let runs = network_loop::run_all(&Head::parse(file, &head)?)?;
    let expected = &runs[0].1;
    compare(file, head.lines().count() + 2, expected, &runs)?;
    Ok(format!("{head}{SEPARATOR}\n{}\n", expected.join("\n")))
}

/// First word of the first line that is not a comment.
fn first_word(text: &str) -> Option<&str> {
    let said = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with(';'));
    said.and_then(|line| line.split_whitespace().next())
}

/// What stands above the separator, and the lines below it.
fn split(text: &str) -> (String, Vec<String>) {
    let is_separator = |line: &&str| line.starts_with("---");
    let head = text.lines().take_while(|line| !is_separator(line)).map(|line| format!("{line}\n"));
    let below = text.lines().skip_while(|line| !is_separator(line)).skip(1);
    (head.collect(), below.map(str::to_owned).collect())
}

fn compare(
    file: &str,
    first_line: usize,
    expected: &[String],
    runs: &[(String, Vec<String>)],
) -> Result<usize, GoldenError> {
    for (engine, got) in runs {
        if let Some(mismatch) = Mismatch::find(file, engine, first_line, expected, got) {
            return Err(GoldenError::Differs(Box::new(mismatch)));
        }
    }
    Ok(runs.len())
}

#[cfg(test)]
#[path = "golden_tests.rs"]
mod tests;
