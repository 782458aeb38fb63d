//! spikeloop: see ARCHITECTURE.md.
pub mod policy;
pub mod rng;
