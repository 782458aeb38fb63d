//! A fully connected layer of LIF neurons with one learnable threshold.

use crate::nn::actor::ActorShape;
use crate::nn::lif::{LifShape, LifState, LifTrace};
use crate::nn::linear::Linear;
use crate::nn::parameters::{Layout, Slot};
use crate::nn::spike::Spike;
use crate::nn::threshold;

/// Weights, decays, and the `r` of the threshold `tanh(r)`.
#[derive(Debug, Clone)]
pub(super) struct SpikingLayer {
    pub(super) linear: Linear,
    r: Slot,
    lif: LifShape,
    learn_threshold: bool,
}

impl SpikingLayer {
    pub(super) fn new(
        layout: &mut Layout,
        name: &str,
        (inputs, neurons): (usize, usize),
        shape: &ActorShape,
    ) -> Self {
        let linear = Linear::new(layout, name, inputs, neurons);
        let r = layout.add(&format!("{name}.r"), &[1]);
        Self { linear, r, lif: shape.lif, learn_threshold: shape.learn_thresholds }
    }

    pub(super) fn set_r(&self, values: &mut [f32], r: f32) {
        self.r.of_mut(values).fill(r);
    }

    pub(super) fn project(&self, values: &mut [f32]) {
        self.r.of_mut(values).iter_mut().for_each(threshold::project);
    }

    /// All steps from rest. Shapes: `input` [steps, rows, inputs].
    pub(super) fn forward<S: Spike>(
        &self,
        values: &[f32],
        input: &[f32],
        steps: usize,
    ) -> LifTrace<S> {
        let drive = self.linear.forward(values, input);
        let mut state = LifState::rest(drive.len() / steps);
        self.lif.forward(threshold::threshold(self.r.of(values)[0]), &drive, &mut state)
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
        if self.learn_threshold {
            let r = self.r.of(values)[0];
            self.r.of_mut(gradient)[0] += threshold::r_gradient(r, d.threshold);
        }
        d.drive
    }
}
