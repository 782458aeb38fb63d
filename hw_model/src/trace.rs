//! Golden traces: a map, its input and what the chip does with it, in one text file that every
//! engine must reproduce line by line.
//!
//! ```text
//! ; lif: half of the current and three quarters of the voltage remain
//! chip loihi1
//! detail compartment
//! core 000 label lif
//! ...                                    the map, as crate::core_map writes it
//! input t=00 port=in line=0              the host makes line 0 spike in step 0
//! input t=03..06 port=in line=1          ... and line 1 in steps 3, 4 and 5
//! run 7
//! --- below: expectation ...
//! t=0001 core=000 cx=0000 u=-0000448 v=-0000448 s=0 r=00
//! ...
//! total synaptic_ops_dense 1
//! ...
//! time davies2018 ps 123456
//! ```
//! Only what stands below `---` is ever rewritten.

use std::sync::Arc;

use crate::core_map::CoreMap;
use crate::engine::{DenseEngine, Engine, EventEngine, Stimulus};
use crate::error::{ChipError, MapError, TextError};

mod mismatch;
mod observe;
mod read;

pub use mismatch::{Mismatch, TotalChange};
pub use observe::{Detail, Observer, observe, state_digest, total_lines};

/// The line that starts an expectation.
pub const SEPARATOR: &str = "--- below: expectation, update with `UPDATE_GOLDEN=1 cargo test` or `spikeloop trace record FILE`";

/// Most steps of a trace: a bound for files that ask for more than anyone would read.
pub const STEPS_MAX: usize = 100_000;

/// A trace file, read and checked.
#[derive(Debug, Clone)]
pub struct Trace {
    place: String,
    /// Everything down to the separator, which is its last line.
    head: String,
    map: Arc<CoreMap>,
    detail: Detail,
    stimulus: Stimulus,
    expected: Vec<String>,
}

/// A trace file that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// A line does not say what it should.
    #[error(transparent)]
    Text(#[from] TextError),
    /// There is no such chip.
    #[error("{place}: {reason}")]
    Chip {
        /// The file.
        place: String,
        /// The reason.
        reason: ChipError,
    },
    /// The map does not fit its chip.
    #[error("{place}: {reason}")]
    Map {
        /// The file.
        place: String,
        /// The reason.
        reason: Box<MapError>,
    },
}

impl Trace {
    /// Reads a trace file; `place` is its name in errors. The expectation may be missing.
    ///
    /// Errors: the first line that is wrong, an unknown chip, or a map that does not fit.
    pub fn parse(place: &str, text: &str) -> Result<Self, TraceError> {
        read::parse(place, text)
    }

    /// The map that is run.
    pub fn map(&self) -> &Arc<CoreMap> {
        &self.map
    }

    /// The input, as long as the run.
    pub fn stimulus(&self) -> &Stimulus {
        &self.stimulus
    }

    /// How much is written down.
    pub fn detail(&self) -> Detail {
        self.detail
    }

    /// The lines below the separator.
    pub fn expected(&self) -> &[String] {
        &self.expected
    }

    /// What `engine`, fresh and on the map of this trace, does: the lines of an expectation.
    pub fn run(&self, engine: &mut dyn Engine) -> Vec<String> {
        let mut lines = observe(engine, &self.stimulus, self.detail);
        lines.extend(total_lines(engine));
        lines
    }

    /// Runs every engine of [`engines`]; returns how many agree with the expectation: all.
    ///
    /// Errors: the first difference of the first engine that differs.
    pub fn check_all(&self) -> Result<usize, Box<Mismatch>> {
        self.check_against(&self.expected)
    }

    /// The file with an expectation that all engines agree on.
    ///
    /// Errors: an engine that differs from the dense one; then there is nothing to write down.
    pub fn updated_text(&self) -> Result<String, Box<Mismatch>> {
        let lines = self.run(&mut DenseEngine::new(Arc::clone(&self.map)));
        self.check_against(&lines)?;
        let mut text = self.head.clone();
        for line in lines {
            text.push_str(&line);
            text.push('\n');
        }
        Ok(text)
    }

    fn check_against(&self, expected: &[String]) -> Result<usize, Box<Mismatch>> {
        let first_line = self.head.lines().count() + 1;
        let engines = engines(&self.map);
        let count = engines.len();
        for (name, mut engine) in engines {
            let got = self.run(engine.as_mut());
            if let Some(mismatch) = Mismatch::find(&self.place, name, first_line, expected, &got) {
                return Err(Box::new(mismatch));
            }
        }
        Ok(count)
    }
}

/// A fresh engine of every kind and thread count that must agree, with its name.
pub fn engines(map: &Arc<CoreMap>) -> Vec<(&'static str, Box<dyn Engine>)> {
    let event = |threads| Box::new(EventEngine::with_threads(Arc::clone(map), threads));
    vec![
        ("dense", Box::new(DenseEngine::new(Arc::clone(map)))),
        ("event on 1 thread", event(1)),
        ("event on 2 threads", event(2)),
        ("event on 3 threads", event(3)),
    ]
}
