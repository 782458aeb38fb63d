//! Fully connected layer.

use crate::nn::gemm::{Matrix, multiply};
use crate::nn::parameters::{Layout, Slot};

/// `y = W x + b` on rows.
///
/// Tensors: `NAME.weight` [outputs, inputs], `NAME.bias` `[outputs]`.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Features of a row of the input.
    pub inputs: usize,
    /// Features of a row of the output.
    pub outputs: usize,
    weight: Slot,
    bias: Slot,
}

impl Linear {
    /// Adds the layer's tensors to `layout`.
    pub fn new(layout: &mut Layout, name: &str, inputs: usize, outputs: usize) -> Self {
        let weight = layout.add(&format!("{name}.weight"), &[outputs, inputs]);
        let bias = layout.add(&format!("{name}.bias"), &[outputs]);
        Self { inputs, outputs, weight, bias }
    }

    /// Shapes: `input` [rows, inputs]; result [rows, outputs].
    pub fn forward(&self, values: &[f32], input: &[f32]) -> Vec<f32> {
        let rows = input.len() / self.inputs;
        let mut output = self.bias.of(values).repeat(rows);
        let weight = Matrix::new(self.weight.of(values), self.outputs, self.inputs);
        let input = Matrix::new(input, rows, self.inputs);
        multiply(input, weight.transposed(), &mut output, true);
        output
    }

    /// Adds the gradients of weight and bias to `gradient`.
    ///
    /// Shapes: `input` [rows, inputs], `d_output` [rows, outputs].
    pub fn backward(&self, gradient: &mut [f32], input: &[f32], d_output: &[f32]) {
        let rows = input.len() / self.inputs;
        let d_rows = Matrix::new(d_output, rows, self.outputs);
        let input = Matrix::new(input, rows, self.inputs);
        multiply(d_rows.transposed(), input, self.weight.of_mut(gradient), true);
        let d_bias = self.bias.of_mut(gradient);
        for row in d_output.chunks_exact(self.outputs) {
            d_bias.iter_mut().zip(row).for_each(|(sum, d)| *sum += d);
        }
    }

    /// Gradient of the input, [rows, inputs].
    pub fn backward_input(&self, values: &[f32], d_output: &[f32]) -> Vec<f32> {
        let rows = d_output.len() / self.outputs;
        let mut d_input = vec![0.0; rows * self.inputs];
        let weight = Matrix::new(self.weight.of(values), self.outputs, self.inputs);
        multiply(Matrix::new(d_output, rows, self.outputs), weight, &mut d_input, false);
        d_input
    }
}

#[cfg(test)]
#[path = "linear_tests.rs"]
mod tests;
