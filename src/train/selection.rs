//! Flights that tell which actor of a training is the best: always the same ones, in rooms that
//! nothing is learned in and that are no evaluation maps.

use serde::{Deserialize, Serialize};

use crate::closed_loop::{Outcome, TrialConfig, run_trial};
use crate::net::EemSan;
use crate::reference::EemSanPolicy;
use crate::rng::{Streams, stream};
use crate::train::on_each;
use crate::train::rooms::{RoomRules, drawn_room};
use crate::world::World;
use crate::world::pairs::{Pair, PairRules, generate_pairs};

/// Number of the trial whose streams give pairs, and of the first flight.
const TRIAL: u64 = 5;

/// When actors are compared, and on what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SelectionConfig {
    /// Rounds of training between two comparisons.
    pub every: u64,
    /// Rooms.
    pub n_rooms: usize,
    /// Flights in each room.
    pub flights_per_room: usize,
    /// What rooms are like.
    #[serde(default)]
    pub rooms: RoomRules,
}

/// The flights.
#[derive(Debug, Clone)]
pub(super) struct Selection {
    trial: TrialConfig,
    streams: Streams,
    places: Vec<(World, Vec<Pair>)>,
    /// Whether actors act as late as on a chip that streams.
    late: bool,
}

/// Flights of one room.
struct Part<'s> {
    number: usize,
    place: &'s (World, Vec<Pair>),
    goals: usize,
}

impl Selection {
    /// Draws rooms and pairs.
    pub(super) fn new(
        config: &SelectionConfig,
        trial: &TrialConfig,
        seed: u64,
        late: bool,
    ) -> Self {
        let streams = Streams::new(seed, TRIAL);
        let rules =
            PairRules { distance_m_min: config.rooms.distance_m_min, ..PairRules::default() };
        let place = |number: usize| {
            let name = format!("selection-{number}");
            let draw = streams.at(stream::SELECTION_ROOMS, number as u64);
            let world = World::new(drawn_room(&config.rooms, draw, name));
            let streams = Streams::new(seed, (TRIAL << 32) + number as u64);
            let pairs = generate_pairs(&world, config.flights_per_room, rules, streams);
            (world, pairs.expect("rooms have free places"))
        };
        let places = (0..config.n_rooms).map(place).collect();
        Self { trial: trial.clone(), streams, places, late }
    }

    /// Share of the flights that `network` brings to their goals.
    pub(super) fn share(&self, network: &EemSan, threads: usize) -> f32 {
        let part = |(number, place)| Part { number, place, goals: 0 };
        let mut parts: Vec<Part<'_>> = self.places.iter().enumerate().map(part).collect();
        on_each(&mut parts, threads, |part| part.goals = self.goals(network, part));
        let flights: usize = parts.iter().map(|part| part.place.1.len()).sum();
        let goals: usize = parts.iter().map(|part| part.goals).sum();
        goals as f32 / flights.max(1) as f32
    }

    fn goals(&self, network: &EemSan, part: &Part<'_>) -> usize {
        let (world, pairs) = part.place;
        let mut policy = match self.late {
            true => EemSanPolicy::streaming(network),
            false => EemSanPolicy::new(network),
        };
        let reached = |(index, pair): &(usize, &Pair)| {
            let flight = (part.number * pairs.len() + index) as u64;
            let streams = Streams::new(self.streams.at(stream::EXPLORATION, flight).bits(), 0);
            let (start, goal) = (pair.start, pair.goal);
            let flown = run_trial(world, start, goal, &self.trial, &mut policy, streams);
            flown.expect("settings were checked").outcome == Outcome::Success
        };
        pairs.iter().enumerate().filter(reached).count()
    }
}

#[cfg(test)]
#[path = "selection_tests.rs"]
mod tests;
