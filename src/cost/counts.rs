//! Numbers of operations.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Arithmetic operations.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ops {
    /// Sums, differences.
    pub additions: u64,
    /// Products.
    pub multiplications: u64,
}

/// NeuroBench's workload metrics, sums over control ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct NeuroBench {
    /// Synaptic operations if every input and weight were there.
    pub dense: u64,
    /// Those with input and weight not 0, in calls with any input outside of -1, 0, 1.
    pub effective_macs: u64,
    /// The same in all other calls.
    pub effective_acs: u64,
    /// Membranes in the first step of a tick, and those that changed in later ones.
    pub membrane_updates: u64,
    /// Neurons times steps: what a chip that visits every neuron does.
    pub membrane_updates_dense: u64,
}

/// The same work in all four accountings.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// By the rule that gives the paper's figures.
    pub paper: Ops,
    /// As performed by a processor that sees frames.
    pub exact: Ops,
    /// As performed by the chip.
    pub chip: Ops,
    /// As NeuroBench counts.
    pub neurobench: NeuroBench,
}

impl Ops {
    /// As many products as sums.
    pub(super) fn products(n: u64) -> Self {
        Self { additions: n, multiplications: n }
    }

    /// Sums alone.
    pub(super) fn sums(n: u64) -> Self {
        Self { additions: n, multiplications: 0 }
    }
}

impl NeuroBench {
    /// Files `effective` operations of one call under AC or MAC.
    pub fn add_effective(&mut self, effective: u64, reals: bool) {
        match reals {
            true => self.effective_macs += effective,
            false => self.effective_acs += effective,
        }
    }
}

impl AddAssign for Ops {
    fn add_assign(&mut self, other: Self) {
        self.additions += other.additions;
        self.multiplications += other.multiplications;
    }
}

impl AddAssign for NeuroBench {
    fn add_assign(&mut self, other: Self) {
        self.dense += other.dense;
        self.effective_macs += other.effective_macs;
        self.effective_acs += other.effective_acs;
        self.membrane_updates += other.membrane_updates;
        self.membrane_updates_dense += other.membrane_updates_dense;
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.paper += other.paper;
        self.exact += other.exact;
        self.chip += other.chip;
        self.neurobench += other.neurobench;
    }
}
