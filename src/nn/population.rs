//! Population code: each dimension of an observation becomes a group of spiking neurons.

use crate::nn::parameters::{Layout, Parameters, Slot};
use crate::nn::spike::Spike;
use crate::rng::{Draw, Streams};

/// Deviation over the distance of neighbouring means at the start, PopSAN's ratio
/// `sqrt(0.15) / (6 / 9)`.
const DEVIATION_PER_DISTANCE: f32 = 0.580_947_5;

/// Smallest deviation that projection leaves.
pub const DEVIATION_MIN: f32 = 0.01;

/// Where the draws of a batch come from: sample `i` of the batch has a stream of its own, so that
/// the division into shards changes no draw.
#[derive(Debug, Clone, Copy)]
pub struct SpikeDraws<'a> {
    /// Streams of the run.
    pub streams: &'a Streams,
    /// Name of the stream.
    pub name: &'static str,
    /// Number of the update.
    pub update: u64,
    /// Number of the first sample in the batch.
    pub first: usize,
}

impl SpikeDraws<'_> {
    fn sample(&self, index: usize) -> Draw {
        self.streams.at(self.name, (self.update << 24) + (self.first + index) as u64)
    }

    /// One stream per sample, for `rows` samples.
    pub fn samples(&self, rows: usize) -> Vec<Draw> {
        (0..rows).map(|index| self.sample(index)).collect()
    }
}

/// Gaussian receptive fields with learnable means and deviations (eq. 6).
///
/// Tensors: `NAME.mean`, `NAME.deviation` [dimensions, neurons].
#[derive(Debug, Clone)]
pub struct Population {
    ranges: Vec<(f32, f32)>,
    neurons: usize,
    mean: Slot,
    deviation: Slot,
}

impl Population {
    /// Adds the tensors to `layout`; `ranges` has lowest and highest value of each dimension,
    /// `neurons` is the size of a group (10 in the paper).
    pub fn new(layout: &mut Layout, name: &str, ranges: &[(f32, f32)], neurons: usize) -> Self {
        let shape = [ranges.len(), neurons];
        let mean = layout.add(&format!("{name}.mean"), &shape);
        let deviation = layout.add(&format!("{name}.deviation"), &shape);
        Self { ranges: ranges.to_vec(), neurons, mean, deviation }
    }

    /// Number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.ranges.len()
    }

    /// Number of neurons of all groups.
    pub fn outputs(&self) -> usize {
        self.ranges.len() * self.neurons
    }

    /// Means evenly spaced over each range with its ends.
    pub fn initialise(&self, parameters: &mut Parameters) {
        let gaps = self.neurons.saturating_sub(1).max(1) as f32;
        for (dimension, (low, high)) in self.ranges.iter().enumerate() {
            let distance = (high - low) / gaps;
            for neuron in 0..self.neurons {
                let at = dimension * self.neurons + neuron;
                self.mean.of_mut(&mut parameters.values)[at] = low + distance * neuron as f32;
                self.deviation.of_mut(&mut parameters.values)[at] =
                    DEVIATION_PER_DISTANCE * distance;
            }
        }
    }

    /// Keeps deviations at or above [`DEVIATION_MIN`].
    pub fn project(&self, values: &mut [f32]) {
        self.deviation.of_mut(values).iter_mut().for_each(|d| *d = d.max(DEVIATION_MIN));
    }

    /// Strength of stimulation `A = exp(-((s - mean) / deviation)^2 / 2)` (eq. 6).
    ///
    /// Shapes: `observations` [rows, dimensions]; result [rows, outputs].
    pub fn activity(&self, values: &[f32], observations: &[f32]) -> Vec<f32> {
        let fields = self.mean.of(values).chunks_exact(self.neurons);
        let fields = fields.zip(self.deviation.of(values).chunks_exact(self.neurons));
        let mut activity = Vec::with_capacity(observations.len() * self.neurons);
        for row in observations.chunks_exact(self.ranges.len()) {
            for (value, (means, deviations)) in row.iter().zip(fields.clone()) {
                activity.extend(means.iter().zip(deviations).map(|(mean, deviation)| {
                    let offset = (value - mean) / deviation;
                    libm::expf(-0.5 * offset * offset)
                }));
            }
        }
        activity
    }

    /// Independent Bernoulli draws of every neuron in every step (eq. 7 with R = 1).
    ///
    /// Shapes: `activity` [rows, outputs], one stream per row; result [steps, rows, outputs].
    pub fn spikes<S: Spike>(&self, activity: &[f32], steps: usize, draws: &mut [Draw]) -> Vec<f32> {
        bernoulli::<S>(activity, self.outputs(), steps, draws)
    }

    /// Adds the gradients of means and deviations; gives the gradient of the observations.
    ///
    /// The draw counts as the identity (straight through), as in PopSAN.
    /// Shapes: `d_activity` [rows, outputs], the sum over the steps; result [rows, dimensions].
    pub fn backward(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        observations: &[f32],
        activity: &[f32],
        d_activity: &[f32],
    ) -> Vec<f32> {
        let mut d_observations = vec![0.0; observations.len()];
        let (mean, deviation) = (self.mean.of(values), self.deviation.of(values));
        for (at, (activity, d)) in activity.iter().zip(d_activity).enumerate() {
            let (source, field) = (at / self.neurons, at % self.outputs());
            let offset = (observations[source] - mean[field]) / deviation[field];
            let d_offset = -d * activity * offset / deviation[field];
            d_observations[source] += d_offset;
            self.mean.of_mut(gradient)[field] -= d_offset;
            self.deviation.of_mut(gradient)[field] -= d_offset * offset;
        }
        d_observations
    }
}

/// Independent draws in every step, one stream for each row.
///
/// Shapes: `activity` [rows, width]; result [steps, rows, width].
pub(super) fn bernoulli<S: Spike>(
    activity: &[f32],
    width: usize,
    steps: usize,
    draws: &mut [Draw],
) -> Vec<f32> {
    let mut spikes = vec![0.0; steps * activity.len()];
    for step in spikes.chunks_exact_mut(activity.len().max(1)) {
        let rows = step.chunks_exact_mut(width).zip(activity.chunks_exact(width));
        for ((spikes, activity), draw) in rows.zip(&mut *draws) {
            for (spikes, activity) in spikes.chunks_mut(2).zip(activity.chunks(2)) {
                let bits = draw.bits();
                let uniforms = [uniform_24(bits >> 40), uniform_24(bits & 0xff_ffff)];
                for ((spike, probability), uniform) in spikes.iter_mut().zip(activity).zip(uniforms)
                {
                    *spike = S::draw(*probability, uniform);
                }
            }
        }
    }
    spikes
}

/// Uniform in `[0, 1)` from 24 bits.
fn uniform_24(bits: u64) -> f32 {
    bits as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Sum over the steps of [steps, length].
pub(crate) fn sum_of_steps(all: &[f32], length: usize) -> Vec<f32> {
    let mut total = vec![0.0; length];
    for step in all.chunks_exact(length.max(1)) {
        total.iter_mut().zip(step).for_each(|(sum, value)| *sum += value);
    }
    total
}

#[cfg(test)]
#[path = "population_tests.rs"]
mod tests;
