//! spikeloop: see ARCHITECTURE.md.
pub mod compile;
pub mod files;
pub mod host;
pub mod net;
pub mod npz;
pub mod policy;
pub mod reference;
pub mod rng;
