//! BDETT's thresholds of one layer, step by step.
//!
//! Source as in [`crate::net::bdett`]: Zyunduo/dynamic-threshold at e10d578. A trial begins with
//! fresh thresholds, which the published code never resets; exponents stay within 60 of 0.

use crate::cost::Ops;
use crate::elementary::{exp, softplus, sum_and_bounds};
use crate::net::Bdett;

/// Exponents are kept within this of 0.
const EXPONENT_MAX: f32 = 60.0;

/// The rule and what a layer carries on.
#[derive(Debug, Clone)]
pub(super) struct MovingThresholds {
    rule: Bdett,
    /// `E` of each neuron.
    energy: Vec<f32>,
    thresholds: Vec<f32>,
}

impl MovingThresholds {
    /// At the start of a trial.
    pub(super) fn new(rule: Bdett, neurons: usize) -> Self {
        Self { rule, energy: vec![rule.initial; neurons], thresholds: vec![rule.initial; neurons] }
    }

    /// A new trial.
    pub(super) fn restart(&mut self) {
        *self = Self::new(self.rule, self.energy.len());
    }

    /// Which neurons fire in a step that took their voltages from `before` to `now`; then `E`.
    ///
    /// Gives the sums and products that it took, quotients being products; comparisons,
    /// exponentials and logarithms are neither (one of the latter two for each half of the rule).
    pub(super) fn fire(&mut self, before: &[f32], now: &[f32], spikes: &mut [bool]) -> Ops {
        let rule = self.rule;
        let mut ops = Ops::default();
        for n in 0..now.len() {
            let temporal = exp(bounded((before[n] - now[n]) / rule.temporal_scale)) - 1.0;
            self.thresholds[n] =
                rule.energy_share * self.energy[n] + (1.0 - rule.energy_share) * temporal;
            spikes[n] = now[n] > self.thresholds[n];
            ops += Ops { additions: 3, multiplications: 3 };
        }
        let voltage = below_mean(now, &rule, &mut ops);
        let threshold = below_mean(&self.thresholds, &rule, &mut ops);
        for (energy, now) in self.energy.iter_mut().zip(now) {
            let above = now - voltage;
            let bend = softplus(bounded(above / rule.energy_scale));
            *energy = rule.energy_slope * above + threshold + bend;
            ops += Ops { additions: 3, multiplications: 2 };
        }
        ops
    }
}

/// Mean of a layer less a part of its range.
fn below_mean(values: &[f32], rule: &Bdett, ops: &mut Ops) -> f32 {
    let (sum, least, most) = sum_and_bounds(values);
    *ops += Ops { additions: values.len() as u64 + 2, multiplications: 2 };
    sum / values.len() as f32 - rule.spread * (most - least)
}

fn bounded(exponent: f32) -> f32 {
    exponent.clamp(-EXPONENT_MAX, EXPONENT_MAX)
}
