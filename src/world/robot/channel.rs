//! One actuated quantity: a dead time, then a first-order lag.

use std::collections::VecDeque;

use super::Lag;
use crate::world::PHYSICS_STEP_S;

/// State of one channel, at rest at first.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    /// Commands on their way, oldest first; always as long as the delay.
    pending: VecDeque<f64>,
    value: f64,
    /// Share of the gap to the command left after one step, and on average during it.
    gap_end: f64,
    gap_mean: f64,
}

impl Channel {
    pub(super) fn new(lag: Lag) -> Self {
        let (gap_end, gap_mean) = gap_shares(lag.time_constant_s());
        let pending = std::iter::repeat_n(0.0, lag.delay_steps() as usize).collect();
        Self { pending, value: 0.0, gap_end, gap_mean }
    }

    /// One physics step; returns the mean value during it.
    pub(super) fn step(&mut self, command: f64) -> f64 {
        self.pending.push_back(command);
        let target = self.pending.pop_front().unwrap_or(command);
        let gap = self.value - target;
        self.value = target + gap * self.gap_end;
        target + gap * self.gap_mean
    }

    pub(super) fn value(&self) -> f64 {
        self.value
    }
}

/// `exp(-t / tau)` at the end of a step and its mean over the step; no gap without a lag.
fn gap_shares(time_constant_s: f64) -> (f64, f64) {
    if time_constant_s == 0.0 {
        return (0.0, 0.0);
    }
    let steps = PHYSICS_STEP_S / time_constant_s;
    (libm::exp(-steps), -libm::expm1(-steps) / steps)
}
