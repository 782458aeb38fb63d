//! Back through time along a tape.

use std::marker::PhantomData;

use pulp::{Simd, WithSimd};

use crate::nn::spike::Spike;
use crate::nn::spiking_encoder::layer::{LaidLayer, Layer, LayerGradient, Sparse};
use crate::nn::spiking_encoder::{Frame, LaidOut, SpikingEncoder};

/// The backward pass along some frames, compiled for several instruction sets.
pub(super) struct Backward<'a, S> {
    encoder: &'a SpikingEncoder,
    weights: &'a LaidOut,
    /// The first one is not gone through.
    frames: &'a [Frame],
    /// Gradients of the last layer's voltages after each frame.
    reads: &'a [Option<Vec<f32>>],
    /// Gradient of the share of a layer's neurons that spike in a frame.
    rate_scale: f32,
    mode: PhantomData<S>,
}

/// What comes to a layer from later frames: gradients of its voltages and currents. That of its
/// spikes comes from the layer above.
struct Later {
    voltage: Vec<f32>,
    current: Vec<f32>,
    spikes: Vec<f32>,
    /// The gradient of the currents again, without zeros, for the layer below.
    sparse: Sparse,
}

impl Later {
    fn nothing(layer: &Layer) -> Self {
        let none = || vec![0.0; layer.neurons()];
        let sparse = Sparse::default();
        Self { voltage: none(), current: none(), spikes: none(), sparse }
    }

    /// Adds the gradient of voltages that were read.
    fn read(&mut self, d_voltage: &[f32]) {
        for ((later_v, later_c), d) in self.voltage.iter_mut().zip(&mut self.current).zip(d_voltage)
        {
            *later_v += d;
            *later_c += d;
        }
    }
}

/// The layer above: its weights, and the gradient of its currents in this frame.
struct Above<'a> {
    layer: &'a Layer,
    laid: &'a LaidLayer,
    d_current: &'a Sparse,
}

impl<S: Spike> WithSimd for Backward<'_, S> {
    type Output = Vec<LayerGradient>;

    #[inline(always)]
    fn with_simd<V: Simd>(self, simd: V) -> Vec<LayerGradient> {
        let layers = &self.encoder.layers;
        let mut gradients: Vec<LayerGradient> = layers.iter().map(Layer::no_gradient).collect();
        let mut later: Vec<Later> = layers.iter().map(Later::nothing).collect();
        for (frame, read) in self.frames.iter().zip(self.reads).skip(1).rev() {
            if frame.rest {
                for later in &mut later {
                    later.voltage.fill(0.0);
                    later.current.fill(0.0);
                }
                continue;
            }
            self.frame_back(simd, frame, read.as_deref(), &mut later, &mut gradients);
        }
        gradients
    }
}

impl<'a, S: Spike> Backward<'a, S> {
    pub(super) fn new(
        encoder: &'a SpikingEncoder,
        weights: &'a LaidOut,
        frames: &'a [Frame],
        reads: &'a [Option<Vec<f32>>],
        rate_scale: f32,
    ) -> Self {
        Self { encoder, weights, frames, reads, rate_scale, mode: PhantomData }
    }

    /// All layers of one frame, last one first.
    #[inline(always)]
    fn frame_back<V: Simd>(
        &self,
        simd: V,
        frame: &Frame,
        read: Option<&[f32]>,
        later: &mut [Later],
        gradients: &mut [LayerGradient],
    ) {
        let layers = &self.encoder.layers;
        for index in (0..layers.len()).rev() {
            let (here, above) = later.split_at_mut(index + 1);
            let (here, voltage) = (&mut here[index], &frame.voltage[index]);
            if let Some(above) = above.first() {
                let (layer, laid) = (&layers[index + 1], &self.weights.layers[index + 1]);
                let above = Above { layer, laid, d_current: &above.sparse };
                self.spikes_back(simd, voltage, &above, &mut here.spikes);
                self.neurons_back(voltage, here);
            } else {
                self.neurons_back(voltage, here);
                read.into_iter().for_each(|read| here.read(read));
            }
            if index > 0 {
                here.sparse.fill(&here.current, layers[index].outputs);
            }
            let input = index.checked_sub(1).map_or(&frame.input, |below| &frame.spikes[below]);
            layers[index].parameters_back(simd, input, &here.current, &mut gradients[index]);
        }
    }

    /// Gradient of the spikes; left at 0 for pixels where no neuron is near its threshold, since
    /// nothing of it passes there.
    #[inline(always)]
    fn spikes_back<V: Simd>(
        &self,
        simd: V,
        voltage: &[f32],
        above: &Above<'_>,
        d_spikes: &mut [f32],
    ) {
        let (threshold, channels) = (self.encoder.shape.threshold, above.layer.inputs);
        let pixels = voltage.chunks_exact(channels).zip(d_spikes.chunks_exact_mut(channels));
        for (pixel, (voltage, d_spikes)) in pixels.enumerate() {
            let mut any = false;
            for v in voltage {
                any |= S::slope(v - threshold) != 0.0;
            }
            if any {
                let Above { layer, laid, d_current } = above;
                layer.input_back(simd, laid, d_current, pixel, d_spikes);
            } else {
                d_spikes.fill(0.0);
            }
        }
    }

    /// Turns what comes from later frames into what goes to the one before; the gradient of the
    /// currents is also that of the drive of this frame.
    #[inline(always)]
    fn neurons_back(&self, voltage: &[f32], later: &mut Later) {
        let lif = &self.encoder.shape.lif;
        let reset = if lif.gradient_through_reset { lif.keep_voltage } else { 0.0 };
        let threshold = self.encoder.shape.threshold;
        let rate = self.rate_scale / voltage.len() as f32;
        let later_states = later.voltage.iter_mut().zip(&mut later.current);
        for ((v, d_spike), (later_v, later_c)) in
            voltage.iter().zip(&later.spikes).zip(later_states)
        {
            let through = (d_spike + rate - reset * v * *later_v) * S::slope(v - threshold);
            let kept = lif.keep_voltage * (1.0 - S::fire(v - threshold));
            *later_v = through + kept * *later_v;
            *later_c = *later_v + lif.keep_current * *later_c;
        }
    }
}
