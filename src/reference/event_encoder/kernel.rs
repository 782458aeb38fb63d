//! The weights of a convolution, and what a row of output pixels gets through them.

use pulp::Simd;

use super::convolve::{Rows, gather, gather_any};
use crate::net::eem_san::{ConvLayer, KERNEL};

/// Weights and biases, laid out so that an input reaches runs of neighbouring outputs.
#[derive(Debug, Clone)]
pub(super) struct Kernel {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Pixels along a side of the input.
    pub(super) side: usize,
    /// [kernel row, kernel column, input channel, output channel].
    weights: Vec<f32>,
    /// Of a row of output pixels.
    bias: Vec<f32>,
    /// Sums of one row of output pixels.
    pub(super) drive: Vec<f32>,
}

impl Kernel {
    pub(super) fn new(layer: &ConvLayer) -> Self {
        let taps = KERNEL * KERNEL;
        let mut weights = vec![0.0; layer.weights.len()];
        for (at, weight) in layer.weights.iter().enumerate() {
            let (output, rest) = (at / (layer.inputs * taps), at % (layer.inputs * taps));
            let (input, tap) = (rest / taps, rest % taps);
            weights[(tap * layer.inputs + input) * layer.outputs + output] = *weight;
        }
        Self {
            inputs: layer.inputs,
            outputs: layer.outputs,
            side: layer.side,
            weights,
            bias: layer.bias.repeat(layer.side / 2),
            drive: vec![0.0; layer.outputs * (layer.side / 2)],
        }
    }

    /// The drive of a row of output pixels: the bias, then the inputs in their order.
    #[inline(always)]
    pub(super) fn receive<'a, S: Simd, I: Rows<'a>>(&mut self, simd: S, row: usize, input: I) {
        self.drive.copy_from_slice(&self.bias);
        let by_row = self.weights.chunks_exact(KERNEL * self.inputs * self.outputs);
        for (kernel_row, weights) in by_row.enumerate() {
            let sent = input.padded(2 * row + kernel_row);
            let drive = self.drive.as_mut_slice();
            match self.outputs {
                n if n == 8 * S::F32_LANES => gather::<S, I::Row, 8>(simd, sent, weights, drive),
                n if n == 4 * S::F32_LANES => gather::<S, I::Row, 4>(simd, sent, weights, drive),
                n if n == 2 * S::F32_LANES => gather::<S, I::Row, 2>(simd, sent, weights, drive),
                n if n == S::F32_LANES => gather::<S, I::Row, 1>(simd, sent, weights, drive),
                n => gather_any(sent, weights, drive, n),
            }
        }
    }
}
