//! The deep critic: what an action is worth in a state.

use crate::nn::activation::{relu, relu_backward};
use crate::nn::init;
use crate::nn::linear::Linear;
use crate::nn::parameters::{Layout, Parameters};
use crate::rng::Streams;

/// Sizes of a critic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CriticShape {
    /// Dimensions of an observation.
    pub observations: usize,
    /// Components of an action.
    pub actions: usize,
    /// Neurons of the hidden layers, at least one; the action joins the output of the first.
    pub hidden: Vec<usize>,
}

impl CriticShape {
    /// 512, 512, 512 (hyper-parameter table).
    pub fn eem_san(observations: usize) -> Self {
        Self { observations, actions: 2, hidden: vec![512; 3] }
    }
}

/// Layers of a critic; parameters are apart.
///
/// Tensors: `K.weight`, `K.bias` for layer K from 1. ReLU after every layer but the last.
#[derive(Debug, Clone)]
pub struct Critic {
    shape: CriticShape,
    layout: Layout,
    layers: Vec<Linear>,
}

/// What a forward pass leaves for the backward pass.
#[derive(Debug, Clone)]
pub struct CriticTrace {
    /// Input of every layer, the action joined to that of the second.
    inputs: Vec<Vec<f32>>,
    /// One value per row.
    pub value: Vec<f32>,
}

impl Critic {
    /// Layers for a shape. Panics without a hidden layer.
    pub fn new(shape: &CriticShape) -> Self {
        assert!(!shape.hidden.is_empty(), "a critic needs a hidden layer for the action to join");
        let mut layout = Layout::default();
        let mut layers = Vec::new();
        let mut inputs = shape.observations;
        for (index, neurons) in shape.hidden.iter().chain([&1]).enumerate() {
            let joined = if index == 1 { shape.actions } else { 0 };
            let name = (index + 1).to_string();
            layers.push(Linear::new(&mut layout, &name, inputs + joined, *neurons));
            inputs = *neurons;
        }
        Self { shape: shape.clone(), layout, layers }
    }

    /// Sizes.
    pub fn shape(&self) -> &CriticShape {
        &self.shape
    }

    /// Names, shapes and places of the tensors.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Fresh parameters.
    pub fn initial(&self, streams: &Streams) -> Parameters {
        let mut parameters = Parameters::zeros(&self.layout);
        init::uniform_by_fan_in(&mut parameters, streams);
        parameters
    }

    /// Shapes: `observations` [rows, observations], `actions` [rows, actions].
    pub fn forward(&self, values: &[f32], observations: &[f32], actions: &[f32]) -> CriticTrace {
        let mut inputs: Vec<Vec<f32>> = Vec::new();
        let mut next = observations.to_vec();
        for (index, layer) in self.layers.iter().enumerate() {
            if index > 0 {
                relu(&mut next);
            }
            if index == 1 {
                next = join(&next, self.shape.hidden[0], actions, self.shape.actions);
            }
            let output = layer.forward(values, &next);
            inputs.push(std::mem::replace(&mut next, output));
        }
        CriticTrace { inputs, value: next }
    }

    /// Adds the gradients of all parameters. Shapes: `d_value` `[rows]`.
    pub fn backward(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &CriticTrace,
        d_value: &[f32],
    ) {
        let mut d_output = d_value.to_vec();
        for index in (0..self.layers.len()).rev() {
            self.layers[index].backward(gradient, &trace.inputs[index], &d_output);
            if index > 0 {
                d_output = self.step_back(values, trace, index, &d_output).0;
            }
        }
    }

    /// Gradient of the actions alone, [rows, actions].
    pub fn backward_action(
        &self,
        values: &[f32],
        trace: &CriticTrace,
        d_value: &[f32],
    ) -> Vec<f32> {
        let mut d_output = d_value.to_vec();
        for index in (2..self.layers.len()).rev() {
            d_output = self.step_back(values, trace, index, &d_output).0;
        }
        self.step_back(values, trace, 1, &d_output).1
    }

    /// Gradients of the output of the layer before `index` and, at the second, of the actions.
    fn step_back(
        &self,
        values: &[f32],
        trace: &CriticTrace,
        index: usize,
        d_output: &[f32],
    ) -> (Vec<f32>, Vec<f32>) {
        let mut d_input = self.layers[index].backward_input(values, d_output);
        let mut d_actions = Vec::new();
        if index != 1 {
            relu_backward(&trace.inputs[index], &mut d_input);
            return (d_input, d_actions);
        }
        let mut d_hidden = Vec::with_capacity(d_input.len());
        let width = self.layers[1].inputs;
        let rows = d_input.chunks_exact_mut(width).zip(trace.inputs[1].chunks_exact(width));
        for (d_row, row) in rows {
            let (d_units, d_action) = d_row.split_at_mut(self.shape.hidden[0]);
            relu_backward(row, d_units);
            d_hidden.extend_from_slice(d_units);
            d_actions.extend_from_slice(d_action);
        }
        (d_hidden, d_actions)
    }
}

/// Rows of `left` with those of `right` behind them.
fn join(left: &[f32], left_width: usize, right: &[f32], right_width: usize) -> Vec<f32> {
    let rows = left.chunks_exact(left_width).zip(right.chunks_exact(right_width));
    rows.flat_map(|(left, right)| left.iter().chain(right)).copied().collect()
}

#[cfg(test)]
#[path = "critic_tests.rs"]
mod tests;
