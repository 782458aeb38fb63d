//! A convolution of spiking neurons, kernel 4x4, stride 2, one zero around, run by events.

use std::marker::PhantomData;

use pulp::{Simd, WithSimd};

use crate::nn::lif::LifShape;
use crate::nn::parameters::{Layout, Slot};
use crate::nn::spike::Spike;
use crate::nn::spiking_encoder::Sent;

/// Side of the kernel.
const KERNEL: usize = 4;

/// Places of the kernel.
const TAPS: usize = KERNEL * KERNEL;

/// Neurons that are looked at side by side for spikes.
const BLOCK: usize = 16;

#[derive(Debug, Clone)]
pub(super) struct Layer {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Pixels along a side of the input; the output has half.
    side: usize,
    weight: Slot,
    bias: Slot,
}

/// Weights of a layer in the order of both passes.
#[derive(Debug, Clone)]
pub(super) struct LaidLayer {
    /// [input channel, tap, output channel].
    by_input: Vec<f32>,
    /// [tap, output channel, input channel].
    by_tap: Vec<f32>,
    bias: Vec<f32>,
}

/// Gradients of a layer: of the weights [input channel, tap, output channel], and of the biases.
#[derive(Debug, Clone)]
pub(super) struct LayerGradient {
    pub(super) weights: Vec<f32>,
    pub(super) bias: Vec<f32>,
}

/// Gradient of a layer's currents in one frame, where it is not 0: few of a layer's neurons are near
/// their threshold, and only through those it comes.
#[derive(Debug, Default)]
pub(super) struct Sparse {
    /// Channel and gradient, pixel by pixel.
    entries: Vec<(u32, f32)>,
    /// Where each pixel's entries end.
    ends: Vec<u32>,
}

impl Sparse {
    /// Takes the gradient of all neurons.
    #[inline(always)]
    pub(super) fn fill(&mut self, d_current: &[f32], channels: usize) {
        self.entries.resize(d_current.len(), (0, 0.0));
        self.ends.clear();
        // Every entry is written, and stays where there was no 0: no jumps to guess.
        let mut end = 0;
        for pixel in d_current.chunks_exact(channels) {
            for (channel, d) in pixel.iter().enumerate() {
                self.entries[end] = (channel as u32, *d);
                end += usize::from(*d != 0.0);
            }
            self.ends.push(end as u32);
        }
    }

    #[inline(always)]
    fn pixel(&self, pixel: usize) -> &[(u32, f32)] {
        let first = if pixel == 0 { 0 } else { self.ends[pixel - 1] };
        &self.entries[first as usize..self.ends[pixel] as usize]
    }
}

impl Layer {
    pub(super) fn new(
        layout: &mut Layout,
        name: &str,
        (inputs, outputs): (usize, usize),
        side: usize,
    ) -> Self {
        let weight = layout.add(&format!("{name}.weight"), &[outputs, inputs, KERNEL, KERNEL]);
        let bias = layout.add(&format!("{name}.bias"), &[outputs]);
        Self { inputs, outputs, side, weight, bias }
    }

    pub(super) fn neurons(&self) -> usize {
        self.outputs * self.half() * self.half()
    }

    fn half(&self) -> usize {
        self.side / 2
    }

    /// Place of weight `at` of the saved order in that of [`LaidLayer::by_input`].
    fn place(&self, at: usize) -> usize {
        let (output, rest) = (at / (self.inputs * TAPS), at % (self.inputs * TAPS));
        rest * self.outputs + output
    }

    pub(super) fn lay_out(&self, values: &[f32]) -> LaidLayer {
        let saved = self.weight.of(values);
        let (mut by_input, mut by_tap) = (vec![0.0; saved.len()], vec![0.0; saved.len()]);
        for (at, weight) in saved.iter().enumerate() {
            by_input[self.place(at)] = *weight;
            let (output, rest) = (at / (self.inputs * TAPS), at % (self.inputs * TAPS));
            let (input, tap) = (rest / TAPS, rest % TAPS);
            by_tap[(tap * self.outputs + output) * self.inputs + input] = *weight;
        }
        LaidLayer { by_input, by_tap, bias: self.bias.of(values).to_vec() }
    }

    pub(super) fn no_gradient(&self) -> LayerGradient {
        let weights = vec![0.0; self.inputs * TAPS * self.outputs];
        LayerGradient { weights, bias: vec![0.0; self.outputs] }
    }

    /// Adds gradients to those of all parameters.
    pub(super) fn add_to(&self, gradient: &mut [f32], part: &LayerGradient) {
        for (at, d) in self.weight.of_mut(gradient).iter_mut().enumerate() {
            *d += part.weights[self.place(at)];
        }
        let bias = self.bias.of_mut(gradient).iter_mut();
        bias.zip(&part.bias).for_each(|(d, part)| *d += part);
    }

    /// Adds what spikes send to the currents that they reach.
    ///
    /// Shapes: `input` rising, so that spikes of one pixel are neighbours.
    #[inline(always)]
    fn receive<V: Simd>(&self, simd: V, laid: &LaidLayer, input: &[Sent], current: &mut [f32]) {
        let (n, mut left) = (self.outputs, input);
        while !left.is_empty() {
            let (pixel, spikes, rest) = self.next_pixel(left);
            left = rest;
            for (row, tap_row) in windows(pixel / self.side, self.half()) {
                for (column, tap_column) in windows(pixel % self.side, self.half()) {
                    let target = row * self.half() + column;
                    let tap = tap_row * KERNEL + tap_column;
                    let to = &mut current[target * n..(target + 1) * n];
                    self.pixel_sends(simd, laid, (pixel, tap), spikes, to);
                }
            }
        }
    }

    /// What the spikes of a pixel send to the neurons of one window.
    #[inline(always)]
    fn pixel_sends<V: Simd>(
        &self,
        simd: V,
        laid: &LaidLayer,
        (pixel, tap): (usize, usize),
        spikes: &[Sent],
        to: &mut [f32],
    ) {
        let (n, first) = (self.outputs, pixel * self.inputs);
        let row = |neuron: u32| ((neuron as usize - first) * TAPS + tap) * n;
        let (vectors, rest) = V::as_mut_simd_f32s(to);
        let done = vectors.len() * V::F32_LANES;
        // Two vectors at a time stay in registers while all spikes are added.
        for (index, pair) in vectors.chunks_mut(2).enumerate() {
            let (mut low, mut high) = (pair[0], pair[pair.len() - 1]);
            for (neuron, value) in spikes {
                let row = row(*neuron);
                let (weights, _) = V::as_simd_f32s(&laid.by_input[row..row + n]);
                let value = simd.splat_f32s(*value);
                low = simd.mul_add_e_f32s(value, weights[2 * index], low);
                high = simd.mul_add_e_f32s(value, weights[2 * index + pair.len() - 1], high);
            }
            pair[0] = low;
            pair[pair.len() - 1] = high;
        }
        for (neuron, value) in spikes {
            let row = row(*neuron);
            for (to, weight) in rest.iter_mut().zip(&laid.by_input[row + done..row + n]) {
                *to += value * weight;
            }
        }
    }

    /// Adds the gradients of weights and biases, given that of the currents.
    ///
    /// Shapes: `input` rising.
    #[inline(always)]
    pub(super) fn parameters_back<V: Simd>(
        &self,
        simd: V,
        input: &[Sent],
        d_current: &[f32],
        gradient: &mut LayerGradient,
    ) {
        let (n, mut left) = (self.outputs, input);
        for pixel in d_current.chunks_exact(n) {
            add_scaled(simd, &mut gradient.bias, 1.0, pixel);
        }
        while !left.is_empty() {
            let (pixel, spikes, rest) = self.next_pixel(left);
            left = rest;
            let first = pixel * self.inputs;
            for (row, tap_row) in windows(pixel / self.side, self.half()) {
                for (column, tap_column) in windows(pixel % self.side, self.half()) {
                    let target = (row * self.half() + column) * n;
                    let from = &d_current[target..target + n];
                    let tap = tap_row * KERNEL + tap_column;
                    for (neuron, value) in spikes {
                        let row = ((*neuron as usize - first) * TAPS + tap) * n;
                        add_scaled(simd, &mut gradient.weights[row..row + n], *value, from);
                    }
                }
            }
        }
    }

    /// The pixel of the first spike, all spikes of that pixel, and the others.
    #[inline(always)]
    fn next_pixel<'s>(&self, spikes: &'s [Sent]) -> (usize, &'s [Sent], &'s [Sent]) {
        let inputs = self.inputs as u32;
        let pixel = spikes[0].0 / inputs;
        let end = (pixel + 1) * inputs;
        let mut count = 1;
        while count < spikes.len() && spikes[count].0 < end {
            count += 1;
        }
        let (these, rest) = spikes.split_at(count);
        (pixel as usize, these, rest)
    }

    /// Gradient of what the channels of an input pixel send.
    #[inline(always)]
    pub(super) fn input_back<V: Simd>(
        &self,
        simd: V,
        laid: &LaidLayer,
        d_current: &Sparse,
        pixel: usize,
        d_sent: &mut [f32],
    ) {
        let n = self.inputs;
        d_sent.fill(0.0);
        for (row, tap_row) in windows(pixel / self.side, self.half()) {
            for (column, tap_column) in windows(pixel % self.side, self.half()) {
                let tap = tap_row * KERNEL + tap_column;
                for (output, d) in d_current.pixel(row * self.half() + column) {
                    let weights = (tap * self.outputs + *output as usize) * n;
                    add_scaled(simd, d_sent, *d, &laid.by_tap[weights..weights + n]);
                }
            }
        }
    }
}

/// `to += factor * from`.
#[inline(always)]
fn add_scaled<V: Simd>(simd: V, to: &mut [f32], factor: f32, from: &[f32]) {
    let all = simd.splat_f32s(factor);
    let (to, to_rest) = V::as_mut_simd_f32s(to);
    let (from, from_rest) = V::as_simd_f32s(from);
    for (to, from) in to.iter_mut().zip(from) {
        *to = simd.mul_add_e_f32s(all, *from, *to);
    }
    for (to, from) in to_rest.iter_mut().zip(from_rest) {
        *to += factor * from;
    }
}

/// Windows along one side that hold pixel `at`, and the place of the pixel in each.
#[inline(always)]
fn windows(at: usize, n: usize) -> impl Iterator<Item = (usize, usize)> {
    let (last, tap) = (at.div_ceil(2), (at + 1) % 2);
    // The last window is none at the far edge, the one before it none at the near edge.
    let backs = usize::from(last == n)..2 - usize::from(last == 0);
    Windows { last, tap, backs }
}

/// An iterator without a closure, which might be compiled for another instruction set.
struct Windows {
    last: usize,
    tap: usize,
    backs: core::ops::Range<usize>,
}

impl Iterator for Windows {
    type Item = (usize, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, usize)> {
        let back = self.backs.start;
        if back >= self.backs.end {
            return None;
        }
        self.backs.start += 1;
        Some((self.last - back, self.tap + 2 * back))
    }
}

/// One frame through one layer, compiled for several instruction sets.
pub(super) struct Advance<'a, S> {
    pub(super) layer: &'a Layer,
    pub(super) laid: &'a LaidLayer,
    pub(super) lif: &'a LifShape,
    pub(super) threshold: f32,
    pub(super) input: &'a [Sent],
    /// Voltages after the frame before.
    pub(super) before: &'a [f32],
    pub(super) current: &'a mut [f32],
    pub(super) voltage: &'a mut [f32],
    pub(super) spikes: &'a mut Vec<Sent>,
    pub(super) mode: PhantomData<S>,
}

impl<S: Spike> WithSimd for Advance<'_, S> {
    type Output = ();

    #[inline(always)]
    fn with_simd<V: Simd>(mut self, simd: V) {
        self.decay();
        self.layer.receive(simd, self.laid, self.input, self.current);
        self.fire();
    }
}

impl<S: Spike> Advance<'_, S> {
    #[inline(always)]
    fn decay(&mut self) {
        let bias = &self.laid.bias;
        for pixel in self.current.chunks_exact_mut(self.layer.outputs) {
            for (current, bias) in pixel.iter_mut().zip(bias) {
                *current = self.lif.keep_current * *current + bias;
            }
        }
    }

    /// `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]`.
    #[inline(always)]
    fn fire(&mut self) {
        for ((v, before), c) in self.voltage.iter_mut().zip(self.before).zip(&*self.current) {
            let kept = 1.0 - S::fire(before - self.threshold);
            *v = self.lif.keep_voltage * before * kept + c;
        }
        self.spikes.clear();
        for (block, voltage) in self.voltage.chunks(BLOCK).enumerate() {
            // Every entry is written, and stays where there was a spike: no jumps to guess.
            let (mut sent, mut end) = ([(0, 0.0); BLOCK + 1], 0);
            for (lane, v) in voltage.iter().enumerate() {
                let value = S::fire(v - self.threshold);
                sent[end] = ((block * BLOCK + lane) as u32, value);
                end += usize::from(value != 0.0);
            }
            self.spikes.extend_from_slice(&sent[..end]);
        }
    }
}
