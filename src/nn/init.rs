//! Initial weights.

use crate::nn::parameters::{Entry, Parameters};
use crate::rng::{Streams, stream};

/// Fills every `.weight` and `.bias` with uniform numbers within `1 / sqrt(fan_in)`, PyTorch's
/// default for fully connected and convolutional layers. Other tensors are left alone.
///
/// `fan_in` is the product of all extents of the weight but the first; for a transposed
/// convolution that counts the outputs, as it does there. Each tensor has draws of its own.
pub fn uniform_by_fan_in(parameters: &mut Parameters, streams: &Streams) {
    let entries = parameters.layout().entries().to_vec();
    for (index, entry) in entries.iter().enumerate() {
        let Some(fan_in) = fan_in(&entries, entry) else { continue };
        let bound = 1.0 / (fan_in as f64).sqrt();
        let mut draw = streams.at(stream::NN_INIT, index as u64);
        for value in entry.slot.of_mut(&mut parameters.values) {
            *value = draw.uniform_in(-bound, bound) as f32;
        }
    }
}

fn fan_in(entries: &[Entry], entry: &Entry) -> Option<usize> {
    let (layer, kind) = entry.name.rsplit_once('.')?;
    let weight = match kind {
        "weight" => entry,
        "bias" => entries.iter().find(|other| other.name == format!("{layer}.weight"))?,
        _ => return None,
    };
    Some(weight.shape[1..].iter().product())
}

#[cfg(test)]
#[path = "init_tests.rs"]
mod tests;
