//! HSVAE's spiking encoder in 32-bit floats, driven by events.
//!
//! The inputs of a neuron are added one by one in the order of their numbers, after its bias, and
//! nothing is contracted, so that every machine computes the same bits whatever its vector width.

mod convolve;
mod layer;
mod spike_map;

use pulp::{Arch, Simd, WithSimd};

use crate::net::eem_san::{EventEncoder, Readout};
use crate::policy::EventFrame;
use layer::Layer;
use spike_map::SpikeMap;

/// The encoder with the state of one episode.
#[derive(Debug, Clone)]
pub struct FloatEncoder {
    layers: Vec<Layer>,
    /// The input of each layer in the last step, and the output of the last one.
    maps: Vec<SpikeMap>,
    readout: Readout,
    spikes: Vec<u64>,
    frames: u64,
}

impl FloatEncoder {
    /// Takes the weights; the state is that at the start of an episode.
    pub fn new(encoder: &EventEncoder) -> Self {
        let layers: Vec<Layer> =
            encoder.layers.iter().map(|layer| Layer::new(layer, encoder)).collect();
        let input = layers.iter().map(Layer::input_map);
        let maps = input.chain(layers.last().map(Layer::output_map)).collect();
        let readout = encoder.readout.clone();
        Self { spikes: vec![0; layers.len()], layers, maps, readout, frames: 0 }
    }

    /// A new episode: all state zero. Counts of spikes and frames go on.
    pub fn reset(&mut self) {
        self.layers.iter_mut().for_each(Layer::reset);
        self.maps.iter_mut().for_each(SpikeMap::clear);
    }

    /// One step of all layers, each in the same step as the one before it.
    pub fn step(&mut self, frame: &EventFrame) {
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

    /// The DVS state: `mu` of the last layer's voltages now.
    ///
    /// Shapes: one number for each latent dimension (64). Neurons count channel by channel, as in
    /// the trained weights.
    pub fn state(&self) -> Vec<f32> {
        self.layers.last().map_or_else(Vec::new, |last| self.readout.apply(&last.voltages()))
    }

    /// The DVS state at the start of an episode: all voltages 0.
    pub fn resting_state(&self) -> Vec<f32> {
        self.readout.apply(&vec![0.0; self.layers.last().map_or(0, Layer::n_neurons)])
    }

    /// Neurons of each layer that spiked in the last step, rising, channel by channel.
    pub fn spiking(&self) -> Vec<Vec<u32>> {
        self.maps.iter().skip(1).map(SpikeMap::channel_by_channel).collect()
    }

    /// Frames seen since the encoder was made.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Spikes of each layer since the encoder was made.
    pub fn spikes(&self) -> &[u64] {
        &self.spikes
    }

    /// Neurons of each layer.
    pub fn neurons(&self) -> Vec<usize> {
        self.layers.iter().map(Layer::n_neurons).collect()
    }
}

/// A step of all layers; the first map holds its input.
struct Step<'a> {
    layers: &'a mut [Layer],
    maps: &'a mut [SpikeMap],
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (index, layer) in self.layers.iter_mut().enumerate() {
            let (before, after) = self.maps.split_at_mut(index + 1);
            layer.step(simd, &before[index], &mut after[0]);
        }
    }
}

#[cfg(test)]
#[path = "event_encoder_tests.rs"]
mod tests;
