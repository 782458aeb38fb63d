use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};

type Forward = fn(&mut [f32]);
type Backward = fn(&[f32], &mut [f32]);

#[test]
fn gradients_equal_finite_differences() {
    let passes: [(Forward, Backward); 2] = [(relu, relu_backward), (sigmoid, sigmoid_backward)];
    for (forward, backward) in passes {
        let (input, weights) = (gaussians(4, 40), gaussians(5, 40));
        let run = |input: &[f32]| {
            let mut values = input.to_vec();
            forward(&mut values);
            values
        };
        let mut d = weights.clone();
        backward(&run(&input), &mut d);
        check("activation", &input, &d, |x| weighted(&run(x), &weights));
    }
}

#[test]
fn relu_cuts_and_sigmoid_halves_at_zero() {
    let mut values = [-1.0, 0.0, 2.0];
    relu(&mut values);
    assert_eq!(values, [0.0, 0.0, 2.0]);
    let mut values = [0.0, 100.0, -100.0];
    sigmoid(&mut values);
    assert_eq!((values[0], values[1]), (0.5, 1.0));
    assert!(values[2] >= 0.0 && values[2] < 1e-30);
}
