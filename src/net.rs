//! What a network is, before it meets a chip: layers, decays, thresholds, encoder, decoder.

pub mod builtin;
pub mod description;
pub mod encoder;
pub mod error;
pub mod integer;
pub mod network;

pub use encoder::RateEncoder;
pub use error::NetError;
pub use network::{Layer, Network};
