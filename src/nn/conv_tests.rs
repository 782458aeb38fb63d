use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};

const WINDOWS: [Window; 4] = [
    HALVING,
    Window { kernel: 3, stride: 1, padding: 1 },
    Window { kernel: 2, stride: 2, padding: 0 },
    Window { kernel: 3, stride: 2, padding: 2 },
];

/// One output element by its definition.
fn by_definition(
    (inputs, side, window): (usize, usize, Window),
    kernel: &[f32],
    image: &[f32],
    (y, x): (usize, usize),
) -> f32 {
    let mut sum = 0.0;
    for channel in 0..inputs {
        for tap in 0..window.kernel * window.kernel {
            let row = (y * window.stride + tap / window.kernel).checked_sub(window.padding);
            let column = (x * window.stride + tap % window.kernel).checked_sub(window.padding);
            if let (Some(row), Some(column)) = (row, column)
                && row < side
                && column < side
            {
                let weight = kernel[channel * window.kernel * window.kernel + tap];
                sum += weight * image[(channel * side + row) * side + column];
            }
        }
    }
    sum
}

#[test]
fn convolution_equals_its_definition() {
    for (seed, window) in WINDOWS.into_iter().enumerate() {
        let mut layout = Layout::default();
        let layer = Conv::new(&mut layout, "conv", (3, 2), 8, window);
        let values = gaussians(seed as u64, layout.length());
        let input = gaussians(90, 2 * layer.input_size());
        let output = layer.forward(&values, &input);
        let positions = window.positions(8);
        for (at, found) in output.iter().enumerate() {
            let (image, rest) = (at / layer.output_size(), at % layer.output_size());
            let (channel, place) = (rest / (positions * positions), rest % (positions * positions));
            let size = 3 * window.kernel * window.kernel;
            let kernel = &values[channel * size..][..size];
            let image = &input[image * layer.input_size()..][..layer.input_size()];
            let place = (place / positions, place % positions);
            let sum = by_definition((3, 8, window), kernel, image, place);
            let expected = sum + values[2 * size + channel];
            assert!((found - expected).abs() < 1e-4, "{window:?} [{at}]: {found}, not {expected}");
        }
    }
}

#[test]
fn transposed_convolution_is_the_adjoint_of_convolution() {
    for window in WINDOWS {
        let positions = 4;
        let side = window.side(positions);
        let (mut a, mut b) = (Layout::default(), Layout::default());
        let down = Conv::new(&mut a, "conv", (3, 2), side, window);
        let up = ConvTranspose::new(&mut b, "conv", (2, 3), positions, window);
        let kernel = gaussians(5, 2 * 3 * window.kernel * window.kernel);
        let values = |biases: usize| [kernel.clone(), vec![0.0; biases]].concat();
        let (large, small) = (gaussians(6, down.input_size()), gaussians(7, down.output_size()));
        let left = weighted(&down.forward(&values(2), &large), &small);
        let right = weighted(&up.forward(&values(3), &small), &large);
        assert!((left - right).abs() < 1e-3, "{window:?}: {left} {right}");
    }
}

#[test]
fn gradients_equal_finite_differences() {
    for window in WINDOWS {
        let mut layout = Layout::default();
        let layer = Conv::new(&mut layout, "conv", (2, 6), 6, window);
        let (values, input) = (gaussians(1, layout.length()), gaussians(2, 2 * layer.input_size()));
        let weights = gaussians(3, 2 * layer.output_size());
        let mut gradient = layout.zeros();
        layer.backward(&mut gradient, &input, &weights);
        check("conv", &values, &gradient, |v| weighted(&layer.forward(v, &input), &weights));
        let d_input = layer.backward_input(&values, &weights);
        check("image", &input, &d_input, |x| weighted(&layer.forward(&values, x), &weights));
    }
}

#[test]
fn gradients_of_the_transpose_equal_finite_differences() {
    for window in WINDOWS {
        let mut layout = Layout::default();
        let layer = ConvTranspose::new(&mut layout, "conv", (2, 3), 4, window);
        let (values, input) = (gaussians(1, layout.length()), gaussians(2, 2 * layer.input_size()));
        let weights = gaussians(3, 2 * layer.output_size());
        let mut gradient = layout.zeros();
        let d_input = layer.backward(&values, &mut gradient, &input, &weights);
        check("conv", &values, &gradient, |v| weighted(&layer.forward(v, &input), &weights));
        check("image", &input, &d_input, |x| weighted(&layer.forward(&values, x), &weights));
    }
}
