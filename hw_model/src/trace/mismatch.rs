//! Where what an engine did differs from what was expected, and by how much.

use std::collections::BTreeMap;
use std::fmt;

/// Lines shown before the difference.
const CONTEXT: usize = 3;

/// The first line in which an engine differs from an expectation, and what that comes to.
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
    /// Number of expected lines, wherever they stand, that the engine does not give.
    pub missing: usize,
    /// Number of lines of the engine that are not expected.
    pub unexpected: usize,
    /// Counters and times of the whole run that differ, see [`total_lines`](super::total_lines).
    pub totals: Vec<TotalChange>,
}

/// A counter or a time of a whole run that is not as expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TotalChange {
    /// What the line calls it: `total messages`, `time davies2018 ps`.
    pub name: String,
    /// Expected value.
    pub expected: u64,
    /// Value of the engine.
    pub got: u64,
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
            missing: n_only_in(expected, got),
            unexpected: n_only_in(got, expected),
            totals: changed_totals(expected, got),
        })
    }
}

/// Number of lines of `these` that `others` do not have, or not as often.
fn n_only_in(these: &[String], others: &[String]) -> usize {
    let mut left: BTreeMap<&str, usize> = BTreeMap::new();
    others.iter().for_each(|line| *left.entry(line).or_default() += 1);
    let is_only_here = |line: &&String| match left.get_mut(line.as_str()) {
        Some(n) if *n > 0 => {
            *n -= 1;
            false
        }
        _ => true,
    };
    these.iter().filter(is_only_here).count()
}

/// Name and value of a line of the totals.
fn total(line: &str) -> Option<(&str, u64)> {
    let (name, value) = line.rsplit_once(' ')?;
    let is_total = ["total ", "time "].iter().any(|start| name.starts_with(start));
    Some((name, value.parse().ok()?)).filter(|_| is_total)
}

/// Totals that both have, with different values, in the order of `got`.
fn changed_totals(expected: &[String], got: &[String]) -> Vec<TotalChange> {
    let expected: BTreeMap<&str, u64> = expected.iter().filter_map(|line| total(line)).collect();
    let change = |(name, got): (&str, u64)| {
        let expected = *expected.get(name)?;
        let name = name.to_owned();
        (expected != got).then_some(TotalChange { name, expected, got })
    };
    got.iter().filter_map(|line| total(line)).filter_map(change).collect()
}

impl fmt::Display for TotalChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, expected, got } = self;
        write!(f, "{name}: {expected} -> {got}")?;
        if *expected == 0 {
            return Ok(());
        }
        write!(f, " ({:+.2} %)", 100.0 * (*got as f64 - *expected as f64) / *expected as f64)
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}:{}: {} gives another result", self.file, self.line, self.engine)?;
        self.context.iter().try_for_each(|line| writeln!(f, "    {line}"))?;
        let side = |line: &Option<String>| line.clone().unwrap_or("nothing more".to_owned());
        writeln!(f, "  - {}   (expected)", side(&self.expected))?;
        writeln!(f, "  + {}   (got)", side(&self.got))?;
        let (missing, unexpected) = (self.missing, self.unexpected);
        writeln!(f, "in all: expected lines missing {missing}, lines not expected {unexpected}")?;
        self.totals.iter().try_for_each(|change| writeln!(f, "  {change}"))?;
        write!(
            f,
            "if the new result is right: `spikeloop trace record {}` or `UPDATE_GOLDEN=1 cargo test`, \
             and say why in traces/README.md",
            self.file
        )
    }
}

impl std::error::Error for Mismatch {}
