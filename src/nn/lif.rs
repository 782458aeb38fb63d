//! Leaky integrate-and-fire neurons over several steps (Algorithm 1), and back through time.

use std::marker::PhantomData;

use crate::nn::spike::Spike;

/// Decays and gradient path of a layer of LIF neurons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LifShape {
    /// `d_c`: part of the current that is kept per step.
    pub keep_current: f32,
    /// `d_v`: part of the voltage that is kept per step.
    pub keep_voltage: f32,
    /// Whether gradients flow through the reset `(1 - s_prev)`, as they do in SAN.
    pub gradient_through_reset: bool,
}

impl Default for LifShape {
    /// 0.5, 0.75 (Sec. 4.1), gradients through the reset.
    fn default() -> Self {
        Self { keep_current: 0.5, keep_voltage: 0.75, gradient_through_reset: true }
    }
}

/// State of a layer between two steps: `c`, `v`, `s` of every neuron of every sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LifState {
    /// Currents `c`.
    pub current: Vec<f32>,
    /// Voltages `v`.
    pub voltage: Vec<f32>,
    /// Spikes `s` of the last step.
    pub spikes: Vec<f32>,
}

impl LifState {
    /// At rest; `neurons` counts those of all samples.
    pub fn rest(neurons: usize) -> Self {
        Self {
            current: vec![0.0; neurons],
            voltage: vec![0.0; neurons],
            spikes: vec![0.0; neurons],
        }
    }
}

/// What a forward pass leaves for the backward pass.
///
/// Shapes: [steps, neurons of all samples].
#[derive(Debug, Clone)]
pub struct LifTrace<S> {
    /// Voltages before the reset.
    pub voltage: Vec<f32>,
    /// Spikes.
    pub spikes: Vec<f32>,
    neurons: usize,
    thresholds: Firing,
    mode: PhantomData<S>,
}

/// What voltages were compared with.
#[derive(Debug, Clone)]
pub enum Firing {
    /// One threshold.
    One(f32),
    /// One for each neuron in each step, [steps, neurons of all samples].
    Each(Vec<f32>),
}

impl<S> LifTrace<S> {
    /// What a layer of `neurons` did.
    pub(super) fn new(
        voltage: Vec<f32>,
        spikes: Vec<f32>,
        neurons: usize,
        thresholds: Firing,
    ) -> Self {
        Self { voltage, spikes, neurons, thresholds, mode: PhantomData }
    }

    /// What voltages were compared with.
    pub fn thresholds(&self) -> &Firing {
        &self.thresholds
    }

    /// Neurons of all samples.
    pub fn neurons(&self) -> usize {
        self.neurons
    }
}

/// Gradients of one layer.
#[derive(Debug, Clone)]
pub struct LifGradient {
    /// Of the drive `W s + b`, [steps, neurons].
    pub drive: Vec<f32>,
    /// Of the threshold (eq. 9, eq:partial).
    pub threshold: f32,
}

impl LifShape {
    /// Runs all steps: `c = d_c c + x`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]`.
    ///
    /// Shapes: `drive` [steps, neurons], neurons as in `state`, which is carried on.
    pub fn forward<S: Spike>(
        &self,
        threshold: f32,
        drive: &[f32],
        state: &mut LifState,
    ) -> LifTrace<S> {
        let neurons = state.current.len();
        let (mut voltage, mut spikes) = (vec![0.0; drive.len()], vec![0.0; drive.len()]);
        let rows = voltage.chunks_exact_mut(neurons).zip(spikes.chunks_exact_mut(neurons));
        for (input, (voltage, spikes)) in drive.chunks_exact(neurons).zip(rows) {
            self.charge(input, state, voltage);
            spikes.iter_mut().zip(&*voltage).for_each(|(s, v)| *s = S::fire(*v - threshold));
            state.voltage.copy_from_slice(voltage);
            state.spikes.copy_from_slice(spikes);
        }
        LifTrace::new(voltage, spikes, neurons, Firing::One(threshold))
    }

    /// Currents and voltages of one step; voltages and spikes in `state` are still those before.
    pub(super) fn charge(&self, drive: &[f32], state: &mut LifState, voltage: &mut [f32]) {
        let before = state.current.iter_mut().zip(&state.voltage).zip(&state.spikes);
        for ((v, ((c, v_before), s_before)), x) in voltage.iter_mut().zip(before).zip(drive) {
            *c = self.keep_current * *c + x;
            *v = self.keep_voltage * v_before * (1.0 - s_before) + *c;
        }
    }

    /// Back through all steps by STBP (eq. 8).
    ///
    /// `d_spikes` and, where the voltage itself is read, `d_voltage` are gradients of what the
    /// layer gave, [steps, neurons]; the gradient of the initial state is dropped. Thresholds that
    /// are [`Firing::Each`] count as given.
    pub fn backward<S: Spike>(
        &self,
        trace: &LifTrace<S>,
        d_spikes: Option<&[f32]>,
        d_voltage: Option<&[f32]>,
    ) -> LifGradient {
        let neurons = trace.neurons;
        let mut drive = vec![0.0; trace.voltage.len()];
        let (mut later_v, mut later_c) = (vec![0.0; neurons], vec![0.0; neurons]);
        let mut d_threshold = 0.0;
        for step in (0..trace.voltage.len() / neurons).rev() {
            let at = step * neurons..(step + 1) * neurons;
            let out = &mut drive[at.clone()];
            if let Some(d_spikes) = d_spikes {
                out.copy_from_slice(&d_spikes[at.clone()]);
            }
            let (voltage, spikes) = (&trace.voltage[at.clone()], &trace.spikes[at.clone()]);
            match &trace.thresholds {
                Firing::One(threshold) => {
                    let each = std::iter::repeat(*threshold);
                    self.step_back::<S>(each, voltage, spikes, out, &mut later_v);
                }
                Firing::Each(all) => {
                    let each = all[at.clone()].iter().copied();
                    self.step_back::<S>(each, voltage, spikes, out, &mut later_v);
                }
            }
            d_threshold -= sum(out);
            if let Some(d_voltage) = d_voltage {
                later_v.iter_mut().zip(&d_voltage[at]).for_each(|(d, read)| *d += read);
            }
            for ((out, c), v) in out.iter_mut().zip(&mut later_c).zip(&later_v) {
                *c = v + self.keep_current * *c;
                *out = *c;
            }
        }
        LifGradient { drive, threshold: d_threshold as f32 }
    }

    /// Turns `later_v`, the gradient of the next step's voltage, into that of this step's, and
    /// `d_spikes`, the gradient of this step's spikes, into the part of it that flows through the
    /// firing; the sum of that is `-dL/dH` of this step.
    fn step_back<S: Spike>(
        &self,
        thresholds: impl Iterator<Item = f32>,
        voltage: &[f32],
        spikes: &[f32],
        d_spikes: &mut [f32],
        later_v: &mut [f32],
    ) {
        let reset = if self.gradient_through_reset { self.keep_voltage } else { 0.0 };
        let rows = voltage.iter().zip(spikes).zip(d_spikes).zip(later_v).zip(thresholds);
        for ((((v, s), d), later), threshold) in rows {
            let through = (*d - reset * v * *later) * S::slope(v - threshold);
            *later = through + self.keep_voltage * (1.0 - s) * *later;
            *d = through;
        }
    }
}

/// Sum in eight partial sums, in a fixed order.
fn sum(values: &[f32]) -> f64 {
    let mut lanes = [0.0f32; 8];
    for chunk in values.chunks(8) {
        lanes.iter_mut().zip(chunk).for_each(|(lane, value)| *lane += value);
    }
    lanes.iter().map(|lane| f64::from(*lane)).sum()
}

#[cfg(test)]
#[path = "lif_tests.rs"]
mod tests;
