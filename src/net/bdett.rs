//! The rule of BDETT's thresholds, as numbers in a weights file.
//!
//! Source: Zyunduo/dynamic-threshold at e10d578, the code of Ding et al., NeurIPS 2022.

use serde::Serialize;

/// Thresholds that move with the voltages of their neuron and of its layer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bdett {
    /// Threshold and energy part at the start of a trial: 0.5 in the published code.
    pub initial: f32,
    /// Voltage over which the temporal part changes: 3.
    pub temporal_scale: f32,
    /// Share of the energy part in the threshold, the rest is the temporal part's: 0.5.
    pub energy_share: f32,
    /// Part of the layer's range that is taken off its mean: 0.2.
    pub spread: f32,
    /// Slope of the energy part in the voltage: 0.01.
    pub energy_slope: f32,
    /// Voltage over which the energy part bends: 4.
    pub energy_scale: f32,
}

impl Bdett {
    /// Numbers of a rule.
    pub(super) const LEN: usize = 6;

    /// The numbers in the order of the fields.
    pub(super) fn from_array(numbers: &[f32]) -> Self {
        let number = |index: usize| numbers[index];
        Self {
            initial: number(0),
            temporal_scale: number(1),
            energy_share: number(2),
            spread: number(3),
            energy_slope: number(4),
            energy_scale: number(5),
        }
    }
}
