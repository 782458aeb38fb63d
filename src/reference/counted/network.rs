//! A network as it is, counted.

use crate::coding::robot_state;
use crate::cost::Counts;
use crate::net::eem_san::StateCode;
use crate::net::{EemSan, EncoderKind};
use crate::policy::Observation;
use crate::reference::counted::{
    AvaeEncoder, SpikingDecision, SpikingEncoder, active_pixels, coded,
};
use crate::rng::{Streams, stream};

/// EEM-SAN or a network that it is compared with, with its own encoder, if it has one.
#[derive(Debug, Clone)]
pub struct CountedNetwork {
    laser: StateCode,
    dvs: Option<(Encoder, StateCode)>,
    decision: SpikingDecision,
    steps: u32,
}

#[derive(Debug, Clone)]
enum Encoder {
    Spiking(SpikingEncoder),
    Artificial(AvaeEncoder),
}

impl CountedNetwork {
    /// Takes a network's weights; its trial has yet to start.
    pub fn new(network: &EemSan) -> Self {
        let encoder = network.encoder.as_ref().map(|encoder| match encoder.kind {
            EncoderKind::Avae => Encoder::Artificial(AvaeEncoder::new(encoder)),
            EncoderKind::Hsvae | EncoderKind::Fsvae => {
                Encoder::Spiking(SpikingEncoder::new(encoder))
            }
        });
        let code = network.dvs.as_ref().map(|dvs| dvs.code.clone());
        Self {
            laser: network.laser.code.clone(),
            dvs: encoder.zip(code),
            decision: SpikingDecision::new(network),
            steps: network.steps,
        }
    }

    /// `T`, steps per decision.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// A new trial.
    pub fn reset(&mut self) {
        self.decision.reset();
        if let Some((Encoder::Spiking(encoder), _)) = &mut self.dvs {
            encoder.reset();
        }
    }

    /// Spikes of each output neuron in one control tick, with the random streams of its trial, and
    /// the operations that they took. Acts as [`crate::reference::EemSanPolicy`] does.
    pub fn tick(
        &mut self,
        observation: &Observation,
        streams: Streams,
        tick: u64,
    ) -> (Vec<u32>, Counts) {
        let steps = self.steps;
        let spikes = |code: &StateCode, state: &[f32], name: &str| {
            coded(code, state, steps, streams.at(name, tick))
        };
        let state = robot_state(observation);
        let mut inputs = vec![spikes(&self.laser, &state, stream::LASER_POPULATION)];
        let mut counts = Counts::default();
        if let Some((encoder, code)) = &mut self.dvs {
            let frames = active_pixels(observation);
            let seen = match encoder {
                Encoder::Spiking(encoder) => encoder.tick(&frames),
                Encoder::Artificial(encoder) => encoder.tick(&frames),
            };
            counts += seen.counts;
            inputs.push(spikes(code, &seen.output, stream::DVS_POPULATION));
        }
        let decided = self.decision.tick(&inputs);
        counts += decided.counts;
        (decided.output, counts)
    }
}
