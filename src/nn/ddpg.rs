//! Deep deterministic policy gradient: one update of critic and actor from a batch.

use std::ops::Range;

use crate::nn::actor::{Actor, ActorShape, ActorTrace, History};
use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::critic::{Critic, CriticShape};
use crate::nn::parameters::Parameters;
use crate::nn::population::SpikeDraws;
use crate::nn::shards::{self, Shards};
use crate::nn::soft_update::soft_update;
use crate::nn::spike::Rectangular;
use crate::nn::state::{StateError, StateReader, StateWriter};
use crate::nn::variant::Form;
use crate::rng::{Streams, stream};

/// Factor on the initial weights of a branch that joins a trained actor.
const QUIET_BRANCH: f32 = 0.1;

/// Settings of the update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DdpgSettings {
    /// Optimiser of the actor.
    pub actor: AdamSettings,
    /// Optimiser of each critic.
    pub critic: AdamSettings,
    /// Discount of later rewards.
    pub discount: f32,
    /// Part of the online networks that target networks take over per update.
    pub tau: f32,
    /// Two critics, the smaller of whose target values counts: a departure from the paper.
    pub twin_critics: bool,
    /// Division of a batch.
    pub shards: Shards,
}

impl Default for DdpgSettings {
    /// The paper's table; tau 0.01 from SAN.
    fn default() -> Self {
        Self {
            actor: AdamSettings::with_rate(1e-4),
            critic: AdamSettings::with_rate(1e-4),
            discount: 0.99,
            tau: 0.01,
            twin_critics: false,
            shards: Shards::default(),
        }
    }
}

/// A batch of transitions.
///
/// Shapes: observations [rows, dimensions], actions [rows, actions], the others `[rows]`.
#[derive(Debug, Clone, Copy)]
pub struct Transitions<'a> {
    /// What was seen.
    pub observations: &'a [f32],
    /// What was done, in 0 to 1.
    pub actions: &'a [f32],
    /// What it gave.
    pub rewards: &'a [f32],
    /// What was seen then.
    pub next_observations: &'a [f32],
    /// 1 where the episode ended there (goal or collision, not the step limit), else 0; between
    /// them where the reward is that of several steps, whose discount is worked in.
    pub terminal: &'a [f32],
    /// What the critics see in place of the observations before and after, [rows, their
    /// dimensions]: a departure from the paper, for critics that know more than the actor.
    pub judged: Option<[&'a [f32]; 2]>,
    /// What was seen before the observations before and after, for actors that carry a state: it is
    /// run through without gradients first.
    pub history: Option<[History<'a>; 2]>,
}

impl<'a> Transitions<'a> {
    /// What the critics see before and after.
    fn judged(&self) -> [&'a [f32]; 2] {
        self.judged.unwrap_or([self.observations, self.next_observations])
    }
}

/// What a teacher says about the rows of a batch: a departure from the paper.
///
/// The teacher gives a cost for each of `levels x levels` actions, whose components are evenly
/// spaced from 0 to 1, and names the cheapest.
#[derive(Debug, Clone, Copy)]
pub struct Guide<'a> {
    /// Actions per component.
    pub levels: usize,
    /// The cheapest action, [rows, 2].
    pub actions: &'a [f32],
    /// First component's level times `levels` plus the second one's, [rows, levels * levels].
    pub costs: &'a [f32],
}

/// What the actor is to make small: a weighted sum of three terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Objective {
    /// Weight of `-Q / mean |Q|` (deep deterministic policy gradient; the scale is that of
    /// Fujimoto and Gu 2021, TD3+BC), the mean over the shard of the batch. Negative: of plain `-Q`.
    pub value: f32,
    /// Weight of the squared distance to the teacher's action.
    pub imitation: f32,
    /// Weight of the teacher's cost of the actor's action.
    pub cost: f32,
    /// Costs this much above the cheapest, and higher ones, count as this much.
    pub cost_max: f32,
}

impl Objective {
    /// Plain DDPG.
    pub const PLAIN: Self = Self { value: -1.0, imitation: 0.0, cost: 0.0, cost_max: 1.0 };
}

/// What an update measured before it changed anything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses {
    /// Mean squared error of the critic, mean over critics.
    pub critic: f64,
    /// What the actor makes small: the weighted terms of its [`Objective`], mean over the batch.
    pub actor: f64,
}

/// A network that learns, its target and its optimiser.
#[derive(Debug, Clone, PartialEq)]
pub struct Learner {
    /// Parameters that learn.
    pub online: Parameters,
    /// Parameters that follow.
    pub target: Parameters,
    /// Moments.
    pub adam: Adam,
}

impl Learner {
    fn new(online: Parameters) -> Self {
        let adam = Adam::new(online.values.len());
        Self { target: online.clone(), online, adam }
    }

    fn write(&self, state: &mut StateWriter, name: &str) {
        state.parameters(&format!("{name}."), &self.online);
        state.parameters(&format!("target.{name}."), &self.target);
        state.adam(&format!("adam.{name}."), self.online.layout(), &self.adam);
    }

    fn read(&mut self, state: &StateReader, name: &str) -> Result<(), StateError> {
        state.parameters(&format!("{name}."), &mut self.online)?;
        state.parameters(&format!("target.{name}."), &mut self.target)?;
        let layout = self.online.layout().clone();
        state.adam(&format!("adam.{name}."), &layout, &mut self.adam)
    }
}

/// Actor, critics, their targets and optimisers.
#[derive(Debug, Clone)]
pub struct Ddpg {
    settings: DdpgSettings,
    actor_layers: Actor,
    critic_layers: Critic,
    /// The actor.
    pub actor: Learner,
    /// One critic, or two.
    pub critics: Vec<Learner>,
    updates: u64,
}

impl Ddpg {
    /// Fresh networks.
    ///
    /// Initial weights are draws of the run with seed `seed`: trial 0 for the actor, 1 and 2 for
    /// the critics. Panics when the shapes do not fit each other.
    pub fn new(
        settings: &DdpgSettings,
        actor: &ActorShape,
        critic: &CriticShape,
        seed: u64,
    ) -> Self {
        assert_eq!(actor.actions, critic.actions, "actions of actor and critic");
        let (actor_layers, critic_layers) = (Actor::new(actor), Critic::new(critic));
        let critics = if settings.twin_critics { 1..=2 } else { 1..=1 };
        let fresh = |trial| Learner::new(critic_layers.initial(&Streams::new(seed, trial)));
        Self {
            settings: *settings,
            actor: Learner::new(actor_layers.initial(&Streams::new(seed, 0))),
            critics: critics.map(fresh).collect(),
            actor_layers,
            critic_layers,
            updates: 0,
        }
    }

    /// Layers of the actor.
    pub fn actor_layers(&self) -> &Actor {
        &self.actor_layers
    }

    /// Changes the step lengths of both optimisers.
    pub fn set_rates(&mut self, actor: f32, critic: f32) {
        self.settings.actor.learning_rate = actor;
        self.settings.critic.learning_rate = critic;
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// One step of every critic towards `r + discount (1 - terminal) Q'(s', a'(s'))`, one step of
    /// the actor up `mean Q(s, a(s))` of the first critic, then soft updates of all targets.
    ///
    /// Spikes of the population code are drawn anew from `streams`, by update and row.
    pub fn update(&mut self, batch: &Transitions, streams: &Streams) -> Losses {
        self.update_guided(batch, None, &Objective::PLAIN, true, streams)
    }

    /// As [`Ddpg::update`], with another objective of the actor; critics stay as they are unless
    /// `judge` is set (their loss is 0 then).
    pub fn update_guided(
        &mut self,
        batch: &Transitions,
        guide: Option<&Guide>,
        objective: &Objective,
        judge: bool,
        streams: &Streams,
    ) -> Losses {
        let critic = if judge { self.update_critics(batch, streams) } else { 0.0 };
        let (actor, _) = self.update_actor(batch, guide, objective, streams);
        for learner in self.critics.iter_mut().chain([&mut self.actor]) {
            let tau = self.settings.tau;
            soft_update(&mut learner.target.values, &learner.online.values, tau);
        }
        self.updates += 1;
        Losses { critic, actor }
    }

    /// An update of the actor alone, for what made its observations to learn as well: gives its
    /// loss, and the gradient of the observations, [rows, dimensions].
    pub fn update_seeing(
        &mut self,
        batch: &Transitions,
        guide: &Guide,
        objective: &Objective,
        streams: &Streams,
    ) -> (f64, Vec<f32>) {
        let seen = self.update_actor(batch, Some(guide), objective, streams);
        let Learner { target, online, .. } = &mut self.actor;
        soft_update(&mut target.values, &online.values, self.settings.tau);
        self.updates += 1;
        seen
    }

    fn update_critics(&mut self, batch: &Transitions, streams: &Streams) -> f64 {
        let rows = batch.rewards.len();
        let parts =
            self.settings.shards.run(rows, |range| self.critic_shard(batch, streams, range));
        let loss = parts.iter().flatten().map(|part| part.1).sum::<f64>();
        let mut by_critic: Vec<Vec<Vec<f32>>> = self.critics.iter().map(|_| Vec::new()).collect();
        for part in parts {
            part.into_iter().zip(&mut by_critic).for_each(|(part, all)| all.push(part.0));
        }
        for (critic, gradients) in self.critics.iter_mut().zip(by_critic) {
            let gradient = shards::sum(gradients);
            critic.adam.step(&self.settings.critic, &mut critic.online.values, &gradient);
        }
        loss / self.critics.len() as f64
    }

    /// Gradient and part of the loss of each critic.
    fn critic_shard(
        &self,
        batch: &Transitions,
        streams: &Streams,
        range: Range<usize>,
    ) -> Vec<(Vec<f32>, f64)> {
        let wanted = self.wanted(batch, streams, &range);
        let observations = part(batch.judged()[0], batch, &range);
        let actions = part(batch.actions, batch, &range);
        let one = |critic: &Learner| {
            let values = &critic.online.values;
            let trace = self.critic_layers.forward(values, observations, actions);
            let errors = trace.value.iter().zip(&wanted).map(|(value, wanted)| value - wanted);
            let rows = batch.rewards.len() as f32;
            let d_value: Vec<f32> = errors.clone().map(|error| 2.0 * error / rows).collect();
            let mut gradient = self.critic_layers.layout().zeros();
            self.critic_layers.backward(values, &mut gradient, &trace, &d_value);
            (gradient, errors.map(|e| f64::from(e * e)).sum::<f64>() / f64::from(rows))
        };
        self.critics.iter().map(one).collect()
    }

    /// What the critics should say.
    fn wanted(&self, batch: &Transitions, streams: &Streams, range: &Range<usize>) -> Vec<f32> {
        let next = part(batch.next_observations, batch, range);
        let draws = self.draws(streams, stream::POPULATION_SPIKES_NEXT, range);
        let history = batch.history.map(|[_, next]| next.rows(range));
        let acted = self.act(&self.actor.target.values, next, history, &draws);
        let judged = part(batch.judged()[1], batch, range);
        let mut least = vec![f32::INFINITY; range.len()];
        for critic in &self.critics {
            let trace = self.critic_layers.forward(&critic.target.values, judged, &acted.action);
            least
                .iter_mut()
                .zip(&trace.value)
                .for_each(|(least, value)| *least = least.min(*value));
        }
        let outcomes = batch.rewards[range.clone()].iter().zip(&batch.terminal[range.clone()]);
        let wanted = outcomes.zip(least).map(|((reward, terminal), value)| {
            reward + self.settings.discount * (1.0 - terminal) * value
        });
        wanted.collect()
    }

    fn update_actor(
        &mut self,
        batch: &Transitions,
        guide: Option<&Guide>,
        objective: &Objective,
        streams: &Streams,
    ) -> (f64, Vec<f32>) {
        let rows = batch.rewards.len();
        let shard = |range| self.actor_shard(batch, guide, objective, streams, range);
        let parts = self.settings.shards.run(rows, shard);
        let (mut loss, mut gradients, mut d_observations) = (0.0, Vec::new(), Vec::new());
        for (gradient, d_seen, part) in parts {
            gradients.push(gradient);
            d_observations.extend(d_seen);
            loss += part;
        }
        let gradient = shards::sum(gradients);
        self.actor.adam.step(&self.settings.actor, &mut self.actor.online.values, &gradient);
        self.actor_layers.project(&mut self.actor.online.values);
        (loss, d_observations)
    }

    /// Gradients of parameters and observations, and part of the loss.
    fn actor_shard(
        &self,
        batch: &Transitions,
        guide: Option<&Guide>,
        objective: &Objective,
        streams: &Streams,
        range: Range<usize>,
    ) -> (Vec<f32>, Vec<f32>, f64) {
        let observations = part(batch.observations, batch, &range);
        let draws = self.draws(streams, stream::POPULATION_SPIKES, &range);
        let values = &self.actor.online.values;
        let history = batch.history.map(|[before, _]| before.rows(&range));
        let acted = self.act(values, observations, history, &draws);
        let rows = batch.rewards.len() as f32;
        let (mut d_action, mut loss) = (vec![0.0; acted.action.len()], 0.0);
        if objective.value != 0.0 {
            let critic = &self.critics[0].online.values;
            let seen = part(batch.judged()[0], batch, &range);
            let judged = self.critic_layers.forward(critic, seen, &acted.action);
            let size: f32 = judged.value.iter().map(|q| q.abs()).sum::<f32>() / range.len() as f32;
            let scale = match objective.value {
                plain if plain < 0.0 => -plain,
                scaled => scaled / size.max(1e-3),
            };
            let d_value = vec![-scale / rows; range.len()];
            d_action = self.critic_layers.backward_action(critic, &judged, &d_value);
            let value = judged.value.iter().map(|q| f64::from(*q)).sum::<f64>();
            loss -= f64::from(scale) * value / f64::from(rows);
        }
        if let Some(guide) = guide {
            loss += guide.follow(objective, &acted.action, &range, rows, &mut d_action);
        }
        let mut gradient = self.actor_layers.layout().zeros();
        let d_seen = self.actor_layers.backward(values, &mut gradient, &acted, &d_action);
        (gradient, d_seen, loss)
    }

    /// The actor's pass, from the state that `history` leaves.
    fn act(
        &self,
        values: &[f32],
        observations: &[f32],
        history: Option<History<'_>>,
        draws: &SpikeDraws,
    ) -> ActorTrace<Rectangular> {
        let Some(history) = history else {
            return self.actor_layers.forward(values, observations, draws);
        };
        let mut draws = draws.samples(history.known.len());
        let mut state = self.actor_layers.after(values, &history, &mut draws);
        self.actor_layers.forward_from(values, observations, &mut state, &mut draws)
    }

    fn draws<'a>(
        &self,
        streams: &'a Streams,
        name: &'static str,
        range: &Range<usize>,
    ) -> SpikeDraws<'a> {
        SpikeDraws { streams, name, update: self.updates, first: range.start }
    }

    /// Takes the actor's parameters, `prefix` before each name, for the actor and its target.
    ///
    /// A laser-only actor will do for one with events: its DVS branch stays as it is, with weights
    /// and biases small enough that it is nearly silent at first.
    ///
    /// Errors: a network of another form; a tensor is missing or has another shape; nothing is
    /// changed then.
    pub fn begin_with(&mut self, state: &StateReader, prefix: &str) -> Result<(), StateError> {
        let expected = self.actor_layers.shape().form;
        if let Some(found) = Form::of(state, prefix).filter(|found| *found != expected) {
            return Err(StateError::Form { file: state.file().to_owned(), found, expected });
        }
        let mut online = self.actor.online.clone();
        let of_events = |name: &str| name.contains(".dvs.");
        let entries = self.actor.online.layout().entries().iter();
        let with_events = entries
            .filter(|entry| of_events(&entry.name))
            .any(|entry| state.has(&format!("{prefix}{}", entry.name)));
        for entry in self.actor.online.layout().entries() {
            let values = entry.slot.of_mut(&mut online.values);
            if of_events(&entry.name) && !with_events {
                let scaled = entry.name.ends_with(".weight") || entry.name.ends_with(".bias");
                let factor = if scaled { QUIET_BRANCH } else { 1.0 };
                values.iter_mut().for_each(|value| *value *= factor);
                continue;
            }
            let read = state.floats(&format!("{prefix}{}", entry.name), &entry.shape)?;
            values.copy_from_slice(&read);
        }
        self.actor.target = online.clone();
        self.actor.online = online;
        Ok(())
    }

    /// Adds everything that the next update depends on.
    pub fn write(&self, state: &mut StateWriter) {
        self.actor.write(state, "actor");
        for (index, critic) in self.critics.iter().enumerate() {
            critic.write(state, &format!("critic{}", index + 1));
        }
        state.count("updates", self.updates);
    }

    /// Takes over what [`Ddpg::write`] wrote for the same shapes.
    ///
    /// Errors: a tensor is missing or has another shape; nothing is changed then.
    pub fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let mut fresh = self.clone();
        fresh.actor.read(state, "actor")?;
        for (index, critic) in fresh.critics.iter_mut().enumerate() {
            critic.read(state, &format!("critic{}", index + 1))?;
        }
        fresh.updates = state.count("updates")?;
        *self = fresh;
        Ok(())
    }
}

impl Guide<'_> {
    /// Part of the loss that the teacher makes; its gradient is added to `d_action`.
    fn follow(
        &self,
        objective: &Objective,
        actions: &[f32],
        range: &Range<usize>,
        rows: f32,
        d_action: &mut [f32],
    ) -> f64 {
        let mut loss = 0.0f32;
        for ((row, action), d) in
            range.clone().zip(actions.chunks_exact(2)).zip(d_action.chunks_exact_mut(2))
        {
            let wanted = &self.actions[2 * row..2 * row + 2];
            for ((d, action), wanted) in d.iter_mut().zip(action).zip(wanted) {
                let off = action - wanted;
                loss += objective.imitation * off * off / rows;
                *d += 2.0 * objective.imitation * off / rows;
            }
            if objective.cost != 0.0 {
                let (cost, slopes) = self.cost(row, action, objective.cost_max);
                loss += objective.cost * cost / rows;
                d.iter_mut().zip(slopes).for_each(|(d, slope)| *d += objective.cost * slope / rows);
            }
        }
        f64::from(loss)
    }

    /// Cost of an action above the cheapest, at its nearest level, and the slopes there: from the
    /// level below to the one above.
    fn cost(&self, row: usize, action: &[f32], most: f32) -> (f32, [f32; 2]) {
        let n = self.levels;
        let costs = &self.costs[row * n * n..(row + 1) * n * n];
        let least = costs.iter().copied().fold(f32::INFINITY, f32::min);
        let cost = |left: usize, right: usize| (costs[left * n + right] - least).min(most);
        let last = n - 1;
        let level = |a: f32| ((a * last as f32).round().max(0.0) as usize).min(last);
        let (left, right) = (level(action[0]), level(action[1]));
        let around = |at: usize| (at.saturating_sub(1), (at + 1).min(last));
        let slope = |low: f32, high: f32, (from, to): (usize, usize)| {
            (high - low) * last as f32 / (to - from) as f32
        };
        let (l, r) = (around(left), around(right));
        let slopes = [
            slope(cost(l.0, right), cost(l.1, right), l),
            slope(cost(left, r.0), cost(left, r.1), r),
        ];
        (cost(left, right), slopes)
    }
}

/// Rows `range` of a part of the batch.
fn part<'a>(all: &'a [f32], batch: &Transitions, range: &Range<usize>) -> &'a [f32] {
    let width = all.len() / batch.rewards.len();
    &all[range.start * width..range.end * width]
}

#[cfg(test)]
#[path = "ddpg_tests.rs"]
mod tests;
