//! Deep deterministic policy gradient: one update of critic and actor from a batch.

use std::ops::Range;

use crate::nn::actor::{Actor, ActorShape, ActorTrace};
use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::critic::{Critic, CriticShape};
use crate::nn::parameters::Parameters;
use crate::nn::population::SpikeDraws;
use crate::nn::shards::{self, Shards};
use crate::nn::soft_update::soft_update;
use crate::nn::spike::Rectangular;
use crate::nn::state::{StateError, StateReader, StateWriter};
use crate::rng::{Streams, stream};

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
    /// 1 where the episode ended there (goal or collision, not the step limit), else 0.
    pub terminal: &'a [f32],
}

/// What an update measured before it changed anything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses {
    /// Mean squared error of the critic, mean over critics.
    pub critic: f64,
    /// `-mean Q` of the actor's own actions.
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
    /// Fresh networks; the critics see the actor's observations.
    ///
    /// Initial weights are draws of the run with seed `seed`: trial 0 for the actor, 1 and 2 for
    /// the critics. Panics when the shapes do not fit each other.
    pub fn new(
        settings: &DdpgSettings,
        actor: &ActorShape,
        critic: &CriticShape,
        seed: u64,
    ) -> Self {
        assert_eq!(actor.observations(), critic.observations, "observations of actor and critic");
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

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// One step of every critic towards `r + discount (1 - terminal) Q'(s', a'(s'))`, one step of
    /// the actor up `mean Q(s, a(s))` of the first critic, then soft updates of all targets.
    ///
    /// Spikes of the population code are drawn anew from `streams`, by update and row.
    pub fn update(&mut self, batch: &Transitions, streams: &Streams) -> Losses {
        let critic = self.update_critics(batch, streams);
        let actor = self.update_actor(batch, streams);
        for learner in self.critics.iter_mut().chain([&mut self.actor]) {
            let tau = self.settings.tau;
            soft_update(&mut learner.target.values, &learner.online.values, tau);
        }
        self.updates += 1;
        Losses { critic, actor }
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
        let observations = part(batch.observations, batch, &range);
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
        let acted: ActorTrace<Rectangular> =
            self.actor_layers.forward(&self.actor.target.values, next, &draws);
        let mut least = vec![f32::INFINITY; range.len()];
        for critic in &self.critics {
            let trace = self.critic_layers.forward(&critic.target.values, next, &acted.action);
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

    fn update_actor(&mut self, batch: &Transitions, streams: &Streams) -> f64 {
        let rows = batch.rewards.len();
        let parts = self.settings.shards.run(rows, |range| self.actor_shard(batch, streams, range));
        let (gradients, losses): (Vec<_>, Vec<f64>) = parts.into_iter().unzip();
        let gradient = shards::sum(gradients);
        self.actor.adam.step(&self.settings.actor, &mut self.actor.online.values, &gradient);
        self.actor_layers.project(&mut self.actor.online.values);
        losses.iter().sum()
    }

    fn actor_shard(
        &self,
        batch: &Transitions,
        streams: &Streams,
        range: Range<usize>,
    ) -> (Vec<f32>, f64) {
        let observations = part(batch.observations, batch, &range);
        let draws = self.draws(streams, stream::POPULATION_SPIKES, &range);
        let values = &self.actor.online.values;
        let acted: ActorTrace<Rectangular> =
            self.actor_layers.forward(values, observations, &draws);
        let critic = &self.critics[0].online.values;
        let judged = self.critic_layers.forward(critic, observations, &acted.action);
        let rows = batch.rewards.len() as f32;
        let d_value = vec![-1.0 / rows; range.len()];
        let d_action = self.critic_layers.backward_action(critic, &judged, &d_value);
        let mut gradient = self.actor_layers.layout().zeros();
        self.actor_layers.backward(values, &mut gradient, &acted, &d_action);
        let loss = -judged.value.iter().map(|q| f64::from(*q)).sum::<f64>() / f64::from(rows);
        (gradient, loss)
    }

    fn draws<'a>(
        &self,
        streams: &'a Streams,
        name: &'static str,
        range: &Range<usize>,
    ) -> SpikeDraws<'a> {
        SpikeDraws { streams, name, update: self.updates, first: range.start }
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

/// Rows `range` of a part of the batch.
fn part<'a>(all: &'a [f32], batch: &Transitions, range: &Range<usize>) -> &'a [f32] {
    let width = all.len() / batch.rewards.len();
    &all[range.start * width..range.end * width]
}

#[cfg(test)]
#[path = "ddpg_tests.rs"]
mod tests;
