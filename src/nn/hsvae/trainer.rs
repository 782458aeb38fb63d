//! Training of the auto-encoder, stretch by stretch of its episodes (Algorithm 2).

use std::ops::Range;

use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::hsvae::{Hsvae, HsvaeBatch, HsvaeLoss, HsvaeShape, HsvaeState};
use crate::nn::lif::LifState;
use crate::nn::parameters::Parameters;
use crate::nn::shards::{self, Shards};
use crate::nn::spike::Rectangular;
use crate::nn::state::{StateError, StateReader, StateWriter};
use crate::nn::vae;
use crate::rng::Streams;

/// Settings of the training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HsvaeSettings {
    /// Optimiser.
    pub adam: AdamSettings,
    /// Division of a batch.
    pub shards: Shards,
}

impl Default for HsvaeSettings {
    /// Adam with rate 1e-3, which the paper does not give.
    fn default() -> Self {
        Self { adam: AdamSettings::with_rate(1e-3), shards: Shards::default() }
    }
}

/// A stretch of some episodes, side by side.
#[derive(Debug, Clone, Copy)]
pub struct Sequences<'a> {
    /// Number of episodes.
    pub samples: usize,
    /// [ticks * frames, samples, pixels]; gradients go back to the first of them, no further.
    pub frames: &'a [f32],
    /// What to reconstruct at each tick, [ticks, samples, pixels].
    pub targets: &'a [f32],
}

/// The auto-encoder while it learns.
#[derive(Debug, Clone)]
pub struct HsvaeTrainer {
    settings: HsvaeSettings,
    layers: Hsvae,
    /// Parameters.
    pub parameters: Parameters,
    adam: Adam,
}

impl HsvaeTrainer {
    /// Fresh parameters.
    pub fn new(settings: &HsvaeSettings, shape: &HsvaeShape, streams: &Streams) -> Self {
        let layers = Hsvae::new(shape);
        let parameters = layers.initial(streams);
        let adam = Adam::new(parameters.values.len());
        Self { settings: *settings, layers, parameters, adam }
    }

    /// Layers.
    pub fn layers(&self) -> &Hsvae {
        &self.layers
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.adam.steps
    }

    /// Step length of the next updates.
    pub fn set_learning_rate(&mut self, learning_rate: f32) {
        self.settings.adam.learning_rate = learning_rate;
    }

    /// One step on a stretch; `state` is carried from stretch to stretch of the same episodes.
    pub fn update(
        &mut self,
        batch: &Sequences,
        state: &mut HsvaeState,
        streams: &Streams,
    ) -> HsvaeLoss {
        let (gradient, loss) = self.gradient(batch, state, streams);
        self.adam.step(&self.settings.adam, &mut self.parameters.values, &gradient);
        loss
    }

    /// Gradient and loss of a stretch; carries `state` on and changes nothing else.
    pub fn gradient(
        &self,
        batch: &Sequences,
        state: &mut HsvaeState,
        streams: &Streams,
    ) -> (Vec<f32>, HsvaeLoss) {
        let carried: &HsvaeState = state;
        let parts = self
            .settings
            .shards
            .run(batch.samples, |range| self.shard(batch, carried, streams, range));
        let mut loss = HsvaeLoss::default();
        let (mut gradients, mut states) = (Vec::new(), Vec::new());
        for (gradient, part, state) in parts {
            loss.reconstruction += part.reconstruction;
            loss.divergence += part.divergence;
            loss.rate += part.rate;
            gradients.push(gradient);
            states.push(state);
        }
        *state = HsvaeState::join(&states);
        (shards::sum(gradients), loss)
    }

    fn shard(
        &self,
        batch: &Sequences,
        state: &HsvaeState,
        streams: &Streams,
        range: Range<usize>,
    ) -> (Vec<f32>, HsvaeLoss, HsvaeState) {
        let shape = self.layers.shape();
        let take = |all: &[f32]| shards::samples(all, batch.samples, shape.pixels(), &range);
        let (frames, targets) = (take(batch.frames), take(batch.targets));
        let ticks = targets.len() / (range.len() * shape.pixels()).max(1);
        let rows = (0..ticks).flat_map(|t| range.clone().map(move |s| t * batch.samples + s));
        let noise = vae::latent_noise(streams, self.updates(), rows, shape.latent());
        let share = range.len() as f32 / batch.samples as f32;
        let part = HsvaeBatch { frames: &frames, targets: &targets, noise: &noise, share };
        let mut state = state.samples(batch.samples, &range);
        let mut gradient = self.layers.layout().zeros();
        let values = &self.parameters.values;
        let loss = self.layers.loss::<Rectangular>(values, &mut gradient, &part, &mut state);
        (gradient, loss, state)
    }

    /// Adds everything that the next update depends on, but the carried state.
    pub fn write(&self, state: &mut StateWriter) {
        state.parameters("hsvae.", &self.parameters);
        state.adam("adam.hsvae.", self.parameters.layout(), &self.adam);
    }

    /// Takes over what [`HsvaeTrainer::write`] wrote for the same shape.
    ///
    /// Errors: a tensor is missing or has another shape; nothing is changed then.
    pub fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let mut fresh = self.clone();
        state.parameters("hsvae.", &mut fresh.parameters)?;
        state.adam("adam.hsvae.", fresh.layers.layout(), &mut fresh.adam)?;
        *self = fresh;
        Ok(())
    }
}

impl HsvaeState {
    /// Puts sample `sample` of `count` back to the start of an episode.
    pub fn clear(&mut self, sample: usize, count: usize) {
        for layer in &mut self.layers {
            for all in [&mut layer.current, &mut layer.voltage, &mut layer.spikes] {
                let neurons = all.len() / count.max(1);
                all[sample * neurons..(sample + 1) * neurons].fill(0.0);
            }
        }
    }

    /// State of samples `range` of `count`.
    pub fn samples(&self, count: usize, range: &Range<usize>) -> Self {
        let part = |all: &[f32]| {
            let neurons = all.len() / count.max(1);
            all[range.start * neurons..range.end * neurons].to_vec()
        };
        let layer = |layer: &LifState| LifState {
            current: part(&layer.current),
            voltage: part(&layer.voltage),
            spikes: part(&layer.spikes),
        };
        Self { samples: range.len(), layers: self.layers.iter().map(layer).collect() }
    }

    /// States of some samples behind each other.
    pub fn join(parts: &[Self]) -> Self {
        let mut parts = parts.iter();
        let mut all = parts.next().cloned().unwrap_or_default();
        for part in parts {
            all.samples += part.samples;
            for (to, from) in all.layers.iter_mut().zip(&part.layers) {
                to.current.extend_from_slice(&from.current);
                to.voltage.extend_from_slice(&from.voltage);
                to.spikes.extend_from_slice(&from.spikes);
            }
        }
        all
    }
}
