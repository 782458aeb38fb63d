//! What could differ on the chip: weights of fewer bits, narrower registers, faults, more cores.
//!
//! A *variant* is one such chip and how the network is put on it; an *axis* changes one thing of the
//! variant that ships, value by value.

mod axis;
mod variant;

pub use axis::{AXES, Axis};
pub use variant::{Variant, VariantError};

#[cfg(test)]
#[path = "study_tests.rs"]
mod tests;
