//! What an actor makes of one of its senses: a code, and a layer of the middle fuse module.

use crate::nn::actor::ActorShape;
use crate::nn::actor::layer::SpikingLayer;
use crate::nn::bdett::BdettState;
use crate::nn::lif::LifTrace;
use crate::nn::parameters::{Layout, Parameters, Slot};
use crate::nn::population::{Population, bernoulli, sum_of_steps};
use crate::nn::rate::RateCode;
use crate::nn::spike::Spike;
use crate::nn::variant::{Code, Fusion};
use crate::rng::Draw;

/// A sense: its code and, with middle fusion, its layer.
#[derive(Debug, Clone)]
pub(super) struct Branch {
    code: SenseCode,
    pub(super) layer: Option<SpikingLayer>,
    /// Its first number in an observation.
    first: usize,
}

#[derive(Debug, Clone)]
enum SenseCode {
    Population(Population),
    Rate(RateCode),
}

/// What a forward pass leaves for the backward pass.
#[derive(Debug, Clone)]
pub(super) struct BranchTrace<S> {
    observations: Vec<f32>,
    activity: Vec<f32>,
    /// Spikes of the code, [steps, rows, lines]; with naive fusion they are the actor's.
    pub(super) input: Vec<f32>,
    pub(super) lif: Option<LifTrace<S>>,
}

impl Branch {
    pub(super) fn new(
        layout: &mut Layout,
        name: &str,
        (code, ranges): (Code, &[(f32, f32)]),
        first: usize,
        (shape, rule): (&ActorShape, Option<Slot>),
    ) -> Self {
        let name_of = |part: &str| format!("{part}.{name}");
        let code = match code {
            Code::Rate => SenseCode::Rate(RateCode::new(ranges)),
            Code::Population => {
                let name = name_of("population");
                SenseCode::Population(Population::new(layout, &name, ranges, shape.population))
            }
        };
        let mut branch = Self { code, layer: None, first };
        if shape.form.fusion == Fusion::Middle {
            let sizes = (branch.lines(), shape.fused);
            branch.layer = Some(SpikingLayer::new(layout, &name_of("fuse"), sizes, shape, rule));
        }
        branch
    }

    /// Lines of the code.
    pub(super) fn lines(&self) -> usize {
        match &self.code {
            SenseCode::Population(code) => code.outputs(),
            SenseCode::Rate(code) => code.outputs(),
        }
    }

    fn dimensions(&self) -> usize {
        match &self.code {
            SenseCode::Population(code) => code.dimensions(),
            SenseCode::Rate(code) => code.dimensions(),
        }
    }

    pub(super) fn initialise(&self, parameters: &mut Parameters) {
        if let SenseCode::Population(code) = &self.code {
            code.initialise(parameters);
        }
    }

    pub(super) fn project(&self, values: &mut [f32]) {
        if let SenseCode::Population(code) = &self.code {
            code.project(values);
        }
    }

    pub(super) fn forward<S: Spike>(
        &self,
        values: &[f32],
        observations: &[f32],
        shape: &ActorShape,
        draws: &mut [Draw],
        state: Option<&mut BdettState>,
    ) -> BranchTrace<S> {
        let all = observations.chunks_exact(shape.observations());
        let part = all.flat_map(|row| &row[self.first..self.first + self.dimensions()]);
        let observations: Vec<f32> = part.copied().collect();
        let activity = match &self.code {
            SenseCode::Population(code) => code.activity(values, &observations),
            SenseCode::Rate(code) => code.activity(&observations),
        };
        let input = bernoulli::<S>(&activity, self.lines(), shape.steps, draws);
        let layer = self.layer.as_ref();
        let lif = layer.map(|layer| layer.forward(values, &input, shape.steps, state));
        BranchTrace { observations, activity, input, lif }
    }

    /// Adds the gradients of the parameters; puts those of this sense's numbers into
    /// `d_observations`.
    ///
    /// Shapes: `d_spikes` is of what the branch gave: of its layer or, without one, of its code.
    pub(super) fn backward<S: Spike>(
        &self,
        values: &[f32],
        gradient: &mut [f32],
        trace: &BranchTrace<S>,
        d_spikes: Vec<f32>,
        d_observations: (&mut [f32], usize),
    ) {
        let d_input = match (&self.layer, &trace.lif) {
            (Some(layer), Some(lif)) => {
                let d_drive = layer.backward(values, gradient, &trace.input, lif, &d_spikes);
                layer.linear.backward_input(values, &d_drive)
            }
            _ => d_spikes,
        };
        let d_activity = sum_of_steps(&d_input, trace.activity.len());
        let (seen, activity) = (&trace.observations, &trace.activity);
        let d_part = match &self.code {
            SenseCode::Rate(code) => code.backward(seen, &d_activity),
            SenseCode::Population(code) => {
                code.backward(values, gradient, seen, activity, &d_activity)
            }
        };
        let (all, width) = d_observations;
        for (row, d) in all.chunks_exact_mut(width).zip(d_part.chunks_exact(self.dimensions())) {
            row[self.first..][..d.len()].copy_from_slice(d);
        }
    }
}
