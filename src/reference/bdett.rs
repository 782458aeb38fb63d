//! BDETT's thresholds of one layer, step by step.
//!
//! Source as in [`crate::net::bdett`]: Zyunduo/dynamic-threshold at e10d578. A trial begins with
//! fresh thresholds, which the published code never resets; exponents stay within 60 of 0.

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
    pub(super) fn fire(&mut self, before: &[f32], now: &[f32], spikes: &mut [bool]) {
        let rule = self.rule;
        for n in 0..now.len() {
            let temporal = exp(bounded((before[n] - now[n]) / rule.temporal_scale)) - 1.0;
            self.thresholds[n] =
                rule.energy_share * self.energy[n] + (1.0 - rule.energy_share) * temporal;
            spikes[n] = now[n] > self.thresholds[n];
        }
        let (voltage, threshold) = (below_mean(now, &rule), below_mean(&self.thresholds, &rule));
        for (energy, now) in self.energy.iter_mut().zip(now) {
            let above = now - voltage;
            let bend = softplus(bounded(above / rule.energy_scale));
            *energy = rule.energy_slope * above + threshold + bend;
        }
    }
}

/// Mean of a layer less a part of its range.
fn below_mean(values: &[f32], rule: &Bdett) -> f32 {
    let (sum, least, most) = sum_and_bounds(values);
    sum / values.len() as f32 - rule.spread * (most - least)
}

fn bounded(exponent: f32) -> f32 {
    exponent.clamp(-EXPONENT_MAX, EXPONENT_MAX)
}
