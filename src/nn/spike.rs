//! When a neuron fires, and what the backward pass takes for the derivative of that.

/// How a spike comes about and is differentiated. Training uses [`Rectangular`]; [`Smooth`] puts a
/// differentiable function in every place where spikes arise, so that finite differences can check
/// the same backward code.
pub trait Spike: Copy + Send + Sync {
    /// Output of a neuron whose voltage is `distance` above its threshold.
    fn fire(distance: f32) -> f32;
    /// Derivative of [`Spike::fire`], or what stands for it.
    fn slope(distance: f32) -> f32;
    /// A spike with probability `probability`, given a uniform number in `[0, 1)`.
    fn draw(probability: f32, uniform: f32) -> f32;
}

/// Step function; its derivative is taken as a rectangular window (eq. 8, eq:stbp).
#[derive(Debug, Clone, Copy)]
pub struct Rectangular;

impl Spike for Rectangular {
    fn fire(distance: f32) -> f32 {
        f32::from(distance > 0.0)
    }

    fn slope(distance: f32) -> f32 {
        f32::from(distance.abs() < 0.5)
    }

    fn draw(probability: f32, uniform: f32) -> f32 {
        f32::from(uniform < probability)
    }
}

/// A logistic function of slope 1 at the threshold, its true derivative, and expectations in
/// place of draws.
#[derive(Debug, Clone, Copy)]
pub struct Smooth;

impl Spike for Smooth {
    fn fire(distance: f32) -> f32 {
        1.0 / (1.0 + (-4.0 * distance).exp())
    }

    fn slope(distance: f32) -> f32 {
        let fired = Self::fire(distance);
        4.0 * fired * (1.0 - fired)
    }

    fn draw(probability: f32, _uniform: f32) -> f32 {
        probability
    }
}
