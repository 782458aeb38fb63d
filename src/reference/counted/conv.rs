//! A convolution that counts. Pictures are `[row][column][channel]`.

use crate::cost::{Counts, Traffic};
use crate::net::ConvLayer;
use crate::net::eem_san::KERNEL;
use crate::reference::counted::has_reals;

#[derive(Debug, Clone)]
pub(super) struct Conv {
    inputs: usize,
    outputs: usize,
    side: usize,
    /// [kernel row, kernel column, input channel, output channel].
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Conv {
    pub(super) fn new(layer: &ConvLayer) -> Self {
        let taps = KERNEL * KERNEL;
        let mut weights = vec![0.0; layer.weights.len()];
        for (at, weight) in layer.weights.iter().enumerate() {
            let (output, rest) = (at / (layer.inputs * taps), at % (layer.inputs * taps));
            let (channel, tap) = (rest / taps, rest % taps);
            weights[(tap * layer.inputs + channel) * layer.outputs + output] = *weight;
        }
        let (inputs, outputs, side) = (layer.inputs, layer.outputs, layer.side);
        Self { inputs, outputs, side, weights, bias: layer.bias.clone() }
    }

    /// Numbers of the input.
    pub(super) fn input_size(&self) -> usize {
        self.side * self.side * self.inputs
    }

    /// Neurons or outputs.
    pub(super) fn output_size(&self) -> usize {
        self.side / 2 * (self.side / 2) * self.outputs
    }

    /// Every weight times its input, on the bias.
    pub(super) fn multiply(&self, input: &[f32], counts: &mut Counts) -> Vec<f32> {
        let mut all = self.biases(counts);
        let mut effective = 0;
        for (window, sums) in all.chunks_exact_mut(self.outputs).enumerate() {
            for (tap, weights) in self.weights.chunks_exact(self.inputs * self.outputs).enumerate()
            {
                let pixel = self.pixel(window, tap).map(|pixel| pixel * self.inputs);
                let weights = weights.chunks_exact(self.outputs);
                match pixel {
                    Some(first) => {
                        for (x, weights) in input[first..first + self.inputs].iter().zip(weights) {
                            effective += multiply(sums, weights, *x, counts);
                        }
                    }
                    None => weights.for_each(|weights| count_border(weights, counts)),
                }
            }
        }
        counts.neurobench.add_effective(effective, has_reals(input));
        all
    }

    /// The weights of every spike, on the bias.
    pub(super) fn receive(&self, spikes: &[usize], counts: &mut Counts) -> Vec<f32> {
        let mut all = self.biases(counts);
        for spike in spikes {
            let (pixel, channel) = (spike / self.inputs, spike % self.inputs);
            for (window, tap) in self.windows(pixel) {
                let at = (tap * self.inputs + channel) * self.outputs;
                let weights = &self.weights[at..at + self.outputs];
                let Some(window) = window else {
                    weights.iter().for_each(|_| counts.paper.additions += 1);
                    continue;
                };
                let sums = &mut all[window * self.outputs..(window + 1) * self.outputs];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum += weight;
                    counts.paper.additions += 1;
                    counts.exact.additions += 1;
                    counts.chip.additions += 1;
                    counts.neurobench.effective_acs += u64::from(*weight != 0.0);
                }
            }
        }
        self.count_dense(counts);
        all
    }

    /// Inputs of a call with these values.
    pub(super) fn traffic(&self, input: &[f32]) -> Traffic {
        let active = input.iter().enumerate().filter(|(_, x)| **x != 0.0);
        let windows = |(at, _)| self.windows(at / self.inputs).filter(|(w, _)| w.is_some()).count();
        let (mut arrivals, mut reached) = (0, 0);
        for windows in active.map(windows) {
            arrivals += 1;
            reached += windows as u64;
        }
        Traffic::call(arrivals, reached, has_reals(input))
    }

    /// The bias everywhere; the paper counts it as an addition.
    fn biases(&self, counts: &mut Counts) -> Vec<f32> {
        let mut all = Vec::with_capacity(self.output_size());
        for _ in 0..self.output_size() / self.outputs {
            for bias in &self.bias {
                all.push(*bias);
                counts.paper.additions += 1;
            }
        }
        all
    }

    /// NeuroBench runs the layer again, on ones.
    fn count_dense(&self, counts: &mut Counts) {
        for window in 0..self.output_size() / self.outputs {
            for (tap, weights) in self.weights.chunks_exact(self.inputs * self.outputs).enumerate()
            {
                if self.pixel(window, tap).is_some() {
                    weights.iter().for_each(|_| counts.neurobench.dense += 1);
                }
            }
        }
    }

    /// The pixel below a tap of a window; `None` outside of the picture.
    fn pixel(&self, window: usize, tap: usize) -> Option<usize> {
        let half = self.side / 2;
        let place = |window: usize, tap: usize| {
            (2 * window + tap).checked_sub(1).filter(|at| *at < self.side)
        };
        let row = place(window / half, tap / KERNEL)?;
        Some(row * self.side + place(window % half, tap % KERNEL)?)
    }

    /// The four windows that hold a pixel and its tap in each; `None` for a window outside.
    fn windows(&self, pixel: usize) -> impl Iterator<Item = (Option<usize>, usize)> + use<> {
        let half = self.side / 2;
        let (rows, columns) = (pair(pixel / self.side, half), pair(pixel % self.side, half));
        rows.into_iter().flat_map(move |(row, row_tap)| {
            columns.map(move |(column, column_tap)| {
                let window = row.zip(column).map(|(row, column)| row * half + column);
                (window, row_tap * KERNEL + column_tap)
            })
        })
    }
}

/// Both windows along a side that hold pixel `at`, later one first, and its tap in each.
fn pair(at: usize, windows: usize) -> [(Option<usize>, usize); 2] {
    let (last, tap) = (at.div_ceil(2), (at + 1) % 2);
    [(Some(last).filter(|last| *last < windows), tap), (last.checked_sub(1), tap + 2)]
}

/// Products of one input; gives how many of them NeuroBench takes for effective.
fn multiply(sums: &mut [f32], weights: &[f32], x: f32, counts: &mut Counts) -> u64 {
    let (mut products, mut effective) = (0u32, 0u32);
    for (sum, weight) in sums.iter_mut().zip(weights) {
        *sum += weight * x;
        products += 1;
        effective += u32::from(x != 0.0 && *weight != 0.0);
    }
    let products = u64::from(products);
    for ops in [&mut counts.paper, &mut counts.exact, &mut counts.chip] {
        ops.multiplications += products;
        ops.additions += products;
    }
    counts.neurobench.dense += products;
    u64::from(effective)
}

/// Products with a zero outside of the picture, which the paper counts.
fn count_border(weights: &[f32], counts: &mut Counts) {
    for _ in weights {
        counts.paper.multiplications += 1;
        counts.paper.additions += 1;
    }
}
