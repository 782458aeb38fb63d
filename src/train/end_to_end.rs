//! The encoder of event frames while it learns through the actor (EEM-SAN's ablation "E2E").
//!
//! The gradient that an update of the actor gives for what it saw goes on through the DVS state
//! into the encoder. It needs the encoder's voltages of the moment, so it comes from the newest
//! ticks of all worlds, a *stretch*, and not from the replay memory: every so many ticks actor and
//! encoder make one step together on the stretch just flown, and it is forgotten. Gradients end at
//! the first frame of a stretch and at the start of a flight; states are carried on. Updates from
//! the replay memory go on as without, and leave the encoder alone; DVS states there are as old as
//! their transitions, so the memory should be short.
//!
//! Steps on a stretch move the actor as much as the encoder. With a step length of 0 the encoder
//! stays, all else is the same: the control that tells what learning it is worth.

use std::sync::Arc;

use crate::closed_loop::planner::LEVELS;
use crate::net::eem_san::ROBOT_STATE;
use crate::net::{ConvLayer, EventEncoder, Readout};
use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::lif::LifShape;
use crate::nn::shards;
use crate::nn::soft_update::soft_update;
use crate::nn::spiking_encoder::{LaidOut, Tape};
use crate::nn::{
    Guide, Parameters, Rectangular, SpikingEncoder, SpikingEncoderShape, StateError, StateReader,
    StateWriter, Transitions,
};
use crate::policy::{EventFrame, FRAME_COLUMNS};
use crate::reference::FloatEncoder;
use crate::train::flight::Flight;
use crate::train::on_each;

/// What turns a flight's event frames into its DVS state.
#[derive(Debug, Clone)]
pub enum Sight {
    /// An encoder that stays as it is.
    Fixed(FloatEncoder),
    /// One that learns.
    Learning(LearningSight),
}

/// An encoder that learns, with the state of one flight.
#[derive(Debug, Clone)]
pub struct LearningSight {
    layers: Arc<SpikingEncoder>,
    weights: Arc<LaidOut>,
    tape: Tape,
}

impl Sight {
    /// A new flight: all state zero.
    pub fn reset(&mut self) {
        match self {
            Self::Fixed(encoder) => encoder.reset(),
            Self::Learning(sight) => sight.tape.reset(),
        }
    }

    /// One event frame.
    pub fn step(&mut self, frame: &EventFrame) {
        match self {
            Self::Fixed(encoder) => encoder.step(frame),
            Self::Learning(LearningSight { layers, weights, tape }) => {
                layers.step::<Rectangular>(weights, tape, frame.active());
            }
        }
    }

    /// The DVS state now.
    pub fn state(&self) -> Vec<f32> {
        match self {
            Self::Fixed(encoder) => encoder.state(),
            Self::Learning(sight) => sight.layers.state(&sight.weights, &sight.tape),
        }
    }

    /// The DVS state at the start of a flight.
    pub fn resting_state(&self) -> Vec<f32> {
        match self {
            Self::Fixed(encoder) => encoder.resting_state(),
            Self::Learning(sight) => sight.layers.state(&sight.weights, &sight.layers.tape(false)),
        }
    }

    fn learning(&mut self) -> Option<&mut LearningSight> {
        match self {
            Self::Fixed(_) => None,
            Self::Learning(sight) => Some(sight),
        }
    }
}

/// What all worlds saw in the newest ticks, and what the teacher said about it.
#[derive(Debug, Clone, Default)]
pub(super) struct Stretch {
    pub(super) ticks: usize,
    /// [ticks, worlds, observation].
    pub(super) observations: Vec<f32>,
    /// [ticks, worlds, insight].
    insights: Vec<f32>,
    /// [ticks, worlds, 2].
    planned: Vec<f32>,
    /// [ticks, worlds, actions of the planner].
    costs: Vec<f32>,
    /// [ticks, worlds]: rewards, which nothing is learned from here.
    nothing: Vec<f32>,
    /// Frame of the world's tape that the DVS state was read after, [ticks, worlds].
    frames: Vec<usize>,
}

impl Stretch {
    /// Adds what the actor is about to act on.
    pub(super) fn add(&mut self, flights: &mut [Flight<'_>]) {
        for flight in flights {
            self.observations.extend(flight.observation());
            let (insight, planned, costs) = flight.taught();
            self.insights.extend(insight);
            self.planned.extend(planned);
            self.costs.extend(costs);
            self.nothing.push(0.0);
            let sight = flight.sight().and_then(Sight::learning);
            self.frames.push(sight.map_or(0, |sight| sight.tape.newest()));
        }
        self.ticks += 1;
    }

    /// Frames of one world of several, each with the gradient of the DVS state after it.
    fn of_world<'d>(
        &self,
        world: usize,
        worlds: usize,
        d_observations: &'d [f32],
    ) -> Vec<(usize, &'d [f32])> {
        let rows = d_observations.chunks_exact(d_observations.len() / self.rows());
        let rows = rows.zip(&self.frames).skip(world).step_by(worlds);
        rows.map(|(d, frame)| (*frame, &d[ROBOT_STATE..])).collect()
    }

    /// Observations in all.
    fn rows(&self) -> usize {
        self.frames.len()
    }

    /// As a batch for the actor alone; with `insight` critics see what they know.
    pub(super) fn transitions(&self, insight: bool) -> Transitions<'_> {
        Transitions {
            observations: &self.observations,
            actions: &self.planned,
            rewards: &self.nothing,
            next_observations: &self.observations,
            terminal: &self.nothing,
            judged: insight.then_some([&self.insights, &self.insights]),
            history: None,
        }
    }

    /// What the planner says.
    pub(super) fn guide(&self) -> Guide<'_> {
        Guide { levels: LEVELS, actions: &self.planned, costs: &self.costs }
    }

    /// The same, `times` times behind each other, but for the frames.
    pub(super) fn repeated(&self, times: usize) -> Self {
        Self {
            ticks: self.ticks,
            observations: self.observations.repeat(times),
            insights: self.insights.repeat(times),
            planned: self.planned.repeat(times),
            costs: self.costs.repeat(times),
            nothing: self.nothing.repeat(times),
            frames: Vec::new(),
        }
    }
}

/// The encoder's parameters and their optimiser.
#[derive(Debug, Clone)]
pub(super) struct EndToEnd {
    layers: Arc<SpikingEncoder>,
    /// The encoder that training began with, for what does not learn.
    first: EventEncoder,
    parameters: Parameters,
    adam: Adam,
    /// Moving average, when there is one.
    average: Option<Parameters>,
}

/// One world's part of an update.
struct Part<'f> {
    tape: &'f mut Tape,
    d_states: Vec<(usize, &'f [f32])>,
    gradient: Vec<f32>,
    rate: f64,
}

impl EndToEnd {
    /// Begins with `encoder`, whose readout gives DVS states of zero mean and unit deviation.
    pub(super) fn new(encoder: &EventEncoder, averaged: bool) -> Self {
        let shape = SpikingEncoderShape {
            side: FRAME_COLUMNS,
            channels: encoder.layers.iter().map(|layer| layer.outputs).collect(),
            latent: encoder.readout.bias.len(),
            lif: LifShape {
                keep_current: encoder.keep_current as f32,
                keep_voltage: encoder.keep_voltage as f32,
                ..LifShape::default()
            },
            threshold: encoder.threshold as f32,
        };
        let layers = SpikingEncoder::new(&shape);
        let mut parameters = Parameters::zeros(layers.layout());
        for entry in layers.layout().entries() {
            entry.slot.of_mut(&mut parameters.values).copy_from_slice(tensor(encoder, &entry.name));
        }
        let adam = Adam::new(parameters.values.len());
        let average = averaged.then(|| parameters.clone());
        Self { layers: Arc::new(layers), first: encoder.clone(), parameters, adam, average }
    }

    /// Sights for `n` flights; only those that record can be learned from.
    pub(super) fn sights(&self, n: usize, recording: bool) -> Vec<Sight> {
        let weights = Arc::new(self.layers.lay_out(&self.parameters.values));
        let sight = |_| {
            let (layers, weights) = (Arc::clone(&self.layers), Arc::clone(&weights));
            Sight::Learning(LearningSight { tape: layers.tape(recording), layers, weights })
        };
        (0..n).map(sight).collect()
    }

    /// One step down the gradient of the observations of a stretch and of `rate_weight` times the
    /// mean spike rate, which is given back. The flights go on with the new weights.
    ///
    /// Shapes: `d_observations` [ticks, worlds, observation].
    pub(super) fn update(
        &mut self,
        flights: &mut [Flight<'_>],
        stretch: &Stretch,
        d_observations: &[f32],
        (learning_rate, rate_weight): (f32, f32),
        threads: usize,
    ) -> f64 {
        let worlds = flights.len();
        let weights = self.layers.lay_out(&self.parameters.values);
        let sights = flights.iter_mut().filter_map(|flight| flight.sight()?.learning());
        let mut parts = Vec::with_capacity(worlds);
        for (world, sight) in sights.enumerate() {
            let d_states = stretch.of_world(world, worlds, d_observations);
            let gradient = self.layers.layout().zeros();
            parts.push(Part { tape: &mut sight.tape, d_states, gradient, rate: 0.0 });
        }
        let rate_scale = rate_weight / worlds as f32;
        on_each(&mut parts, threads, |part| {
            let (tape, d_states, gradient) = (&*part.tape, &part.d_states, &mut part.gradient);
            let layers = &self.layers;
            part.rate =
                layers.backward::<Rectangular>(&weights, tape, d_states, rate_scale, gradient);
            part.tape.forget();
        });
        let rate = parts.iter().map(|part| part.rate).sum::<f64>() / worlds as f64;
        let gradient = shards::sum(parts.into_iter().map(|part| part.gradient).collect());
        let settings = AdamSettings::with_rate(learning_rate);
        self.adam.step(&settings, &mut self.parameters.values, &gradient);
        let weights = Arc::new(self.layers.lay_out(&self.parameters.values));
        for sight in flights.iter_mut().filter_map(|flight| flight.sight()?.learning()) {
            sight.weights = Arc::clone(&weights);
        }
        rate
    }

    /// The average moves towards the encoder that learns.
    pub(super) fn follow(&mut self, share: f32) {
        if let Some(average) = &mut self.average {
            soft_update(&mut average.values, &self.parameters.values, share);
        }
    }

    /// The encoder to save: the average if there is one.
    pub(super) fn encoder(&self) -> EventEncoder {
        let parameters = self.average.as_ref().unwrap_or(&self.parameters);
        let of = |name: &str| parameters.tensor(name).expect("a tensor of this network").to_vec();
        let mut encoder = self.first.clone();
        for (index, layer) in encoder.layers.iter_mut().enumerate() {
            layer.weights = of(&format!("encoder.{}.weight", index + 1));
            layer.bias = of(&format!("encoder.{}.bias", index + 1));
        }
        encoder.readout = Readout { weights: of("mu.weight"), bias: of("mu.bias") };
        encoder
    }

    /// Adds everything that the next update depends on.
    pub(super) fn write(&self, state: &mut StateWriter) {
        state.parameters("encoder.", &self.parameters);
        state.adam("adam.encoder.", self.parameters.layout(), &self.adam);
        if let Some(average) = &self.average {
            state.parameters("average.encoder.", average);
        }
    }

    /// Takes over what [`EndToEnd::write`] wrote.
    ///
    /// Errors: a tensor is missing or has another shape; nothing is changed then.
    pub(super) fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let mut fresh = self.clone();
        state.parameters("encoder.", &mut fresh.parameters)?;
        state.adam("adam.encoder.", fresh.layers.layout(), &mut fresh.adam)?;
        if let Some(average) = &mut fresh.average {
            state.parameters("average.encoder.", average)?;
        }
        *self = fresh;
        Ok(())
    }
}

/// The elements of the encoder's tensor of this name.
fn tensor<'e>(encoder: &'e EventEncoder, name: &str) -> &'e [f32] {
    match name {
        "mu.weight" => &encoder.readout.weights,
        "mu.bias" => &encoder.readout.bias,
        _ => {
            let part = |layer: &'e ConvLayer| match name.strip_prefix(&layer.name)? {
                ".bias" => Some(&layer.bias[..]),
                ".weight" => Some(&layer.weights[..]),
                _ => None,
            };
            encoder.layers.iter().find_map(part).expect("layers have the same names")
        }
    }
}

#[cfg(test)]
#[path = "end_to_end_tests.rs"]
mod tests;
