//! Spiking neurons that count.

use crate::cost::{Activity, Counts};

/// State of a layer.
#[derive(Debug, Clone)]
pub(super) struct Neurons {
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
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
            current: vec![0.0; n],
            voltage: vec![0.0; n],
            spikes: vec![false; n],
        }
    }

    pub(super) fn reset(&mut self) {
        self.current.fill(0.0);
        self.voltage.fill(0.0);
        self.spikes.fill(false);
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
            activity.fired[layer] += u64::from(self.spikes[n]);
        }
    }

    /// Numbers of the neurons that spiked.
    pub(super) fn spiked(&self) -> Vec<usize> {
        self.spikes.iter().enumerate().filter(|(_, spike)| **spike).map(|(n, _)| n).collect()
    }
}
