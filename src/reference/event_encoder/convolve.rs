//! What a row of input pixels sends to the sums of a row of output pixels, through one row of the
//! kernels. A sum gets its inputs one by one, in the order of the input neurons.
//!
//! Shapes: weights `[kernel column][input channel][output channel]`, sums `[column][channel]`.

use pulp::Simd;

use super::spike_map::{PaddedRow, SpikeMap};
use crate::net::eem_san::KERNEL;

/// What a row of neurons or pixels sends.
pub(super) trait Sending<'a>: Copy {
    /// Those that send.
    fn active(self) -> PaddedRow<'a>;

    /// Adds what the one at bit `at` sends to sums in registers, given its weights.
    fn add<S: Simd, const N: usize>(
        self,
        simd: S,
        at: usize,
        weights: &[S::f32s; N],
        sums: &mut [S::f32s; N],
    );

    /// The same for any number of sums.
    fn add_any(self, at: usize, weights: &[f32], sums: &mut [f32]);
}

/// The rows of an input.
pub(super) trait Rows<'a>: Copy {
    /// One of them.
    type Row: Sending<'a>;

    /// Row `row` with its margin; row 0 is the margin above the picture.
    fn padded(self, row: usize) -> Self::Row;
}

impl<'a> Rows<'a> for &'a SpikeMap {
    type Row = PaddedRow<'a>;

    #[inline(always)]
    fn padded(self, row: usize) -> PaddedRow<'a> {
        self.padded_row(row)
    }
}

/// Spikes: each weight as it is.
impl<'a> Sending<'a> for PaddedRow<'a> {
    #[inline(always)]
    fn active(self) -> PaddedRow<'a> {
        self
    }

    #[inline(always)]
    fn add<S: Simd, const N: usize>(
        self,
        simd: S,
        _: usize,
        weights: &[S::f32s; N],
        sums: &mut [S::f32s; N],
    ) {
        for i in 0..N {
            sums[i] = simd.add_f32s(sums[i], weights[i]);
        }
    }

    #[inline(always)]
    fn add_any(self, _: usize, weights: &[f32], sums: &mut [f32]) {
        for i in 0..sums.len() {
            sums[i] += weights[i];
        }
    }
}

/// Outputs of artificial neurons, of which those above 0 are marked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Graded<'a> {
    pub(super) marked: &'a SpikeMap,
    /// With the margin of the map.
    pub(super) outputs: &'a [f32],
    /// Outputs of a row with its margin.
    pub(super) row_len: usize,
}

/// A row of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct GradedRow<'a> {
    active: PaddedRow<'a>,
    /// One for each bit.
    values: &'a [f32],
}

impl<'a> Rows<'a> for Graded<'a> {
    type Row = GradedRow<'a>;

    #[inline(always)]
    fn padded(self, row: usize) -> GradedRow<'a> {
        let values = &self.outputs[row * self.row_len..][..self.row_len];
        GradedRow { active: self.marked.padded_row(row), values }
    }
}

/// Each weight times the output, rounded, then added: no contraction, whatever the machine has.
impl<'a> Sending<'a> for GradedRow<'a> {
    #[inline(always)]
    fn active(self) -> PaddedRow<'a> {
        self.active
    }

    #[inline(always)]
    fn add<S: Simd, const N: usize>(
        self,
        simd: S,
        at: usize,
        weights: &[S::f32s; N],
        sums: &mut [S::f32s; N],
    ) {
        let value = simd.splat_f32s(self.values[at]);
        for i in 0..N {
            sums[i] = simd.add_f32s(sums[i], simd.mul_f32s(value, weights[i]));
        }
    }

    #[inline(always)]
    fn add_any(self, at: usize, weights: &[f32], sums: &mut [f32]) {
        let value = self.values[at];
        for i in 0..sums.len() {
            sums[i] += value * weights[i];
        }
    }
}

/// For pixels of `N` vectors, which stay in registers while a window is looked at.
#[inline(always)]
pub(super) fn gather<'a, S: Simd, R: Sending<'a>, const N: usize>(
    simd: S,
    row: R,
    weights: &[f32],
    sums: &mut [[S::f32s; N]],
) {
    let weights = S::as_simd_f32s(weights).0.as_chunks::<N>().0;
    if weights.len() == KERNEL {
        return scatter(simd, row, weights, sums);
    }
    for (column, sums) in sums.iter_mut().enumerate() {
        let mut added = *sums;
        let mut at = column * weights.len() / 2;
        for weights in weights.chunks(64) {
            let mut left = row.active().window(at, weights.len());
            while left != 0 {
                let bit = left.trailing_zeros() as usize;
                row.add(simd, at + bit, &weights[bit], &mut added);
                left &= left - 1;
            }
            at += weights.len();
        }
        *sums = added;
    }
}

/// The same for one input channel, in which most windows have no spike: from each spike to the
/// windows that it lies in.
#[inline(always)]
fn scatter<'a, S: Simd, R: Sending<'a>, const N: usize>(
    simd: S,
    row: R,
    weights: &[[S::f32s; N]],
    sums: &mut [[S::f32s; N]],
) {
    for (index, word) in row.active().words().iter().enumerate() {
        let mut left = *word;
        while left != 0 {
            let pixel = 64 * index + left.trailing_zeros() as usize;
            left &= left - 1;
            if let Some(sums) = sums.get_mut(pixel / 2) {
                row.add(simd, pixel, &weights[pixel % 2], sums);
            }
            if let Some(before) = (pixel / 2).checked_sub(1) {
                row.add(simd, pixel, &weights[pixel % 2 + 2], &mut sums[before]);
            }
        }
    }
}

/// For pixels of any number of channels.
#[inline(always)]
pub(super) fn gather_any<'a, R: Sending<'a>>(
    row: R,
    weights: &[f32],
    sums: &mut [f32],
    outputs: usize,
) {
    let window = weights.len() / outputs;
    for (column, sums) in sums.chunks_exact_mut(outputs).enumerate() {
        let mut at = column * window / 2;
        for weights in weights.chunks(64 * outputs) {
            let mut left = row.active().window(at, weights.len() / outputs);
            while left != 0 {
                let bit = left.trailing_zeros() as usize;
                row.add_any(at + bit, &weights[bit * outputs..][..outputs], sums);
                left &= left - 1;
            }
            at += 64;
        }
    }
}
