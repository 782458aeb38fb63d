//! Rates to spikes: one Bernoulli draw per input and step.

use crate::net::RateEncoder;
use crate::policy::Observation;
use crate::reference::InputSpikes;
use crate::rng::{Streams, stream};

/// Input spikes of one decision. Float reference and chip take the same draws.
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
