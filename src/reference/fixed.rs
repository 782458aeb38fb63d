//! Algorithm 1 in the chip's arithmetic, without cores, axons or delays.
//!
//! What the compiled network must compute if the host's windows and bias lines do what they are
//! meant to: the chip's output counts equal these exactly.

use hw_model::ChipSpec;
use hw_model::compartment::{CompartmentParams, CompartmentState, Widths, update};

use crate::coding::InputSpikes;
use crate::compile::graph::GraphPopulation;
use crate::compile::quantize::{Quantized, QuantizedLayer};
use crate::net::Network;
use crate::reference::Decision;

/// A quantized network.
#[derive(Debug, Clone)]
pub struct FixedNetwork {
    layers: Vec<FixedLayer>,
    widths: Widths,
}

/// A fully connected layer in chip units.
#[derive(Debug, Clone)]
pub(super) struct FixedLayer {
    pub(super) params: CompartmentParams,
    inputs: usize,
    pub(super) weights: Vec<i64>,
    pub(super) bias: Vec<i64>,
}

impl FixedNetwork {
    /// The same layers as `network`, with the mantissas of `quantized`.
    pub fn new(network: &Network, quantized: &Quantized, chip: &ChipSpec) -> Self {
        let layer = |(layer, q): (&crate::net::Layer, &QuantizedLayer)| {
            let population = quantized.graph.populations.iter().find(|p| p.name == layer.name);
            let population = population.expect("every layer is a population");
            FixedLayer::new(population, q, chip)
        };
        let layers = network.layers.iter().zip(&quantized.layers).map(layer).collect();
        Self { layers, widths: Widths::new(&chip.arithmetic) }
    }

    /// One decision from zero state.
    pub fn decide(&self, input: &InputSpikes) -> Decision {
        let outputs = self.layers.last().map_or(0, |layer| layer.bias.len());
        let mut decision = Decision::new(self.layers.len(), outputs);
        let mut states: Vec<Vec<CompartmentState>> =
            self.layers.iter().map(|l| vec![CompartmentState::default(); l.bias.len()]).collect();
        for step in input {
            let mut spikes = step.clone();
            for (index, (layer, state)) in self.layers.iter().zip(&mut states).enumerate() {
                spikes = layer.step(&self.widths, state, &[&spikes]);
                decision.add_step(index, &spikes, index + 1 == self.layers.len());
            }
        }
        decision
    }
}

impl FixedLayer {
    /// The layer `q`, which became `population`.
    pub(super) fn new(population: &GraphPopulation, q: &QuantizedLayer, chip: &ChipSpec) -> Self {
        Self {
            params: CompartmentParams::new(
                population.decay_current,
                population.decay_voltage,
                (q.threshold_mantissa << chip.arithmetic.threshold_shift) as i32,
                0,
                1,
            ),
            inputs: q.weights.len() / q.bias.len(),
            weights: q.weights.iter().map(|m| 64 * (i64::from(*m) << q.exponent)).collect(),
            bias: q.bias.iter().map(|m| 64 * (i64::from(*m) << q.bias_exponent)).collect(),
        }
    }

    /// One step; `inputs` are several groups of spikes that share the weights.
    pub(super) fn step(
        &self,
        widths: &Widths,
        state: &mut [CompartmentState],
        inputs: &[&[bool]],
    ) -> Vec<bool> {
        let rows = self.weights.chunks(self.inputs).zip(&self.bias);
        let neuron = |(state, (row, bias)): (&mut CompartmentState, (&[i64], &i64))| {
            let arriving = |input: &[bool]| -> i64 {
                let spiking = row.iter().zip(input).filter(|(_, spike)| **spike);
                spiking.map(|(weight, _)| weight).sum()
            };
            let sum = inputs.iter().map(|input| arriving(input)).sum::<i64>() + bias;
            let done = update(&self.params, widths, *state, sum);
            *state = done.state;
            done.spike
        };
        state.iter_mut().zip(rows).map(neuron).collect()
    }
}
