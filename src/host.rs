//! The host's side of the chip: what to inject when, what to read when, and what it means.

pub mod chip_policy;
pub mod deployment;
pub mod encode;

pub use chip_policy::{ChipPolicy, ChipUse};
pub use deployment::{DecisionProgram, Deployment};

use crate::policy::Action;

/// Spike counts of the two output neurons as wheel speeds: count / T, left then right.
pub fn decode(counts: &[u32], steps: u32) -> Action {
    let rate = |neuron: usize| f64::from(counts[neuron]) / f64::from(steps);
    Action { left: rate(0), right: rate(1) }
}
