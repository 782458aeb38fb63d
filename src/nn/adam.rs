//! Adam.

/// Settings of Adam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamSettings {
    /// Step length.
    pub learning_rate: f32,
    /// Part of the mean gradient that is kept per step.
    pub keep_first: f32,
    /// Part of the mean squared gradient that is kept per step.
    pub keep_second: f32,
    /// Added to the root of the mean squared gradient.
    pub epsilon: f32,
}

impl AdamSettings {
    /// The usual decays with this step length.
    pub fn with_rate(learning_rate: f32) -> Self {
        Self { learning_rate, keep_first: 0.9, keep_second: 0.999, epsilon: 1e-8 }
    }
}

/// Moments of all parameters of a network, and the number of steps taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    /// Running mean of the gradient.
    pub first: Vec<f32>,
    /// Running mean of the squared gradient.
    pub second: Vec<f32>,
    /// Steps taken.
    pub steps: u64,
}

impl Adam {
    /// Before the first step.
    pub fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters], steps: 0 }
    }

    /// One step down the gradient.
    pub fn step(&mut self, settings: &AdamSettings, values: &mut [f32], gradient: &[f32]) {
        assert_eq!(values.len(), gradient.len(), "elements of parameters and gradient");
        assert_eq!(values.len(), self.first.len(), "elements of parameters and moments");
        self.steps += 1;
        let AdamSettings { learning_rate, keep_first, keep_second, epsilon } = *settings;
        let rate = learning_rate / self.bias_correction(keep_first);
        let root = self.bias_correction(keep_second).sqrt();
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((value, d), (first, second)) in values.iter_mut().zip(gradient).zip(moments) {
            *first = keep_first * *first + (1.0 - keep_first) * d;
            *second = keep_second * *second + (1.0 - keep_second) * d * d;
            *value -= rate * *first / (second.sqrt() / root + epsilon);
        }
    }

    /// `1 - keep^steps`.
    fn bias_correction(&self, keep: f32) -> f32 {
        (1.0 - libm::pow(f64::from(keep), self.steps as f64)) as f32
    }
}

#[cfg(test)]
#[path = "adam_tests.rs"]
mod tests;
