//! Training of the actor: flights in random rooms, a replay memory, updates in between.
//!
//! The plain recipe is DDPG with SAN's reward. Departures, each a setting of a phase: several
//! worlds side by side, two critics, and a teacher, a planner, whose actions or whose
//! costs the actor follows, an average of the actor over its updates, and a choice among the rounds'
//! actors by flights of their own.
//!
//! Networks with dynamic thresholds carry a state from tick to tick. What they saw in the last
//! ticks before an observation is remembered with it, and an update runs through that first, without
//! gradients, from rest or from where the flight began: a departure from the published code, which
//! goes on from whatever state the update before has left.

use crate::closed_loop::TrialConfig;
use crate::closed_loop::planner::{Knowledge, LEVELS, Terrain};
use crate::net::{EemSan, EventEncoder};
use crate::nn::adam::AdamSettings;
use crate::nn::population::{SpikeDraws, sum_of_steps};
use crate::nn::shards::Shards;
use crate::nn::soft_update::soft_update;
use crate::nn::{
    ActorState, CriticShape, Ddpg, DdpgSettings, Guide, History, Losses, Objective, Parameters,
    Rectangular, StateError, StateReader, StateWriter, Transitions,
};
use crate::policy::{Action, TOLD};
use crate::reference::FloatEncoder;
use crate::rng::{Streams, stream};
use crate::train::config::{ActorConfig, Phase, Teacher, TrainConfigError};
use crate::train::end_to_end::{EndToEnd, Sight, Stretch};
use crate::train::flight::{Delays, Ends, Flight, INSIGHT};
use crate::train::recent::Recent;
use crate::train::replay::{Batch, Replay};
use crate::train::selection::Selection;
use crate::train::{add_encoder, on_each, rooms};
use crate::world::World;
use crate::world::dvs::CAMERA_DEG;

/// Parts of a batch whose gradients are summed; threads do not change the result.
const SHARDS: usize = 2;

/// Numbers of a row of the history.
pub const HISTORY: usize = 6;

/// The actor in training.
#[derive(Debug)]
pub struct ActorTraining {
    config: ActorConfig,
    trial: TrialConfig,
    threads: usize,
    encoder: Option<FloatEncoder>,
    /// The encoder again, as it is saved.
    saved_encoder: Option<EventEncoder>,
    /// The encoder in place of those two, when it learns.
    learned: Option<EndToEnd>,
    ddpg: Ddpg,
    /// Moving average of the actor, when there is one.
    average: Option<Parameters>,
    selection: Option<Selection>,
    /// What each comparison found.
    shares: Vec<f32>,
    replay: Replay,
    round: u64,
    /// Control ticks of all worlds so far.
    ticks: u64,
    history: Vec<[f32; HISTORY]>,
}

/// What training is doing, for whoever measures time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// All worlds moved on by a control tick.
    Flown,
    /// An update was made.
    Updated,
}

/// A round in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActorReport {
    /// Ends of flights that the actor drove.
    pub ends: Ends,
    /// Mean loss of critics and actor.
    pub losses: Losses,
    /// Mean reward per control tick.
    pub reward: f64,
    /// Mean loss of the actor on what was just seen, when the encoder learns with it.
    pub seen: Option<f64>,
    /// Mean spike rate of the encoder's layers there, when it was not left as it is.
    pub rate: Option<f64>,
}

/// What a comparison of actors found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selected {
    /// Share of the flights that the actor of now brings to their goals.
    pub share: f32,
    /// Whether that is more than any before it.
    pub best: bool,
}

impl ActorTraining {
    /// Fresh networks: of the configured variant, else EEM-SAN's with an encoder, the laser-only
    /// control's without.
    ///
    /// Errors: settings of the flights out of their limits; a variant that does not go with the
    /// encoder or its absence, or with delays; an encoder should learn, and there is none, or one
    /// that cannot ([`ActorConfig::check_encoder`]).
    pub fn new(
        config: &ActorConfig,
        encoder: Option<&EventEncoder>,
        threads: usize,
    ) -> Result<Self, TrainConfigError> {
        if config.end_to_end.is_some() && encoder.is_none() {
            return Err(TrainConfigError::NoEncoder);
        }
        encoder.map_or(Ok(()), |encoder| config.check_encoder(encoder.kind))?;
        let variant = config.variant(encoder.is_some())?;
        let latent = encoder.map(|encoder| encoder.readout.bias.len());
        let shape = config.shape(variant, latent.or(config.told.then_some(TOLD)));
        let first = config.phase(0).0;
        let settings = DdpgSettings {
            actor: AdamSettings::with_rate(first.actor_rate),
            critic: AdamSettings::with_rate(first.critic_rate),
            discount: config.discount,
            tau: config.tau,
            twin_critics: config.twin_critics,
            shards: Shards { count: SHARDS, threads },
        };
        let width = shape.observations();
        let seen = if config.insight { INSIGHT } else { width };
        let critic =
            CriticShape { hidden: vec![config.critic_neurons; 3], ..CriticShape::eem_san(seen) };
        let trial = config.flight.trial("configuration", encoder.is_some())?;
        let trial = TrialConfig { told: config.told, ..trial };
        let late = config.delays() != Delays::default();
        let selection = config.selection.as_ref();
        let ddpg = Ddpg::new(&settings, &shape, &critic, config.seed);
        Ok(Self {
            selection: selection.map(|rules| Selection::new(rules, &trial, config.seed, late)),
            shares: Vec::new(),
            trial,
            threads,
            encoder: encoder.map(FloatEncoder::new),
            saved_encoder: encoder.cloned(),
            average: (config.average > 0.0).then(|| ddpg.actor.online.clone()),
            learned: config
                .end_to_end
                .as_ref()
                .and(encoder)
                .map(|encoder| EndToEnd::new(encoder, config.average > 0.0)),
            ddpg,
            replay: Replay::new(width, INSIGHT, config.memory)
                .with_history(config.history_ticks(variant)),
            round: 0,
            ticks: 0,
            history: Vec::new(),
            config: config.clone(),
        })
    }

    /// Rounds done.
    pub fn round(&self) -> u64 {
        self.round
    }

    /// Rounds in all.
    pub fn rounds(&self) -> u64 {
        self.config.rounds()
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.ddpg.updates()
    }

    /// Control ticks flown, all worlds together.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// For every round: share of the actor's flights that reached the goal, share that touched
    /// something, reward per tick, critic's and actor's loss, updates so far.
    pub fn history(&self) -> &[[f32; HISTORY]] {
        &self.history
    }

    /// One round; `each` is called after every tick and every update.
    pub fn run_round(&mut self, mut each: impl FnMut(Stage)) -> ActorReport {
        let (phase, through) = self.config.phase(self.round);
        let phase = phase.clone();
        self.ddpg.set_rates(phase.actor_rate, phase.critic_rate);
        let worlds = self.worlds(&phase);
        let mut flights = self.flights(&worlds, &phase);
        let mut recent = vec![Recent::default(); flights.len()];
        let mut state =
            self.ddpg.actor_layers().rest(&self.ddpg.actor.online.values, flights.len());
        let (mut sums, mut stretch) = (Sums::default(), Stretch::default());
        for tick in 0..self.config.flight.ticks_per_round {
            if self.see(&mut flights, &mut stretch, &phase, &mut sums) {
                each(Stage::Updated);
            }
            self.fly(&mut flights, &phase, through, tick, &mut state);
            for flight in &flights {
                sums.reward += flight.last.as_ref().map_or(0.0, |step| f64::from(step.reward));
            }
            for (flight, recent) in flights.iter().zip(&mut recent) {
                let (n, discount) = (self.config.reward_steps, self.config.discount);
                recent.add(flight.last.clone(), n, discount, &mut self.replay);
            }
            self.ticks += flights.len() as u64;
            each(Stage::Flown);
            for _ in 0..phase.updates_per_tick {
                if self.replay.len() < self.config.batch {
                    break;
                }
                sums.add(self.update(&phase));
                each(Stage::Updated);
            }
        }
        let mut ends = Ends::default();
        flights.iter().for_each(|flight| ends.add(&flight.ends));
        let ticks = self.config.flight.ticks_per_round * flights.len() as u64;
        self.finish(ends, &sums, ticks)
    }

    /// Keeps in mind what the actor is about to act on; whether actor and encoder learned from the
    /// latest of it.
    fn see(
        &mut self,
        flights: &mut [Flight<'_>],
        stretch: &mut Stretch,
        phase: &Phase,
        sums: &mut Sums,
    ) -> bool {
        let (Some(settings), Some(learned)) = (&self.config.end_to_end, &mut self.learned) else {
            return false;
        };
        stretch.add(flights);
        if (stretch.ticks as u64) < settings.stretch_ticks {
            return false;
        }
        let stretch = std::mem::take(stretch);
        let streams = Streams::new(self.config.seed, 4);
        let shown = stretch.repeated(settings.draws);
        let (transitions, guide) = (shown.transitions(self.config.insight), shown.guide());
        let (loss, d_shown) =
            self.ddpg.update_seeing(&transitions, &guide, &objective(phase), &streams);
        let d_seen = sum_of_steps(&d_shown, stretch.observations.len());
        sums.seen.push(loss);
        if phase.encoder_rate > 0.0 {
            let step = (phase.encoder_rate, settings.rate_weight);
            sums.rates.push(learned.update(flights, &stretch, &d_seen, step, self.threads));
        }
        self.average();
        true
    }

    fn finish(&mut self, ends: Ends, sums: &Sums, ticks: u64) -> ActorReport {
        let losses = sums.mean();
        let reward = sums.reward / ticks.max(1) as f64;
        let share = |n: u64| n as f32 / ends.total().max(1) as f32;
        self.history.push([
            share(ends.goal),
            share(ends.contact),
            reward as f32,
            losses.critic as f32,
            losses.actor as f32,
            self.updates() as f32,
        ]);
        self.round += 1;
        let (seen, rate) = (mean(&sums.seen), mean(&sums.rates));
        ActorReport { ends, losses, reward, seen, rate }
    }

    fn worlds(&self, phase: &Phase) -> Vec<(World, Terrain)> {
        let n = self.config.flight.worlds as u64;
        let streams = Streams::new(self.config.seed, 2);
        rooms::places(&phase.rooms, &streams, self.round * n, n, self.threads)
    }

    fn flights<'w>(&self, worlds: &'w [(World, Terrain)], phase: &Phase) -> Vec<Flight<'w>> {
        let n = worlds.len() as u64;
        let sights = self.sights(worlds.len(), phase.encoder_rate > 0.0);
        let flight = |((index, (world, terrain)), sight): ((usize, &'w (World, Terrain)), _)| {
            let streams = Streams::new(self.config.seed, (2 << 32) + self.round * n + index as u64);
            let sight = (sight, self.config.delays());
            let drive = (&self.trial, self.knowledge());
            let distance_m = phase.rooms.distance_m_min;
            let mut flight = Flight::new((world, terrain), drive, distance_m, sight, streams);
            flight.reward_contact = self.config.reward_contact;
            flight
        };
        worlds.iter().enumerate().zip(sights).map(flight).collect()
    }

    fn sights(&self, n: usize, learning: bool) -> Vec<Option<Sight>> {
        match &self.learned {
            Some(learned) => learned.sights(n, learning).into_iter().map(Some).collect(),
            None => vec![self.encoder.clone().map(Sight::Fixed); n],
        }
    }

    /// What the teacher knows of movers.
    fn knowledge(&self) -> Knowledge {
        let sees = self.encoder.is_some() || self.config.told;
        match self.config.teacher {
            Teacher::Everything => Knowledge::Everything,
            Teacher::Sensors if sees => Knowledge::Camera { field_of_view_deg: CAMERA_DEG },
            Teacher::Sensors => Knowledge::Laser,
        }
    }

    /// One control tick of all worlds: the actor's action with noise, or the planner's. The actor's
    /// `state` goes on, afresh for flights that ended.
    fn fly(
        &self,
        flights: &mut [Flight<'_>],
        phase: &Phase,
        through: f64,
        tick: u64,
        state: &mut ActorState,
    ) {
        let seen: Vec<f32> =
            flights.iter().flat_map(|flight| flight.observation()).copied().collect();
        let streams = Streams::new(self.config.seed, 3);
        let update = (self.round << 20) + tick;
        let draws =
            SpikeDraws { streams: &streams, name: stream::POPULATION_SPIKES, update, first: 0 };
        let (actor, mut draws) = (self.ddpg.actor_layers(), draws.samples(flights.len()));
        let values = &self.ddpg.actor.online.values;
        let acted = actor.forward_from::<Rectangular>(values, &seen, state, &mut draws);
        let [first, last] = phase.exploration;
        let noise = first + (last - first) * through;
        let mut work: Vec<(&mut Flight<'_>, [f32; 2])> = flights
            .iter_mut()
            .zip(acted.action.chunks_exact(2))
            .map(|(flight, action)| (flight, [action[0], action[1]]))
            .collect();
        on_each(&mut work, self.threads, |(flight, action)| {
            let number = flight.number() as u64;
            let mut choice = flight.streams().at(stream::EXPLORATION, (2 << 32) + number);
            let mut draw = flight.streams().at(stream::EXPLORATION, (1 << 32) + tick);
            let planned = flight.planned();
            let own = Action { left: f64::from(action[0]), right: f64::from(action[1]) };
            let base = if choice.bernoulli(phase.planner_share) { planned } else { own };
            let mut mix = |a: f64| (draw.gaussian() * noise + (1.0 - noise) * a).clamp(0.0, 1.0);
            flight.drive(Action { left: mix(base.left), right: mix(base.right) });
        });
        for (row, flight) in flights.iter().enumerate() {
            if flight.last.as_ref().is_some_and(|step| step.ended) {
                state.restart(row);
            }
        }
    }

    fn update(&mut self, phase: &Phase) -> Losses {
        let streams = Streams::new(self.config.seed, 4);
        let batch = self.replay.draw(self.config.batch, &streams, self.ddpg.updates());
        let objective = objective(phase);
        let guide = Guide { levels: LEVELS, actions: &batch.planned, costs: &batch.costs };
        let mut transitions = transitions(&batch, self.replay.history_ticks());
        if self.config.insight {
            transitions.judged = Some([&batch.insights, &batch.next_insights]);
        }
        let losses =
            self.ddpg.update_guided(&transitions, Some(&guide), &objective, phase.critic, &streams);
        self.average();
        losses
    }

    /// Averages move towards what learns, after an update.
    fn average(&mut self) {
        if let Some(average) = &mut self.average {
            let online = &self.ddpg.actor.online.values;
            soft_update(&mut average.values, online, self.config.average);
        }
        if let Some(learned) = &mut self.learned {
            learned.follow(self.config.average);
        }
    }

    /// After a round that is due for it: lets the actor, as it would be saved, fly the flights of
    /// the selection. `None` also where the training has diverged.
    pub fn select(&mut self) -> Option<Selected> {
        let (rules, selection) = (self.config.selection.as_ref()?, self.selection.as_ref()?);
        if self.round / rules.every == self.shares.len() as u64 {
            return None;
        }
        let bytes = self.weights();
        // Weights that are no numbers do not fly; whoever writes a checkpoint says that they are none.
        let network = EemSan::from_bytes("actor", "actor in training", &bytes).ok()?;
        let share = selection.share(&network, self.threads);
        let best = self.shares.iter().all(|before| *before < share);
        self.shares.push(share);
        Some(Selected { share, best })
    }

    /// For every round since the first comparison: what the last one found.
    pub fn shares(&self) -> Vec<f32> {
        let every = self.config.selection.as_ref().map_or(1, |rules| rules.every);
        let share = |round: u64| self.shares.get((round / every) as usize - 1).copied();
        (every..=self.round).filter_map(share).collect()
    }

    /// Begins with the actor of a weights file in place of a fresh one.
    ///
    /// Errors: a tensor is missing or has another shape.
    pub fn begin_with(&mut self, weights: &StateReader) -> Result<(), StateError> {
        self.ddpg.begin_with(weights, "actor.")?;
        if let Some(average) = &mut self.average {
            average.clone_from(&self.ddpg.actor.online);
        }
        Ok(())
    }

    /// Adds everything that the next round depends on.
    pub fn write(&self, state: &mut StateWriter) {
        self.ddpg.write(state);
        self.replay.write(state);
        state.count("round", self.round);
        state.count("ticks", self.ticks);
        let rows: Vec<f32> = self.history.iter().flatten().copied().collect();
        state.floats("history", &[self.history.len(), HISTORY], &rows);
        if let Some(average) = &self.average {
            state.parameters("average.", average);
        }
        if let Some(learned) = &self.learned {
            learned.write(state);
        }
        if self.selection.is_some() {
            state.count("selections", self.shares.len() as u64);
            state.floats("shares", &[self.shares.len()], &self.shares);
        }
    }

    /// Takes over what [`ActorTraining::write`] wrote for the same configuration.
    ///
    /// Errors: a tensor is missing or has another shape.
    pub fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let (round, ticks) = (state.count("round")?, state.count("ticks")?);
        let rows = state.floats("history", &[round as usize, HISTORY])?;
        let mut average = self.average.clone();
        if let Some(average) = &mut average {
            state.parameters("average.", average)?;
        }
        let mut shares = Vec::new();
        if self.selection.is_some() {
            shares = state.floats("shares", &[state.count("selections")? as usize])?;
        }
        let mut learned = self.learned.clone();
        learned.as_mut().map_or(Ok(()), |learned| learned.read(state))?;
        self.ddpg.read(state)?;
        self.replay.read(state)?;
        self.learned = learned;
        (self.average, self.shares) = (average, shares);
        (self.round, self.ticks) = (round, ticks);
        let row = |row: &[f32]| std::array::from_fn(|index| row[index]);
        self.history = rows.chunks_exact(HISTORY).map(row).collect();
        Ok(())
    }

    /// The weights file of the actor, of its average if there is one, with its encoder, for
    /// [`EemSan::from_bytes`].
    pub fn weights(&self) -> Vec<u8> {
        let mut state = StateWriter::default();
        state.parameters("actor.", self.average.as_ref().unwrap_or(&self.ddpg.actor.online));
        if self.config.told {
            state.floats("actor.told", &[1], &[TOLD as f32]);
        }
        let learned = self.learned.as_ref().map(EndToEnd::encoder);
        if let Some(encoder) = learned.as_ref().or(self.saved_encoder.as_ref()) {
            add_encoder(&mut state, encoder);
        }
        state.bytes()
    }
}

fn objective(phase: &Phase) -> Objective {
    Objective {
        value: phase.value,
        imitation: phase.imitation,
        cost: phase.cost,
        cost_max: phase.cost_max,
    }
}

fn transitions(batch: &Batch, ticks: usize) -> Transitions<'_> {
    let [before, next] = &batch.pasts;
    let history = [before, next].map(|past| History {
        ticks,
        observations: &past.observations,
        known: &past.known,
    });
    Transitions {
        observations: &batch.observations,
        actions: &batch.actions,
        rewards: &batch.rewards,
        next_observations: &batch.next_observations,
        terminal: &batch.terminal,
        judged: None,
        history: (ticks > 0).then_some(history),
    }
}

/// Sums over a round.
#[derive(Debug, Default)]
struct Sums {
    critic: f64,
    actor: f64,
    updates: u64,
    reward: f64,
    /// Losses on what was just seen, when the encoder learns.
    seen: Vec<f64>,
    /// The encoder's spike rates.
    rates: Vec<f64>,
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

impl Sums {
    fn add(&mut self, losses: Losses) {
        self.critic += losses.critic;
        self.actor += losses.actor;
        self.updates += 1;
    }

    fn mean(&self) -> Losses {
        let n = self.updates.max(1) as f64;
        Losses { critic: self.critic / n, actor: self.actor / n }
    }
}
