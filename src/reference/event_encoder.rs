//! HSVAE's spiking encoder in 32-bit floats, driven by events, and those of AVAE and FSVAE.
//!
//! The inputs of a neuron are added one by one in the order of their numbers, after its bias, and
//! nothing is contracted, so that every machine computes the same bits whatever its vector width.
//! Artificial neurons whose output is 0 are left out, as are neurons without a spike.

mod artificial;
mod convolve;
mod kernel;
mod layer;
mod spike_map;

use pulp::{Arch, Simd, WithSimd};

use crate::net::EncoderKind;
use crate::net::eem_san::{ConvLayer, EventEncoder, FRAMES_PER_TICK, Readout};
use crate::policy::EventFrame;
use artificial::ArtificialLayer;
use layer::Layer;
use spike_map::SpikeMap;

/// The encoder with the state of one episode.
#[derive(Debug, Clone)]
pub struct FloatEncoder {
    kind: EncoderKind,
    layers: Layers,
    /// Neurons of each layer.
    neurons: Vec<usize>,
    /// The input of each layer in the last step, and the output of the last one.
    maps: Vec<SpikeMap>,
    readout: Readout,
    spikes: Vec<u64>,
    frames: u64,
    /// Frames since the control tick began, or the episode.
    of_tick: usize,
}

/// Layers of either kind.
#[derive(Debug, Clone)]
enum Layers {
    Spiking(Vec<Layer>),
    Artificial(Vec<ArtificialLayer>),
}

impl Layers {
    fn new(encoder: &EventEncoder) -> Self {
        let layers = encoder.layers.iter();
        if encoder.kind.spikes() {
            return Self::Spiking(layers.map(|layer| Layer::new(layer, encoder)).collect());
        }
        let n = encoder.layers.len();
        let layer = |(index, layer)| ArtificialLayer::new(layer, index + 1 == n);
        Self::Artificial(layers.enumerate().map(layer).collect())
    }

    fn reset(&mut self) {
        match self {
            Self::Spiking(layers) => layers.iter_mut().for_each(Layer::reset),
            Self::Artificial(layers) => layers.iter_mut().for_each(ArtificialLayer::reset),
        }
    }
}

impl FloatEncoder {
    /// Takes the weights; the state is that at the start of an episode.
    pub fn new(encoder: &EventEncoder) -> Self {
        let input = encoder.layers.iter().map(|layer| SpikeMap::new(layer.inputs, layer.side));
        let output = |layer: &ConvLayer| SpikeMap::new(layer.outputs, layer.side / 2);
        Self {
            kind: encoder.kind,
            maps: input.chain(encoder.layers.last().map(output)).collect(),
            layers: Layers::new(encoder),
            neurons: encoder.layers.iter().map(ConvLayer::neurons).collect(),
            readout: encoder.readout.clone(),
            spikes: vec![0; encoder.layers.len()],
            frames: 0,
            of_tick: 0,
        }
    }

    /// A new episode: all state zero. Counts of spikes and frames go on.
    pub fn reset(&mut self) {
        self.layers.reset();
        self.maps.iter_mut().for_each(SpikeMap::clear);
        self.of_tick = 0;
    }

    /// One step of all layers, each in the same step as the one before it. An encoder that carries
    /// no state from tick to tick begins anew after each [`FRAMES_PER_TICK`] frames of an episode.
    pub fn step(&mut self, frame: &EventFrame) {
        if self.of_tick == FRAMES_PER_TICK {
            if !self.kind.carries() {
                self.layers.reset();
            }
            self.of_tick = 0;
        }
        self.of_tick += 1;
        if let Some(pixels) = self.maps.first_mut() {
            pixels.clear();
            frame.active().for_each(|pixel| pixels.mark(pixel));
        }
        // The whole step is compiled for several instruction sets, the machine's is taken.
        Arch::new().dispatch(Step { layers: &mut self.layers, maps: &mut self.maps });
        for (count, output) in self.spikes.iter_mut().zip(&self.maps[1..]) {
            *count += output.n_spikes();
        }
        self.frames += 1;
    }

    /// The DVS state: `mu` of the last layer's voltages now; of artificial neurons that of the mean
    /// of the last layer's outputs over the tick's frames so far.
    ///
    /// Shapes: one number for each latent dimension (64). Neurons count channel by channel, as in
    /// the trained weights.
    pub fn state(&self) -> Vec<f32> {
        let read = match &self.layers {
            Layers::Spiking(layers) => layers.last().map(Layer::voltages),
            Layers::Artificial(layers) => layers.last().map(|last| last.mean(self.of_tick)),
        };
        read.map_or_else(Vec::new, |read| self.readout.apply(&read))
    }

    /// The DVS state at the start of an episode: all voltages 0.
    pub fn resting_state(&self) -> Vec<f32> {
        self.readout.apply(&vec![0.0; self.neurons.last().copied().unwrap_or(0)])
    }

    /// Neurons of each layer that spiked in the last step, rising, channel by channel; artificial
    /// ones whose sum was above 0.
    pub fn spiking(&self) -> Vec<Vec<u32>> {
        self.maps.iter().skip(1).map(SpikeMap::channel_by_channel).collect()
    }

    /// Frames seen since the encoder was made.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Spikes of each layer since the encoder was made; of artificial neurons, outputs above 0.
    pub fn spikes(&self) -> &[u64] {
        &self.spikes
    }

    /// Neurons of each layer.
    pub fn neurons(&self) -> Vec<usize> {
        self.neurons.clone()
    }
}

/// A step of all layers; the first map holds its input.
struct Step<'a> {
    layers: &'a mut Layers,
    maps: &'a mut [SpikeMap],
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.layers {
            Layers::Spiking(layers) => {
                for (index, layer) in layers.iter_mut().enumerate() {
                    let (before, after) = self.maps.split_at_mut(index + 1);
                    layer.step(simd, &before[index], &mut after[0]);
                }
            }
            Layers::Artificial(layers) => {
                for index in 0..layers.len() {
                    let (below, here) = layers.split_at_mut(index);
                    let (before, after) = self.maps.split_at_mut(index + 1);
                    here[0].step(simd, below.last(), &before[index], &mut after[0]);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "event_encoder_tests.rs"]
mod tests;
