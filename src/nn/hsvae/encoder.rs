//! Convolutions, spiking or artificial, and the readout of their last voltages or outputs.

use crate::nn::activation::{relu, relu_backward};
use crate::nn::conv::{Conv, HALVING};
use crate::nn::hsvae::{EncoderKind, HsvaeShape, HsvaeState};
use crate::nn::lif::{LifShape, LifState, LifTrace};
use crate::nn::linear::Linear;
use crate::nn::parameters::Layout;
use crate::nn::spike::Spike;

#[derive(Debug, Clone)]
pub(super) struct Encoder {
    kind: EncoderKind,
    layers: Vec<Conv>,
    mean: Linear,
    log_variance: Linear,
    lif: LifShape,
    threshold: f32,
    frames: usize,
}

/// What a forward pass of the encoder gives and leaves for the backward pass.
#[derive(Debug, Clone)]
pub struct EncoderTrace<S> {
    /// Samples side by side.
    pub samples: usize,
    /// Layer by layer; none of artificial layers.
    pub layers: Vec<LifTrace<S>>,
    /// Outputs of artificial layers, [ticks * frames, samples, outputs] each; none of spiking ones.
    pub outputs: Vec<Vec<f32>>,
    /// Voltages of the last layer after the last frame of each tick, or the mean of its outputs
    /// over the tick, [ticks, samples, latent].
    pub readout: Vec<f32>,
    /// `mu`, [ticks, samples, latent].
    pub mean: Vec<f32>,
    /// Logarithm of `sigma^2`, [ticks, samples, latent].
    pub log_variance: Vec<f32>,
}

impl<S> EncoderTrace<S> {
    /// Spike rate of each layer: spikes per neuron and step. Of artificial layers the share of
    /// outputs that are above 0.
    pub fn rates(&self) -> Vec<f64> {
        let rate = |layer: &LifTrace<S>| {
            layer.spikes.iter().map(|s| f64::from(*s)).sum::<f64>() / layer.spikes.len() as f64
        };
        let active = |outputs: &Vec<f32>| {
            let active = outputs.iter().filter(|output| **output > 0.0).count();
            active as f64 / outputs.len() as f64
        };
        self.layers.iter().map(rate).chain(self.outputs.iter().map(active)).collect()
    }

    /// Mean of the layers' rates.
    pub fn mean_rate(&self) -> f64 {
        let rates = self.rates();
        rates.iter().sum::<f64>() / rates.len() as f64
    }

    /// What some ticks left, one after the other.
    fn join(ticks: impl Iterator<Item = Self>) -> Option<Self> {
        ticks.reduce(|mut all, tick| {
            for (all, layer) in all.layers.iter_mut().zip(&tick.layers) {
                all.voltage.extend_from_slice(&layer.voltage);
                all.spikes.extend_from_slice(&layer.spikes);
            }
            all.readout.extend(tick.readout);
            all.mean.extend(tick.mean);
            all.log_variance.extend(tick.log_variance);
            all
        })
    }
}

impl Encoder {
    pub(super) fn new(layout: &mut Layout, shape: &HsvaeShape) -> Self {
        let mut layers = Vec::new();
        let (mut inputs, mut side) = (1, shape.side);
        for (index, outputs) in shape.channels.iter().enumerate() {
            assert!(side % 2 == 0 && side > 0, "side {} halves {index} times only", shape.side);
            let name = format!("encoder.{}", index + 1);
            layers.push(Conv::new(layout, &name, (inputs, *outputs), side, HALVING));
            (inputs, side) = (*outputs, side / 2);
        }
        let latent = shape.latent();
        let mean = Linear::new(layout, "mu", latent, latent);
        let log_variance = Linear::new(layout, "sigma", latent, latent);
        let (lif, threshold, frames) = (shape.lif, shape.threshold, shape.frames);
        assert!(!layers.is_empty() && frames > 0, "an encoder needs layers and frames");
        Self { kind: shape.encoder, layers, mean, log_variance, lif, threshold, frames }
    }

    /// Neurons of each layer.
    pub(super) fn neurons(&self) -> impl Iterator<Item = usize> {
        self.layers.iter().map(Conv::output_size)
    }

    /// All layers at rest.
    pub(super) fn rest(&self, samples: usize) -> HsvaeState {
        let layers = self.neurons().map(|n| LifState::rest(samples * n)).collect();
        HsvaeState { samples, layers }
    }

    pub(super) fn forward<S: Spike>(
        &self,
        values: &[f32],
        frames: &[f32],
        state: &mut HsvaeState,
    ) -> EncoderTrace<S> {
        match self.kind {
            EncoderKind::Spiking => self.spiking(values, frames, state),
            EncoderKind::PerTick => {
                let pixels = self.layers.first().map_or(1, Conv::input_size);
                let ticks = frames.chunks_exact(self.frames * state.samples * pixels);
                let tick = |frames| self.spiking(values, frames, &mut self.rest(state.samples));
                let ticks = EncoderTrace::join(ticks.map(tick));
                ticks.unwrap_or_else(|| self.spiking(values, &[], &mut self.rest(state.samples)))
            }
            EncoderKind::Artificial => self.artificial(values, frames, state.samples),
        }
    }

    fn spiking<S: Spike>(
        &self,
        values: &[f32],
        frames: &[f32],
        state: &mut HsvaeState,
    ) -> EncoderTrace<S> {
        assert_eq!(state.layers.len(), self.layers.len(), "layers of the encoder's state");
        let mut layers: Vec<LifTrace<S>> = Vec::new();
        for (layer, state) in self.layers.iter().zip(&mut state.layers) {
            let input = layers.last().map_or(frames, |trace| &trace.spikes);
            let drive = layer.forward(values, input);
            layers.push(self.lif.forward(self.threshold, &drive, state));
        }
        let last = layers.last().map_or(&[][..], |trace| &trace.voltage);
        let step = state.layers.last().map_or(1, |state| state.voltage.len());
        let readout: Vec<f32> = last
            .chunks_exact(step)
            .skip(self.frames - 1)
            .step_by(self.frames)
            .flatten()
            .copied()
            .collect();
        let (mean, log_variance) = self.read(values, &readout);
        let (samples, outputs) = (state.samples, Vec::new());
        EncoderTrace { samples, layers, outputs, readout, mean, log_variance }
    }

    fn artificial<S: Spike>(
        &self,
        values: &[f32],
        frames: &[f32],
        samples: usize,
    ) -> EncoderTrace<S> {
        let mut outputs: Vec<Vec<f32>> = Vec::new();
        for (index, layer) in self.layers.iter().enumerate() {
            let input = outputs.last().map_or(frames, |output| output);
            let mut output = layer.forward(values, input);
            if index + 1 < self.layers.len() {
                relu(&mut output);
            }
            outputs.push(output);
        }
        let last = outputs.last().map_or(&[][..], |output| output);
        let frame = samples * self.mean.inputs;
        let mut readout = Vec::with_capacity(last.len() / self.frames);
        for tick in last.chunks_exact((self.frames * frame).max(1)) {
            let mut sums = vec![0.0; frame];
            for outputs in tick.chunks_exact(frame) {
                sums.iter_mut().zip(outputs).for_each(|(sum, output)| *sum += output);
            }
            readout.extend(sums.iter().map(|sum| sum / self.frames as f32));
        }
        let (mean, log_variance) = self.read(values, &readout);
        EncoderTrace { samples, layers: Vec::new(), outputs, readout, mean, log_variance }
    }

    /// `mu` and log variance.
    fn read(&self, values: &[f32], readout: &[f32]) -> (Vec<f32>, Vec<f32>) {
        (self.mean.forward(values, readout), self.log_variance.forward(values, readout))
    }

    /// Adds the gradients of all parameters, given those of mean and log variance; `rate_scale` is
    /// the weight of the mean spike rate in the loss. Where no state is carried the trace must be
    /// that of one tick.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        frames: &[f32],
        trace: &EncoderTrace<S>,
        [d_mean, d_log_variance]: [&[f32]; 2],
        rate_scale: f32,
    ) {
        let d_readout = self.readout_backward(values, gradient, trace, d_mean, d_log_variance);
        if self.kind == EncoderKind::Artificial {
            return self.artificial_backward(values, gradient, frames, trace, &d_readout);
        }
        let d_voltage = self.voltage_backward(trace, &d_readout);
        let mut d_spikes: Option<Vec<f32>> = None;
        for (index, layer) in self.layers.iter().enumerate().rev() {
            let last = index + 1 == self.layers.len();
            let read = last.then_some(d_voltage.as_slice());
            let spikes = trace.layers[index].spikes.len();
            if rate_scale != 0.0 {
                let d_rate = rate_scale / (spikes * self.layers.len()) as f32;
                let all = d_spikes.get_or_insert_with(|| vec![0.0; spikes]);
                all.iter_mut().for_each(|d| *d += d_rate);
            }
            let d = self.lif.backward(&trace.layers[index], d_spikes.as_deref(), read);
            let below = index.checked_sub(1).map(|below| &trace.layers[below].spikes);
            layer.backward(gradient, below.map_or(frames, |spikes| spikes), &d.drive);
            if index > 0 {
                d_spikes = Some(layer.backward_input(values, &d.drive));
            }
        }
    }

    /// Adds the gradients of artificial layers, given that of the readout.
    fn artificial_backward<S>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        frames: &[f32],
        trace: &EncoderTrace<S>,
        d_readout: &[f32],
    ) {
        let frame = trace.samples * self.mean.inputs;
        let mut d = Vec::with_capacity(self.frames * d_readout.len());
        for d_tick in d_readout.chunks_exact(frame.max(1)) {
            let each: Vec<f32> = d_tick.iter().map(|d| d / self.frames as f32).collect();
            (0..self.frames).for_each(|_| d.extend_from_slice(&each));
        }
        for (index, layer) in self.layers.iter().enumerate().rev() {
            if index + 1 < self.layers.len() {
                relu_backward(&trace.outputs[index], &mut d);
            }
            let below = index.checked_sub(1).map_or(frames, |below| &trace.outputs[below]);
            layer.backward(gradient, below, &d);
            if index > 0 {
                d = layer.backward_input(values, &d);
            }
        }
    }

    /// Gradients of `mu` and log variance, and that of what they read.
    fn readout_backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &EncoderTrace<S>,
        d_mean: &[f32],
        d_log_variance: &[f32],
    ) -> Vec<f32> {
        self.mean.backward(gradient, &trace.readout, d_mean);
        self.log_variance.backward(gradient, &trace.readout, d_log_variance);
        let mut d_readout = self.mean.backward_input(values, d_mean);
        let other = self.log_variance.backward_input(values, d_log_variance);
        d_readout.iter_mut().zip(&other).for_each(|(d, other)| *d += other);
        d_readout
    }

    /// Gradient of the last layer's voltages: zero but after the last frame of each tick.
    fn voltage_backward<S>(&self, trace: &EncoderTrace<S>, d_readout: &[f32]) -> Vec<f32> {
        let last = trace.layers.last().expect("an encoder has layers");
        let mut d_voltage = vec![0.0; last.voltage.len()];
        let step = last.neurons();
        let read = d_voltage.chunks_exact_mut(step).skip(self.frames - 1);
        for (to, from) in read.step_by(self.frames).zip(d_readout.chunks_exact(step)) {
            to.copy_from_slice(from);
        }
        d_voltage
    }
}
