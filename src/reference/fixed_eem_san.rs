//! EEM-SAN in the chip's arithmetic, layer by layer: without cores, axons, delays or holds.
//!
//! What the compiled network must compute in the schedule `held`, spike for spike.

use hw_model::ChipSpec;
use hw_model::compartment::{CompartmentState, Widths, update};

use crate::coding::{InputSpikes, LayerSpikes};
use crate::compile::QuantizedEemSan;
use crate::net::EemSan;
use crate::net::eem_san::KERNEL;
use crate::policy::EventFrame;
use crate::reference::Decision;
use crate::reference::fixed::FixedLayer;

/// A quantized EEM-SAN with the encoder's state of one episode.
#[derive(Debug, Clone)]
pub struct FixedEemSan {
    encoder: Vec<FixedConv>,
    /// Whether the encoder's state goes on from tick to tick.
    carries: bool,
    branches: Vec<FixedLayer>,
    decision: Vec<FixedLayer>,
    widths: Widths,
}

/// A convolution; neurons count channel by channel, row by row.
#[derive(Debug, Clone)]
struct FixedConv {
    inputs: usize,
    /// Pixels along a side of the input.
    side: usize,
    /// The layer that one output pixel is: weights `[output, input, row, column]`.
    window: FixedLayer,
    state: Vec<CompartmentState>,
    /// Voltages of the last step, before spikes reset them.
    voltages: Vec<i32>,
}

impl FixedEemSan {
    /// The same layers as `network`, with the mantissas of `quantized`; at rest.
    pub fn new(network: &EemSan, quantized: &QuantizedEemSan, chip: &ChipSpec) -> Self {
        let populations = quantized.graph.populations.iter();
        let mut layers: Vec<FixedLayer> = populations
            .zip(&quantized.layers)
            .map(|(population, (_, q))| FixedLayer::new(population, q, chip))
            .collect();
        let decision = layers.split_off(quantized.encoder_layers + quantized.branches);
        let branches = layers.split_off(quantized.encoder_layers);
        let shapes = network.encoder.iter().flat_map(|encoder| &encoder.layers);
        let conv = |(window, shape): (FixedLayer, &crate::net::ConvLayer)| FixedConv {
            inputs: shape.inputs,
            side: shape.side,
            window,
            state: vec![CompartmentState::default(); shape.neurons()],
            voltages: vec![0; shape.neurons()],
        };
        let encoder = layers.into_iter().zip(shapes).map(conv).collect();
        let carries = network.encoder.as_ref().is_none_or(|encoder| encoder.kind.carries());
        let widths = Widths::new(&chip.arithmetic);
        Self { encoder, carries, branches, decision, widths }
    }

    /// A new episode: the encoder at rest.
    pub fn reset(&mut self) {
        for layer in &mut self.encoder {
            layer.state.fill(CompartmentState::default());
            layer.voltages.fill(0);
        }
    }

    /// One step of the encoder for each frame: spikes of its layers. An encoder that forgets (FSVAE)
    /// begins at rest: the frames are those of a control tick.
    pub fn encode(&mut self, frames: &[EventFrame]) -> LayerSpikes {
        if !self.carries {
            self.reset();
        }
        let mut all = vec![Vec::new(); self.encoder.len()];
        for frame in frames {
            let mut spikes: Vec<u32> = frame.active().map(|pixel| pixel as u32).collect();
            for (layer, seen) in self.encoder.iter_mut().zip(&mut all) {
                spikes = layer.step(&self.widths, &spikes);
                seen.push(spikes.clone());
            }
        }
        all
    }

    /// Voltages of the encoder's last layer in its last step, before spikes reset them, in chip
    /// units.
    pub fn latent_voltages(&self) -> &[i32] {
        self.encoder.last().map_or(&[], |layer| &layer.voltages)
    }

    /// One decision from zero state, and the spikes of branches and decision module.
    ///
    /// Shapes: `inputs[branch][step][line]`, for every branch.
    pub fn decide(&self, inputs: &[InputSpikes]) -> (Decision, LayerSpikes) {
        let layers = || self.branches.iter().chain(&self.decision);
        let outputs = self.decision.last().map_or(0, |layer| layer.bias.len());
        let (n, n_branches) = (layers().count(), self.branches.len());
        let mut decision = Decision::new(n, outputs);
        let mut all = vec![Vec::new(); n];
        let mut states: Vec<Vec<CompartmentState>> =
            layers().map(|layer| vec![CompartmentState::default(); layer.bias.len()]).collect();
        for step in 0..inputs.first().map_or(0, Vec::len) {
            let mut arriving = Vec::new();
            if n_branches == 0 {
                arriving.push(inputs.iter().flat_map(|input| &input[step]).copied().collect());
            }
            let mut fused: Vec<Vec<bool>> = Vec::new();
            for (index, (layer, state)) in layers().zip(&mut states).enumerate() {
                // The first layers are the branches, one for each input.
                let spikes = match inputs.get(index).filter(|_| index < n_branches) {
                    Some(input) => layer.step(&self.widths, state, &[&input[step]]),
                    None => {
                        let sources: Vec<&[bool]> = arriving.iter().map(Vec::as_slice).collect();
                        layer.step(&self.widths, state, &sources)
                    }
                };
                decision.add_step(index, &spikes, index + 1 == n);
                let spiking = spikes.iter().enumerate().filter(|(_, spike)| **spike);
                all[index].push(spiking.map(|(neuron, _)| neuron as u32).collect());
                if index < n_branches {
                    fused.push(spikes);
                    arriving.clone_from(&fused);
                } else {
                    arriving = vec![spikes];
                }
            }
        }
        (decision, all)
    }
}

impl FixedConv {
    /// Input and output spikes are neuron numbers.
    fn step(&mut self, widths: &Widths, input: &[u32]) -> Vec<u32> {
        let (half, side) = (self.side / 2, self.side);
        let outputs = self.window.bias.len();
        let bias = self.window.bias.iter();
        let mut sums: Vec<i64> =
            bias.flat_map(|bias| std::iter::repeat_n(*bias, half * half)).collect();
        for neuron in input.iter().map(|neuron| *neuron as usize) {
            let (channel, y, x) = (neuron / (side * side), neuron / side % side, neuron % side);
            // Output row r sees input rows 2 r - 1 to 2 r + 2 through kernel rows 0 to 3.
            for row in (0..half).filter(|row| (2 * row..2 * row + KERNEL).contains(&(y + 1))) {
                for column in (0..half).filter(|c| (2 * c..2 * c + KERNEL).contains(&(x + 1))) {
                    let tap = (y + 1 - 2 * row) * KERNEL + x + 1 - 2 * column;
                    for output in 0..outputs {
                        let kernel = (output * self.inputs + channel) * KERNEL * KERNEL;
                        sums[(output * half + row) * half + column] +=
                            self.window.weights[kernel + tap];
                    }
                }
            }
        }
        let mut spikes = Vec::new();
        for (neuron, sum) in sums.into_iter().enumerate() {
            let done = update(&self.window.params, widths, self.state[neuron], sum);
            self.state[neuron] = done.state;
            self.voltages[neuron] = done.voltage_before_reset;
            if done.spike {
                spikes.push(neuron as u32);
            }
        }
        spikes
    }
}
