//! Rate code: each dimension of an observation is a probability to spike.

/// SAN's code. A dimension whose range reaches below 0 has two lines, its positive and its negative
/// part; each is a probability.
#[derive(Debug, Clone)]
pub struct RateCode {
    /// Whether a dimension has a sign.
    signed: Vec<bool>,
}

impl RateCode {
    /// `ranges` has lowest and highest value of each dimension.
    pub fn new(ranges: &[(f32, f32)]) -> Self {
        Self { signed: ranges.iter().map(|(low, _)| *low < 0.0).collect() }
    }

    /// Number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.signed.len()
    }

    /// Number of lines.
    pub fn outputs(&self) -> usize {
        self.signed.iter().map(|signed| 1 + usize::from(*signed)).sum()
    }

    /// Probabilities to spike per step.
    ///
    /// Shapes: `observations` [rows, dimensions]; result [rows, outputs].
    pub fn activity(&self, observations: &[f32]) -> Vec<f32> {
        let mut activity = Vec::with_capacity(observations.len() + observations.len() / 8);
        for row in observations.chunks_exact(self.dimensions()) {
            for (value, signed) in row.iter().zip(&self.signed) {
                activity.push(value.max(0.0));
                if *signed {
                    activity.push((-value).max(0.0));
                }
            }
        }
        activity
    }

    /// The gradient of the observations from that of the lines, a draw as the identity (straight
    /// through).
    ///
    /// Shapes: `d_activity` [rows, outputs]; result [rows, dimensions].
    pub fn backward(&self, observations: &[f32], d_activity: &[f32]) -> Vec<f32> {
        let mut lines = d_activity.iter();
        let mut next = || lines.next().copied().unwrap_or_default();
        let dimensions = observations.iter().zip(self.signed.iter().cycle());
        let d_observation = |(value, signed): (&f32, &bool)| {
            let (positive, negative) = (next(), if *signed { next() } else { 0.0 });
            match value {
                _ if *value > 0.0 => positive,
                _ if *value < 0.0 => -negative,
                _ => 0.0,
            }
        };
        dimensions.map(d_observation).collect()
    }
}

#[cfg(test)]
#[path = "rate_tests.rs"]
mod tests;
