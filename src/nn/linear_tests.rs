use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};

#[test]
fn rows_are_weight_times_input_plus_bias() {
    let mut layout = Layout::default();
    let layer = Linear::new(&mut layout, "fc", 2, 3);
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.5, 0.25, 0.125];
    let output = layer.forward(&values, &[1.0, 0.0, 1.0, -1.0]);
    assert_eq!(output, [1.5, 3.25, 5.125, -0.5, -0.75, -0.875]);
}

#[test]
fn gradients_equal_finite_differences() {
    let mut layout = Layout::default();
    let layer = Linear::new(&mut layout, "fc", 7, 9);
    let (values, input) = (gaussians(1, layout.length()), gaussians(2, 8 * 7));
    let weights = gaussians(3, 8 * 9);
    let mut gradient = layout.zeros();
    layer.backward(&mut gradient, &input, &weights);
    check("parameters", &values, &gradient, |v| weighted(&layer.forward(v, &input), &weights));
    let d_input = layer.backward_input(&values, &weights);
    check("input", &input, &d_input, |x| weighted(&layer.forward(&values, x), &weights));
}
