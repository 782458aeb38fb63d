//! What each core of a chip did, from the result files of `run`, `drive` and `agree`.

use std::collections::BTreeMap;

use hw_model::CoreMap;
use serde::Deserialize;
use thiserror::Error;

use crate::report::results::slowest_counter;
use crate::report::tables::synaptic_ops;

/// What the cores of one map did.
#[derive(Debug, Clone, PartialEq)]
pub struct CoreActivity {
    by_core: Vec<BTreeMap<String, u64>>,
    /// Chip steps or decisions.
    n: u64,
    unit: &'static str,
}

/// A result file without the activity that was asked for.
#[derive(Debug, Error)]
pub enum ActivityError {
    /// Not JSON of the expected form.
    #[error("{file}: not a result of `spikeloop run`, `drive` or `agree --json` ({message})")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// A result of another core map.
    #[error(
        "{file}: no counters of the cores of map {expected}, but of {found}; run or drive this \
         map with --json and give that file"
    )]
    Map {
        /// The file.
        file: String,
        /// SHA-256 of the map that was asked for.
        expected: String,
        /// What the file is about.
        found: String,
    },
    /// A result with too many or too few cores.
    #[error("{file}: counters of {found} cores, the map has {expected}; run or drive it again")]
    Cores {
        /// The file.
        file: String,
        /// Cores in the file.
        found: usize,
        /// Cores of the map.
        expected: usize,
    },
}

/// The parts of a result that tell activity; `run` and `agree` have one, `drive` one per driver.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Saved {
    map_digest: Option<String>,
    counters_by_core: Vec<BTreeMap<String, u64>>,
    /// Of `run`.
    steps: Option<u64>,
    /// Of `agree`.
    decisions: u64,
    /// Of a driver.
    summary: SavedSummary,
    drivers: Vec<Saved>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct SavedSummary {
    decisions: u64,
}

impl CoreActivity {
    /// Reads the text of a result; `file` is the name that errors mention. Drivers and seeds with
    /// the same map are added up.
    ///
    /// Errors: not a result, or none of `map`.
    pub fn from_json(file: &str, text: &str, map: &CoreMap) -> Result<Self, ActivityError> {
        let whole: Saved = serde_json::from_str(text)
            .map_err(|e| ActivityError::Syntax { file: file.to_owned(), message: e.to_string() })?;
        let unit = if whole.steps.is_some() { "chip step" } else { "decision" };
        let expected = map.digest();
        let parts: Vec<&Saved> = whole.drivers.iter().chain([&whole]).collect();
        let counted = |part: &&&Saved| !part.counters_by_core.is_empty();
        let of_map: Vec<&Saved> = parts
            .iter()
            .filter(counted)
            .filter(|part| part.map_digest.as_ref() == Some(&expected))
            .copied()
            .collect();
        if of_map.is_empty() {
            let digests = parts.iter().filter(counted).filter_map(|p| p.map_digest.as_deref());
            let mut digests: Vec<&str> = digests.collect();
            digests.dedup();
            let found = if digests.is_empty() { "none".to_owned() } else { digests.join(", ") };
            return Err(ActivityError::Map { file: file.to_owned(), expected, found });
        }
        let mut activity = Self { by_core: vec![BTreeMap::new(); map.cores().len()], n: 0, unit };
        for part in of_map {
            activity.add(file, part)?;
        }
        Ok(activity)
    }

    fn add(&mut self, file: &str, part: &Saved) -> Result<(), ActivityError> {
        let (found, expected) = (part.counters_by_core.len(), self.by_core.len());
        if found != expected {
            return Err(ActivityError::Cores { file: file.to_owned(), found, expected });
        }
        for (sums, counters) in self.by_core.iter_mut().zip(&part.counters_by_core) {
            for (name, n) in counters {
                let sum = sums.entry(name.clone()).or_default();
                *sum = sum.saturating_add(*n);
            }
        }
        let n = part.steps.unwrap_or(part.decisions).max(part.summary.decisions);
        self.n = self.n.saturating_add(n);
        Ok(())
    }

    /// What rates are given per: chip step or decision.
    pub fn unit(&self) -> &'static str {
        self.unit
    }

    /// Synaptic operations of a core per unit. Panics when there is no such core.
    pub fn synaptic_ops(&self, core: usize) -> f64 {
        self.per(synaptic_ops(&self.by_core[core]))
    }

    /// The same of the busiest core.
    pub fn most(&self) -> f64 {
        (0..self.by_core.len()).map(|core| self.synaptic_ops(core)).fold(0.0, f64::max)
    }

    /// Chip time, in microseconds by a cost table per unit, of the steps in which `core` was the slowest.
    /// Panics when there is no such core.
    pub fn slowest_us(&self, core: usize, cost_table: &str) -> f64 {
        self.per(self.counter(core, &slowest_counter(cost_table))) / 1e6
    }

    /// What a core did, in words that go after others.
    pub(super) fn about(&self, core: usize) -> String {
        let counter = |name: &str| self.per(self.counter(core, name));
        format!(
            "; per {} {:.1} synaptic operations, {:.1} spikes, {:.1} messages",
            self.unit,
            self.synaptic_ops(core),
            counter("updates_spiking"),
            counter("messages")
        )
    }

    fn counter(&self, core: usize, name: &str) -> u64 {
        self.by_core[core].get(name).copied().unwrap_or(0)
    }

    fn per(&self, count: u64) -> f64 {
        count as f64 / self.n.max(1) as f64
    }
}

#[cfg(test)]
#[path = "activity_tests.rs"]
mod tests;
