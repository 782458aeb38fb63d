//! Activations without parameters.

/// `max(x, 0)` in place.
pub fn relu(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = value.max(0.0));
}

/// Turns the gradient of a ReLU's output into that of its input; `output` is what it gave.
pub fn relu_backward(output: &[f32], d_output: &mut [f32]) {
    for (d, value) in d_output.iter_mut().zip(output) {
        *d = if *value > 0.0 { *d } else { 0.0 };
    }
}

/// `1 / (1 + exp(-x))` in place.
pub fn sigmoid(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = 1.0 / (1.0 + (-*value).exp()));
}

/// Turns the gradient of a sigmoid's output into that of its input; `output` is what it gave.
pub fn sigmoid_backward(output: &[f32], d_output: &mut [f32]) {
    d_output.iter_mut().zip(output).for_each(|(d, value)| *d *= value * (1.0 - value));
}

#[cfg(test)]
#[path = "activation_tests.rs"]
mod tests;
