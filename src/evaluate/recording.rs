//! A trial flown with everything written down, to be looked at afterwards.

use hw_model::OpCounts;

use crate::closed_loop::{TrialConfig, run_trial};
use crate::coding::LayerSpikes;
use crate::evaluate::driver::{Active, Driver};
use crate::evaluate::{Flown, FlyError};
use crate::host::ChipUse;
use crate::policy::{Action, Observation, Policy};
use crate::rng::Streams;
use crate::world::pairs::Pair;
use crate::world::{PHYSICS_STEP_S, World};

/// Layers with more neurons than this have their spikes counted, not kept.
pub const RASTER_NEURONS_MAX: usize = 1024;

/// A trial and all that happened in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// How it went, as [`crate::evaluate::fly`] gives it.
    pub flown: Flown,
    /// Settings it was flown by.
    pub config: TrialConfig,
    /// Every control tick.
    pub ticks: Vec<Tick>,
    /// Centres of the movers (mm) at the beginning of every control tick, and after the last.
    pub movers_mm: Vec<Vec<[i32; 2]>>,
}

/// A control tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// What the robot sensed at its beginning.
    pub observation: Observation,
    /// What was decided, before noise.
    pub action: Action,
    /// Spikes of the layers of up to [`RASTER_NEURONS_MAX`] neurons; none of the others.
    pub spikes: LayerSpikes,
    /// Number of spikes of every layer.
    pub layer_spikes: Vec<u64>,
    /// The DVS state that the host computed; empty without an encoder.
    pub dvs_state: Vec<f32>,
    /// What each core did; empty without a chip.
    pub cores: Vec<OpCounts>,
    /// What the chip did since the trial began.
    pub chip: Option<ChipUse>,
}

/// Flies trial `trial` again, alone, and writes everything down. The flight is the one of
/// [`crate::evaluate::fly`]: a trial depends on the seed and its number alone, and watching changes
/// nothing.
///
/// Errors: as `fly`; the planner. Panics when there is no such pair.
pub fn record(
    world: &World,
    pairs: &[Pair],
    trial: usize,
    config: &TrialConfig,
    driver: &Driver,
    seed: u64,
) -> Result<Recording, FlyError> {
    check_recordable(driver)?;
    let config = driver.config(config)?;
    let streams = Streams::new(seed, trial as u64);
    let active = driver.start(&streams);
    let kept = driver.layers().iter().map(|(_, n)| *n <= RASTER_NEURONS_MAX).collect();
    let cores = active.core_counts();
    let mut recorder = Recorder { active, kept, cores, ticks: Vec::new() };
    let pair = &pairs[trial];
    let outcome = run_trial(world, pair.start, pair.goal, &config, &mut recorder, streams)?;
    let steps = (outcome.time_s / PHYSICS_STEP_S).round() as u64;
    let movers = |tick: u64| {
        let discs = world.mover_discs(steps.min(tick * config.steps_per_tick()));
        let milli = |metres: f64| (metres * 1000.0).round() as i32;
        discs.iter().map(|disc| [milli(disc.centre().x), milli(disc.centre().y)]).collect()
    };
    Ok(Recording {
        movers_mm: (0..=outcome.ticks).map(movers).collect(),
        flown: Flown { trial, outcome, chip: recorder.active.chip_use() },
        ticks: recorder.ticks,
        config,
    })
}

/// Errs for a driver whose trials cannot be recorded: the planner.
pub fn check_recordable(driver: &Driver) -> Result<(), FlyError> {
    match driver.planner_knowledge().is_some() {
        true => Err(FlyError::Recorded { driver: driver.label.clone() }),
        false => Ok(()),
    }
}

/// A driver that keeps what it sees and does.
struct Recorder {
    active: Active,
    /// Which layers' spikes are kept.
    kept: Vec<bool>,
    /// Counts of the cores at the end of the last tick.
    cores: Vec<OpCounts>,
    ticks: Vec<Tick>,
}

impl Policy for Recorder {
    fn start_trial(&mut self, streams: Streams) {
        self.active.policy().start_trial(streams);
    }

    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let (action, mut spikes) = self.active.act_watched(observation, tick);
        let of_layer = |steps: &Vec<Vec<u32>>| steps.iter().map(|step| step.len() as u64).sum();
        let layer_spikes = spikes.iter().map(of_layer).collect();
        let large = spikes.iter_mut().zip(&self.kept).filter(|(_, kept)| !**kept);
        large.for_each(|(steps, _)| steps.clear());
        let after = self.active.core_counts();
        let before = std::mem::replace(&mut self.cores, after);
        let cores = self.cores.iter().zip(&before).map(|(after, before)| *after - *before);
        self.ticks.push(Tick {
            observation: observation.clone(),
            action,
            layer_spikes,
            cores: cores.collect(),
            spikes,
            dvs_state: self.active.dvs_state().to_vec(),
            chip: self.active.chip_use(),
        });
        action
    }
}
