#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod compartment;
pub mod container;
pub mod core_map;
pub mod cost;
pub mod counters;
pub mod engine;
pub mod error;
pub mod faults;
pub mod fixed;
pub mod id;
pub mod spec;
pub mod synapse;
mod text_line;
pub mod trace;
pub mod weight;

pub use core_map::{CoreMap, CoreMapParts};
pub use counters::OpCounts;
pub use engine::{DenseEngine, Engine, EventEngine, MemoryUse};
pub use error::{ChipError, MapError, TextError};
pub use faults::Faults;
pub use spec::ChipSpec;
pub use trace::Trace;
