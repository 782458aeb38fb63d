//! A fully connected layer that counts.

use crate::cost::{Counts, Traffic};
use crate::reference::counted::has_reals;

/// Weights by input: `columns[i * outputs + o]`.
#[derive(Debug, Clone)]
pub(super) struct Dense {
    inputs: usize,
    columns: Vec<f32>,
    bias: Vec<f32>,
}

impl Dense {
    /// Weights are [outputs, inputs].
    pub(super) fn new(weights: &[f32], bias: &[f32]) -> Self {
        let inputs = weights.len() / bias.len();
        let columns = (0..inputs).flat_map(|i| weights.iter().skip(i).step_by(inputs)).copied();
        Self { inputs, columns: columns.collect(), bias: bias.to_vec() }
    }

    /// Every weight times its input, on the bias.
    pub(super) fn multiply(&self, input: &[f32], counts: &mut Counts) -> Vec<f32> {
        let mut sums = self.bias.clone();
        for (x, column) in input.iter().zip(self.columns.chunks_exact(sums.len())) {
            // The counter that the paper used takes an input for each output.
            for _ in 0..self.inputs {
                counts.paper.multiplications += 1;
                counts.paper.additions += 1;
            }
            for (sum, weight) in sums.iter_mut().zip(column) {
                *sum += weight * x;
                counts.exact.multiplications += 1;
                counts.exact.additions += 1;
                counts.chip.multiplications += 1;
                counts.chip.additions += 1;
            }
        }
        self.bias.iter().for_each(|_| counts.paper.additions += 1);
        self.neurobench(input, counts);
        sums
    }

    /// The weights of every spike of every group, on the bias.
    pub(super) fn receive(&self, groups: &[&[bool]], counts: &mut Counts) -> Vec<f32> {
        let mut sums = self.bias.clone();
        for group in groups {
            let columns = group.iter().zip(self.columns.chunks_exact(sums.len()));
            for (_, column) in columns.filter(|(spike, _)| **spike) {
                for (sum, weight) in sums.iter_mut().zip(column) {
                    *sum += weight;
                    counts.paper.additions += 1;
                    counts.exact.additions += 1;
                    counts.chip.additions += 1;
                }
            }
        }
        self.bias.iter().for_each(|_| counts.paper.additions += 1);
        self.neurobench(&fused(groups), counts);
        sums
    }

    /// NeuroBench runs the layer again, on ones.
    fn neurobench(&self, input: &[f32], counts: &mut Counts) {
        let mut effective = 0;
        for (x, column) in input.iter().zip(self.columns.chunks_exact(self.bias.len())) {
            for weight in column {
                counts.neurobench.dense += 1;
                effective += u64::from(*x != 0.0 && *weight != 0.0);
            }
        }
        counts.neurobench.add_effective(effective, has_reals(input));
    }
}

/// Groups added element by element.
pub(super) fn fused(groups: &[&[bool]]) -> Vec<f32> {
    let width = groups.first().map_or(0, |group| group.len());
    let sum = |i: usize| groups.iter().map(|group| f32::from(u8::from(group[i]))).sum();
    (0..width).map(sum).collect()
}

/// A call with these inputs.
pub(super) fn traffic(input: &[f32]) -> Traffic {
    let nonzero = input.iter().filter(|x| **x != 0.0).count() as u64;
    Traffic::call(nonzero, nonzero, has_reals(input))
}
