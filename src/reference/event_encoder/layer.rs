//! A convolution of spiking neurons, pixel by pixel.

use pulp::Simd;

use super::kernel::Kernel;
use super::spike_map::SpikeMap;
use crate::net::eem_san::{ConvLayer, EventEncoder};

/// Neurons are `[row][column][channel]`.
#[derive(Debug, Clone)]
pub(super) struct Layer {
    kernel: Kernel,
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
    current: Vec<f32>,
    voltage: Vec<f32>,
}

impl Layer {
    pub(super) fn new(layer: &ConvLayer, encoder: &EventEncoder) -> Self {
        let neurons = layer.neurons();
        Self {
            kernel: Kernel::new(layer),
            keep_current: encoder.keep_current as f32,
            keep_voltage: encoder.keep_voltage as f32,
            threshold: encoder.threshold as f32,
            current: vec![0.0; neurons],
            voltage: vec![0.0; neurons],
        }
    }

    /// All state zero.
    pub(super) fn reset(&mut self) {
        self.current.fill(0.0);
        self.voltage.fill(0.0);
    }

    /// Voltages now, channel by channel.
    pub(super) fn voltages(&self) -> Vec<f32> {
        by_channel(&self.voltage, self.kernel.outputs)
    }

    /// One step, row by row.
    #[inline(always)]
    pub(super) fn step<S: Simd>(&mut self, simd: S, input: &SpikeMap, output: &mut SpikeMap) {
        output.clear();
        for row in 0..self.kernel.side / 2 {
            self.kernel.receive(simd, row, input);
            self.update(row, output);
        }
    }

    /// `c = d_c c + x`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]` of a row. `s_prev` is
    /// seen from the voltage, which stays until the next step: a neuron without a spike at the
    /// start of an episode has the voltage 0, at which it does not matter.
    #[inline(always)]
    fn update(&mut self, row: usize, output: &mut SpikeMap) {
        let drive = &self.kernel.drive;
        let len = drive.len();
        let current = &mut self.current[row * len..][..len];
        let voltage = &mut self.voltage[row * len..][..len];
        // Copies, which no write to the state can change: the loop becomes vectors.
        let Self { keep_current, keep_voltage, threshold, .. } = *self;
        for ((current, voltage), drive) in current.iter_mut().zip(voltage.iter_mut()).zip(drive) {
            let kept = 1.0 - f32::from(*voltage > threshold);
            *current = keep_current * *current + drive;
            *voltage = keep_voltage * *voltage * kept + *current;
        }
        mark_above(threshold, voltage, row, output);
    }
}

/// `[row][column][channel]` as `[channel][row][column]`, the order of trained weights.
pub(super) fn by_channel(values: &[f32], channels: usize) -> Vec<f32> {
    let of = |channel: usize| values.iter().skip(channel).step_by(channels);
    (0..channels).flat_map(of).copied().collect()
}

/// Marks the neurons of row `row` whose values are above `threshold`.
#[inline(always)]
pub(super) fn mark_above(threshold: f32, values: &[f32], row: usize, output: &mut SpikeMap) {
    let (blocks, rest) = values.as_chunks::<FLAGS>();
    for (index, block) in blocks.iter().enumerate() {
        let mut above = [0u8; FLAGS];
        for i in 0..FLAGS {
            above[i] = u8::from(block[i] > threshold);
        }
        output.merge(row, index * FLAGS, packed(&above));
    }
    for (index, value) in rest.iter().enumerate() {
        output.merge(row, FLAGS * blocks.len() + index, u64::from(*value > threshold));
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
