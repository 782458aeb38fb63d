//! Spiking neurons that count.

use crate::cost::{Activity, Counts};
use crate::net::Bdett;
use crate::reference::bdett::MovingThresholds;

/// State of a layer.
#[derive(Debug, Clone)]
pub(super) struct Neurons {
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
    /// In place of the threshold.
    moving: Option<MovingThresholds>,
    current: Vec<f32>,
    pub(super) voltage: Vec<f32>,
    pub(super) spikes: Vec<bool>,
}

impl Neurons {
    pub(super) fn new(n: usize, keep: (f64, f64), threshold: f64) -> Self {
        Self {
            keep_current: keep.0 as f32,
            keep_voltage: keep.1 as f32,
            threshold: threshold as f32,
            moving: None,
            current: vec![0.0; n],
            voltage: vec![0.0; n],
            spikes: vec![false; n],
        }
    }

    /// The same with thresholds that move.
    pub(super) fn moving(self, rule: Bdett) -> Self {
        Self { moving: Some(MovingThresholds::new(rule, self.voltage.len())), ..self }
    }

    pub(super) fn reset(&mut self) {
        self.current.fill(0.0);
        self.voltage.fill(0.0);
        self.spikes.fill(false);
        self.moving.iter_mut().for_each(MovingThresholds::restart);
    }

    /// `c = d_c c + x`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]`. The reset selects 0;
    /// `first` is the first step of a control tick.
    pub(super) fn step(
        &mut self,
        drive: &[f32],
        first: bool,
        layer: usize,
        counts: &mut Counts,
        activity: &mut Activity,
    ) {
        let all_before = self.moving.as_ref().map(|_| self.voltage.clone());
        for (n, drive) in drive.iter().enumerate() {
            let before = self.voltage[n];
            self.current[n] = self.keep_current * self.current[n] + drive;
            let kept = self.keep_voltage * before;
            self.voltage[n] = if self.spikes[n] { 0.0 } else { kept } + self.current[n];
            self.spikes[n] = self.voltage[n] > self.threshold;
            counts.exact.multiplications += 2;
            counts.exact.additions += 2;
            counts.chip.multiplications += 2;
            // Current, voltage, and the bias that the float network has in `drive`.
            counts.chip.additions += 3;
            let changed = self.voltage[n] != before;
            counts.neurobench.membrane_updates += u64::from(first || changed);
            counts.neurobench.membrane_updates_dense += 1;
            activity.membranes_changed += u64::from(!first && changed);
        }
        if let (Some(moving), Some(before)) = (&mut self.moving, all_before) {
            let ops = moving.fire(&before, &self.voltage, &mut self.spikes);
            counts.exact += ops;
            counts.chip += ops;
        }
        activity.fired[layer] += self.spikes.iter().filter(|spike| **spike).count() as u64;
    }

    /// Numbers of the neurons that spiked.
    pub(super) fn spiked(&self) -> Vec<usize> {
        self.spikes.iter().enumerate().filter(|(_, spike)| **spike).map(|(n, _)| n).collect()
    }
}
