//! The spiking encoder of event frames while it learns through the actor: forward and backward by
//! events, one sample at a time.
//!
//! [`crate::nn::Hsvae`] learns from batches by dense products. Here every world flies with a
//! [`Tape`] of its own, which its camera adds frames to as they come; gradients of the DVS state
//! that the actor gives go back along it. Neurons are `[row][column][channel]` while running, so
//! that a spike reaches runs of neighbours; parameters are laid out as they are saved.

mod back;
mod layer;

use pulp::Arch;

use crate::nn::lif::LifShape;
use crate::nn::linear::Linear;
use crate::nn::parameters::Layout;
use crate::nn::spike::Spike;
use back::Backward;
use layer::{Advance, LaidLayer, Layer};

/// A neuron or pixel and what it sends: 1 for a spike, something else only when smoothed.
pub(crate) type Sent = (u32, f32);

/// Sizes and settings of an encoder.
#[derive(Debug, Clone, PartialEq)]
pub struct SpikingEncoderShape {
    /// Pixels along one side of a frame; a multiple of 2 to the number of layers.
    pub side: usize,
    /// Channels of the layers; the frame has one.
    pub channels: Vec<usize>,
    /// Numbers of the DVS state.
    pub latent: usize,
    /// Decays and gradient path.
    pub lif: LifShape,
    /// Threshold of all layers; it does not learn.
    pub threshold: f32,
}

/// Layers of an encoder; parameters are apart.
///
/// Tensors: `encoder.K.weight` [outputs, inputs, 4, 4], `encoder.K.bias`, K from 1; `mu.weight`
/// [latent, neurons of the last layer], `mu.bias`.
#[derive(Debug, Clone)]
pub struct SpikingEncoder {
    shape: SpikingEncoderShape,
    layout: Layout,
    layers: Vec<Layer>,
    readout: Linear,
}

/// Parameters in the order in which frames run through them.
#[derive(Debug, Clone)]
pub struct LaidOut {
    layers: Vec<LaidLayer>,
    values: Vec<f32>,
}

/// State of one sample's encoder, and what its latest frames left for the backward pass.
#[derive(Debug, Clone)]
pub struct Tape {
    /// Currents after the last frame, layer by layer.
    current: Vec<Vec<f32>>,
    /// The frame before the first one of the tape, then those of the tape.
    frames: Vec<Frame>,
    /// Frames whose memory is free to be used again.
    spare: Vec<Frame>,
    /// Whether frames are kept for a backward pass.
    recording: bool,
}

/// What one frame left.
#[derive(Debug, Clone)]
struct Frame {
    /// Marks the start of an episode: all voltages are 0, and no gradient goes further back.
    rest: bool,
    /// Active pixels.
    input: Vec<Sent>,
    /// Voltages before the reset, layer by layer.
    voltage: Vec<Vec<f32>>,
    /// Spikes, layer by layer.
    spikes: Vec<Vec<Sent>>,
}

impl SpikingEncoder {
    /// Layers for a shape. Panics when the side does not halve as often as there are layers.
    pub fn new(shape: &SpikingEncoderShape) -> Self {
        let mut layout = Layout::default();
        let mut layers = Vec::new();
        let (mut inputs, mut side) = (1, shape.side);
        for (index, outputs) in shape.channels.iter().enumerate() {
            assert!(side % 2 == 0 && side > 0, "side {} halves {index} times only", shape.side);
            let name = format!("encoder.{}", index + 1);
            layers.push(Layer::new(&mut layout, &name, (inputs, *outputs), side));
            (inputs, side) = (*outputs, side / 2);
        }
        let last = layers.last().map(Layer::neurons).expect("an encoder has layers");
        let readout = Linear::new(&mut layout, "mu", last, shape.latent);
        Self { shape: shape.clone(), layout, layers, readout }
    }

    /// Sizes and settings.
    pub fn shape(&self) -> &SpikingEncoderShape {
        &self.shape
    }

    /// Names, shapes and places of the tensors.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Neurons of each layer.
    pub fn neurons(&self) -> Vec<usize> {
        self.layers.iter().map(Layer::neurons).collect()
    }

    /// Parameters made ready to run.
    pub fn lay_out(&self, values: &[f32]) -> LaidOut {
        let layers = self.layers.iter().map(|layer| layer.lay_out(values)).collect();
        LaidOut { layers, values: values.to_vec() }
    }

    /// A tape at the start of an episode.
    pub fn tape(&self, recording: bool) -> Tape {
        let current = self.layers.iter().map(|layer| vec![0.0; layer.neurons()]).collect();
        Tape { current, frames: vec![self.resting()], spare: Vec::new(), recording }
    }

    fn resting(&self) -> Frame {
        Frame {
            rest: true,
            input: Vec::new(),
            voltage: self.layers.iter().map(|layer| vec![0.0; layer.neurons()]).collect(),
            spikes: vec![Vec::new(); self.layers.len()],
        }
    }

    /// One frame through all layers, each in the same step as the one before it.
    pub fn step<S: Spike>(
        &self,
        weights: &LaidOut,
        tape: &mut Tape,
        pixels: impl Iterator<Item = usize>,
    ) {
        let mut now = tape.spare.pop().unwrap_or_else(|| self.resting());
        now.rest = false;
        now.input.clear();
        now.input.extend(pixels.map(|pixel| (pixel as u32, 1.0)));
        let before = tape.frames.last().expect("a tape has a frame");
        let layers = self.layers.iter().zip(&weights.layers);
        let (lif, threshold) = (&self.shape.lif, self.shape.threshold);
        for (index, (layer, laid)) in layers.enumerate() {
            let (below, here) = now.spikes.split_at_mut(index);
            let work = Advance::<S> {
                layer,
                laid,
                lif,
                threshold,
                input: below.last().unwrap_or(&now.input),
                before: &before.voltage[index],
                current: &mut tape.current[index],
                voltage: &mut now.voltage[index],
                spikes: &mut here[0],
                mode: std::marker::PhantomData,
            };
            Arch::new().dispatch(work);
        }
        tape.frames.push(now);
        if !tape.recording {
            tape.forget();
        }
    }

    /// The DVS state: `mu` of the last layer's voltages now.
    pub fn state(&self, weights: &LaidOut, tape: &Tape) -> Vec<f32> {
        self.readout.forward(&weights.values, &self.read(tape, tape.newest()))
    }

    /// Voltages of the last layer after frame `index` of the tape, channel by channel.
    fn read(&self, tape: &Tape, index: usize) -> Vec<f32> {
        let voltage = tape.frames[index].voltage.last().expect("an encoder has layers");
        self.by_channel().map(|neuron| voltage[neuron]).collect()
    }

    /// Neurons of the last layer in the order of the readout's weights: channel by channel.
    fn by_channel(&self) -> impl Iterator<Item = usize> {
        let channels = self.shape.channels.last().copied().unwrap_or(1);
        let area = self.readout.inputs / channels;
        (0..self.readout.inputs).map(move |n| (n % area) * channels + n / area)
    }

    /// Adds to `gradient` those of all parameters, given those of the DVS states after some frames
    /// of the tape, and `rate_scale` times the tape's mean spike rate (over layers), which is given
    /// back.
    ///
    /// Shapes: `d_states` pairs of a frame ([`Tape::newest`]) and the gradient of its state, frames
    /// rising; `gradient` as the layout. Gradients end at the state that the tape began with.
    pub fn backward<S: Spike>(
        &self,
        weights: &LaidOut,
        tape: &Tape,
        d_states: &[(usize, &[f32])],
        rate_scale: f32,
        gradient: &mut [f32],
    ) -> f64 {
        let mut reads: Vec<Option<Vec<f32>>> = vec![None; tape.frames.len()];
        for (index, d_state) in d_states {
            self.readout.backward(gradient, &self.read(tape, *index), d_state);
            let d_voltages = self.readout.backward_input(&weights.values, d_state);
            let mut read = vec![0.0; d_voltages.len()];
            self.by_channel().zip(&d_voltages).for_each(|(neuron, d)| read[neuron] = *d);
            reads[*index] = Some(read);
        }
        let last = d_states.last().map_or(0, |(index, _)| *index);
        let frames = &tape.frames[..=last];
        let seen = frames.iter().skip(1).filter(|frame| !frame.rest).count().max(1);
        let scale = rate_scale / (seen * self.layers.len()) as f32;
        let work = Backward::<S>::new(self, weights, frames, &reads, scale);
        let parts = Arch::new().dispatch(work);
        for (layer, part) in self.layers.iter().zip(&parts) {
            layer.add_to(gradient, part);
        }
        let rates = tape.rates(&self.neurons());
        rates.iter().sum::<f64>() / rates.len() as f64
    }
}

impl Tape {
    /// Number of the newest frame.
    pub fn newest(&self) -> usize {
        self.frames.len() - 1
    }

    /// The start of an episode: all state zero.
    pub fn reset(&mut self) {
        self.current.iter_mut().for_each(|current| current.fill(0.0));
        let last = self.frames.last().expect("a tape has a frame");
        let mut rest = self.spare.pop().unwrap_or_else(|| last.clone());
        rest.rest = true;
        rest.input.clear();
        rest.voltage.iter_mut().for_each(|voltage| voltage.fill(0.0));
        rest.spikes.iter_mut().for_each(Vec::clear);
        self.frames.push(rest);
        if !self.recording {
            self.forget();
        }
    }

    /// Forgets all frames; the state stays.
    pub fn forget(&mut self) {
        let last = self.frames.len() - 1;
        self.spare.extend(self.frames.drain(..last));
    }

    /// Spikes per neuron and frame of each layer, given the layers' numbers of neurons.
    pub fn rates(&self, neurons: &[usize]) -> Vec<f64> {
        let frames = || self.frames.iter().skip(1).filter(|frame| !frame.rest);
        let spikes = |index: usize| frames().map(|frame| frame.spikes[index].len()).sum::<usize>();
        let all = |neurons: &usize| (frames().count().max(1) * neurons) as f64;
        neurons.iter().enumerate().map(|(index, n)| spikes(index) as f64 / all(n)).collect()
    }
}

#[cfg(test)]
#[path = "spiking_encoder_tests.rs"]
mod tests;
