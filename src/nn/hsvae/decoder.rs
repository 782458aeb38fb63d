//! Decoders: the encoder's convolutions mirrored and transposed.

use crate::nn::activation::{relu, relu_backward, sigmoid, sigmoid_backward};
use crate::nn::conv::{ConvTranspose, HALVING};
use crate::nn::hsvae::spiking_decoder::{SpikingDecoder, SpikingDecoderTrace};
use crate::nn::hsvae::{DecoderKind, HsvaeShape};
use crate::nn::parameters::Layout;
use crate::nn::spike::Spike;

/// A decoder of either kind; both have the same tensors.
#[derive(Debug, Clone)]
pub(super) enum Decoder {
    Artificial(ArtificialDecoder),
    Spiking(SpikingDecoder),
}

/// What a forward pass leaves.
#[derive(Debug, Clone)]
pub(super) enum DecoderTrace<S> {
    Artificial(ArtificialTrace),
    Spiking(SpikingDecoderTrace<S>),
}

/// ReLU between the layers, sigmoid at the end: pixels are in 0 to 1 (the paper names neither).
#[derive(Debug, Clone)]
pub(super) struct ArtificialDecoder {
    layers: Vec<ConvTranspose>,
}

/// Output of every layer, the latent vector first.
#[derive(Debug, Clone)]
pub(super) struct ArtificialTrace {
    outputs: Vec<Vec<f32>>,
}

impl<S> DecoderTrace<S> {
    /// The frames.
    pub(super) fn output(&self) -> &[f32] {
        match self {
            Self::Artificial(trace) => trace.outputs.last().map_or(&[], |output| output),
            Self::Spiking(trace) => &trace.output,
        }
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
        match shape.decoder {
            DecoderKind::Artificial => Self::Artificial(ArtificialDecoder { layers }),
            DecoderKind::Spiking => Self::Spiking(SpikingDecoder::new(layers, shape)),
        }
    }

    /// Shapes: `latent` [rows, latent]; output [rows, pixels].
    pub(super) fn forward<S: Spike>(&self, values: &[f32], latent: &[f32]) -> DecoderTrace<S> {
        match self {
            Self::Artificial(decoder) => DecoderTrace::Artificial(decoder.forward(values, latent)),
            Self::Spiking(decoder) => DecoderTrace::Spiking(decoder.forward(values, latent)),
        }
    }

    /// Adds the gradients of all parameters; gives that of the latent vectors.
    ///
    /// Panics when the trace is another decoder's.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &DecoderTrace<S>,
        mut d_output: Vec<f32>,
    ) -> Vec<f32> {
        sigmoid_backward(trace.output(), &mut d_output);
        match (self, trace) {
            (Self::Artificial(decoder), DecoderTrace::Artificial(trace)) => {
                decoder.backward(values, gradient, trace, d_output)
            }
            (Self::Spiking(decoder), DecoderTrace::Spiking(trace)) => {
                decoder.backward(values, gradient, trace, &d_output)
            }
            _ => unreachable!("a decoder leaves traces of its own kind"),
        }
    }
}

impl ArtificialDecoder {
    fn forward(&self, values: &[f32], latent: &[f32]) -> ArtificialTrace {
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
        ArtificialTrace { outputs }
    }

    /// The same from the gradient of the sum before the sigmoid.
    fn backward(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &ArtificialTrace,
        d_drive: Vec<f32>,
    ) -> Vec<f32> {
        let mut d = d_drive;
        for (index, layer) in self.layers.iter().enumerate().rev() {
            if index + 1 < self.layers.len() {
                relu_backward(&trace.outputs[index + 1], &mut d);
            }
            d = layer.backward(values, gradient, &trace.outputs[index], &d);
        }
        d
    }
}
