//! Decoder of LIF neurons: the latent vector drives them for the steps of a control tick.

use crate::nn::activation::sigmoid;
use crate::nn::conv::ConvTranspose;
use crate::nn::hsvae::HsvaeShape;
use crate::nn::lif::{LifShape, LifState, LifTrace};
use crate::nn::spike::Spike;

/// All layers but the last spike, at rest before the first step. Pixels are the sigmoid of the mean
/// drive of the last one, which has no neurons.
#[derive(Debug, Clone)]
pub(super) struct SpikingDecoder {
    layers: Vec<ConvTranspose>,
    lif: LifShape,
    threshold: f32,
    steps: usize,
}

/// What a forward pass leaves.
#[derive(Debug, Clone)]
pub(super) struct SpikingDecoderTrace<S> {
    latent: Vec<f32>,
    /// Spiking layers, [steps, rows, neurons].
    layers: Vec<LifTrace<S>>,
    /// What the last layer takes: mean spikes of the one before, [rows, neurons].
    mean: Vec<f32>,
    /// The frames, [rows, pixels].
    pub(super) output: Vec<f32>,
}

impl SpikingDecoder {
    /// Takes the layers, latent vector first; as many steps as a tick has frames.
    pub(super) fn new(layers: Vec<ConvTranspose>, shape: &HsvaeShape) -> Self {
        Self { layers, lif: shape.lif, threshold: shape.threshold, steps: shape.frames }
    }

    /// Shapes: `latent` [rows, latent]; output [rows, pixels].
    pub(super) fn forward<S: Spike>(
        &self,
        values: &[f32],
        latent: &[f32],
    ) -> SpikingDecoderTrace<S> {
        let mut layers: Vec<LifTrace<S>> = Vec::new();
        let (last, hidden) = self.layers.split_last().expect("a decoder has layers");
        for layer in hidden {
            let drive = match layers.last() {
                Some(below) => layer.forward(values, &below.spikes),
                // The same in every step.
                None => layer.forward(values, latent).repeat(self.steps),
            };
            let mut state = LifState::rest(drive.len() / self.steps);
            layers.push(self.lif.forward(self.threshold, &drive, &mut state));
        }
        let mean = match layers.last() {
            Some(layer) => self.mean(&layer.spikes),
            None => latent.to_vec(),
        };
        let mut output = last.forward(values, &mean);
        sigmoid(&mut output);
        SpikingDecoderTrace { latent: latent.to_vec(), layers, mean, output }
    }

    fn mean(&self, spikes: &[f32]) -> Vec<f32> {
        let mut sums = self.sum(spikes);
        sums.iter_mut().for_each(|sum| *sum /= self.steps as f32);
        sums
    }

    /// Sum over the steps.
    fn sum(&self, all: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0; all.len() / self.steps];
        for step in all.chunks_exact(sums.len().max(1)) {
            sums.iter_mut().zip(step).for_each(|(sum, value)| *sum += value);
        }
        sums
    }

    /// Adds the gradients of all parameters, given that of the mean drive of the last layer; gives
    /// that of the latent vectors.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &SpikingDecoderTrace<S>,
        d_drive: &[f32],
    ) -> Vec<f32> {
        let (last, hidden) = self.layers.split_last().expect("a decoder has layers");
        let mut d_mean = last.backward(values, gradient, &trace.mean, d_drive);
        if hidden.is_empty() {
            return d_mean;
        }
        d_mean.iter_mut().for_each(|d| *d /= self.steps as f32);
        let mut d = d_mean.repeat(self.steps);
        for (index, layer) in hidden.iter().enumerate().rev() {
            let d_drive = self.lif.backward(&trace.layers[index], Some(&d), None).drive;
            d = match index.checked_sub(1) {
                Some(below) => {
                    layer.backward(values, gradient, &trace.layers[below].spikes, &d_drive)
                }
                None => layer.backward(values, gradient, &trace.latent, &self.sum(&d_drive)),
            };
        }
        d
    }
}
