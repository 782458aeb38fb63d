//! A convolution of artificial neurons: ReLU, but for the last layer, whose outputs are summed over
//! the frames of a control tick.

use pulp::Simd;

use super::convolve::Graded;
use super::kernel::Kernel;
use super::layer::{by_channel, mark_above};
use super::spike_map::{MARGIN, SpikeMap};
use crate::net::eem_san::ConvLayer;

/// Neurons are `[row][column][channel]`.
#[derive(Debug, Clone)]
pub(super) struct ArtificialLayer {
    kernel: Kernel,
    /// Outputs above 0, with a margin around the picture as [`SpikeMap`] has it; those of neurons
    /// that are not marked there are of no meaning.
    outputs: Vec<f32>,
    /// Sums before the ReLU, over the frames since the tick began; empty but in the last layer.
    sums: Vec<f32>,
}

impl ArtificialLayer {
    pub(super) fn new(layer: &ConvLayer, last: bool) -> Self {
        let padded = layer.side / 2 + 2 * MARGIN;
        let (outputs, sums) = match last {
            true => (0, layer.neurons()),
            false => (padded * padded * layer.outputs, 0),
        };
        Self { kernel: Kernel::new(layer), outputs: vec![0.0; outputs], sums: vec![0.0; sums] }
    }

    /// The start of a control tick.
    pub(super) fn reset(&mut self) {
        self.sums.fill(0.0);
    }

    /// Mean of the last layer's sums over `frames` frames, channel by channel; zeros of none.
    pub(super) fn mean(&self, frames: usize) -> Vec<f32> {
        let sums = by_channel(&self.sums, self.kernel.outputs);
        sums.into_iter().map(|sum| sum / frames.max(1) as f32).collect()
    }

    /// One frame, row by row; `before` is the layer before, none for the first, whose input is
    /// events. Outputs above 0 are marked in `output`.
    #[inline(always)]
    pub(super) fn step<S: Simd>(
        &mut self,
        simd: S,
        before: Option<&Self>,
        input: &SpikeMap,
        output: &mut SpikeMap,
    ) {
        output.clear();
        for row in 0..self.kernel.side / 2 {
            match before {
                None => self.kernel.receive(simd, row, input),
                Some(before) => self.kernel.receive(simd, row, before.graded(input)),
            }
            self.update(row, output);
        }
    }

    /// The outputs, with the map in which they are marked.
    #[inline(always)]
    fn graded<'a>(&'a self, marked: &'a SpikeMap) -> Graded<'a> {
        let row_len = self.outputs.len() / (self.kernel.side / 2 + 2 * MARGIN);
        Graded { marked, outputs: &self.outputs, row_len }
    }

    #[inline(always)]
    fn update(&mut self, row: usize, output: &mut SpikeMap) {
        let drive = &self.kernel.drive;
        let len = drive.len();
        if self.outputs.is_empty() {
            let sums = &mut self.sums[row * len..][..len];
            for i in 0..len {
                sums[i] += drive[i];
            }
        } else {
            let margin = MARGIN * self.kernel.outputs;
            let padded = len + 2 * margin;
            let first = (row + MARGIN) * padded + margin;
            self.outputs[first..first + len].copy_from_slice(drive);
        }
        mark_above(0.0, drive, row, output);
    }
}
