//! What each layer of a compiled network does, measured before anything flies.

use std::sync::Arc;

use hw_model::core_map::Population;
use hw_model::engine::{Engine, SpikeRecord, Stimulus};
use hw_model::{CoreMap, EventEngine, OpCounts};

use crate::compile::place::{LayerWork, Work};
use crate::host::chip_policy::{ChipPolicy, ChipUse};
use crate::host::deployment::Deployment;
use crate::host::eem_san_policy::EemSanChipPolicy;
use crate::host::eem_san_program::Schedule;
use crate::net::eem_san::FRAMES_PER_TICK;
use crate::policy::{EventFrame, Observation, Policy};
use crate::rng::{Streams, stream};

/// Random observations that it decides on; of a network without a host program, steps.
const DECISIONS: u64 = 40;

/// Marked pixels of a random event frame: as many as in motion, 3.7 % of them.
const EVENTS: usize = 600;

/// Rate of the random spikes into a network without a host program.
const INPUT_RATE: f64 = 0.2;

/// Counts of each population, over some decisions on random observations, its phase, and the steps.
pub(super) fn of_populations(deployment: &Deployment) -> Work {
    let map = &deployment.map;
    let engine: Box<dyn Engine> = Box::new(EventEngine::new(Arc::clone(map)));
    let takes_frames = deployment.takes_frames();
    let (by_core, steps) = if deployment.program.is_some() {
        let mut policy = ChipPolicy::new(deployment, engine).expect("there is a program");
        decide(&mut policy, takes_frames);
        counted(policy.chip_use())
    } else if deployment.eem_san.is_some() {
        let mut policy = EemSanChipPolicy::new(deployment, engine).expect("there is a program");
        decide(&mut policy, takes_frames);
        counted(policy.chip_use())
    } else {
        (run(map, engine), DECISIONS)
    };
    // Encoder and decision module of an EEM-SAN work one after the other, but when they stream.
    let held = deployment.eem_san.as_ref().filter(|p| p.schedule != Schedule::Streaming);
    let encoder = held.and_then(|program| program.encoder.as_ref());
    let encoder = encoder.map_or(&[][..], |phase| &phase.layers);
    let of_population = |(index, population): (usize, &Population)| {
        let counts = population.cores().into_iter().map(|core| &by_core[core.index()]);
        let encodes = encoder.iter().any(|window| window.population as usize == index);
        LayerWork { counts: OpCounts::total(counts), phase: usize::from(!encodes) }
    };
    Work { layers: map.populations().iter().enumerate().map(of_population).collect(), steps }
}

/// Counts of each core, and steps.
fn counted(used: ChipUse) -> (Vec<OpCounts>, u64) {
    (used.by_core, used.counts.barriers)
}

fn decide(policy: &mut dyn Policy, takes_frames: bool) {
    let streams = Streams::new(0, 0);
    policy.start_trial(streams);
    for tick in 0..DECISIONS {
        let mut draw = streams.at(stream::STIMULUS, tick);
        let frames = if takes_frames { FRAMES_PER_TICK } else { 0 };
        let frames = (0..frames).map(|_| EventFrame::random(&mut draw, EVENTS)).collect();
        policy.act(&Observation::random(&mut draw, frames), tick);
    }
}

/// Random spikes on all lines of all ports.
fn run(map: &CoreMap, mut engine: Box<dyn Engine>) -> Vec<OpCounts> {
    let mut spikes = Vec::new();
    for step in 0..DECISIONS {
        let mut draw = Streams::new(0, 0).at(stream::STIMULUS, step);
        for (port, about) in map.ports().iter().enumerate() {
            let lines = (0..about.lines).filter(|_| draw.bernoulli(INPUT_RATE));
            spikes.extend(lines.map(|line| (step, port as u32, line)));
        }
    }
    let stimulus = Stimulus::new(map, DECISIONS as usize, spikes).expect("lines of the map");
    engine.run(&stimulus, &mut SpikeRecord::none());
    engine.core_counts()
}
