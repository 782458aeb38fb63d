//! Named, seeded, portable random streams.
//!
//! Every random draw of the project comes from a [`Streams`]: the seed of the run, the number of
//! the trial, the *name* of the stream and a counter (usually the control tick) together select
//! one ChaCha8 key stream. Draws of different streams never influence each other, so trials can
//! run in any order and on any number of threads, and a draw that is added to one part of the
//! program changes no other.
//!
//! Only integers and uniforms are taken from the generator; [`Draw::gaussian`] uses `libm`, whose
//! results do not depend on the platform.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Names of all streams, one place to see who draws what.
pub mod stream {
    /// Gaussian range noise of the laser, one draw per ray and control tick.
    pub const LASER_NOISE: &str = "laser.noise";
    /// Bernoulli draws of the spike encoder, one per input, decision step and control tick.
    pub const ENCODER_SPIKES: &str = "encoder.spikes";
    /// Gaussian exploration noise on the two action components.
    pub const ACTION_NOISE: &str = "action.noise";
    /// Start and goal positions of generated trials.
    pub const TRIAL_PAIRS: &str = "trial.pairs";
    /// Thresholds of the event camera's pixels, drawn once per device.
    pub const DVS_THRESHOLDS: &str = "dvs.thresholds";
    /// Places of the event camera's hot pixels, drawn once per device.
    pub const DVS_HOT_PIXELS: &str = "dvs.hot_pixels";
    /// How far each pixel of the event camera is from its next leak event when a trial starts.
    pub const DVS_START: &str = "dvs.start";
    /// Noise events of the event camera, one stream per physics step.
    pub const DVS_NOISE: &str = "dvs.noise";
    /// Seed of the messages that a faulty chip loses, one chip for each trial.
    pub const FAULTS_MESSAGES: &str = "faults.messages";
    /// Seed of the dead synapses of a faulty chip.
    pub const FAULTS_SYNAPSES: &str = "faults.synapses";
    /// Order in which cores of a faulty chip die.
    pub const FAULTS_CORES: &str = "faults.cores";
    /// Noise of a degraded laser, one draw per sector and control tick.
    pub const LASER_FAULT: &str = "laser.fault";
    /// Noise on degraded weights, and which are lost; one counter value per layer.
    pub const WEIGHT_FAULTS: &str = "weights.fault";
    /// Stimuli made by the trace tool and by benches.
    pub const STIMULUS: &str = "stimulus";
    /// Initial weights, one counter value per tensor. An auto-encoder and an actor of one seed draw the
    /// same numbers, tensor by tensor; told apart, what ships could not be trained again.
    pub const NN_INIT: &str = "nn.init";
    /// Bernoulli draws of the population code for the observation that is acted on or learned from.
    pub const POPULATION_SPIKES: &str = "nn.population";
    /// Bernoulli draws of the population code for the observation after it (target networks).
    pub const POPULATION_SPIKES_NEXT: &str = "nn.population.next";
    /// Bernoulli draws of the population code of robot and laser state, per control tick.
    pub const LASER_POPULATION: &str = "population.laser";
    /// Bernoulli draws of the population code of the DVS state, per control tick.
    pub const DVS_POPULATION: &str = "population.dvs";
    /// Rooms that training takes place in, one counter value per room.
    pub const TRAIN_ROOMS: &str = "train.rooms";
    /// Rooms in which actors are compared while they train, one counter value per room.
    pub const SELECTION_ROOMS: &str = "selection.rooms";
    /// Choices of exploration, one stream per world and tick.
    pub const EXPLORATION: &str = "train.exploration";
    /// Which transitions make a batch, one counter value per update.
    pub const REPLAY: &str = "train.replay";
    /// Gaussian draws of the latent vector while the auto-encoder is trained.
    pub const LATENT_NOISE: &str = "nn.latent";
}

/// The streams of one trial of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    seed: u64,
    trial: u64,
}

impl Streams {
    /// Streams of trial number `trial` in the run with seed `seed`.
    pub fn new(seed: u64, trial: u64) -> Self {
        Self { seed, trial }
    }

    /// The stream called `name` at `counter` (a control tick, say).
    pub fn at(&self, name: &str, counter: u64) -> Draw {
        let mut key = [0u8; 32];
        key[0..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&self.trial.to_le_bytes());
        key[16..24].copy_from_slice(&fnv1a(name.as_bytes()).to_le_bytes());
        key[24..32].copy_from_slice(&counter.to_le_bytes());
        Draw { generator: ChaCha8Rng::from_seed(key), spare: None }
    }
}

/// FNV-1a, 64 bit: turns a stream's name into a part of its key.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Draws from one stream, in order.
#[derive(Debug, Clone)]
pub struct Draw {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Draw {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.generator.next_u64()
    }

    /// Uniform in `[0, 1)`, 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform_in(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// True with probability `p`; `p` at or above 1 is always true, at or below 0 never.
    pub fn bernoulli(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// Uniform integer in `0..n`. Panics when `n` is 0.
    pub fn below(&mut self, n: u64) -> u64 {
        assert!(n > 0, "cannot draw below 0");
        ((u128::from(self.bits()) * u128::from(n)) >> 64) as u64
    }

    /// Standard normal by Box and Muller, two values per pair of uniforms.
    pub fn gaussian(&mut self) -> f64 {
        if let Some(value) = self.spare.take() {
            return value;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        let angle = core::f64::consts::TAU * self.uniform();
        self.spare = Some(radius * libm::sin(angle));
        radius * libm::cos(angle)
    }
}

#[cfg(test)]
#[path = "rng_tests.rs"]
mod tests;
