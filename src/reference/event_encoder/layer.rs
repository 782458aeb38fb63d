//! A convolution of spiking neurons, pixel by pixel.

use pulp::Simd;

use super::convolve::{gather, gather_any};
use super::spike_map::SpikeMap;
use crate::net::eem_san::{ConvLayer, EventEncoder, KERNEL};

/// Neurons are `[row][column][channel]`.
#[derive(Debug, Clone)]
pub(super) struct Layer {
    inputs: usize,
    outputs: usize,
    side: usize,
    /// [kernel row, kernel column, input channel, output channel].
    weights: Vec<f32>,
    /// Of a row of output pixels.
    bias: Vec<f32>,
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
    /// Sums of one row of output pixels.
    drive: Vec<f32>,
    current: Vec<f32>,
    voltage: Vec<f32>,
}

impl Layer {
    pub(super) fn new(layer: &ConvLayer, encoder: &EventEncoder) -> Self {
        let taps = KERNEL * KERNEL;
        let mut weights = vec![0.0; layer.weights.len()];
        for (at, weight) in layer.weights.iter().enumerate() {
            let (output, rest) = (at / (layer.inputs * taps), at % (layer.inputs * taps));
            let (input, tap) = (rest / taps, rest % taps);
            weights[(tap * layer.inputs + input) * layer.outputs + output] = *weight;
        }
        let neurons = layer.neurons();
        Self {
            inputs: layer.inputs,
            outputs: layer.outputs,
            side: layer.side,
            weights,
            bias: layer.bias.repeat(layer.side / 2),
            keep_current: encoder.keep_current as f32,
            keep_voltage: encoder.keep_voltage as f32,
            threshold: encoder.threshold as f32,
            drive: vec![0.0; layer.outputs * (layer.side / 2)],
            current: vec![0.0; neurons],
            voltage: vec![0.0; neurons],
        }
    }

    /// All state zero.
    pub(super) fn reset(&mut self) {
        self.current.fill(0.0);
        self.voltage.fill(0.0);
    }

    pub(super) fn input_map(&self) -> SpikeMap {
        SpikeMap::new(self.inputs, self.side)
    }

    pub(super) fn output_map(&self) -> SpikeMap {
        SpikeMap::new(self.outputs, self.side / 2)
    }

    pub(super) fn n_neurons(&self) -> usize {
        self.voltage.len()
    }

    /// Voltages now, channel by channel.
    pub(super) fn voltages(&self) -> Vec<f32> {
        let area = self.voltage.len() / self.outputs;
        let of =
            |channel: usize| self.voltage.iter().skip(channel).step_by(self.outputs).take(area);
        (0..self.outputs).flat_map(of).copied().collect()
    }

    /// One step, row by row.
    #[inline(always)]
    pub(super) fn step<S: Simd>(&mut self, simd: S, input: &SpikeMap, output: &mut SpikeMap) {
        output.clear();
        for row in 0..self.side / 2 {
            self.drive.copy_from_slice(&self.bias);
            self.receive(simd, input, row);
            self.update(row, output);
        }
    }

    /// Adds the inputs of a row of output pixels to their drive, in the order of the input neurons.
    #[inline(always)]
    fn receive<S: Simd>(&mut self, simd: S, input: &SpikeMap, row: usize) {
        let by_row = self.weights.chunks_exact(KERNEL * self.inputs * self.outputs);
        for (kernel_row, weights) in by_row.enumerate() {
            let spikes = input.padded_row(2 * row + kernel_row);
            let drive = self.drive.as_mut_slice();
            match self.outputs {
                n if n == 8 * S::F32_LANES => gather::<S, 8>(simd, spikes, weights, drive),
                n if n == 4 * S::F32_LANES => gather::<S, 4>(simd, spikes, weights, drive),
                n if n == 2 * S::F32_LANES => gather::<S, 2>(simd, spikes, weights, drive),
                n if n == S::F32_LANES => gather::<S, 1>(simd, spikes, weights, drive),
                n => gather_any(spikes, weights, drive, n),
            }
        }
    }

    /// `c = d_c c + x`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]` of a row. `s_prev` is
    /// seen from the voltage, which stays until the next step: a neuron without a spike at the
    /// start of an episode has the voltage 0, at which it does not matter.
    #[inline(always)]
    fn update(&mut self, row: usize, output: &mut SpikeMap) {
        let len = self.drive.len();
        let current = &mut self.current[row * len..][..len];
        let voltage = &mut self.voltage[row * len..][..len];
        for i in 0..len {
            let kept = 1.0 - f32::from(voltage[i] > self.threshold);
            current[i] = self.keep_current * current[i] + self.drive[i];
            voltage[i] = self.keep_voltage * voltage[i] * kept + current[i];
        }
        let (blocks, rest) = voltage.as_chunks::<FLAGS>();
        for (index, block) in blocks.iter().enumerate() {
            let mut spiked = [0u8; FLAGS];
            for i in 0..FLAGS {
                spiked[i] = u8::from(block[i] > self.threshold);
            }
            output.merge(row, index * FLAGS, packed(&spiked));
        }
        for (index, voltage) in rest.iter().enumerate() {
            output.merge(row, FLAGS * blocks.len() + index, u64::from(*voltage > self.threshold));
        }
    }
}

/// Bits that are made at once.
const FLAGS: usize = 32;

/// One bit for each of the flags, which are 0 or 1.
#[inline(always)]
fn packed(flags: &[u8; FLAGS]) -> u64 {
    // The product brings flag `i` of eight to bit 56 + i; no two terms meet.
    const GATHER: u64 = 0x0102_0408_1020_4080;
    let mut bits = 0;
    for (index, eight) in flags.as_chunks::<8>().0.iter().enumerate() {
        bits |= (u64::from_le_bytes(*eight).wrapping_mul(GATHER) >> 56) << (8 * index);
    }
    bits
}
