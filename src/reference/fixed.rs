//! Algorithm 1 in the chip's arithmetic, without cores, axons or delays.
//!
//! What the compiled network must compute if the host's windows and bias lines do what they are
//! meant to: the chip's output counts equal these exactly.

use hw_model::ChipSpec;
use hw_model::compartment::{CompartmentParams, CompartmentState, Widths, update};

use crate::coding::InputSpikes;
use crate::compile::quantize::Quantized;
use crate::net::Network;
use crate::reference::Decision;

/// A quantized network.
#[derive(Debug, Clone)]
pub struct FixedNetwork {
    layers: Vec<FixedLayer>,
    widths: Widths,
}

#[derive(Debug, Clone)]
struct FixedLayer {
    params: CompartmentParams,
    inputs: usize,
    weights: Vec<i64>,
    bias: Vec<i64>,
}

impl FixedNetwork {
    /// The same layers as `network`, with the mantissas of `quantized`.
    pub fn new(network: &Network, quantized: &Quantized, chip: &ChipSpec) -> Self {
        let layer =
            |(layer, q): (&crate::net::Layer, &crate::compile::quantize::QuantizedLayer)| {
                let population = quantized.graph.populations.iter().find(|p| p.name == layer.name);
                let population = population.expect("every layer is a population");
                FixedLayer {
                    params: CompartmentParams::new(
                        population.decay_current,
                        population.decay_voltage,
                        (q.threshold_mantissa << chip.arithmetic.threshold_shift) as i32,
                        0,
                        1,
                    ),
                    inputs: layer.inputs,
                    weights: q.weights.iter().map(|m| 64 * (i64::from(*m) << q.exponent)).collect(),
                    bias: q.bias.iter().map(|m| 64 * (i64::from(*m) << q.bias_exponent)).collect(),
                }
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
                spikes = layer.step(&self.widths, state, &spikes);
                decision.add_step(index, &spikes, index + 1 == self.layers.len());
            }
        }
        decision
    }
}

impl FixedLayer {
    fn step(&self, widths: &Widths, state: &mut [CompartmentState], input: &[bool]) -> Vec<bool> {
        let rows = self.weights.chunks(self.inputs).zip(&self.bias);
        let neuron = |(state, (row, bias)): (&mut CompartmentState, (&[i64], &i64))| {
            let arriving = row.iter().zip(input).filter(|(_, spike)| **spike);
            let sum = arriving.map(|(weight, _)| weight).sum::<i64>() + bias;
            let done = update(&self.params, widths, *state, sum);
            *state = done.state;
            done.spike
        };
        state.iter_mut().zip(rows).map(neuron).collect()
    }
}
