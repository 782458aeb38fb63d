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
    /// Of an output pixel.
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
            bias: layer.bias.clone(),
            drive: vec![0.0; layer.outputs * (layer.side / 2)],
        }
    }

    /// The drive of a row of output pixels: the bias, then the inputs in their order.
    #[inline(always)]
    pub(super) fn receive<'a, S: Simd, I: Rows<'a>>(&mut self, simd: S, row: usize, input: I) {
        match self.outputs {
            n if n == 8 * S::F32_LANES => self.rows::<S, I, 8>(simd, row, input),
            n if n == 4 * S::F32_LANES => self.rows::<S, I, 4>(simd, row, input),
            n if n == 2 * S::F32_LANES => self.rows::<S, I, 2>(simd, row, input),
            n if n == S::F32_LANES => self.rows::<S, I, 1>(simd, row, input),
            n => {
                for (drive, bias) in self.drive.iter_mut().zip(self.bias.iter().cycle()) {
                    *drive = *bias;
                }
                let by_row = self.weights.chunks_exact(KERNEL * self.inputs * n);
                for (kernel_row, weights) in by_row.enumerate() {
                    gather_any(input.padded(2 * row + kernel_row), weights, &mut self.drive, n);
                }
            }
        }
    }

    /// The same where a pixel has `N` vectors of outputs.
    #[inline(always)]
    fn rows<'a, S: Simd, I: Rows<'a>, const N: usize>(&mut self, simd: S, row: usize, input: I) {
        let pixels = S::as_mut_simd_f32s(&mut self.drive).0.as_chunks_mut::<N>().0;
        let bias = S::as_simd_f32s(&self.bias).0.as_chunks::<N>().0;
        pixels.fill(bias[0]);
        let by_row = self.weights.chunks_exact(KERNEL * self.inputs * self.outputs);
        for (kernel_row, weights) in by_row.enumerate() {
            gather::<S, I::Row, N>(simd, input.padded(2 * row + kernel_row), weights, pixels);
        }
    }
}
