//! spikeloop: see ARCHITECTURE.md.
pub mod closed_loop;
pub mod policy;
pub mod rng;
pub mod world;
