//! The spiking actor: codes, fusion, decision module (Algorithm 1), in all forms of
//! [`crate::nn::variant`].

mod branch;
mod layer;

use std::ops::Range;

use crate::nn::bdett::{Bdett, BdettState};
use crate::nn::init;
use crate::nn::lif::{LifShape, LifTrace};
use crate::nn::parameters::{Layout, Parameters, Slot};
use crate::nn::population::{SpikeDraws, sum_of_steps};
use crate::nn::spike::{Rectangular, Spike};
use crate::nn::variant::{Code, Form, Fusion, Thresholds};
use crate::rng::{Draw, Streams};
use branch::{Branch, BranchTrace};
use layer::SpikingLayer;

/// Sizes and settings of an actor.
#[derive(Debug, Clone, PartialEq)]
pub struct ActorShape {
    /// Code, fusion and thresholds.
    pub form: Form,
    /// Lowest and highest value of each dimension of robot and laser state.
    pub laser: Vec<(f32, f32)>,
    /// The same for the DVS state; empty for a form without events.
    pub dvs: Vec<(f32, f32)>,
    /// Neurons per dimension of the population code.
    pub population: usize,
    /// Neurons of each group of the middle fuse module.
    pub fused: usize,
    /// Neurons of the hidden layers of the decision module.
    pub hidden: Vec<usize>,
    /// Output neurons.
    pub actions: usize,
    /// `T`: steps per decision.
    pub steps: usize,
    /// Decays and gradient path of all layers.
    pub lif: LifShape,
    /// Thresholds at the start.
    pub threshold: f32,
}

impl ActorShape {
    /// EEM-SAN: 22 and 64 dimensions, 10 neurons each, 220-20 and 640-20, 20-256-256-256-2, T = 5.
    ///
    /// Goal direction, angular speed are in -1 to 1, other laser and robot terms in 0 to 1, the
    /// DVS state like a unit Gaussian. Other forms have the same sizes where they have the parts.
    pub fn eem_san() -> Self {
        let mut laser = vec![(0.0, 1.0); 22];
        (laser[0], laser[3]) = ((-1.0, 1.0), (-1.0, 1.0));
        Self {
            form: Form::EEM_SAN,
            laser,
            dvs: vec![(-3.0, 3.0); 64],
            population: 10,
            fused: 20,
            hidden: vec![256; 3],
            actions: 2,
            steps: 5,
            lif: LifShape::default(),
            threshold: 0.5,
        }
    }

    /// The same without the DVS branch.
    pub fn laser_only() -> Self {
        Self { dvs: Vec::new(), ..Self::eem_san() }
    }

    /// Dimensions of an observation.
    pub fn observations(&self) -> usize {
        self.laser.len() + self.dvs.len()
    }
}

/// Layers of an actor; parameters are apart.
///
/// Tensors, those that the form has: `bdett`, the numbers of dynamic thresholds in the order of
/// [`Bdett`]; `population.B.mean`, `population.B.deviation`, `fuse.B.weight`, `fuse.B.bias` for
/// branch B = `laser`, `dvs`; `decision.K.weight`, `decision.K.bias` for K from 1. A layer's learned
/// threshold is `tanh` of its `.r`, its fixed one its `.threshold`. With naive fusion the first
/// layer's inputs are the lines of all codes, one after the other.
#[derive(Debug, Clone)]
pub struct Actor {
    shape: ActorShape,
    layout: Layout,
    rule: Option<Slot>,
    branches: Vec<Branch>,
    layers: Vec<SpikingLayer>,
}

/// What a forward pass leaves for the backward pass.
#[derive(Debug, Clone)]
pub struct ActorTrace<S> {
    branches: Vec<BranchTrace<S>>,
    /// Input of the decision module.
    fused: Vec<f32>,
    layers: Vec<LifTrace<S>>,
    /// Spike count over T, [rows, actions].
    pub action: Vec<f32>,
}

/// What an actor carries from one decision to the next: nothing unless thresholds are dynamic.
#[derive(Debug, Clone, PartialEq)]
pub struct ActorState {
    rule: Bdett,
    /// Branches first, and their neurons per row.
    layers: Vec<(usize, BdettState)>,
}

impl ActorState {
    /// A new trial for row `row`.
    pub fn restart(&mut self, row: usize) {
        for (width, layer) in &mut self.layers {
            layer.restart(&self.rule, row, *width);
        }
    }
}

/// What was seen in the ticks before observations, for networks that carry a state.
#[derive(Debug, Clone, Copy)]
pub struct History<'a> {
    /// Ticks.
    pub ticks: usize,
    /// The oldest first, [rows, ticks, dimensions]; what was before the trial does not matter.
    pub observations: &'a [f32],
    /// How many of the ticks are of the trial, the newest ones, `[rows]`.
    pub known: &'a [f32],
}

impl<'a> History<'a> {
    /// Observations of tick `tick`, [rows, dimensions].
    fn at(&self, tick: usize) -> Vec<f32> {
        let width = self.observations.len() / (self.known.len() * self.ticks).max(1);
        let rows = self.observations.chunks_exact((width * self.ticks).max(1));
        rows.flat_map(|row| &row[tick * width..(tick + 1) * width]).copied().collect()
    }

    /// Rows whose trial has not begun by tick `tick`.
    fn before_trial(&self, tick: usize) -> impl Iterator<Item = usize> + '_ {
        let late = move |(row, known): (usize, &f32)| {
            (tick + (*known as usize) < self.ticks).then_some(row)
        };
        self.known.iter().enumerate().filter_map(late)
    }

    /// Some rows of it.
    pub(super) fn rows(&self, range: &Range<usize>) -> History<'a> {
        let width = self.observations.len() / self.known.len().max(1);
        let observations = &self.observations[range.start * width..range.end * width];
        History { observations, known: &self.known[range.clone()], ..*self }
    }
}

impl Actor {
    /// Layers for a shape.
    pub fn new(shape: &ActorShape) -> Self {
        let mut layout = Layout::default();
        let dynamic = shape.form.thresholds == Thresholds::Dynamic;
        let rule = dynamic.then(|| layout.add("bdett", &[Bdett::LEN]));
        let mut branches = Vec::new();
        for (name, code, ranges, first) in [
            ("laser", shape.form.code, &shape.laser, 0),
            ("dvs", Code::Population, &shape.dvs, shape.laser.len()),
        ] {
            if !ranges.is_empty() {
                let code = (code, ranges.as_slice());
                branches.push(Branch::new(&mut layout, name, code, first, (shape, rule)));
            }
        }
        let mut layers = Vec::new();
        let mut inputs = match shape.form.fusion {
            Fusion::Middle => shape.fused,
            Fusion::Naive => branches.iter().map(Branch::lines).sum(),
        };
        for (index, neurons) in shape.hidden.iter().chain([&shape.actions]).enumerate() {
            let name = format!("decision.{}", index + 1);
            layers.push(SpikingLayer::new(&mut layout, &name, (inputs, *neurons), shape, rule));
            inputs = *neurons;
        }
        Self { shape: shape.clone(), layout, rule, branches, layers }
    }

    /// Sizes and settings.
    pub fn shape(&self) -> &ActorShape {
        &self.shape
    }

    /// Names, shapes and places of the tensors.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Fresh parameters: PyTorch's default weights, evenly spaced receptive fields, equal
    /// thresholds.
    pub fn initial(&self, streams: &Streams) -> Parameters {
        let mut parameters = Parameters::zeros(&self.layout);
        init::uniform_by_fan_in(&mut parameters, streams);
        self.branches.iter().for_each(|branch| branch.initialise(&mut parameters));
        if let Some(rule) = self.rule {
            let numbers = Bdett { initial: self.shape.threshold, ..Bdett::PUBLISHED };
            rule.of_mut(&mut parameters.values).copy_from_slice(&numbers.to_array());
        }
        let height = self.shape.threshold;
        self.spiking().for_each(|layer| layer.set_threshold(&mut parameters.values, height));
        self.project(&mut parameters.values);
        parameters
    }

    /// Puts thresholds and deviations back into their limits, after each update.
    pub fn project(&self, values: &mut [f32]) {
        self.branches.iter().for_each(|branch| branch.project(values));
        self.spiking().for_each(|layer| layer.project(values));
    }

    fn spiking(&self) -> impl Iterator<Item = &SpikingLayer> {
        self.branches.iter().filter_map(|branch| branch.layer.as_ref()).chain(&self.layers)
    }

    /// The state of `rows` trials that begin.
    pub fn rest(&self, values: &[f32], rows: usize) -> ActorState {
        let rule = self.rule.map(|rule| Bdett::from_slice(rule.of(values)));
        let layer = |rule: &Bdett, layer: &SpikingLayer| {
            let width = layer.linear.outputs;
            (width, BdettState::fresh(rule, rows * width))
        };
        let layers = rule.iter().flat_map(|rule| self.spiking().map(move |l| layer(rule, l)));
        ActorState { layers: layers.collect(), rule: rule.unwrap_or(Bdett::PUBLISHED) }
    }

    /// The state that what was seen before leaves, from rest or from where a trial began.
    pub fn after(&self, values: &[f32], history: &History, draws: &mut [Draw]) -> ActorState {
        let mut state = self.rest(values, history.known.len());
        for tick in 0..history.ticks {
            let seen = history.at(tick);
            self.forward_from::<Rectangular>(values, &seen, &mut state, draws);
            history.before_trial(tick).for_each(|row| state.restart(row));
        }
        state
    }

    /// Actions for observations, from rest.
    ///
    /// Shapes: `observations` [rows, laser + dvs], scaled to the ranges of the shape.
    pub fn forward<S: Spike>(
        &self,
        values: &[f32],
        observations: &[f32],
        draws: &SpikeDraws,
    ) -> ActorTrace<S> {
        let rows = observations.len() / self.shape.observations();
        let (mut state, mut draws) = (self.rest(values, rows), draws.samples(rows));
        self.forward_from(values, observations, &mut state, &mut draws)
    }

    /// The same from a state, which is carried on; `draws` has a stream for each row.
    pub fn forward_from<S: Spike>(
        &self,
        values: &[f32],
        observations: &[f32],
        state: &mut ActorState,
        draws: &mut [Draw],
    ) -> ActorTrace<S> {
        let rows = observations.len() / self.shape.observations();
        let mut states = state.layers.iter_mut().map(|(_, layer)| layer);
        let mut branches: Vec<BranchTrace<S>> = Vec::new();
        for branch in &self.branches {
            let state = branch.layer.as_ref().and_then(|_| states.next());
            branches.push(branch.forward(values, observations, &self.shape, draws, state));
        }
        let fused = match self.shape.form.fusion {
            Fusion::Middle => add(branches.iter().filter_map(|b| Some(&*b.lif.as_ref()?.spikes))),
            Fusion::Naive => self.join(&mut branches),
        };
        let mut layers: Vec<LifTrace<S>> = Vec::new();
        for layer in &self.layers {
            let input = layers.last().map_or(&fused, |trace| &trace.spikes);
            let trace = layer.forward(values, input, self.shape.steps, states.next());
            layers.push(trace);
        }
        let output = layers.last().map_or(&fused, |trace| &trace.spikes);
        let mut action = sum_of_steps(output, rows * self.shape.actions);
        action.iter_mut().for_each(|count| *count /= self.shape.steps as f32);
        ActorTrace { branches, fused, layers, action }
    }

    /// Takes the lines of all codes, row by row.
    fn join<S>(&self, branches: &mut [BranchTrace<S>]) -> Vec<f32> {
        if let [one] = branches {
            return std::mem::take(&mut one.input);
        }
        let inputs: Vec<Vec<f32>> =
            branches.iter_mut().map(|branch| std::mem::take(&mut branch.input)).collect();
        let mut parts: Vec<_> = self
            .branches
            .iter()
            .zip(&inputs)
            .map(|(branch, input)| input.chunks_exact(branch.lines()))
            .collect();
        let rows = parts.first().map_or(0, |rows| rows.len());
        let mut joined = Vec::with_capacity(inputs.iter().map(Vec::len).sum());
        for _ in 0..rows {
            parts.iter_mut().for_each(|rows| joined.extend(rows.next().unwrap_or_default()));
        }
        joined
    }

    /// Adds the gradients of all parameters; gives that of the observations.
    ///
    /// Shapes: `d_action` [rows, actions]; result [rows, laser + dvs].
    pub fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &ActorTrace<S>,
        d_action: &[f32],
    ) -> Vec<f32> {
        let per_step = d_action.iter().map(|d| d / self.shape.steps as f32).collect::<Vec<_>>();
        let mut d_spikes = per_step.repeat(self.shape.steps);
        for (index, layer) in self.layers.iter().enumerate().rev() {
            let below = index.checked_sub(1).map(|below| &trace.layers[below].spikes);
            let input = below.unwrap_or(&trace.fused);
            let d_drive = layer.backward(values, gradient, input, &trace.layers[index], &d_spikes);
            d_spikes = layer.linear.backward_input(values, &d_drive);
        }
        let width = self.shape.observations();
        let mut d_observations = vec![0.0; d_action.len() / self.shape.actions * width];
        let mut first = 0;
        for (branch, trace) in self.branches.iter().zip(&trace.branches) {
            let d_part = match branch.layer {
                Some(_) => d_spikes.clone(),
                None => {
                    let all = self.layers[0].linear.inputs;
                    let own = first..first + branch.lines();
                    first = own.end;
                    d_spikes.chunks_exact(all).flat_map(|row| &row[own.clone()]).copied().collect()
                }
            };
            let d_all = (d_observations.as_mut_slice(), width);
            branch.backward(values, gradient, trace, d_part, d_all);
        }
        d_observations
    }
}

/// Element-wise sum (the fusion of MF).
fn add<'a>(mut parts: impl Iterator<Item = &'a [f32]>) -> Vec<f32> {
    let mut total = parts.next().unwrap_or_default().to_vec();
    for part in parts {
        total.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
    }
    total
}

#[cfg(test)]
#[path = "actor_tests.rs"]
mod tests;
