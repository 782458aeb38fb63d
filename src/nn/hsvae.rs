//! Hybrid spiking variational auto-encoder: LIF encoder whose state lives for an episode,
//! artificial decoder (Table 1, Algorithm 2); and the two that the paper compares it with, of the
//! same sizes: AVAE, whose encoder is artificial, and FSVAE, whose encoder forgets after each
//! control tick and whose decoder spikes.

mod decoder;
mod encoder;
mod spiking_decoder;
mod trainer;

use crate::nn::init;
use crate::nn::lif::{LifShape, LifState};
use crate::nn::parameters::{Layout, Parameters};
use crate::nn::spike::{Rectangular, Spike};
use crate::nn::vae;
use crate::rng::Streams;
use decoder::Decoder;
use encoder::Encoder;
pub use encoder::EncoderTrace;
pub use trainer::{HsvaeSettings, HsvaeTrainer, Sequences};

/// Log variance of the latent vector at the start, when it is aligned.
const LOG_VARIANCE_START: f32 = -4.0;

/// What the convolutions of an encoder are made of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum EncoderKind {
    /// LIF neurons whose state lives for an episode (HSVAE).
    #[default]
    Spiking,
    /// LIF neurons at rest at the start of each control tick (FSVAE).
    PerTick,
    /// ReLU after all layers but the last, no memory; what is read is the mean of the last layer's
    /// outputs over the frames of a tick (AVAE).
    Artificial,
}

/// What the hidden layers of a decoder are made of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DecoderKind {
    /// ReLU (HSVAE, AVAE).
    #[default]
    Artificial,
    /// LIF neurons that the latent vector drives for as many steps as a tick has frames, at rest
    /// before (FSVAE).
    Spiking,
}

/// Sizes and settings of an auto-encoder.
#[derive(Debug, Clone, PartialEq)]
pub struct HsvaeShape {
    /// What the encoder is made of.
    pub encoder: EncoderKind,
    /// What the decoder is made of.
    pub decoder: DecoderKind,
    /// Pixels along one side of a frame; a multiple of 2 to the number of layers.
    pub side: usize,
    /// Channels of the encoder's layers; the frame has one.
    pub channels: Vec<usize>,
    /// Frames per control tick; `mu` and `sigma` are read after the last.
    pub frames: usize,
    /// Decays and gradient path of spiking layers.
    pub lif: LifShape,
    /// Threshold of all spiking layers; it does not learn (the paper gives none).
    pub threshold: f32,
    /// Weight of the divergence in the loss (1 in eq. 5).
    pub divergence_weight: f32,
    /// Weight of the mean spike rate of the encoder's layers in the loss: 0 in the paper, above 0
    /// makes them sparse. Artificial layers have no spikes, and it does nothing.
    pub rate_weight: f32,
    /// Factor on the encoder's initial weights (PyTorch's default); its biases begin at 0.
    pub encoder_gain: f32,
    /// Sum over the inputs of a neuron of what is added to each initial weight. With 0, sparse
    /// frames die out before the last layer; above, a layer's spikes begin as an image of how many
    /// events there are where.
    pub encoder_lean: f32,
    /// Whether `mu` begins as the last layer's voltages, with little noise, in place of random
    /// mixtures of them.
    pub aligned_latent: bool,
    /// Factor on the initial weights of a spiking decoder, which are too small for spikes.
    pub decoder_gain: f32,
    /// What is added to the initial bias of the decoder's last layer: with 0 all pixels begin near
    /// 0.5, below as dark as frames are.
    pub decoder_bias: f32,
}

impl HsvaeShape {
    /// 128 x 128 x 1 - 16 - 32 - 16 - 1 channels, 5 frames (Table 1).
    pub fn eem_san() -> Self {
        Self {
            encoder: EncoderKind::Spiking,
            decoder: DecoderKind::Artificial,
            side: 128,
            channels: vec![16, 32, 16, 1],
            frames: 5,
            lif: LifShape::default(),
            threshold: 0.5,
            divergence_weight: 1.0,
            rate_weight: 0.0,
            encoder_gain: 1.0,
            encoder_lean: 0.0,
            aligned_latent: false,
            decoder_gain: 1.0,
            decoder_bias: 0.0,
        }
    }

    /// Pixels of a frame.
    pub fn pixels(&self) -> usize {
        self.side * self.side
    }

    /// Elements of the latent vector: neurons of the last encoder layer (64).
    pub fn latent(&self) -> usize {
        let side = self.side >> self.channels.len();
        side * side * self.channels.last().copied().unwrap_or(1)
    }
}

/// States of the encoder's layers for some samples; zero at the start of an episode.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HsvaeState {
    /// Number of samples.
    pub samples: usize,
    /// Layer by layer, [samples, neurons]; nothing where no state is carried from tick to tick.
    pub layers: Vec<LifState>,
}

/// The two terms of eq. 5, mean over ticks and samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HsvaeLoss {
    /// Mean squared error per pixel.
    pub reconstruction: f64,
    /// Divergence from a unit Gaussian, times its weight.
    pub divergence: f64,
    /// Mean spike rate of the encoder's layers, times its weight.
    pub rate: f64,
}

/// Layers of an auto-encoder; parameters are apart.
///
/// Tensors: `encoder.K.weight`, `.bias`; `mu.weight`, `.bias`; `sigma.weight`, `.bias` (the log
/// variance); `decoder.K.weight`, `.bias`; K from 1.
#[derive(Debug, Clone)]
pub struct Hsvae {
    shape: HsvaeShape,
    layout: Layout,
    encoder: Encoder,
    decoder: Decoder,
}

/// Part of a batch that one shard works on.
#[derive(Debug, Clone, Copy)]
pub struct HsvaeBatch<'a> {
    /// [ticks * frames, samples, pixels].
    pub frames: &'a [f32],
    /// What to reconstruct, [ticks, samples, pixels].
    pub targets: &'a [f32],
    /// Gaussian draws, [ticks, samples, latent].
    pub noise: &'a [f32],
    /// Share of these samples in the batch; losses and gradients are scaled by it.
    pub share: f32,
}

impl Hsvae {
    /// Layers for a shape.
    pub fn new(shape: &HsvaeShape) -> Self {
        let mut layout = Layout::default();
        let encoder = Encoder::new(&mut layout, shape);
        let decoder = Decoder::new(&mut layout, shape);
        Self { shape: shape.clone(), layout, encoder, decoder }
    }

    /// Sizes and settings.
    pub fn shape(&self) -> &HsvaeShape {
        &self.shape
    }

    /// Names, shapes and places of the tensors.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Fresh parameters.
    pub fn initial(&self, streams: &Streams) -> Parameters {
        let mut parameters = Parameters::zeros(&self.layout);
        init::uniform_by_fan_in(&mut parameters, streams);
        for entry in self.layout.entries().iter().filter(|e| e.name.starts_with("encoder.")) {
            let weights = entry.slot.of_mut(&mut parameters.values);
            if entry.name.ends_with(".bias") {
                weights.fill(0.0);
                continue;
            }
            let fan_in: usize = entry.shape[1..].iter().product();
            let lean = self.shape.encoder_lean / fan_in as f32;
            weights.iter_mut().for_each(|w| *w = *w * self.shape.encoder_gain + lean);
        }
        if self.shape.aligned_latent {
            self.align(&mut parameters);
        }
        self.start_decoder(&mut parameters);
        parameters
    }

    /// `mu` begins near the last voltages themselves, so that the decoder sees them where they are,
    /// and with little noise.
    fn align(&self, parameters: &mut Parameters) {
        let n = self.shape.latent();
        for (name, scale) in [("mu.weight", 0.1), ("sigma.weight", 0.1), ("sigma.bias", 0.0)] {
            let slot = self.layout.find(name).expect("a tensor of this network").slot;
            let values = slot.of_mut(&mut parameters.values);
            values.iter_mut().for_each(|value| *value *= scale);
            match name {
                "mu.weight" => (0..n).for_each(|i| values[i * n + i] += 1.0),
                "sigma.bias" => values.fill(LOG_VARIANCE_START),
                _ => {}
            }
        }
    }

    /// Spikes from the start where the decoder has neurons, and how dark its pictures begin.
    fn start_decoder(&self, parameters: &mut Parameters) {
        let last = format!("decoder.{}.bias", self.shape.channels.len());
        for entry in self.layout.entries().iter().filter(|e| e.name.starts_with("decoder.")) {
            let values = entry.slot.of_mut(&mut parameters.values);
            if entry.name.ends_with(".weight") && self.shape.decoder == DecoderKind::Spiking {
                values.iter_mut().for_each(|w| *w *= self.shape.decoder_gain);
            }
            if entry.name == last {
                values.iter_mut().for_each(|b| *b += self.shape.decoder_bias);
            }
        }
    }

    /// State at the start of an episode.
    pub fn rest(&self, samples: usize) -> HsvaeState {
        match self.shape.encoder {
            EncoderKind::Spiking => self.encoder.rest(samples),
            EncoderKind::PerTick | EncoderKind::Artificial => {
                HsvaeState { samples, layers: Vec::new() }
            }
        }
    }

    /// Runs frames through the encoder and reads `mu` and log variance after every tick.
    ///
    /// Shapes: `frames` [ticks * frames, samples, pixels], samples as in `state`, which is
    /// carried on.
    pub fn encode<S: Spike>(
        &self,
        values: &[f32],
        frames: &[f32],
        state: &mut HsvaeState,
    ) -> EncoderTrace<S> {
        self.encoder.forward(values, frames, state)
    }

    /// Frames for latent vectors, each pixel in 0 to 1.
    ///
    /// Shapes: `latent` [rows, latent]; result [rows, pixels].
    pub fn decode(&self, values: &[f32], latent: &[f32]) -> Vec<f32> {
        self.decoder.forward::<Rectangular>(values, latent).output().to_vec()
    }

    /// Loss of eq. 5 over some ticks and its gradient, added to `gradient`. Back-propagation ends
    /// at the state that was carried in, or at the start of each tick where none is.
    pub fn loss<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        batch: &HsvaeBatch,
        state: &mut HsvaeState,
    ) -> HsvaeLoss {
        if self.shape.encoder != EncoderKind::PerTick {
            return self.loss_of_stretch::<S>(values, gradient, batch, state);
        }
        let picture = state.samples * self.shape.pixels();
        let ticks = batch.frames.chunks_exact(self.shape.frames * picture);
        let share = batch.share / ticks.len().max(1) as f32;
        let noise = batch.noise.chunks_exact(state.samples * self.shape.latent());
        let mut sum = HsvaeLoss::default();
        for ((frames, targets), noise) in ticks.zip(batch.targets.chunks_exact(picture)).zip(noise)
        {
            let tick = HsvaeBatch { frames, targets, noise, share };
            let loss = self.loss_of_stretch::<S>(values, gradient, &tick, state);
            sum.reconstruction += loss.reconstruction;
            sum.divergence += loss.divergence;
            sum.rate += loss.rate;
        }
        sum
    }

    /// [`Hsvae::loss`] of ticks that the state goes through; of one where none is carried.
    fn loss_of_stretch<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        batch: &HsvaeBatch,
        state: &mut HsvaeState,
    ) -> HsvaeLoss {
        let seen: EncoderTrace<S> = self.encode(values, batch.frames, state);
        let latent = vae::reparameterise(&seen.mean, &seen.log_variance, batch.noise);
        let made = self.decoder.forward::<S>(values, &latent);
        let mut d_output = vec![0.0; made.output().len()];
        let reconstruction =
            vae::mean_square(made.output(), batch.targets, batch.share, &mut d_output);
        let d_latent = self.decoder.backward(values, gradient, &made, d_output);
        let (mut d_mean, mut d_log) =
            vae::reparameterise_backward(&seen.log_variance, batch.noise, &d_latent);
        let rows = seen.mean.len() / self.shape.latent();
        let scale = self.shape.divergence_weight * batch.share / rows as f32;
        let divergence =
            vae::divergence(&seen.mean, &seen.log_variance, scale, &mut d_mean, &mut d_log);
        let rate_scale = match self.shape.encoder {
            EncoderKind::Spiking | EncoderKind::PerTick => self.shape.rate_weight * batch.share,
            EncoderKind::Artificial => 0.0,
        };
        let d_read = [d_mean.as_slice(), d_log.as_slice()];
        self.encoder.backward(values, gradient, batch.frames, &seen, d_read, rate_scale);
        let rate = f64::from(rate_scale) * seen.mean_rate();
        HsvaeLoss { reconstruction, divergence, rate }
    }
}

#[cfg(test)]
#[path = "hsvae_tests.rs"]
mod tests;
