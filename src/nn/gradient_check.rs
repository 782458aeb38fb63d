//! Gradients against finite differences, for tests.

use crate::rng::{Streams, stream};

/// Gaussian numbers for tests, the same for the same seed.
pub(crate) fn gaussians(seed: u64, count: usize) -> Vec<f32> {
    let mut draw = Streams::new(seed, 1).at(stream::STIMULUS, 0);
    (0..count).map(|_| draw.gaussian() as f32).collect()
}

/// `sum of weights * outputs`: a loss whose gradient with respect to the outputs is `weights`.
pub(crate) fn weighted(outputs: &[f32], weights: &[f32]) -> f64 {
    assert_eq!(outputs.len(), weights.len(), "outputs and weights of a loss");
    outputs
        .iter()
        .zip(weights)
        .map(|(output, weight)| f64::from(*output) * f64::from(*weight))
        .sum()
}

/// Compares up to 200 elements of `gradient`, spread evenly, with differences of `loss` around
/// `values`. The tolerance is one percent of the largest element.
pub(crate) fn check(what: &str, values: &[f32], gradient: &[f32], loss: impl Fn(&[f32]) -> f64) {
    assert_eq!(values.len(), gradient.len(), "{what}: elements");
    let largest = gradient.iter().fold(0.0f32, |largest, d| largest.max(d.abs()));
    assert!(largest > 1e-3, "{what}: largest gradient is {largest}, nothing to compare");
    let tolerance = 1e-2 * f64::from(largest) + 1e-4;
    for index in (0..values.len()).step_by(values.len().div_ceil(200)) {
        let found = f64::from(gradient[index]);
        // Near a kink of a ReLU one step length may be misled; a wrong gradient misleads both.
        let closest = [1e-2f32, 2e-3]
            .map(|step| (found - difference(values, index, step, &loss)).abs())
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(
            closest < tolerance,
            "{what}[{index}]: gradient {found} is {closest} from the difference; largest {largest}"
        );
    }
}

/// Fourth-order central difference.
fn difference(values: &[f32], index: usize, step: f32, loss: impl Fn(&[f32]) -> f64) -> f64 {
    let central = |step: f32| {
        let mut moved = values.to_vec();
        let (above, below) = (values[index] + step, values[index] - step);
        moved[index] = above;
        let high = loss(&moved);
        moved[index] = below;
        (high - loss(&moved)) / f64::from(above - below)
    };
    (4.0 * central(step) - central(2.0 * step)) / 3.0
}
