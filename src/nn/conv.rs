//! Convolutions on square images by im2col, and their transposes by col2im.
//!
//! Images are `[image][channel][row][column]`.

use crate::nn::gemm::{Matrix, multiply};
use crate::nn::parameters::{Layout, Slot};

/// Kernel, stride and padding, the same along both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Side of the kernel.
    pub kernel: usize,
    /// Distance of neighbouring windows.
    pub stride: usize,
    /// Zeros around the image.
    pub padding: usize,
}

/// The window of all layers of HSVAE: 4x4, stride 2, padding 1 (Table 1, `XcYpZsS`).
pub const HALVING: Window = Window { kernel: 4, stride: 2, padding: 1 };

impl Window {
    /// Windows along one side of an image of `side` pixels.
    pub fn positions(self, side: usize) -> usize {
        assert!(side + 2 * self.padding >= self.kernel, "window wider than the padded image");
        (side + 2 * self.padding - self.kernel) / self.stride + 1
    }

    /// Side of the image whose windows are `positions` along one side, with none left over.
    pub fn side(self, positions: usize) -> usize {
        (positions - 1) * self.stride + self.kernel - 2 * self.padding
    }

    fn taps(self) -> usize {
        self.kernel * self.kernel
    }
}

/// A large side and a small side, joined by one kernel: convolution maps large to small, its
/// transpose small to large.
#[derive(Debug, Clone)]
struct Lattice {
    window: Window,
    channels: usize,
    side: usize,
    positions: usize,
}

impl Lattice {
    fn image(&self) -> usize {
        self.channels * self.side * self.side
    }

    fn area(&self) -> usize {
        self.positions * self.positions
    }

    fn rows(&self) -> usize {
        self.channels * self.window.taps()
    }

    /// For every run of pixels that share channel, kernel row and kernel column: first element in
    /// the columns, first pixel, and number of pixels `stride` apart.
    fn runs(&self, mut each: impl FnMut(usize, usize, usize)) {
        let Window { kernel, stride, padding } = self.window;
        for row in 0..self.rows() {
            let (channel, tap) = (row / self.window.taps(), row % self.window.taps());
            let (tap_row, tap_column) = (tap / kernel, tap % kernel);
            let first = padding.saturating_sub(tap_column).div_ceil(stride);
            let room = (self.side + padding).saturating_sub(tap_column);
            let end = room.div_ceil(stride).min(self.positions);
            for y in 0..self.positions {
                let line = y * stride + tap_row;
                if line < padding || line - padding >= self.side || first >= end {
                    continue;
                }
                let pixel = (channel * self.side + line - padding) * self.side;
                let column = first * stride + tap_column - padding;
                let at = row * self.area() + y * self.positions + first;
                each(at, pixel + column, end - first);
            }
        }
    }

    /// Windows of an image as columns: [channels * kernel * kernel, positions * positions].
    fn im2col(&self, image: &[f32], columns: &mut [f32]) {
        columns.fill(0.0);
        self.runs(|at, pixel, count| {
            let targets = &mut columns[at..at + count];
            match self.window.stride {
                2 => gather_even(&image[pixel..], targets),
                stride => {
                    let pixels = image[pixel..].iter().step_by(stride);
                    targets.iter_mut().zip(pixels).for_each(|(to, from)| *to = *from);
                }
            }
        });
    }

    /// Adds columns back to the pixels they came from.
    fn col2im(&self, columns: &[f32], image: &mut [f32]) {
        self.runs(|at, pixel, count| {
            let sources = &columns[at..at + count];
            match self.window.stride {
                2 => scatter_even(sources, &mut image[pixel..]),
                stride => {
                    let pixels = image[pixel..].iter_mut().step_by(stride);
                    pixels.zip(sources).for_each(|(to, from)| *to += from);
                }
            }
        });
    }
}

/// Every second pixel, for the stride of all networks here, in a form that vectorises.
fn gather_even(pixels: &[f32], targets: &mut [f32]) {
    let Some((last, most)) = targets.split_last_mut() else { return };
    *last = pixels[2 * most.len()];
    most.iter_mut().zip(pixels.chunks_exact(2)).for_each(|(to, pair)| *to = pair[0]);
}

/// Adds to every second pixel.
fn scatter_even(sources: &[f32], pixels: &mut [f32]) {
    let Some((last, most)) = sources.split_last() else { return };
    pixels[2 * most.len()] += last;
    pixels.chunks_exact_mut(2).zip(most).for_each(|(pair, from)| pair[0] += from);
}

/// Convolution.
///
/// Tensors: `NAME.weight` [outputs, inputs, kernel, kernel], `NAME.bias` `[outputs]`.
#[derive(Debug, Clone)]
pub struct Conv {
    lattice: Lattice,
    outputs: usize,
    weight: Slot,
    bias: Slot,
}

impl Conv {
    /// Adds the layer's tensors to `layout`; `channels` are those of input and output, `side` that
    /// of the input.
    pub fn new(
        layout: &mut Layout,
        name: &str,
        channels: (usize, usize),
        side: usize,
        window: Window,
    ) -> Self {
        let (inputs, outputs) = channels;
        let shape = [outputs, inputs, window.kernel, window.kernel];
        let weight = layout.add(&format!("{name}.weight"), &shape);
        let bias = layout.add(&format!("{name}.bias"), &[outputs]);
        let lattice = Lattice { window, channels: inputs, side, positions: window.positions(side) };
        Self { lattice, outputs, weight, bias }
    }

    /// Elements of an input image.
    pub fn input_size(&self) -> usize {
        self.lattice.image()
    }

    /// Elements of an output image.
    pub fn output_size(&self) -> usize {
        self.outputs * self.lattice.area()
    }

    fn columns(&self) -> Vec<f32> {
        vec![0.0; self.lattice.rows() * self.lattice.area()]
    }

    fn weight<'a>(&self, values: &'a [f32]) -> Matrix<'a> {
        Matrix::new(self.weight.of(values), self.outputs, self.lattice.rows())
    }

    /// Shapes: `input` [images, input_size]; result [images, output_size].
    pub fn forward(&self, values: &[f32], input: &[f32]) -> Vec<f32> {
        let images = input.len() / self.input_size();
        let mut output = vec![0.0; images * self.output_size()];
        let (mut columns, bias) = (self.columns(), self.bias.of(values));
        let pairs = input.chunks_exact(self.input_size());
        for (image, out) in pairs.zip(output.chunks_exact_mut(self.output_size())) {
            self.lattice.im2col(image, &mut columns);
            fill_channels(out, bias);
            let columns = Matrix::new(&columns, self.lattice.rows(), self.lattice.area());
            multiply(self.weight(values), columns, out, true);
        }
        output
    }

    /// Adds the gradients of weight and bias to `gradient`.
    pub fn backward(&self, gradient: &mut [f32], input: &[f32], d_output: &[f32]) {
        let mut columns = self.columns();
        let pairs = input.chunks_exact(self.input_size());
        for (image, d_out) in pairs.zip(d_output.chunks_exact(self.output_size())) {
            self.lattice.im2col(image, &mut columns);
            let columns = Matrix::new(&columns, self.lattice.rows(), self.lattice.area());
            let d_rows = Matrix::new(d_out, self.outputs, self.lattice.area());
            multiply(d_rows, columns.transposed(), self.weight.of_mut(gradient), true);
            add_channel_sums(d_out, self.bias.of_mut(gradient));
        }
    }

    /// Gradient of the input.
    pub fn backward_input(&self, values: &[f32], d_output: &[f32]) -> Vec<f32> {
        let images = d_output.len() / self.output_size();
        let mut d_input = vec![0.0; images * self.input_size()];
        let mut columns = self.columns();
        let pairs = d_output.chunks_exact(self.output_size());
        for (d_out, d_image) in pairs.zip(d_input.chunks_exact_mut(self.input_size())) {
            let d_rows = Matrix::new(d_out, self.outputs, self.lattice.area());
            multiply(self.weight(values).transposed(), d_rows, &mut columns, false);
            self.lattice.col2im(&columns, d_image);
        }
        d_input
    }
}

/// Transposed convolution: doubles the side where [`Conv`] with the same window halves it.
///
/// Tensors: `NAME.weight` [inputs, outputs, kernel, kernel], `NAME.bias` `[outputs]`.
#[derive(Debug, Clone)]
pub struct ConvTranspose {
    lattice: Lattice,
    inputs: usize,
    weight: Slot,
    bias: Slot,
}

impl ConvTranspose {
    /// Adds the layer's tensors to `layout`; `channels` are those of input and output, `side` that
    /// of the input.
    pub fn new(
        layout: &mut Layout,
        name: &str,
        channels: (usize, usize),
        side: usize,
        window: Window,
    ) -> Self {
        let (inputs, outputs) = channels;
        let shape = [inputs, outputs, window.kernel, window.kernel];
        let weight = layout.add(&format!("{name}.weight"), &shape);
        let bias = layout.add(&format!("{name}.bias"), &[outputs]);
        let large = window.side(side);
        let lattice = Lattice { window, channels: outputs, side: large, positions: side };
        Self { lattice, inputs, weight, bias }
    }

    /// Elements of an input image.
    pub fn input_size(&self) -> usize {
        self.inputs * self.lattice.area()
    }

    /// Elements of an output image.
    pub fn output_size(&self) -> usize {
        self.lattice.image()
    }

    fn columns(&self) -> Vec<f32> {
        vec![0.0; self.lattice.rows() * self.lattice.area()]
    }

    fn weight<'a>(&self, values: &'a [f32]) -> Matrix<'a> {
        Matrix::new(self.weight.of(values), self.inputs, self.lattice.rows())
    }

    /// Shapes: `input` [images, input_size]; result [images, output_size].
    pub fn forward(&self, values: &[f32], input: &[f32]) -> Vec<f32> {
        let images = input.len() / self.input_size();
        let mut output = vec![0.0; images * self.output_size()];
        let (mut columns, bias) = (self.columns(), self.bias.of(values));
        let pairs = input.chunks_exact(self.input_size());
        for (image, out) in pairs.zip(output.chunks_exact_mut(self.output_size())) {
            let rows = Matrix::new(image, self.inputs, self.lattice.area());
            multiply(self.weight(values).transposed(), rows, &mut columns, false);
            fill_channels(out, bias);
            self.lattice.col2im(&columns, out);
        }
        output
    }

    /// Adds the gradients of weight and bias to `gradient`; gives the gradient of the input.
    pub fn backward(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        input: &[f32],
        d_output: &[f32],
    ) -> Vec<f32> {
        let mut d_input = vec![0.0; input.len()];
        let mut columns = self.columns();
        let images = input.chunks_exact(self.input_size());
        let d_images = d_input.chunks_exact_mut(self.input_size());
        for ((image, d_image), d_out) in
            images.zip(d_images).zip(d_output.chunks_exact(self.output_size()))
        {
            self.lattice.im2col(d_out, &mut columns);
            let columns = Matrix::new(&columns, self.lattice.rows(), self.lattice.area());
            let rows = Matrix::new(image, self.inputs, self.lattice.area());
            multiply(rows, columns.transposed(), self.weight.of_mut(gradient), true);
            multiply(self.weight(values), columns, d_image, false);
            add_channel_sums(d_out, self.bias.of_mut(gradient));
        }
        d_input
    }
}

fn fill_channels(image: &mut [f32], bias: &[f32]) {
    let area = image.len() / bias.len();
    image.chunks_exact_mut(area).zip(bias).for_each(|(channel, bias)| channel.fill(*bias));
}

fn add_channel_sums(image: &[f32], sums: &mut [f32]) {
    let area = image.len() / sums.len();
    for (channel, sum) in image.chunks_exact(area).zip(sums) {
        *sum += channel.iter().sum::<f32>();
    }
}

#[cfg(test)]
#[path = "conv_tests.rs"]
mod tests;
