//! The spiking actor: population code, middle fuse module, decision module (Algorithm 1).

mod layer;

use crate::nn::init;
use crate::nn::lif::{LifShape, LifTrace};
use crate::nn::parameters::{Layout, Parameters};
use crate::nn::population::{Population, SpikeDraws, sum_of_steps};
use crate::nn::spike::Spike;
use crate::nn::threshold;
use crate::rng::Streams;
use layer::SpikingLayer;

/// Sizes and settings of an actor.
#[derive(Debug, Clone, PartialEq)]
pub struct ActorShape {
    /// Lowest and highest value of each dimension of robot and laser state.
    pub laser: Vec<(f32, f32)>,
    /// The same for the DVS state; empty for the laser-only form.
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
    /// Whether thresholds learn (eq. 9, 10) or stay.
    pub learn_thresholds: bool,
}

impl ActorShape {
    /// EEM-SAN: 22 and 64 dimensions, 10 neurons each, 220-20 and 640-20, 20-256-256-256-2, T = 5.
    ///
    /// Goal direction, angular speed are in -1 to 1, other laser and robot terms in 0 to 1, the
    /// DVS state like a unit Gaussian.
    pub fn eem_san() -> Self {
        let mut laser = vec![(0.0, 1.0); 22];
        (laser[0], laser[3]) = ((-1.0, 1.0), (-1.0, 1.0));
        Self {
            laser,
            dvs: vec![(-3.0, 3.0); 64],
            population: 10,
            fused: 20,
            hidden: vec![256; 3],
            actions: 2,
            steps: 5,
            lif: LifShape::default(),
            threshold: 0.5,
            learn_thresholds: true,
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
/// Tensors: `population.B.mean`, `population.B.deviation`, `fuse.B.weight`, `fuse.B.bias`,
/// `fuse.B.r` for branch B = `laser`, `dvs`; `decision.K.weight`, `decision.K.bias`,
/// `decision.K.r` for K from 1. The threshold of a layer is `tanh(r)`.
#[derive(Debug, Clone)]
pub struct Actor {
    shape: ActorShape,
    layout: Layout,
    branches: Vec<Branch>,
    layers: Vec<SpikingLayer>,
}

#[derive(Debug, Clone)]
struct Branch {
    population: Population,
    layer: SpikingLayer,
    first: usize,
}

/// What a forward pass leaves for the backward pass.
#[derive(Debug, Clone)]
pub struct ActorTrace<S> {
    branches: Vec<BranchTrace<S>>,
    fused: Vec<f32>,
    layers: Vec<LifTrace<S>>,
    /// Spike count over T, [rows, actions].
    pub action: Vec<f32>,
}

#[derive(Debug, Clone)]
struct BranchTrace<S> {
    observations: Vec<f32>,
    activity: Vec<f32>,
    input: Vec<f32>,
    lif: LifTrace<S>,
}

impl Actor {
    /// Layers for a shape.
    pub fn new(shape: &ActorShape) -> Self {
        let mut layout = Layout::default();
        let mut branches = Vec::new();
        for (name, ranges, first) in
            [("laser", &shape.laser, 0), ("dvs", &shape.dvs, shape.laser.len())]
        {
            if !ranges.is_empty() {
                branches.push(Branch::new(&mut layout, name, ranges, first, shape));
            }
        }
        let mut layers = Vec::new();
        let mut inputs = shape.fused;
        for (index, neurons) in shape.hidden.iter().chain([&shape.actions]).enumerate() {
            let name = format!("decision.{}", index + 1);
            layers.push(SpikingLayer::new(&mut layout, &name, (inputs, *neurons), shape));
            inputs = *neurons;
        }
        Self { shape: shape.clone(), layout, branches, layers }
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
        self.branches.iter().for_each(|branch| branch.population.initialise(&mut parameters));
        let r = threshold::r_of(self.shape.threshold);
        self.spiking().for_each(|layer| layer.set_r(&mut parameters.values, r));
        self.project(&mut parameters.values);
        parameters
    }

    /// Puts thresholds and deviations back into their limits, after each update.
    pub fn project(&self, values: &mut [f32]) {
        self.branches.iter().for_each(|branch| branch.population.project(values));
        self.spiking().for_each(|layer| layer.project(values));
    }

    fn spiking(&self) -> impl Iterator<Item = &SpikingLayer> {
        self.branches.iter().map(|branch| &branch.layer).chain(&self.layers)
    }

    /// Actions for observations.
    ///
    /// Shapes: `observations` [rows, laser + dvs], scaled to the ranges of the shape.
    pub fn forward<S: Spike>(
        &self,
        values: &[f32],
        observations: &[f32],
        draws: &SpikeDraws,
    ) -> ActorTrace<S> {
        let rows = observations.len() / self.shape.observations();
        let mut draws = draws.samples(rows);
        let pass = |branch: &Branch| branch.forward(values, observations, &self.shape, &mut draws);
        let branches: Vec<BranchTrace<S>> = self.branches.iter().map(pass).collect();
        let fused = add(branches.iter().map(|branch| branch.lif.spikes.as_slice()));
        let mut layers: Vec<LifTrace<S>> = Vec::new();
        for layer in &self.layers {
            let input = layers.last().map_or(&fused, |trace| &trace.spikes);
            let trace = layer.forward(values, input, self.shape.steps);
            layers.push(trace);
        }
        let output = layers.last().map_or(&fused, |trace| &trace.spikes);
        let mut action = sum_of_steps(output, rows * self.shape.actions);
        action.iter_mut().for_each(|count| *count /= self.shape.steps as f32);
        ActorTrace { branches, fused, layers, action }
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
        let rows = d_action.len() / self.shape.actions;
        let mut d_observations = vec![0.0; rows * self.shape.observations()];
        for (branch, trace) in self.branches.iter().zip(&trace.branches) {
            let d_part = branch.backward(values, gradient, trace, &d_spikes);
            let rows = d_observations.chunks_exact_mut(self.shape.observations());
            for (row, d) in rows.zip(d_part.chunks_exact(branch.population.dimensions())) {
                row[branch.first..][..d.len()].copy_from_slice(d);
            }
        }
        d_observations
    }
}

impl Branch {
    fn new(
        layout: &mut Layout,
        name: &str,
        ranges: &[(f32, f32)],
        first: usize,
        shape: &ActorShape,
    ) -> Self {
        let name_of = |part: &str| format!("{part}.{name}");
        let population = Population::new(layout, &name_of("population"), ranges, shape.population);
        let sizes = (population.outputs(), shape.fused);
        let layer = SpikingLayer::new(layout, &name_of("fuse"), sizes, shape);
        Self { population, layer, first }
    }

    fn forward<S: Spike>(
        &self,
        values: &[f32],
        observations: &[f32],
        shape: &ActorShape,
        draws: &mut [crate::rng::Draw],
    ) -> BranchTrace<S> {
        let all = observations.chunks_exact(shape.observations());
        let part = all.flat_map(|row| &row[self.first..self.first + self.population.dimensions()]);
        let observations: Vec<f32> = part.copied().collect();
        let activity = self.population.activity(values, &observations);
        let input = self.population.spikes::<S>(&activity, shape.steps, draws);
        let lif = self.layer.forward(values, &input, shape.steps);
        BranchTrace { observations, activity, input, lif }
    }

    fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &BranchTrace<S>,
        d_spikes: &[f32],
    ) -> Vec<f32> {
        let d_drive = self.layer.backward(values, gradient, &trace.input, &trace.lif, d_spikes);
        let d_input = self.layer.linear.backward_input(values, &d_drive);
        let (observations, activity) = (&trace.observations, &trace.activity);
        self.population.backward(values, gradient, observations, activity, &d_input)
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
