//! What a network is, before it meets a chip: layers, decays, thresholds, encoder, decoder.

pub mod bdett;
pub mod builtin;
pub mod controller;
pub mod conv2d;
pub mod description;
pub mod eem_san;
pub mod encoder;
mod encoder_kind;
pub mod error;
pub mod integer;
pub mod network;
mod tensors;
pub mod weight_fault;

pub use bdett::Bdett;
pub use controller::Controller;
pub use eem_san::{Branch, ConvLayer, EemSan, EventEncoder, PopulationCode, Readout, StateCode};
pub use encoder::RateEncoder;
pub use encoder_kind::EncoderKind;
pub use error::NetError;
pub use network::{Layer, Network};
pub use tensors::CHECKPOINT;

use std::path::{Path, PathBuf};

use crate::files;

/// First bytes of a core map file, to tell one from a network.
pub const MAP_LABEL: [u8; 8] = *b"SPIKELP\0";

/// The weights file that is read with a network's file when no other is given: that which a
/// description names, or the npz file beside an integer network. `None` for what has none; files
/// that may be large and are no description are not opened for it.
pub fn weights_beside(network: &Path) -> Option<PathBuf> {
    match network.extension().and_then(|extension| extension.to_str()) {
        Some("json") => Some(network.with_extension("npz")),
        Some("safetensors" | "npz" | "map") => None,
        _ if network.is_file() => description::named_weights(network),
        _ => None,
    }
}

/// The text of a network file.
fn text_of(path: &Path) -> Result<String, NetError> {
    let bytes = files::read_bytes(path)?;
    if bytes.starts_with(&MAP_LABEL) {
        return Err(NetError::CoreMap { file: path.display().to_string() });
    }
    Ok(files::text_of(path, bytes)?)
}
