//! A fully connected layer of LIF neurons with thresholds of either kind.

use crate::nn::actor::ActorShape;
use crate::nn::bdett::{Bdett, BdettState};
use crate::nn::lif::{LifShape, LifState, LifTrace};
use crate::nn::linear::Linear;
use crate::nn::parameters::{Layout, Slot};
use crate::nn::spike::Spike;
use crate::nn::threshold;
use crate::nn::variant::Thresholds;

/// Weights, decays, and what thresholds come from.
#[derive(Debug, Clone)]
pub(super) struct SpikingLayer {
    pub(super) linear: Linear,
    threshold: Threshold,
    lif: LifShape,
}

#[derive(Debug, Clone, Copy)]
enum Threshold {
    /// The `r` of `tanh(r)`.
    Learned(Slot),
    /// The threshold itself.
    Fixed(Slot),
    /// The network's rule.
    Dynamic(Slot),
}

impl SpikingLayer {
    /// `rule` is where the numbers of [`Bdett`] are, when thresholds are dynamic.
    pub(super) fn new(
        layout: &mut Layout,
        name: &str,
        (inputs, neurons): (usize, usize),
        shape: &ActorShape,
        rule: Option<Slot>,
    ) -> Self {
        let linear = Linear::new(layout, name, inputs, neurons);
        let threshold = match (rule, shape.form.thresholds) {
            (Some(rule), _) => Threshold::Dynamic(rule),
            (None, Thresholds::Fixed) => {
                Threshold::Fixed(layout.add(&format!("{name}.threshold"), &[1]))
            }
            (None, _) => Threshold::Learned(layout.add(&format!("{name}.r"), &[1])),
        };
        Self { linear, threshold, lif: shape.lif }
    }

    pub(super) fn set_threshold(&self, values: &mut [f32], height: f32) {
        match self.threshold {
            Threshold::Learned(r) => r.of_mut(values).fill(threshold::r_of(height)),
            Threshold::Fixed(fixed) => fixed.of_mut(values).fill(height),
            Threshold::Dynamic(_) => (),
        }
    }

    pub(super) fn project(&self, values: &mut [f32]) {
        if let Threshold::Learned(r) = self.threshold {
            r.of_mut(values).iter_mut().for_each(threshold::project);
        }
    }

    /// All steps, from rest unless there is a `state` to carry on. Shapes: `input` [steps, rows,
    /// inputs].
    pub(super) fn forward<S: Spike>(
        &self,
        values: &[f32],
        input: &[f32],
        steps: usize,
        state: Option<&mut BdettState>,
    ) -> LifTrace<S> {
        let drive = self.linear.forward(values, input);
        let neurons = drive.len() / steps;
        let height = match self.threshold {
            Threshold::Learned(r) => threshold::threshold(r.of(values)[0]),
            Threshold::Fixed(fixed) => fixed.of(values)[0],
            Threshold::Dynamic(rule) => {
                let rule = Bdett::from_slice(rule.of(values));
                let mut fresh = BdettState::fresh(&rule, neurons);
                let state = state.unwrap_or(&mut fresh);
                return rule.forward(&self.lif, self.linear.outputs, &drive, state);
            }
        };
        self.lif.forward(height, &drive, &mut LifState::rest(neurons))
    }

    /// Adds the gradients of weight, bias and `r`; gives that of the drive.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        input: &[f32],
        trace: &LifTrace<S>,
        d_spikes: &[f32],
    ) -> Vec<f32> {
        let d = self.lif.backward(trace, Some(d_spikes), None);
        self.linear.backward(gradient, input, &d.drive);
        if let Threshold::Learned(slot) = self.threshold {
            let r = slot.of(values)[0];
            slot.of_mut(gradient)[0] += threshold::r_gradient(r, d.threshold);
        }
        d.drive
    }
}
