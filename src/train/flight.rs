//! One world of a round: flights one after the other in one room.

use std::collections::VecDeque;

use crate::closed_loop::planner::{ACTIONS, Knowledge, Planner, Terrain};
use crate::closed_loop::{End, Trial, TrialConfig};
use crate::coding::robot_state;
use crate::net::eem_san::ROBOT_STATE;
use crate::policy::{Action, EventFrame};
use crate::rng::{Streams, stream};
use crate::train::end_to_end::Sight;
use crate::world::World;
use crate::world::pairs::{Pair, PairRules, generate_pairs};

/// Reward for the goal (SAN's training script).
pub const REWARD_GOAL: f32 = 30.0;

/// Reward per metre that the goal comes nearer.
pub const REWARD_PER_M: f32 = 15.0;

/// Pairs drawn per room.
const PAIRS: usize = 32;

/// What one control tick showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What was seen before.
    pub observation: Vec<f32>,
    /// What drove the wheels.
    pub action: [f32; 2],
    /// SAN's reward.
    pub reward: f32,
    /// What was seen then.
    pub next_observation: Vec<f32>,
    /// What the critics see before, [`INSIGHT`] numbers.
    pub insight: Vec<f32>,
    /// What they see then.
    pub next_insight: Vec<f32>,
    /// 1 after goal or contact, 0 otherwise (also at the tick limit); see [`Step::joined`].
    pub terminal: f32,
    /// Whether the flight ended, for whatever reason.
    pub ended: bool,
    /// What the planner would have done.
    pub planned: [f32; 2],
    /// The planner's cost of each of its actions.
    pub costs: [f32; ACTIONS],
}

impl Step {
    /// The first of some steps of one flight, with the rewards of all of them, discounted, and what
    /// was seen after the last one. The discount of the steps between is worked into `terminal`.
    ///
    /// Panics without a step.
    pub fn joined<'s>(steps: impl IntoIterator<Item = &'s Step>, discount: f32) -> Step {
        let mut steps = steps.into_iter();
        let mut joined = steps.next().expect("a step").clone();
        let mut kept = 1.0;
        for step in steps {
            kept *= discount;
            joined.reward += kept * step.reward;
            joined.next_observation.clone_from(&step.next_observation);
            joined.next_insight.clone_from(&step.next_insight);
            joined.terminal = step.terminal;
            joined.ended = step.ended;
        }
        joined.terminal = 1.0 - kept * (1.0 - joined.terminal);
        joined
    }
}

/// Movers that the critics know of.
const KNOWN_MOVERS: usize = 3;

/// Numbers that the critics see: robot and laser state, then for each of the nearest movers its
/// place (of 4 m) and velocity (of 2 m/s) in the robot's frame, then the time to the goal (of 30 s)
/// and the clearance (of 1 m).
pub const INSIGHT: usize = ROBOT_STATE + 4 * KNOWN_MOVERS + 2;

/// Distances of known movers are given in this unit, and no farther.
const KNOWN_M: f64 = 4.0;

/// Ends of flights, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ends {
    /// Reached the goal.
    pub goal: u64,
    /// Touched something.
    pub contact: u64,
    /// Ran out of ticks.
    pub time: u64,
}

impl Ends {
    /// All flights that ended.
    pub fn total(&self) -> u64 {
        self.goal + self.contact + self.time
    }

    /// Adds those of another world.
    pub fn add(&mut self, other: &Self) {
        self.goal += other.goal;
        self.contact += other.contact;
        self.time += other.time;
    }
}

/// How late the actor is, as on a chip that streams.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Delays {
    /// Control ticks between an observation and the action that it leads to; until the first
    /// action the wheels are told to stand.
    pub action_ticks: usize,
    /// Newest event frames that the DVS state lacks.
    pub readout_frames: usize,
}

/// Puts `new` at the end and drops all but the newest `len`.
pub(super) fn keep<T>(line: &mut VecDeque<T>, new: T, len: usize) {
    line.push_back(new);
    while line.len() > len {
        line.pop_front();
    }
}

/// A world and the flight under way in it.
#[derive(Debug)]
pub struct Flight<'w> {
    world: &'w World,
    terrain: &'w Terrain,
    config: TrialConfig,
    knowledge: Knowledge,
    pairs: Vec<Pair>,
    /// Random streams of the world in this round.
    streams: Streams,
    number: usize,
    trial: Trial<'w>,
    planner: Planner<'w>,
    sight: Option<Sight>,
    delays: Delays,
    /// DVS states after the latest frames, oldest first.
    states: VecDeque<Vec<f32>>,
    /// What was seen in the latest ticks, oldest first: the first is what the actor acts on now.
    seen: VecDeque<Vec<f32>>,
    observation: Vec<f32>,
    insight: Vec<f32>,
    planned: Action,
    costs: [f32; ACTIONS],
    /// Reward for contact; SAN's is -20.
    pub reward_contact: f32,
    /// Ends so far in this round.
    pub ends: Ends,
    /// The last tick's step.
    pub last: Option<Step>,
    /// The last tick's event frames.
    pub frames: Vec<EventFrame>,
}

impl<'w> Flight<'w> {
    /// The first flight in `world`. With a sight the robot has a camera. `knowledge` is the
    /// planner's.
    ///
    /// Panics when `config` is out of its limits or the room has no room for trials; both are
    /// checked before training.
    pub fn new(
        (world, terrain): (&'w World, &'w Terrain),
        (config, knowledge): (&TrialConfig, Knowledge),
        distance_m_min: f64,
        (sight, delays): (Option<Sight>, Delays),
        streams: Streams,
    ) -> Self {
        let rules = PairRules { distance_m_min, clearance_m: 0.45 };
        let pairs = generate_pairs(world, PAIRS, rules, streams).expect("rooms have free places");
        let trial = begin(world, &pairs[0], config, streams, 0);
        let speed_m_per_s = config.wheel_speed_m_per_s_max;
        let planner = Planner::new(terrain, pairs[0].goal, speed_m_per_s, knowledge);
        let mut flight = Self {
            world,
            terrain,
            config: config.clone(),
            knowledge,
            pairs,
            streams,
            number: 0,
            trial,
            planner,
            sight,
            delays,
            states: VecDeque::new(),
            seen: VecDeque::new(),
            observation: Vec::new(),
            insight: Vec::new(),
            planned: Action { left: 0.0, right: 0.0 },
            costs: [0.0; ACTIONS],
            reward_contact: -20.0,
            ends: Ends::default(),
            last: None,
            frames: Vec::new(),
        };
        flight.see();
        flight.plan();
        flight
    }

    /// What the actor acts on now: robot and laser state, then the DVS state, of as many ticks ago
    /// as its actions are late.
    pub fn observation(&self) -> &[f32] {
        &self.observation
    }

    /// What the planner would do now.
    pub fn planned(&self) -> Action {
        self.planned
    }

    /// What the critics see now, what the planner would do, and its cost of each action.
    pub(super) fn taught(&self) -> (&[f32], [f32; 2], &[f32; ACTIONS]) {
        (&self.insight, floats(self.planned), &self.costs)
    }

    /// What turns event frames into the DVS state, when there is a camera.
    pub(super) fn sight(&mut self) -> Option<&mut Sight> {
        self.sight.as_mut()
    }

    /// The flight under way.
    pub fn trial(&self) -> &Trial<'w> {
        &self.trial
    }

    /// Number of the flight in this round.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Streams of the world in this round.
    pub fn streams(&self) -> Streams {
        self.streams
    }

    /// Whether no observation has led to an action yet, so that the wheels stand.
    pub fn waits(&self) -> bool {
        self.seen.len() <= self.delays.action_ticks
    }

    /// One control tick with `action`; a flight that ends is followed by the next one. While the
    /// flight waits the wheels stand instead, and there is no step.
    pub fn drive(&mut self, action: Action) {
        let waits = self.waits();
        let action = if waits { Action { left: 0.0, right: 0.0 } } else { action };
        let before_m = self.trial.goal_distance_m();
        self.trial.drive(action);
        let nearer_m = (before_m - self.trial.goal_distance_m()) as f32;
        let (reward, terminal) = match self.trial.end() {
            Some(End::Goal) => (REWARD_GOAL, 1.0),
            Some(End::Hit(_)) => (self.reward_contact, 1.0),
            Some(End::TimeOut) | None => (REWARD_PER_M * nearer_m, 0.0),
        };
        let observation = std::mem::take(&mut self.observation);
        let insight = std::mem::take(&mut self.insight);
        let (planned, costs) = (floats(self.planned), self.costs);
        let action = floats(action);
        self.frames = self.see();
        self.last = (!waits).then(|| Step {
            observation,
            action,
            reward,
            next_observation: self.observation.clone(),
            insight,
            next_insight: self.insight.clone(),
            terminal,
            ended: self.trial.end().is_some(),
            planned,
            costs,
        });
        if self.trial.end().is_some() {
            self.count();
            self.restart();
        }
        self.plan();
    }

    fn count(&mut self) {
        match self.trial.end() {
            Some(End::Goal) => self.ends.goal += 1,
            Some(End::Hit(_)) => self.ends.contact += 1,
            Some(End::TimeOut) | None => self.ends.time += 1,
        }
    }

    fn restart(&mut self) {
        // A start that a mover touches at once is skipped.
        loop {
            self.number += 1;
            let pair = &self.pairs[self.number % PAIRS];
            self.trial = begin(self.world, pair, &self.config, self.streams, self.number);
            if self.trial.end().is_none() || self.number > 10 * PAIRS {
                break;
            }
        }
        let goal = self.trial.goal();
        let speed_m_per_s = self.config.wheel_speed_m_per_s_max;
        self.planner = Planner::new(self.terrain, goal, speed_m_per_s, self.knowledge);
        if let Some(sight) = &mut self.sight {
            sight.reset();
        }
        self.states.clear();
        self.seen.clear();
        self.see();
    }

    fn see(&mut self) -> Vec<EventFrame> {
        let seen = self.trial.observe();
        let mut observation = robot_state(&seen).to_vec();
        self.insight = self.insight(&observation);
        if let Some(sight) = &mut self.sight {
            let late = self.delays.readout_frames;
            for frame in &seen.frames {
                if self.states.is_empty() {
                    self.states.push_back(sight.resting_state());
                }
                sight.step(frame);
                keep(&mut self.states, sight.state(), late + 1);
            }
            observation.extend(self.states.front().expect("the robot has a camera"));
        }
        observation.extend(seen.told);
        keep(&mut self.seen, observation, self.delays.action_ticks + 1);
        self.observation.clone_from(&self.seen[0]);
        seen.frames
    }

    fn insight(&self, observation: &[f32]) -> Vec<f32> {
        let (pose, step) = (self.trial.robot().pose(), self.trial.steps());
        let movers = self
            .world
            .arena()
            .movers()
            .iter()
            .map(|mover| (mover.position(step) - pose.position, mover.velocity_m_per_s(step)));
        let mut movers: Vec<_> = movers.collect();
        movers.sort_by(|a, b| a.0.norm_squared().total_cmp(&b.0.norm_squared()));
        let mut insight = observation[..ROBOT_STATE].to_vec();
        for index in 0..KNOWN_MOVERS {
            let known = movers.get(index).filter(|(way, _)| way.norm() < KNOWN_M);
            let numbers = known.map_or([[1.0, 1.0], [0.0, 0.0]], |(way, velocity)| {
                [pose.ahead_and_left(way / KNOWN_M), pose.ahead_and_left(velocity / 2.0)]
            });
            insight.extend(numbers.as_flattened().iter().map(|number| *number as f32));
        }
        insight.push((self.planner.time_from(&pose) / 30.0).min(2.0) as f32);
        insight.push(self.terrain.clearance_m(pose.position).min(1.0) as f32);
        insight
    }

    fn plan(&mut self) {
        (self.planned, self.costs) = self.planner.plan(&self.trial);
    }
}

/// Two numbers for the two wheels.
fn floats(action: Action) -> [f32; 2] {
    [action.left as f32, action.right as f32]
}

fn begin<'w>(
    world: &'w World,
    pair: &Pair,
    config: &TrialConfig,
    streams: Streams,
    number: usize,
) -> Trial<'w> {
    let streams = Streams::new(streams.at(stream::EXPLORATION, number as u64).bits(), 0);
    Trial::new(world, pair.start, pair.goal, config, streams).expect("settings were checked")
}

#[cfg(test)]
#[path = "flight_tests.rs"]
mod tests;
