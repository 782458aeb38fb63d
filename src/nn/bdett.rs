//! Dynamic thresholds with statistics of the layer (BDETT): one for each neuron and step.
//!
//! Source: Zyunduo/dynamic-threshold at e10d578, `OA/network/sddpg_networks.py`, the code of Ding et
//! al., NeurIPS 2022. In each step, for the neurons `i` of a layer,
//!
//! ```text
//! v_i      as in Algorithm 1
//! T_i      = exp((v_i of the step before - v_i) / 3) - 1
//! theta_i  = 0.5 E_i of the step before + 0.5 T_i
//! s_i      = [v_i > theta_i]
//! V, H     = mean - 0.2 (max - min), of all v and of all theta of the layer
//! E_i      = 0.01 (v_i - V) + H + ln(1 + exp((v_i - V) / 4))
//! ```
//! with `theta = E = 0.5` at first. Currents, voltages, spikes and `E` are carried from one decision
//! to the next. Departures: the published code never resets its thresholds, not even between
//! trials, here a trial begins with fresh ones; no gradient goes through the thresholds, there part
//! of it does; the arguments of both exponentials are kept within 60 of 0, so that nothing becomes
//! infinite.

use crate::elementary::{exp, softplus, sum_and_bounds};
use crate::nn::lif::{Firing, LifShape, LifState, LifTrace};
use crate::nn::spike::Spike;

/// Exponents are kept within this of 0.
const EXPONENT_MAX: f32 = 60.0;

/// Numbers of the rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bdett {
    /// `theta` and `E` at the start: 0.5.
    pub initial: f32,
    /// Voltage over which `T` changes: 3.
    pub temporal_scale: f32,
    /// Share of `E` in the threshold, the rest is `T`'s: 0.5.
    pub energy_share: f32,
    /// Part of the layer's range that is taken off its mean: 0.2.
    pub spread: f32,
    /// Slope of `E` in the voltage: 0.01.
    pub energy_slope: f32,
    /// Voltage over which `E` bends: 4.
    pub energy_scale: f32,
}

/// What a layer carries on: its neurons, those of all samples, and their `E`.
#[derive(Debug, Clone, PartialEq)]
pub struct BdettState {
    /// Currents, voltages, spikes.
    pub lif: LifState,
    /// `E`.
    pub energy: Vec<f32>,
}

impl BdettState {
    /// At the start of a trial; `neurons` counts those of all samples.
    pub fn fresh(rule: &Bdett, neurons: usize) -> Self {
        Self { lif: LifState::rest(neurons), energy: vec![rule.initial; neurons] }
    }

    /// Puts sample `row` of a layer of `width` neurons back to the start.
    pub fn restart(&mut self, rule: &Bdett, row: usize, width: usize) {
        let neurons = row * width..(row + 1) * width;
        let lif = &mut self.lif;
        [&mut lif.current, &mut lif.voltage, &mut lif.spikes]
            .into_iter()
            .for_each(|all| all[neurons.clone()].fill(0.0));
        self.energy[neurons].fill(rule.initial);
    }
}

impl Bdett {
    /// How many numbers it has.
    pub const LEN: usize = 6;

    /// Those of the published code.
    pub const PUBLISHED: Self = Self {
        initial: 0.5,
        temporal_scale: 3.0,
        energy_share: 0.5,
        spread: 0.2,
        energy_slope: 0.01,
        energy_scale: 4.0,
    };

    /// In the order of the fields, as a tensor has them.
    pub fn to_array(self) -> [f32; Self::LEN] {
        let Self { initial, temporal_scale, energy_share, spread, energy_slope, energy_scale } =
            self;
        [initial, temporal_scale, energy_share, spread, energy_slope, energy_scale]
    }

    /// From a tensor's elements. Panics when there are others than [`Bdett::LEN`].
    pub fn from_slice(values: &[f32]) -> Self {
        let Ok([initial, temporal_scale, energy_share, spread, energy_slope, energy_scale]) =
            <[f32; Self::LEN]>::try_from(values)
        else {
            panic!("{} numbers of a rule of {}", values.len(), Self::LEN)
        };
        Self { initial, temporal_scale, energy_share, spread, energy_slope, energy_scale }
    }

    /// Runs all steps of a layer of `width` neurons, samples apart.
    ///
    /// Shapes: `drive` [steps, samples, width], neurons as in `state`, which is carried on.
    pub fn forward<S: Spike>(
        &self,
        lif: &LifShape,
        width: usize,
        drive: &[f32],
        state: &mut BdettState,
    ) -> LifTrace<S> {
        let neurons = state.energy.len();
        let (mut voltage, mut spikes) = (vec![0.0; drive.len()], vec![0.0; drive.len()]);
        let mut thresholds = vec![0.0; drive.len()];
        for (step, drive) in drive.chunks_exact(neurons).enumerate() {
            let at = step * neurons..(step + 1) * neurons;
            let (v, s) = (&mut voltage[at.clone()], &mut spikes[at.clone()]);
            let theta = &mut thresholds[at];
            lif.charge(drive, &mut state.lif, v);
            self.thresholds(v, &state.lif.voltage, &state.energy, theta);
            s.iter_mut().zip(&*v).zip(&*theta).for_each(|((s, v), theta)| *s = S::fire(v - theta));
            let layers = v.chunks_exact(width).zip(theta.chunks_exact(width));
            for ((v, theta), energy) in layers.zip(state.energy.chunks_exact_mut(width)) {
                self.energies(v, theta, energy);
            }
            state.lif.voltage.copy_from_slice(v);
            state.lif.spikes.copy_from_slice(s);
        }
        LifTrace::new(voltage, spikes, neurons, Firing::Each(thresholds))
    }

    fn thresholds(&self, voltage: &[f32], before: &[f32], energy: &[f32], theta: &mut [f32]) {
        let neurons = theta.iter_mut().zip(voltage).zip(before).zip(energy);
        for (((theta, voltage), before), energy) in neurons {
            let temporal = exp(bounded((before - voltage) / self.temporal_scale)) - 1.0;
            *theta = self.energy_share * energy + (1.0 - self.energy_share) * temporal;
        }
    }

    /// `E` of one layer of one sample.
    fn energies(&self, voltage: &[f32], theta: &[f32], energy: &mut [f32]) {
        let (v_low, theta_low) = (self.below_mean(voltage), self.below_mean(theta));
        for (energy, voltage) in energy.iter_mut().zip(voltage) {
            let above = voltage - v_low;
            let bend = softplus(bounded(above / self.energy_scale));
            *energy = self.energy_slope * above + theta_low + bend;
        }
    }

    /// Mean less a part of the range.
    fn below_mean(&self, values: &[f32]) -> f32 {
        let (sum, least, most) = sum_and_bounds(values);
        sum / values.len() as f32 - self.spread * (most - least)
    }
}

fn bounded(exponent: f32) -> f32 {
    exponent.clamp(-EXPONENT_MAX, EXPONENT_MAX)
}

#[cfg(test)]
#[path = "bdett_tests.rs"]
mod tests;
