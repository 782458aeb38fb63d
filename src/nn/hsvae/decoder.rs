//! Artificial decoder: the encoder's convolutions mirrored and transposed.

use crate::nn::activation::{relu, relu_backward, sigmoid, sigmoid_backward};
use crate::nn::conv::{ConvTranspose, HALVING};
use crate::nn::hsvae::HsvaeShape;
use crate::nn::parameters::Layout;

/// ReLU between the layers, sigmoid at the end: pixels are in 0 to 1 (the paper names neither).
#[derive(Debug, Clone)]
pub(super) struct Decoder {
    layers: Vec<ConvTranspose>,
}

/// Output of every layer, the latent vector first.
#[derive(Debug, Clone)]
pub(super) struct DecoderTrace {
    outputs: Vec<Vec<f32>>,
}

impl DecoderTrace {
    /// The frames.
    pub(super) fn output(&self) -> &[f32] {
        self.outputs.last().map_or(&[], |output| output)
    }
}

impl Decoder {
    pub(super) fn new(layout: &mut Layout, shape: &HsvaeShape) -> Self {
        let channels: Vec<usize> = shape.channels.iter().rev().copied().chain([1]).collect();
        let mut side = shape.side >> shape.channels.len();
        let mut layers = Vec::new();
        for (index, pair) in channels.windows(2).enumerate() {
            let name = format!("decoder.{}", index + 1);
            layers.push(ConvTranspose::new(layout, &name, (pair[0], pair[1]), side, HALVING));
            side *= 2;
        }
        Self { layers }
    }

    pub(super) fn forward(&self, values: &[f32], latent: &[f32]) -> DecoderTrace {
        let mut outputs = vec![latent.to_vec()];
        for (index, layer) in self.layers.iter().enumerate() {
            let mut output = layer.forward(values, &outputs[index]);
            if index + 1 < self.layers.len() {
                relu(&mut output);
            } else {
                sigmoid(&mut output);
            }
            outputs.push(output);
        }
        DecoderTrace { outputs }
    }

    /// Adds the gradients of all parameters; gives that of the latent vectors.
    pub(super) fn backward(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &DecoderTrace,
        d_output: Vec<f32>,
    ) -> Vec<f32> {
        let mut d = d_output;
        for (index, layer) in self.layers.iter().enumerate().rev() {
            if index + 1 < self.layers.len() {
                relu_backward(&trace.outputs[index + 1], &mut d);
            } else {
                sigmoid_backward(&trace.outputs[index + 1], &mut d);
            }
            d = layer.backward(values, gradient, &trace.outputs[index], &d);
        }
        d
    }
}
