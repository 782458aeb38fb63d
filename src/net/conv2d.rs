//! Geometry of a two-dimensional convolution: which input pixel meets which output through which
//! tap of the kernel.
//!
//! Cross-correlation with zero padding: output `(oy, ox)` sees input `(oy * stride + ky - pad,
//! ox * stride + kx - pad)` through tap `(ky, kx)`.

use std::ops::Range;

/// Most neurons of a picture, and most weights of a kernel.
const SIZE_MAX: usize = 1 << 24;

/// Channels, rows and columns; neuron number `(channel * height + y) * width + x`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Channels.
    pub channels: usize,
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

impl Shape {
    /// Neurons without a place in a picture: one pixel of `n` channels.
    pub fn flat(n: usize) -> Self {
        Self { channels: n, height: 1, width: 1 }
    }

    /// Number of neurons.
    pub fn neurons(&self) -> usize {
        self.channels * self.height * self.width
    }

    /// Number of the neuron of `channel` at row `y`, column `x`.
    pub fn neuron(&self, channel: usize, y: usize, x: usize) -> usize {
        (channel * self.height + y) * self.width + x
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}x{}", self.channels, self.height, self.width)
    }
}

/// A convolution whose parts go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conv2d {
    input: Shape,
    output: Shape,
    kernel: [usize; 2],
    stride: usize,
    pad: usize,
}

/// Outputs of one dimension that an input pixel reaches: `first..first + len`, through the taps
/// `first_tap`, `first_tap - stride`, ...
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Taps {
    /// First output.
    pub first: usize,
    /// Number of outputs.
    pub len: usize,
    /// Tap of the first output.
    pub first_tap: usize,
}

impl Conv2d {
    /// A convolution of `input` to `channels` channels with a kernel of `[rows, columns]`, and
    /// `pad` zero rows or columns around the input.
    ///
    /// Errors, in words: sizes of 0 or beyond 2^24, padding as large as the kernel, an input
    /// smaller than the kernel.
    pub fn new(
        input: Shape,
        channels: usize,
        kernel: [usize; 2],
        stride: usize,
        pad: usize,
    ) -> Result<Self, String> {
        let sizes = [input.channels, input.height, input.width, channels, kernel[0], kernel[1]];
        let all = sizes.into_iter().chain([stride]);
        if let Some(bad) = all.clone().find(|size| !(1..=SIZE_MAX).contains(size)) {
            return Err(format!("a size is {bad}, must be 1..={SIZE_MAX}"));
        }
        if pad >= kernel[0].min(kernel[1]) {
            return Err(format!("pad = {pad}, must be below the kernel of {kernel:?}"));
        }
        let extent = |size: usize, kernel: usize| {
            let padded = size + 2 * pad;
            padded.checked_sub(kernel).map(|rest| rest / stride + 1).ok_or_else(|| {
                format!("kernel {kernel:?} is larger than {size} pixels with pad {pad}")
            })
        };
        let (height, width) = (extent(input.height, kernel[0])?, extent(input.width, kernel[1])?);
        let output = Shape { channels, height, width };
        let weights = [channels, input.channels, kernel[0], kernel[1]];
        for factors in
            [&[input.channels, input.height, input.width][..], &[channels, height, width], &weights]
        {
            let product =
                factors.iter().try_fold(1usize, |product, size| product.checked_mul(*size));
            if product.is_none_or(|product| product > SIZE_MAX) {
                return Err(format!("{factors:?} is more than {SIZE_MAX} in all"));
            }
        }
        Ok(Self { input, output, kernel, stride, pad })
    }

    /// Shape of the source.
    pub fn input(&self) -> Shape {
        self.input
    }

    /// Shape of the target.
    pub fn output(&self) -> Shape {
        self.output
    }

    /// Shape of the weights: output channel, input channel, row, column.
    pub fn weights_shape(&self) -> [usize; 4] {
        [self.output.channels, self.input.channels, self.kernel[0], self.kernel[1]]
    }

    /// Number of weights.
    pub fn n_weights(&self) -> usize {
        self.weights_shape().iter().product()
    }

    /// Place of a weight in row-major order of [`Conv2d::weights_shape`].
    pub fn weight(&self, output: usize, input: usize, ky: usize, kx: usize) -> usize {
        ((output * self.input.channels + input) * self.kernel[0] + ky) * self.kernel[1] + kx
    }

    /// Distance between neighbouring outputs, in input pixels.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Zero rows and columns around the input.
    pub fn pad(&self) -> usize {
        self.pad
    }

    /// Input rows that the output rows `rows` see.
    pub fn input_rows(&self, rows: &Range<usize>) -> Range<usize> {
        self.seen(rows, self.kernel[0], self.input.height)
    }

    /// Input columns that the output columns `columns` see.
    pub fn input_columns(&self, columns: &Range<usize>) -> Range<usize> {
        self.seen(columns, self.kernel[1], self.input.width)
    }

    /// Output rows within `rows` that see input row `y`; `None` where there are none.
    pub fn row_taps(&self, y: usize, rows: &Range<usize>) -> Option<Taps> {
        self.taps(y, rows, self.kernel[0])
    }

    /// Output columns within `columns` that see input column `x`; `None` where there are none.
    pub fn column_taps(&self, x: usize, columns: &Range<usize>) -> Option<Taps> {
        self.taps(x, columns, self.kernel[1])
    }

    fn seen(&self, outputs: &Range<usize>, kernel: usize, extent: usize) -> Range<usize> {
        if outputs.is_empty() {
            return 0..0;
        }
        let first = (outputs.start * self.stride).saturating_sub(self.pad).min(extent);
        let end = ((outputs.end - 1) * self.stride + kernel).saturating_sub(self.pad).min(extent);
        first..end.max(first)
    }

    fn taps(&self, input: usize, outputs: &Range<usize>, kernel: usize) -> Option<Taps> {
        let padded = input + self.pad;
        // The largest tap that fits belongs to the first output.
        let first = (padded + 1).saturating_sub(kernel).div_ceil(self.stride).max(outputs.start);
        let end = (padded / self.stride + 1).min(outputs.end);
        let len = end.checked_sub(first).filter(|len| *len > 0)?;
        Some(Taps { first, len, first_tap: padded - first * self.stride })
    }
}

#[cfg(test)]
#[path = "conv2d_tests.rs"]
mod tests;
