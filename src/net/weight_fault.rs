//! Degraded weights, as in BDETT's published evaluation (Zyunduo/dynamic-threshold): coarse, noisy
//! or partly lost before anything else is done with the network.

use crate::net::controller::Controller;
use crate::rng::{Streams, stream};

/// Largest step of a weight of 8 bits with a sign.
const STEPS_8_BIT: f32 = 127.0;

/// Standard deviation of the noise on a weight.
const NOISE: f64 = 0.05;

/// Part of the weights that are lost.
const LOST: f64 = 0.3;

/// What is wrong with the weights of the spiking layers; biases, readout and population codes stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightFault {
    /// Rounded to 8 bits, with one scale for all layers: its largest weight is 127 steps.
    EightBit,
    /// Gaussian noise of 0.05 on every weight.
    Noise,
    /// Each weight is 0 with probability 0.3.
    Pruned,
}

impl WeightFault {
    /// The network with such weights; draws are those of the run with seed `seed`, layer by layer.
    pub fn apply(self, network: &Controller, seed: u64) -> Controller {
        let mut network = network.clone();
        let mut layers = network.weights_mut();
        let largest = layers.iter().flat_map(|layer| layer.iter());
        let step = largest.fold(0.0, |most: f32, weight| most.max(weight.abs())) / STEPS_8_BIT;
        for (index, layer) in layers.iter_mut().enumerate() {
            let mut draw = Streams::new(seed, 0).at(stream::WEIGHT_FAULTS, index as u64);
            for weight in layer.iter_mut() {
                match self {
                    Self::EightBit if step == 0.0 => {}
                    Self::EightBit => *weight = (*weight / step).round() * step,
                    Self::Noise => *weight += (NOISE * draw.gaussian()) as f32,
                    Self::Pruned => *weight = if draw.bernoulli(LOST) { 0.0 } else { *weight },
                }
            }
        }
        network
    }
}

#[cfg(test)]
#[path = "weight_fault_tests.rs"]
mod tests;
