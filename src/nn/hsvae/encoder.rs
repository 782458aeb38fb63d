//! Spiking convolutions and the readout of their last voltages.

use crate::nn::conv::{Conv, HALVING};
use crate::nn::hsvae::{HsvaeShape, HsvaeState};
use crate::nn::lif::{LifShape, LifTrace};
use crate::nn::linear::Linear;
use crate::nn::parameters::Layout;
use crate::nn::spike::Spike;

#[derive(Debug, Clone)]
pub(super) struct Encoder {
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
    /// Layer by layer.
    pub layers: Vec<LifTrace<S>>,
    /// Voltages of the last layer after the last frame of each tick, [ticks, samples, latent].
    pub readout: Vec<f32>,
    /// `mu`, [ticks, samples, latent].
    pub mean: Vec<f32>,
    /// Logarithm of `sigma^2`, [ticks, samples, latent].
    pub log_variance: Vec<f32>,
}

impl<S> EncoderTrace<S> {
    /// Spike rate of each layer: spikes per neuron and step.
    pub fn rates(&self) -> Vec<f64> {
        let rate = |layer: &LifTrace<S>| {
            layer.spikes.iter().map(|s| f64::from(*s)).sum::<f64>() / layer.spikes.len() as f64
        };
        self.layers.iter().map(rate).collect()
    }

    /// Mean of the layers' rates.
    pub fn mean_rate(&self) -> f64 {
        self.rates().iter().sum::<f64>() / self.layers.len() as f64
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
        Self { layers, mean, log_variance, lif, threshold, frames }
    }

    /// Neurons of each layer.
    pub(super) fn neurons(&self) -> impl Iterator<Item = usize> {
        self.layers.iter().map(Conv::output_size)
    }

    pub(super) fn forward<S: Spike>(
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
        let mean = self.mean.forward(values, &readout);
        let log_variance = self.log_variance.forward(values, &readout);
        EncoderTrace { layers, readout, mean, log_variance }
    }

    /// Adds the gradients of all parameters, given those of mean and log variance; `rate_scale` is
    /// the weight of the mean spike rate in the loss.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        frames: &[f32],
        trace: &EncoderTrace<S>,
        [d_mean, d_log_variance]: [&[f32]; 2],
        rate_scale: f32,
    ) {
        let d_voltage = self.readout_backward(values, gradient, trace, d_mean, d_log_variance);
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

    /// Gradient of the last layer's voltages: zero but after the last frame of each tick.
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
