//! Configuration files of training (TOML).

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::closed_loop::{ConfigError, TrialConfig};
use crate::net::EncoderKind;
use crate::nn::hsvae;
use crate::nn::variant::{Thresholds, VARIANTS, Variant};
use crate::nn::{ActorShape, DecoderKind, HsvaeShape};
use crate::train::flight::Delays;
use crate::train::rooms::RoomRules;
use crate::train::selection::SelectionConfig;
use crate::world::dvs::CameraConfig;
use crate::world::robot::Actuators;
use crate::world::shown::shown;

/// What the population code of the DVS state covers, deviations.
const LATENT_RANGE: (f32, f32) = (-3.0, 3.0);

/// A configuration that cannot be used.
#[derive(Debug, Error)]
pub enum TrainConfigError {
    /// Not TOML, or not of the expected form.
    #[error("{file}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// A number outside of its range.
    #[error("{file}: {name} is {}, must be {min}..={max}", shown(*value))]
    Range {
        /// The file.
        file: String,
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// Text that is not understood.
    #[error("{file}: {message}")]
    Text {
        /// The file.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// An encoder should learn with the actor, and there is none.
    #[error(
        "end_to_end: no encoder found, one expected to begin with; give --encoder, as \
         `spikeloop train hsvae` writes it"
    )]
    NoEncoder,
    /// An encoder that a setting of the actor's training does not go with.
    #[error(
        "{setting}: the encoder is {kind}, HSVAE expected: {reason}; take an encoder of \
         `spikeloop train hsvae`, or a configuration without it"
    )]
    EncoderKind {
        /// The setting.
        setting: &'static str,
        /// Kind of the encoder.
        kind: &'static str,
        /// Why not.
        reason: &'static str,
    },
    /// A setting of the flights.
    #[error("{file}: {source}")]
    Trial {
        /// The file.
        file: String,
        /// Which one.
        source: ConfigError,
    },
}

/// How flights are flown in training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightConfig {
    /// Fastest wheel speed.
    pub v_max_m_per_s: f64,
    /// Actuators, a preset or `v:DELAY+TAU,w:DELAY+TAU`.
    pub actuators: String,
    /// Control ticks after which a flight is cut off.
    pub ticks_max: u64,
    /// Worlds side by side.
    pub worlds: usize,
    /// Control ticks of each world per round; a checkpoint can be made after each round.
    pub ticks_per_round: u64,
}

/// What an auto-encoder's decoder learns to show after a control tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shows {
    /// What the camera saw (the paper).
    #[default]
    Frames,
    /// Where the movers in view are and how they move, which the simulator tells
    /// ([`crate::train::mover_picture`]).
    Movers,
}

/// Training of the auto-encoder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HsvaeConfig {
    /// Which auto-encoder.
    #[serde(default)]
    pub kind: EncoderKind,
    /// Seed of all random streams.
    pub seed: u64,
    /// Rounds in all.
    pub rounds: u64,
    /// Flights.
    pub flight: FlightConfig,
    /// Rooms.
    #[serde(default)]
    pub rooms: RoomRules,
    /// Step length of Adam.
    pub learning_rate: f32,
    /// The share of it that is left at the end; it falls evenly with the updates.
    #[serde(default = "one")]
    pub learning_rate_end: f32,
    /// Weight of the divergence (1 in eq. 5).
    pub divergence_weight: f32,
    /// Weight of the mean spike rate.
    pub rate_weight: f32,
    /// Factor on the encoder's initial weights.
    pub encoder_gain: f32,
    /// What is added to the initial weights of a neuron, all inputs together.
    pub encoder_lean: f32,
    /// Whether `mu` begins as the last voltages, in place of random mixtures of them.
    pub aligned_latent: bool,
    /// Factor on the initial weights of FSVAE's decoder.
    #[serde(default = "one")]
    pub decoder_gain: f32,
    /// What is added to the initial bias of the decoder's last layer.
    #[serde(default)]
    pub decoder_bias: f32,
    /// Share of noise in the action that drives.
    pub exploration: f64,
    /// What the decoder is to show.
    #[serde(default)]
    pub shows: Shows,
    /// Where it shows what was seen: 1 for the last frame of a tick (the paper), more for the mean
    /// of the tick's frames, blurred over squares of so many pixels.
    pub blur_px: usize,
    /// Control ticks of a stretch that gradients go back through.
    pub stretch_ticks: usize,
}

/// Training of the actor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActorConfig {
    /// Seed of all random streams.
    pub seed: u64,
    /// The network.
    #[serde(default)]
    pub network: NetworkConfig,
    /// Flights.
    pub flight: FlightConfig,
    /// Transitions of a batch.
    pub batch: usize,
    /// Transitions that are remembered.
    pub memory: usize,
    /// What the planner knows.
    #[serde(default)]
    pub teacher: Teacher,
    /// Neurons of each hidden layer of the critics: 512 in the plain recipe.
    pub critic_neurons: usize,
    /// Discount of later rewards.
    pub discount: f32,
    /// Part that target networks take over per update.
    pub tau: f32,
    /// Two critics in place of one.
    pub twin_critics: bool,
    /// Whether critics see where the movers are and how far it is, in place of what the actor sees.
    pub insight: bool,
    /// Rewards that are summed before a critic judges the rest: 1 in the plain recipe.
    pub reward_steps: usize,
    /// Reward for contact: -20 in the plain recipe.
    pub reward_contact: f32,
    /// Control ticks between an observation and its action: 0, and 2 on a chip that streams
    /// ([`crate::net::EemSan::streamed_ticks`]).
    #[serde(default)]
    pub action_delay_ticks: usize,
    /// Newest event frames that the DVS state lacks: 0, and 4 on a chip that streams
    /// ([`crate::net::EemSan::streamed_frames`]).
    #[serde(default)]
    pub readout_delay_frames: usize,
    /// Part of the learning actor that a moving average of it takes over per update; the average
    /// is what is saved to fly. 0: the actor of the last update is saved.
    #[serde(default)]
    pub average: f32,
    /// Whether the simulator tells the actor of movers in place of an encoder: what it learns then is
    /// what a faultless encoder would be worth.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub told: bool,
    /// Lets the encoder learn through the actor; by default it stays as it is.
    #[serde(default)]
    pub end_to_end: Option<EndToEndConfig>,
    /// Flights that choose the best actor; none by default.
    #[serde(default)]
    pub selection: Option<SelectionConfig>,
    /// Phases, one after the other.
    pub phases: Vec<Phase>,
}

/// An encoder that learns with the actor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndToEndConfig {
    /// Control ticks between two steps of the encoder; gradients go back no further.
    pub stretch_ticks: u64,
    /// Times that the actor sees each observation of such a step, with draws of its own of the
    /// population code: the mean gradient is less noisy, and actors are small beside encoders.
    pub draws: usize,
    /// Weight of the mean spike rate of the encoder's layers in the objective.
    pub rate_weight: f32,
}

/// The network that is trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NetworkConfig {
    /// Its row of [`VARIANTS`]; by default `eem-san` with an encoder, `laser-only` without.
    pub variant: Option<String>,
    /// Thresholds at the start, for good where they are fixed.
    pub threshold: f64,
    /// Ticks before an observation that an update runs through first, where thresholds are dynamic;
    /// two leave 0.75^10, 6 %, of a voltage from before, and less of currents and thresholds.
    pub history_ticks: usize,
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self { variant: None, threshold: 0.5, history_ticks: 2 }
    }
}

/// What the planner that teaches knows of movers; it always knows the static obstacles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Teacher {
    /// Where they will be.
    #[default]
    Everything,
    /// What the sensors of the actor show: camera and laser with an encoder or when it is told, the
    /// laser otherwise.
    Sensors,
}

/// A phase of the actor's training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// Rounds.
    pub rounds: u64,
    /// Rooms.
    #[serde(default)]
    pub rooms: RoomRules,
    /// Updates per control tick of all worlds.
    pub updates_per_tick: u64,
    /// Whether critics learn.
    pub critic: bool,
    /// Weight of the critic's judgement in the actor's objective; negative for plain DDPG.
    pub value: f32,
    /// Weight of the distance to the planner's action.
    pub imitation: f32,
    /// Weight of the planner's cost of the actor's action.
    pub cost: f32,
    /// Largest cost above the cheapest action that counts, s.
    pub cost_max: f32,
    /// Share of flights that the planner drives.
    pub planner_share: f64,
    /// Share of noise in the action at the first and at the last round of the phase.
    pub exploration: [f64; 2],
    /// Step length of the actor's Adam.
    pub actor_rate: f32,
    /// Step length of the critics' Adam.
    pub critic_rate: f32,
    /// Step length of the encoder's Adam, where it learns; 0 by default.
    #[serde(default)]
    pub encoder_rate: f32,
}

impl FlightConfig {
    /// Settings of the flights, with a camera or without.
    ///
    /// Errors: a text or number that is not allowed; `file` is the name that errors mention.
    pub fn trial(&self, file: &str, camera: bool) -> Result<TrialConfig, TrainConfigError> {
        let actuators: Actuators =
            self.actuators.parse().map_err(|e: crate::world::robot::ActuatorsError| {
                TrainConfigError::Text { file: file.to_owned(), message: e.to_string() }
            })?;
        range(file, "flight.worlds", self.worlds as f64, 1.0, 256.0)?;
        range(file, "flight.ticks_per_round", self.ticks_per_round as f64, 1.0, 1e6)?;
        let config = TrialConfig {
            actuators,
            ticks_max: self.ticks_max,
            camera: camera.then(CameraConfig::default),
            ..TrialConfig::eem_san(self.v_max_m_per_s)
        };
        let checked = config.check();
        checked.map_err(|source| TrainConfigError::Trial { file: file.to_owned(), source })?;
        Ok(config)
    }
}

impl RoomRules {
    fn check(&self, file: &str) -> Result<(), TrainConfigError> {
        let pairs = [
            ("rooms.side_m", self.side_m, 8.0, 40.0),
            ("rooms.obstacles_per_100_m2", self.obstacles_per_100_m2, 0.0, 15.0),
            ("rooms.movers_per_100_m2", self.movers_per_100_m2, 0.0, 10.0),
            ("rooms.mover_speed_m_per_s", self.mover_speed_m_per_s, 0.1, 5.0),
        ];
        for (name, [low, high], min, max) in pairs {
            range(file, name, low, min, max)?;
            range(file, name, high, low, max)?;
        }
        range(file, "rooms.gap_m", self.gap_m, 0.5, 3.0)?;
        range(file, "rooms.distance_m_min", self.distance_m_min, 1.0, 0.6 * self.side_m[0])
    }
}

impl HsvaeConfig {
    /// Reads a configuration; `file` is the name that errors mention.
    ///
    /// Errors: not TOML, an unknown key, a number outside of its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, TrainConfigError> {
        let config: Self = parse(file, text)?;
        config.flight.trial(file, true)?;
        config.rooms.check(file)?;
        range(file, "rounds", config.rounds as f64, 1.0, 1e6)?;
        range(file, "learning_rate", f64::from(config.learning_rate), 0.0, 1.0)?;
        range(file, "learning_rate_end", f64::from(config.learning_rate_end), 0.0, 1.0)?;
        range(file, "divergence_weight", f64::from(config.divergence_weight), 0.0, 1e3)?;
        range(file, "rate_weight", f64::from(config.rate_weight), 0.0, 1e3)?;
        range(file, "encoder_gain", f64::from(config.encoder_gain), 0.01, 100.0)?;
        range(file, "encoder_lean", f64::from(config.encoder_lean), 0.0, 100.0)?;
        range(file, "decoder_gain", f64::from(config.decoder_gain), 0.01, 100.0)?;
        range(file, "decoder_bias", f64::from(config.decoder_bias), -20.0, 20.0)?;
        if !config.kind.spikes() && config.rate_weight > 0.0 {
            let message = format!(
                "rate_weight is {}, must be 0 with kind = \"{}\": artificial neurons have no spikes",
                config.rate_weight,
                config.kind.name()
            );
            return Err(TrainConfigError::Text { file: file.to_owned(), message });
        }
        range(file, "exploration", config.exploration, 0.0, 1.0)?;
        range(file, "blur_px", config.blur_px as f64, 1.0, 31.0)?;
        if config.blur_px.is_multiple_of(2) {
            let message =
                format!("blur_px is {}, must be odd: a square about a pixel", config.blur_px);
            return Err(TrainConfigError::Text { file: file.to_owned(), message });
        }
        let round = config.flight.ticks_per_round as f64;
        range(file, "stretch_ticks", config.stretch_ticks as f64, 1.0, round.min(64.0))?;
        Ok(config)
    }

    /// The same work for a few seconds: it shows that everything runs, and trains nothing.
    pub fn quick(mut self) -> Self {
        self.rounds = 2;
        self.flight = FlightConfig { worlds: 2, ticks_per_round: 3, ..self.flight };
        self.stretch_ticks = self.stretch_ticks.min(3);
        self
    }

    /// Updates of a round.
    pub fn updates_per_round(&self) -> u64 {
        self.flight.ticks_per_round / self.stretch_ticks as u64
    }

    /// Step length of Adam after so many updates.
    pub fn learning_rate_after(&self, updates: u64) -> f32 {
        let all = self.rounds * self.updates_per_round();
        self.learning_rate * (1.0 - updates as f32 / all.max(1) as f32).max(self.learning_rate_end)
    }

    /// Sizes of the network.
    pub fn shape(&self) -> HsvaeShape {
        let (encoder, decoder) = made_of(self.kind);
        HsvaeShape {
            encoder,
            decoder,
            divergence_weight: self.divergence_weight,
            rate_weight: self.rate_weight,
            encoder_gain: self.encoder_gain,
            encoder_lean: self.encoder_lean,
            aligned_latent: self.aligned_latent,
            decoder_gain: self.decoder_gain,
            decoder_bias: self.decoder_bias,
            ..HsvaeShape::eem_san()
        }
    }
}

impl ActorConfig {
    /// Reads a configuration; `file` is the name that errors mention.
    ///
    /// Errors: not TOML, an unknown key, a number outside of its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, TrainConfigError> {
        let config: Self = parse(file, text)?;
        config.flight.trial(file, true)?;
        config.network.check(file)?;
        range(file, "batch", config.batch as f64, 2.0, 65536.0)?;
        range(file, "memory", config.memory as f64, config.batch as f64, 1e6)?;
        range(file, "critic_neurons", config.critic_neurons as f64, 1.0, 8192.0)?;
        range(file, "discount", f64::from(config.discount), 0.0, 1.0)?;
        range(file, "tau", f64::from(config.tau), 0.0, 1.0)?;
        range(file, "reward_steps", config.reward_steps as f64, 1.0, 200.0)?;
        range(file, "reward_contact", f64::from(config.reward_contact), -1e4, 0.0)?;
        range(file, "action_delay_ticks", config.action_delay_ticks as f64, 0.0, 10.0)?;
        range(file, "readout_delay_frames", config.readout_delay_frames as f64, 0.0, 50.0)?;
        range(file, "average", f64::from(config.average), 0.0, 1.0)?;
        if config.told && config.readout_delay_frames > 0 {
            let message = "told: there are no frames to be late; readout_delay_frames must be 0";
            return Err(TrainConfigError::Text { file: file.into(), message: message.into() });
        }
        if let Some(learned) = &config.end_to_end {
            let (ticks, late) =
                (learned.stretch_ticks as f64, config.delays() != Delays::default());
            let round = config.flight.ticks_per_round as f64;
            range(file, "end_to_end.stretch_ticks", ticks, 1.0, round.min(64.0))?;
            range(file, "end_to_end.draws", learned.draws as f64, 1.0, 64.0)?;
            range(file, "end_to_end.rate_weight", f64::from(learned.rate_weight), 0.0, 1e3)?;
            if late {
                let message = "end_to_end: action_delay_ticks and readout_delay_frames must be 0";
                return Err(TrainConfigError::Text { file: file.into(), message: message.into() });
            }
        }
        if let Some(selection) = &config.selection {
            selection.rooms.check(file)?;
            range(file, "selection.every", selection.every as f64, 1.0, 1e6)?;
            range(file, "selection.n_rooms", selection.n_rooms as f64, 1.0, 1000.0)?;
            let flights = selection.flights_per_room as f64;
            range(file, "selection.flights_per_room", flights, 1.0, 1000.0)?;
        }
        range(file, "number of phases", config.phases.len() as f64, 1.0, 100.0)?;
        config.phases.iter().try_for_each(|phase| phase.check(file))?;
        Ok(config)
    }

    /// The same phases for a few seconds: it shows that everything runs, and trains nothing.
    pub fn quick(mut self) -> Self {
        self.batch = self.batch.min(16);
        self.reward_steps = self.reward_steps.min(3);
        self.flight = FlightConfig { worlds: 2, ticks_per_round: 14, ..self.flight };
        if let Some(learned) = &mut self.end_to_end {
            learned.stretch_ticks = learned.stretch_ticks.min(14);
        }
        self.phases.iter_mut().for_each(|phase| phase.rounds = 1);
        if let Some(selection) = &mut self.selection {
            (selection.every, selection.n_rooms, selection.flights_per_room) = (1, 2, 1);
        }
        self
    }

    /// The network that is trained, with an encoder of events or without; one that is told has no
    /// encoder, and is of those with events.
    ///
    /// Errors: no such network; one that does not go with the encoder or its absence, or with
    /// delays; told, and there is an encoder.
    pub fn variant(&self, encoder: bool) -> Result<&'static Variant, TrainConfigError> {
        if self.told && encoder {
            let message = "told: the simulator tells what an encoder would; leave --encoder out";
            let file = "configuration".to_owned();
            return Err(TrainConfigError::Text { file, message: message.to_owned() });
        }
        let events = encoder || self.told;
        let default = if events { "eem-san" } else { "laser-only" };
        let variant = named("configuration", self.network.variant.as_deref().unwrap_or(default))?;
        let name = variant.name;
        let late = self.delays() != Delays::default();
        let problem = match variant.events {
            true if !events => "takes events, and there is no encoder; give one with --encoder",
            false if events => "takes no events; leave --encoder out",
            _ if late && variant.form.thresholds == Thresholds::Dynamic => {
                "carries a state from tick to tick and cannot be late; set action_delay_ticks and \
                 readout_delay_frames to 0"
            }
            _ => return Ok(variant),
        };
        let message = format!("network.variant {name} {problem}");
        Err(TrainConfigError::Text { file: "configuration".to_owned(), message })
    }

    /// The same with other thresholds at the start.
    ///
    /// Errors: a threshold out of its range.
    pub fn with_threshold(mut self, threshold: f64) -> Result<Self, TrainConfigError> {
        self.network.threshold = threshold;
        self.network.check("--threshold")?;
        Ok(self)
    }

    /// Whether an encoder of this kind goes with the configuration.
    ///
    /// Errors: it should learn with the actor, or be read late, and is not HSVAE.
    pub fn check_encoder(&self, kind: EncoderKind) -> Result<(), TrainConfigError> {
        let (setting, reason) = match self {
            _ if kind.is_hsvae() => return Ok(()),
            Self { end_to_end: Some(_), .. } => {
                ("end_to_end", "only neurons that spike and keep their state learn end to end")
            }
            Self { readout_delay_frames: 1.., .. } => {
                ("readout_delay_frames", "without state from tick to tick nothing streams")
            }
            _ => return Ok(()),
        };
        Err(TrainConfigError::EncoderKind { setting, kind: kind.title(), reason })
    }

    /// Sizes of the actor; `latent` are the dimensions of the DVS state, when there is one.
    pub fn shape(&self, variant: &Variant, latent: Option<usize>) -> ActorShape {
        let dvs = vec![LATENT_RANGE; latent.unwrap_or(0)];
        let (form, threshold) = (variant.form, self.network.threshold as f32);
        ActorShape { form, dvs, threshold, ..ActorShape::eem_san() }
    }

    /// Ticks that the replay memory keeps before each observation.
    pub fn history_ticks(&self, variant: &Variant) -> usize {
        match variant.form.thresholds {
            Thresholds::Dynamic => self.network.history_ticks,
            Thresholds::Learned | Thresholds::Fixed => 0,
        }
    }

    /// How late the actor is.
    pub fn delays(&self) -> Delays {
        Delays { action_ticks: self.action_delay_ticks, readout_frames: self.readout_delay_frames }
    }

    /// Rounds of all phases.
    pub fn rounds(&self) -> u64 {
        self.phases.iter().map(|phase| phase.rounds).sum()
    }

    /// The phase of round `round`, and how far through it the round is, in 0 to 1.
    pub fn phase(&self, round: u64) -> (&Phase, f64) {
        let mut first = 0;
        for phase in &self.phases {
            if round < first + phase.rounds {
                return (phase, (round - first) as f64 / phase.rounds as f64);
            }
            first += phase.rounds;
        }
        (self.phases.last().expect("there is a phase"), 1.0)
    }
}

impl NetworkConfig {
    fn check(&self, file: &str) -> Result<(), TrainConfigError> {
        range(file, "network.threshold", self.threshold, 0.02, 0.99)?;
        range(file, "network.history_ticks", self.history_ticks as f64, 0.0, 16.0)?;
        self.variant.iter().try_for_each(|name| named(file, name).map(|_| ()))
    }
}

fn named(file: &str, name: &str) -> Result<&'static Variant, TrainConfigError> {
    Variant::named(name).ok_or_else(|| {
        let known = VARIANTS.map(|variant| variant.name).join(", ");
        let message = format!("network.variant {name:?}: no such network (there is: {known})");
        TrainConfigError::Text { file: file.to_owned(), message }
    })
}

impl Phase {
    fn check(&self, file: &str) -> Result<(), TrainConfigError> {
        self.rooms.check(file)?;
        range(file, "phases.rounds", self.rounds as f64, 1.0, 1e6)?;
        range(file, "phases.updates_per_tick", self.updates_per_tick as f64, 0.0, 1000.0)?;
        range(file, "phases.value", f64::from(self.value), -1e3, 1e3)?;
        range(file, "phases.imitation", f64::from(self.imitation), 0.0, 1e3)?;
        range(file, "phases.cost", f64::from(self.cost), 0.0, 1e3)?;
        range(file, "phases.cost_max", f64::from(self.cost_max), 0.01, 1e3)?;
        range(file, "phases.planner_share", self.planner_share, 0.0, 1.0)?;
        range(file, "phases.exploration", self.exploration[0], 0.0, 1.0)?;
        range(file, "phases.exploration", self.exploration[1], 0.0, 1.0)?;
        range(file, "phases.actor_rate", f64::from(self.actor_rate), 0.0, 1.0)?;
        range(file, "phases.critic_rate", f64::from(self.critic_rate), 0.0, 1.0)?;
        range(file, "phases.encoder_rate", f64::from(self.encoder_rate), 0.0, 1.0)
    }
}

/// What encoder and decoder of an auto-encoder are made of.
pub fn made_of(kind: EncoderKind) -> (hsvae::EncoderKind, DecoderKind) {
    match kind {
        EncoderKind::Hsvae => (hsvae::EncoderKind::Spiking, DecoderKind::Artificial),
        EncoderKind::Avae => (hsvae::EncoderKind::Artificial, DecoderKind::Artificial),
        EncoderKind::Fsvae => (hsvae::EncoderKind::PerTick, DecoderKind::Spiking),
    }
}

fn one() -> f32 {
    1.0
}

fn parse<T: serde::de::DeserializeOwned>(file: &str, text: &str) -> Result<T, TrainConfigError> {
    let syntax = |e: toml::de::Error| TrainConfigError::Syntax {
        file: file.to_owned(),
        message: e.to_string().trim_end().to_owned(),
    };
    toml::from_str(text).map_err(syntax)
}

fn range(
    file: &str,
    name: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), TrainConfigError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(TrainConfigError::Range { file: file.to_owned(), name, value, min, max })
}

#[cfg(test)]
#[path = "config_tests.rs"]
mod tests;
