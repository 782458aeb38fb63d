//! Between numbers and spikes: observations to input spikes, output counts to wheel speeds.
//!
//! Float reference and chip share this code and its random draws, so that on equal seeds they see
//! equal spikes.

use crate::net::RateEncoder;
use crate::policy::{Action, Observation};
use crate::rng::{Streams, stream};

/// Spikes of one decision: for each step, one flag per input.
pub type InputSpikes = Vec<Vec<bool>>;

/// Input spikes of one decision: one Bernoulli draw per step and input.
///
/// Shapes: `steps` rows of one flag per input; drawn step by step, input by input.
pub fn encode(
    encoder: &RateEncoder,
    observation: &Observation,
    steps: u32,
    streams: &Streams,
    tick: u64,
) -> InputSpikes {
    let probabilities = encoder.probabilities(observation);
    let mut draw = streams.at(stream::ENCODER_SPIKES, tick);
    (0..steps).map(|_| probabilities.iter().map(|p| draw.bernoulli(*p)).collect()).collect()
}

/// Spike counts of the two output neurons as wheel speeds: count / T, left then right.
pub fn decode(counts: &[u32], steps: u32) -> Action {
    let rate = |neuron: usize| f64::from(counts[neuron]) / f64::from(steps);
    Action { left: rate(0), right: rate(1) }
}
