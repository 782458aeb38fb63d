//! Many trials with one driver, in parallel, with the same result in any order.

mod agreement;
mod condition;
mod damage;
mod degradation;
mod driver;
mod in_turn;
mod recording;

pub use agreement::{Agreement, AgreementError, Comparison, LayerAgreement};
pub use condition::{CONDITIONS, Condition};
pub use damage::{Damage, DamageError};
pub use degradation::{DEGRADATIONS, Degradation, DegradedPart};
pub use driver::{Driver, DriverKind, EngineKind};
pub use in_turn::in_turn;
pub use recording::{RASTER_NEURONS_MAX, Recording, Tick, check_recordable, record};

use crate::closed_loop::planner::Terrain;
use crate::closed_loop::{ConfigError, TrialConfig, TrialOutcome, run_planned_trial, run_trial};
use crate::host::ChipUse;
use crate::net::eem_san::FRAMES_PER_TICK;
use crate::rng::Streams;
use crate::world::pairs::Pair;
use crate::world::{PHYSICS_HZ, World};

/// Trials that cannot be flown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlyError {
    /// A setting, start or goal is outside of its limits.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The network takes more or fewer event frames per control tick than there are.
    #[error(
        "{driver}: control rate {control_hz} Hz gives {frames} event frames per control tick, \
         {FRAMES_PER_TICK} needed (FRAMES_PER_TICK); drive at {} Hz (--control-hz)",
        PHYSICS_HZ as usize / FRAMES_PER_TICK
    )]
    Frames {
        /// Label of the driver.
        driver: String,
        /// The rate.
        control_hz: u32,
        /// Frames that it gives.
        frames: u64,
    },
    /// The planner is no policy.
    #[error("{driver}: decides without observations and cannot be recorded; record another driver")]
    Recorded {
        /// Label of the driver.
        driver: String,
    },
}

/// One flown trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Number of the trial: its place among the pairs, and part of its random streams.
    pub trial: usize,
    /// How it went.
    pub outcome: TrialOutcome,
    /// What the chip did, when one drove.
    pub chip: Option<ChipUse>,
}

/// Flies a trial for each pair with drivers made by `driver`, on `threads` threads.
///
/// Trial `i` takes the streams of (seed, i), so results depend neither on the threads nor on how
/// many trials there are. The event camera is on the robot when `driver` needs it, or when `config`
/// has one. `finished` is called after each trial, from any thread.
///
/// Errors: a setting, start or goal outside of its limits; a control rate that does not suit the
/// driver.
pub fn fly(
    world: &World,
    pairs: &[Pair],
    config: &TrialConfig,
    driver: &Driver,
    seed: u64,
    threads: usize,
    finished: &(dyn Fn() + Sync),
) -> Result<Vec<Flown>, FlyError> {
    let config = &driver.config(config)?;
    let planner = driver.planner_knowledge().map(|knowledge| (Terrain::new(world), knowledge));
    let fly_trial = |trial: usize| -> Result<Flown, ConfigError> {
        let (pair, streams) = (&pairs[trial], Streams::new(seed, trial as u64));
        let flown = match &planner {
            None => fly_one(world, pair, config, driver, streams, trial)?,
            Some((terrain, knowledge)) => {
                let (place, start, goal) = ((world, terrain), pair.start, pair.goal);
                let outcome = run_planned_trial(place, *knowledge, start, goal, config, streams)?;
                Flown { trial, outcome, chip: None }
            }
        };
        finished();
        Ok(flown)
    };
    Ok(in_turn(pairs.len(), threads, fly_trial)?)
}

fn fly_one(
    world: &World,
    pair: &Pair,
    config: &TrialConfig,
    driver: &Driver,
    streams: Streams,
    trial: usize,
) -> Result<Flown, ConfigError> {
    let mut active = driver.start(&streams);
    let outcome = run_trial(world, pair.start, pair.goal, config, active.policy(), streams)?;
    Ok(Flown { trial, outcome, chip: active.chip_use() })
}
