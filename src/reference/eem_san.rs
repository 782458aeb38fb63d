//! EEM-SAN in 32-bit floats (Algorithm 1), as a driver, and the networks of its parts.

use std::collections::VecDeque;

use crate::coding::{InputSpikes, LayerSpikes, decode, population_spikes, robot_state};
use crate::net::eem_san::{EemSan, FRAMES_PER_TICK, StateCode};
use crate::policy::{Action, Observation, Policy, TOLD};
use crate::reference::Decision;
use crate::reference::event_encoder::FloatEncoder;
use crate::reference::float::FloatLayer;
use crate::rng::{Streams, stream};

/// Middle fuse module, if there is one, and decision module, laid out for running.
#[derive(Debug, Clone)]
pub struct FloatDecision {
    branches: Vec<FloatLayer>,
    layers: Vec<FloatLayer>,
    /// Whether state lasts from one decision to the next.
    carries: bool,
}

impl FloatDecision {
    /// Takes a network's weights.
    pub fn new(network: &EemSan) -> Self {
        let layer = |layer| match network.dynamic {
            Some(rule) => FloatLayer::new(layer).moving(rule),
            None => FloatLayer::new(layer),
        };
        let branches = network.branches().filter_map(|branch| branch.layer.as_ref());
        Self {
            branches: branches.map(layer).collect(),
            layers: network.decision.iter().map(layer).collect(),
            carries: network.dynamic.is_some(),
        }
    }

    /// A new trial.
    pub fn restart(&mut self) {
        self.branches.iter_mut().chain(&mut self.layers).for_each(FloatLayer::reset);
    }

    /// One decision, from zero state unless thresholds are dynamic.
    ///
    /// Shapes: `inputs[branch][step][line]`. Layers of the result: branches first.
    pub fn decide(&mut self, inputs: &[InputSpikes]) -> Decision {
        self.decide_watched(inputs, &mut |_, _| ())
    }

    /// The same; `watch` gets the spikes of each layer in each step, step by step.
    pub fn decide_watched(
        &mut self,
        inputs: &[InputSpikes],
        watch: &mut dyn FnMut(usize, &[bool]),
    ) -> Decision {
        if !self.carries {
            self.restart();
        }
        let outputs = self.layers.last().map_or(0, |layer| layer.spikes.len());
        let n_branches = self.branches.len();
        let mut decision = Decision::new(n_branches + self.layers.len(), outputs);
        let steps = inputs.first().map_or(0, Vec::len);
        for step in 0..steps {
            for (index, (branch, input)) in self.branches.iter_mut().zip(inputs).enumerate() {
                branch.step(&[&input[step]]);
                watch(index, &branch.spikes);
                decision.add_step(index, &branch.spikes, false);
            }
            let mut lines = Vec::new();
            if self.branches.is_empty() {
                inputs.iter().for_each(|input| lines.extend(&input[step]));
            }
            let fused = self.branches.iter().map(|branch| branch.spikes.as_slice());
            let mut spikes: Vec<&[bool]> = fused.collect();
            if spikes.is_empty() {
                spikes.push(&lines);
            }
            let last = self.layers.len() - 1;
            for (index, layer) in self.layers.iter_mut().enumerate() {
                layer.step(&spikes);
                watch(n_branches + index, &layer.spikes);
                spikes = vec![&layer.spikes];
                decision.add_step(n_branches + index, &layer.spikes, index == last);
            }
        }
        decision
    }
}

/// The float network as a driver.
#[derive(Debug, Clone)]
pub struct EemSanPolicy {
    network: EemSan,
    encoder: Option<FloatEncoder>,
    decision: FloatDecision,
    streams: Streams,
    dvs_state: Vec<f32>,
    late: Option<Late>,
}

/// What a policy with the delays of a chip that streams has under way.
#[derive(Debug, Clone, Default)]
struct Late {
    /// DVS states after the latest frames, oldest first, the state at rest before the first.
    states: VecDeque<Vec<f32>>,
    /// Actions of the latest ticks, oldest first.
    actions: VecDeque<Action>,
}

impl Late {
    fn new(network: &EemSan, encoder: Option<&FloatEncoder>) -> Self {
        let rest = encoder.map_or_else(Vec::new, FloatEncoder::resting_state);
        let stand = Action { left: 0.0, right: 0.0 };
        Self {
            states: VecDeque::from(vec![rest; network.streamed_frames()]),
            actions: VecDeque::from(vec![stand; network.streamed_ticks()]),
        }
    }
}

/// Puts `new` at the end and takes the oldest.
fn shift<T>(line: &mut VecDeque<T>, new: T) -> T {
    line.push_back(new);
    line.pop_front().expect("one was added")
}

impl EemSanPolicy {
    /// A driver; its trial has yet to start.
    pub fn new(network: &EemSan) -> Self {
        Self {
            encoder: network.encoder.as_ref().map(FloatEncoder::new),
            decision: FloatDecision::new(network),
            network: network.clone(),
            streams: Streams::new(0, 0),
            dvs_state: Vec::new(),
            late: None,
        }
    }

    /// The same with the delays of a chip in the schedule `streaming`: the DVS state lacks the
    /// newest [`EemSan::streamed_frames`] frames, and the action of a tick is that of the
    /// observation [`EemSan::streamed_ticks`] ticks before, at first none (the wheels stand).
    pub fn streaming(network: &EemSan) -> Self {
        let policy = Self::new(network);
        Self { late: Some(Late::new(network, policy.encoder.as_ref())), ..policy }
    }

    /// The action that drives now, of the one decided now.
    fn delayed(&mut self, action: Action) -> Action {
        match &mut self.late {
            Some(late) => shift(&mut late.actions, action),
            None => action,
        }
    }

    /// The DVS state of the last tick of [`EemSanPolicy::act_watched`]; empty without an encoder.
    pub fn dvs_state(&self) -> &[f32] {
        &self.dvs_state
    }

    /// Name and neurons of every layer: encoder, branches, decision module.
    pub fn layers(&self) -> Vec<(&str, usize)> {
        self.network.layers()
    }

    /// Whether the network has an encoder of event frames.
    pub fn takes_frames(&self) -> bool {
        self.encoder.is_some()
    }

    /// Whether the simulator tells it of movers.
    pub fn is_told(&self) -> bool {
        self.network.told
    }

    /// [`Policy::act`], and the spikes of every layer: encoder, branches, decision module. They are
    /// those of this observation, also when the action is that of an earlier one.
    ///
    /// Panics as `act` does.
    pub fn act_watched(&mut self, observation: &Observation, tick: u64) -> (Action, LayerSpikes) {
        let layers = self.encoder.as_ref().map_or(0, |encoder| encoder.neurons().len());
        let mut spikes: LayerSpikes = vec![Vec::new(); layers];
        let inputs = self.inputs(observation, tick, &mut |encoder| {
            spikes.iter_mut().zip(encoder.spiking()).for_each(|(all, step)| all.push(step));
        });
        let before = spikes.len();
        spikes.resize(before + self.network.dense_layers().count(), Vec::new());
        let decision = self.decision.decide_watched(&inputs, &mut |layer, of_step| {
            let spiking = of_step.iter().enumerate().filter(|(_, spike)| **spike);
            spikes[before + layer].push(spiking.map(|(neuron, _)| neuron as u32).collect());
        });
        let action = decode(&decision.output_counts, self.network.steps);
        (self.delayed(action), spikes)
    }

    /// Spikes into every branch; `stepped` sees the encoder after each frame.
    fn inputs(
        &mut self,
        observation: &Observation,
        tick: u64,
        stepped: &mut dyn FnMut(&FloatEncoder),
    ) -> Vec<InputSpikes> {
        let state = robot_state(observation);
        let laser = self.spikes(&self.network.laser.code, &state, stream::LASER_POPULATION, tick);
        let mut inputs = vec![laser];
        if let Some(encoder) = &mut self.encoder {
            let frames = &observation.frames;
            assert_eq!(frames.len(), FRAMES_PER_TICK, "event frames at tick {tick}");
            for frame in frames {
                encoder.step(frame);
                stepped(encoder);
                if let Some(late) = &mut self.late {
                    self.dvs_state = shift(&mut late.states, encoder.state());
                }
            }
            if self.late.is_none() {
                self.dvs_state = encoder.state();
            }
        } else if self.network.told {
            assert_eq!(observation.told.len(), TOLD, "numbers told at tick {tick}");
            self.dvs_state.clone_from(&observation.told);
        }
        if let Some(dvs) = &self.network.dvs {
            inputs.push(self.spikes(&dvs.code, &self.dvs_state, stream::DVS_POPULATION, tick));
        }
        inputs
    }

    fn spikes(&self, code: &StateCode, state: &[f32], name: &str, tick: u64) -> InputSpikes {
        let mut draw = self.streams.at(name, tick);
        population_spikes(&code.activity(state), self.network.steps, &mut draw)
    }
}

impl Policy for EemSanPolicy {
    fn start_trial(&mut self, streams: Streams) {
        self.streams = streams;
        self.decision.restart();
        if let Some(encoder) = &mut self.encoder {
            encoder.reset();
        }
        let late = self.late.as_ref();
        self.late = late.map(|_| Late::new(&self.network, self.encoder.as_ref()));
    }

    /// Panics when the network has an encoder and the observation not five frames, or when it is told
    /// and the observation tells nothing: whoever starts the trial sees to that.
    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let inputs = self.inputs(observation, tick, &mut |_| ());
        let action = decode(&self.decision.decide(&inputs).output_counts, self.network.steps);
        self.delayed(action)
    }
}
