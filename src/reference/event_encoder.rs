//! HSVAE's spiking encoder in 32-bit floats, driven by events: plain loops, so that every machine
//! computes the same bits.

use crate::net::eem_san::{ConvLayer, EventEncoder, KERNEL, Readout};
use crate::policy::EventFrame;

/// The encoder with the state of one episode.
#[derive(Debug, Clone)]
pub struct FloatEncoder {
    layers: Vec<Layer>,
    readout: Readout,
    spikes: Vec<u64>,
    frames: u64,
}

/// Neurons are `[row][column][channel]`.
#[derive(Debug, Clone)]
struct Layer {
    inputs: usize,
    outputs: usize,
    side: usize,
    /// [input channel, kernel row, kernel column, output channel].
    weights: Vec<f32>,
    bias: Vec<f32>,
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
    drive: Vec<f32>,
    current: Vec<f32>,
    voltage: Vec<f32>,
    spiked: Vec<f32>,
}

impl FloatEncoder {
    /// Takes the weights; the state is that at the start of an episode.
    pub fn new(encoder: &EventEncoder) -> Self {
        let layers: Vec<Layer> =
            encoder.layers.iter().map(|layer| Layer::new(layer, encoder)).collect();
        let readout = encoder.readout.clone();
        Self { spikes: vec![0; layers.len()], layers, readout, frames: 0 }
    }

    /// A new episode: all state zero. Counts of spikes and frames go on.
    pub fn reset(&mut self) {
        for layer in &mut self.layers {
            layer.current.fill(0.0);
            layer.voltage.fill(0.0);
            layer.spiked.fill(0.0);
        }
    }

    /// One step of all layers, each in the same step as the one before it.
    pub fn step(&mut self, frame: &EventFrame) {
        let mut spikes: Vec<usize> = frame.active().collect();
        for (layer, count) in self.layers.iter_mut().zip(&mut self.spikes) {
            spikes = layer.step(&spikes);
            *count += spikes.len() as u64;
        }
        self.frames += 1;
    }

    /// The DVS state: `mu` of the last layer's voltages now.
    ///
    /// Shapes: one number for each latent dimension (64). Neurons count channel by channel, as in
    /// the trained weights.
    pub fn state(&self) -> Vec<f32> {
        let Some(last) = self.layers.last() else { return Vec::new() };
        let area = last.voltage.len() / last.outputs;
        let voltage = |n: usize| last.voltage[(n % area) * last.outputs + n / area];
        let voltages: Vec<f32> = (0..last.voltage.len()).map(voltage).collect();
        self.readout.apply(&voltages)
    }

    /// The DVS state at the start of an episode: all voltages 0.
    pub fn resting_state(&self) -> Vec<f32> {
        self.readout.apply(&vec![0.0; self.layers.last().map_or(0, |layer| layer.voltage.len())])
    }

    /// Neurons of each layer that spiked in the last step, rising, channel by channel.
    pub fn spiking(&self) -> Vec<Vec<u32>> {
        let of = |layer: &Layer| {
            let area = layer.spiked.len() / layer.outputs;
            let at = |n: &usize| layer.spiked[(n % area) * layer.outputs + n / area] > 0.0;
            (0..layer.spiked.len()).filter(at).map(|n| n as u32).collect()
        };
        self.layers.iter().map(of).collect()
    }

    /// Frames seen since the encoder was made.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Spikes of each layer since the encoder was made.
    pub fn spikes(&self) -> &[u64] {
        &self.spikes
    }

    /// Neurons of each layer.
    pub fn neurons(&self) -> Vec<usize> {
        self.layers.iter().map(|layer| layer.voltage.len()).collect()
    }
}

impl Layer {
    fn new(layer: &ConvLayer, encoder: &EventEncoder) -> Self {
        let taps = KERNEL * KERNEL;
        let mut weights = vec![0.0; layer.weights.len()];
        for (at, weight) in layer.weights.iter().enumerate() {
            let (output, rest) = (at / (layer.inputs * taps), at % (layer.inputs * taps));
            weights[rest * layer.outputs + output] = *weight;
        }
        let neurons = layer.neurons();
        Self {
            inputs: layer.inputs,
            outputs: layer.outputs,
            side: layer.side,
            weights,
            bias: layer.bias.clone(),
            keep_current: encoder.keep_current as f32,
            keep_voltage: encoder.keep_voltage as f32,
            threshold: encoder.threshold as f32,
            drive: vec![0.0; neurons],
            current: vec![0.0; neurons],
            voltage: vec![0.0; neurons],
            spiked: vec![0.0; neurons],
        }
    }

    /// Input and output spikes are neuron numbers.
    fn step(&mut self, input: &[usize]) -> Vec<usize> {
        for pixel in self.drive.chunks_exact_mut(self.outputs) {
            pixel.copy_from_slice(&self.bias);
        }
        input.iter().for_each(|neuron| self.receive(*neuron));
        self.update();
        let mut output = Vec::with_capacity(self.spiked.len() / 4);
        for (block, spiked) in self.spiked.chunks(8).enumerate() {
            if spiked.iter().any(|s| *s > 0.0) {
                let at = |(index, s): (usize, &f32)| (*s > 0.0).then_some(8 * block + index);
                output.extend(spiked.iter().enumerate().filter_map(at));
            }
        }
        output
    }

    /// A spike at row `y` reaches the output rows `(y + 1) / 2` and the one before it.
    fn receive(&mut self, neuron: usize) {
        let (pixel, channel) = (neuron / self.inputs, neuron % self.inputs);
        let (y, x) = (pixel / self.side, pixel % self.side);
        let half = self.side / 2;
        for (row, kernel_row) in targets(y, half) {
            for (column, kernel_column) in targets(x, half) {
                let tap = (channel * KERNEL + kernel_row) * KERNEL + kernel_column;
                let weights = &self.weights[tap * self.outputs..(tap + 1) * self.outputs];
                let target = (row * half + column) * self.outputs;
                let drive = &mut self.drive[target..target + self.outputs];
                drive.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
            }
        }
    }

    /// `c = d_c c + x`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]`.
    fn update(&mut self) {
        let state = self.current.iter_mut().zip(&mut self.voltage).zip(&mut self.spiked);
        for (((current, voltage), spiked), drive) in state.zip(&self.drive) {
            *current = self.keep_current * *current + drive;
            *voltage = self.keep_voltage * *voltage * (1.0 - *spiked) + *current;
            *spiked = f32::from(*voltage > self.threshold);
        }
    }
}

/// Windows along one side that hold pixel `at`, and the place of the pixel in each.
fn targets(at: usize, windows: usize) -> impl Iterator<Item = (usize, usize)> {
    let (last, tap) = (at.div_ceil(2), (at + 1) % 2);
    let both = [Some((last, tap)), last.checked_sub(1).map(|before| (before, tap + 2))];
    both.into_iter().flatten().filter(move |(window, _)| *window < windows)
}

#[cfg(test)]
#[path = "event_encoder_tests.rs"]
mod tests;
