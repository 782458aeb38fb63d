//! The rate code of SAN: a state of 24 numbers, each a probability to spike per step.
//!
//! Source: combra-lab/spiking-ddpg-mapless-navigation, `utility.py` and `environment.py`; Tang et
//! al., IROS 2020. Direction and turning speed are split by sign, so that every number is
//! non-negative.

use serde::{Deserialize, Serialize};

use crate::policy::{LASER_SECTORS, Observation};

/// Inputs of the rate code.
pub const RATE_INPUTS: usize = 6 + LASER_SECTORS;

/// Scales of the rate code.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RateEncoder {
    /// The goal term is `min(1, this / distance)`.
    pub goal_distance_scale_m: f64,
    /// Linear speed that gives probability 1.
    pub linear_scale_m_per_s: f64,
    /// Turning speed that gives probability 1.
    pub angular_scale_rad_per_s: f64,
    /// A laser term is `clip(this / range, 0, 1)`.
    pub laser_scale_m: f64,
}

impl RateEncoder {
    /// Spike probabilities: direction +/-, goal term, linear speed, turning speed +/-, 18 laser
    /// terms from left to right.
    ///
    /// A linear speed above its scale gives a probability above 1, which always spikes: SAN's GPU
    /// path does not clip it either.
    pub fn probabilities(&self, o: &Observation) -> [f64; RATE_INPUTS] {
        let direction = o.goal_direction_rad / std::f64::consts::PI;
        let turning = o.angular_rad_per_s / self.angular_scale_rad_per_s;
        let mut p = [0.0; RATE_INPUTS];
        p[0] = direction.max(0.0);
        p[1] = (-direction).max(0.0);
        p[2] = ratio(self.goal_distance_scale_m, o.goal_distance_m);
        p[3] = o.linear_m_per_s / self.linear_scale_m_per_s;
        p[4] = turning.max(0.0);
        p[5] = (-turning).max(0.0);
        for (p, range) in p[6..].iter_mut().zip(o.laser_m) {
            *p = ratio(self.laser_scale_m, range);
        }
        p
    }

    /// Fields with their names, for checks.
    pub(crate) fn scales(&self) -> [(&'static str, f64); 4] {
        [
            ("goal_distance_scale_m", self.goal_distance_scale_m),
            ("linear_scale_m_per_s", self.linear_scale_m_per_s),
            ("angular_scale_rad_per_s", self.angular_scale_rad_per_s),
            ("laser_scale_m", self.laser_scale_m),
        ]
    }
}

/// `scale / value` within 0..=1; a value of 0 counts as 0.001, as in SAN's evaluation.
fn ratio(scale: f64, value: f64) -> f64 {
    (scale / if value == 0.0 { 0.001 } else { value }).clamp(0.0, 1.0)
}
