//! The host's side of the chip: what to inject when, what to read when, and what it means.

pub mod chip_policy;
pub mod deployment;

pub use chip_policy::{ChipPolicy, ChipUse};
pub use deployment::{DecisionProgram, Deployment};
