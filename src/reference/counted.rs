//! EEM-SAN, its artificial counterparts, and the networks that it is compared with, run while every operation is counted where it is done.
//!
//! The rules are those of [`crate::cost`]; nothing here multiplies sizes with each other. The
//! artificial counterparts have no weights of their own: they take those of the spiking network,
//! with ReLU in place of neurons and a sigmoid at the end, and `sigma` takes those of `mu`.

mod artificial;
mod conv;
mod dense;
mod network;
mod neurons;
mod spiking;

pub use artificial::{ArtificialDecision, ArtificialEncoder, AvaeEncoder};
pub use network::CountedNetwork;
pub use spiking::{SpikingDecision, SpikingEncoder};

use crate::coding::{InputSpikes, population_spikes, robot_state};
use crate::cost::{Activity, Counts, Modules, Shape};
use crate::net::EemSan;
use crate::net::eem_san::StateCode;
use crate::policy::Observation;
use crate::rng::{Draw, Streams, stream};

/// All four modules, run side by side on the same observations.
///
/// Both decision modules see the population spikes of the spiking encoder's state, so that rows
/// differ by the module that is exchanged and nothing else.
#[derive(Debug, Clone)]
pub struct CountedEemSan {
    laser: StateCode,
    dvs: StateCode,
    steps: u32,
    spiking_encoder: SpikingEncoder,
    artificial_encoder: ArtificialEncoder,
    spiking_decision: SpikingDecision,
    artificial_decision: ArtificialDecision,
}

/// What a control tick gave and took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CountedTick {
    /// Spikes of each output neuron of the spiking network.
    pub output_counts: Vec<u32>,
    /// Mean output of the artificial decision module.
    pub artificial_action: Vec<f32>,
    /// Operations as performed.
    pub counts: Modules<Counts>,
    /// Inputs and spikes of the layers.
    pub activity: Modules<Activity>,
}

/// What one module gave and took in a control tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Done<T> {
    /// Its result.
    pub output: T,
    /// Operations as performed.
    pub counts: Counts,
    /// Inputs and spikes of its layers.
    pub activity: Activity,
}

impl CountedEemSan {
    /// Takes a network's weights; `None` for one that Table 5 is not about, as for [`Shape::of`].
    pub fn new(network: &EemSan) -> Option<Self> {
        Shape::of(network)?;
        let (encoder, dvs) = network.encoder.as_ref().zip(network.dvs.as_ref())?;
        Some(Self {
            laser: network.laser.code.clone(),
            dvs: dvs.code.clone(),
            steps: network.steps,
            spiking_encoder: SpikingEncoder::new(encoder),
            artificial_encoder: ArtificialEncoder::new(encoder),
            spiking_decision: SpikingDecision::new(network),
            artificial_decision: ArtificialDecision::new(network),
        })
    }

    /// `T`, steps per decision.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// A new episode.
    pub fn reset(&mut self) {
        self.spiking_encoder.reset();
    }

    /// One control tick with the random streams of its trial; the spiking network acts as
    /// [`crate::reference::EemSanPolicy`] does.
    pub fn tick(&mut self, observation: &Observation, streams: Streams, tick: u64) -> CountedTick {
        let frames = active_pixels(observation);
        let seen = self.spiking_encoder.tick(&frames);
        let artificial = self.artificial_encoder.tick(&frames);
        let state = robot_state(observation);
        let spikes = |code: &StateCode, state: &[f32], name: &str| {
            coded(code, state, self.steps, streams.at(name, tick))
        };
        let inputs: [InputSpikes; 2] = [
            spikes(&self.laser, &state, stream::LASER_POPULATION),
            spikes(&self.dvs, &seen.output, stream::DVS_POPULATION),
        ];
        let decided = self.spiking_decision.tick(&inputs);
        let other = self.artificial_decision.tick(&inputs);
        CountedTick {
            output_counts: decided.output,
            artificial_action: other.output,
            counts: Modules {
                spiking_encoder: seen.counts,
                artificial_encoder: artificial.counts,
                spiking_decision: decided.counts,
                artificial_decision: other.counts,
            },
            activity: Modules {
                spiking_encoder: seen.activity,
                artificial_encoder: artificial.activity,
                spiking_decision: decided.activity,
                artificial_decision: other.activity,
            },
        }
    }
}

/// Active pixels of each frame.
fn active_pixels(observation: &Observation) -> Vec<Vec<usize>> {
    observation.frames.iter().map(|frame| frame.active().collect()).collect()
}

/// Spikes of a state into its branch.
fn coded(code: &StateCode, state: &[f32], steps: u32, mut draw: Draw) -> InputSpikes {
    population_spikes(&code.activity(state), steps, &mut draw)
}

/// Whether a call with these inputs counts as MAC: any is none of -1, 0, 1.
fn has_reals(input: &[f32]) -> bool {
    input.iter().any(|x| *x != 0.0 && x.abs() != 1.0)
}

#[cfg(test)]
#[path = "counted_tests.rs"]
mod tests;
