//! From trained weights to a core map: quantize, partition, place.
//!
//! ```text
//! Network, EemSan (float) --quantize--> IntegerGraph --place--> CoreMap
//! IntegerNet (already integer) -------------^
//! ```

mod chip;
pub mod eem_san;
pub mod error;
pub mod graph;
pub mod place;
pub mod policy;
pub mod quantize;

pub use chip::{ChipOpenError, open_chip};
pub use eem_san::{QuantizedEemSan, quantize_eem_san};
pub use error::CompileError;
pub use graph::IntegerGraph;
pub use place::Split;
pub use policy::Policy;
