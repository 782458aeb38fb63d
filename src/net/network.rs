//! A feed-forward spiking network with trained floating-point weights.

use serde::Serialize;

use crate::net::encoder::RateEncoder;

/// A spiking actor: rate-coded inputs, fully connected LIF layers, two output neurons whose rates
/// are the wheel speeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Network {
    /// Name.
    pub name: String,
    /// `T`: steps per decision.
    pub steps: u32,
    /// How an observation becomes spikes.
    pub encoder: RateEncoder,
    /// Whether the chip has a relay neuron between each host input and the first layer, and a
    /// bias neuron per layer (SAN's published mapping), or the host's spikes go there directly.
    pub relay: bool,
    /// Layers in order.
    pub layers: Vec<Layer>,
}

/// A fully connected layer of leaky integrate-and-fire neurons (EEM-SAN, Algorithm 1):
/// `c = keep_current c + W s + b`, `v = keep_voltage v (1 - s_prev) + c`, `s = [v > threshold]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Layer {
    /// Name.
    pub name: String,
    /// Number of inputs.
    pub inputs: usize,
    /// Number of neurons.
    pub neurons: usize,
    /// `W`, row-major: weight from input `i` to neuron `n` is `weights[n * inputs + i]`.
    pub weights: Vec<f32>,
    /// `b`, one for each neuron; added to the current every step.
    pub bias: Vec<f32>,
    /// `d_c`: part of the current that is kept per step.
    pub keep_current: f64,
    /// `d_v`: part of the voltage that is kept per step.
    pub keep_voltage: f64,
    /// Firing threshold.
    pub threshold: f64,
}

/// Populations that a relayed network adds to its layers.
pub const RELAY_NAMES: [&str; 2] = ["relay", "bias_relay"];

impl Network {
    /// Number of inputs of the first layer.
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, |layer| layer.inputs)
    }

    /// Number of neurons of the last layer.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.neurons)
    }

    /// Weights and biases.
    pub fn parameters(&self) -> usize {
        self.layers.iter().map(|layer| layer.weights.len() + layer.bias.len()).sum()
    }
}
