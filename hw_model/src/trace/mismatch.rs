//! The first difference between what was expected and what an engine did.

use std::fmt;

/// Lines shown before the difference.
const CONTEXT: usize = 3;

/// The first line in which an engine differs from an expectation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mismatch {
    /// The trace file.
    pub file: String,
    /// The engine that differs.
    pub engine: String,
    /// Line of the file, the first is 1.
    pub line: usize,
    /// Up to three lines before it, which agree.
    pub context: Vec<String>,
    /// What the file says there; nothing at its end.
    pub expected: Option<String>,
    /// What the engine did; nothing when it did less.
    pub got: Option<String>,
}

impl Mismatch {
    /// Compares line by line; `first_line` is the place of the first expected line in `file`.
    pub fn find(
        file: &str,
        engine: &str,
        first_line: usize,
        expected: &[String],
        got: &[String],
    ) -> Option<Self> {
        let longer = expected.len().max(got.len());
        let at = (0..longer).find(|i| expected.get(*i) != got.get(*i))?;
        Some(Self {
            file: file.to_owned(),
            engine: engine.to_owned(),
            line: first_line + at,
            context: got[at.saturating_sub(CONTEXT)..at].to_vec(),
            expected: expected.get(at).cloned(),
            got: got.get(at).cloned(),
        })
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}:{}: {} gives another result", self.file, self.line, self.engine)?;
        self.context.iter().try_for_each(|line| writeln!(f, "    {line}"))?;
        let side = |line: &Option<String>| line.clone().unwrap_or("nothing more".to_owned());
        writeln!(f, "  - {}   (expected)", side(&self.expected))?;
        writeln!(f, "  + {}   (got)", side(&self.got))?;
        write!(
            f,
            "if the new result is right: `spikeloop trace record {}` or `UPDATE_GOLDEN=1 cargo test`, \
             and say why in traces/README.md",
            self.file
        )
    }
}

impl std::error::Error for Mismatch {}
