//! Spikes of a row of input pixels to the sums of a row of output pixels, through one row of the
//! kernels. A sum gets its inputs one by one, in the order of the input neurons.
//!
//! Shapes: weights `[kernel column][input channel][output channel]`, sums `[column][channel]`.

use pulp::Simd;

use super::spike_map::PaddedRow;
use crate::net::eem_san::KERNEL;

/// For pixels of `N` vectors, which stay in registers while a window is looked at.
#[inline(always)]
pub(super) fn gather<S: Simd, const N: usize>(
    simd: S,
    spikes: PaddedRow<'_>,
    weights: &[f32],
    sums: &mut [f32],
) {
    let weights = S::as_simd_f32s(weights).0.as_chunks::<N>().0;
    let sums = S::as_mut_simd_f32s(sums).0.as_chunks_mut::<N>().0;
    if weights.len() == KERNEL {
        return scatter(simd, spikes, weights, sums);
    }
    for (column, sums) in sums.iter_mut().enumerate() {
        let mut added = *sums;
        let mut at = column * weights.len() / 2;
        for weights in weights.chunks(64) {
            let mut left = spikes.window(at, weights.len());
            at += weights.len();
            while left != 0 {
                add(simd, &mut added, &weights[left.trailing_zeros() as usize]);
                left &= left - 1;
            }
        }
        *sums = added;
    }
}

/// The same for one input channel, in which most windows have no spike: from each spike to the
/// windows that it lies in.
#[inline(always)]
fn scatter<S: Simd, const N: usize>(
    simd: S,
    spikes: PaddedRow<'_>,
    weights: &[[S::f32s; N]],
    sums: &mut [[S::f32s; N]],
) {
    for (index, word) in spikes.words().iter().enumerate() {
        let mut left = *word;
        while left != 0 {
            let pixel = 64 * index + left.trailing_zeros() as usize;
            left &= left - 1;
            if let Some(sums) = sums.get_mut(pixel / 2) {
                add(simd, sums, &weights[pixel % 2]);
            }
            if let Some(before) = (pixel / 2).checked_sub(1) {
                add(simd, &mut sums[before], &weights[pixel % 2 + 2]);
            }
        }
    }
}

#[inline(always)]
fn add<S: Simd, const N: usize>(simd: S, sums: &mut [S::f32s; N], weights: &[S::f32s; N]) {
    for i in 0..N {
        sums[i] = simd.add_f32s(sums[i], weights[i]);
    }
}

/// For pixels of any number of channels.
#[inline(always)]
pub(super) fn gather_any(spikes: PaddedRow<'_>, weights: &[f32], sums: &mut [f32], outputs: usize) {
    let window = weights.len() / outputs;
    for (column, sums) in sums.chunks_exact_mut(outputs).enumerate() {
        let mut at = column * window / 2;
        for weights in weights.chunks(64 * outputs) {
            let mut left = spikes.window(at, weights.len() / outputs);
            at += 64;
            while left != 0 {
                let row = &weights[left.trailing_zeros() as usize * outputs..][..outputs];
                left &= left - 1;
                for i in 0..outputs {
                    sums[i] += row[i];
                }
            }
        }
    }
}
