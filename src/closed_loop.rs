//! One trial: world to sensors to policy to wheels to world, until it ends.
//!
//! ```text
//! tick:  observe -> Policy::act -> noise, clip -> Twist -> physics steps -> goal? hit? time?
//! ```
//!
//! The robot's centre is compared with the goal at control ticks only, as SAN's evaluation does;
//! contact is looked for after every physics step. When both hold at the end of a tick the goal
//! wins, since SAN tests it first.

mod config;
mod contact;
pub mod mover_map;
mod outcome;
pub mod planner;
pub mod sighted;
mod straight_to_goal;
mod trial;

pub use config::{ConfigError, Setting, TrialConfig};
pub use contact::{MoverContact, Side};
pub use outcome::{End, Outcome, TrialOutcome};
pub use straight_to_goal::StraightToGoal;
pub use trial::Trial;

use nalgebra::Point2;

use crate::policy::Policy;
use crate::rng::Streams;
use crate::world::World;
use crate::world::geometry::Pose;

/// Flies one trial from `start` to its end.
///
/// Errors: [`ConfigError`] for a setting, a start or a goal outside of its limits.
pub fn run_trial(
    world: &World,
    start: Pose,
    goal: Point2<f64>,
    config: &TrialConfig,
    policy: &mut dyn Policy,
    streams: Streams,
) -> Result<TrialOutcome, ConfigError> {
    let mut trial = Trial::new(world, start, goal, config, streams)?;
    policy.start_trial(streams);
    while trial.end().is_none() {
        trial.tick(policy);
    }
    Ok(trial.into_outcome())
}

/// As [`run_trial`], with the planner that knows the obstacles and what `knowledge` says of movers.
///
/// Errors: as [`run_trial`].
pub fn run_planned_trial(
    (world, terrain): (&World, &planner::Terrain),
    knowledge: planner::Knowledge,
    start: Pose,
    goal: Point2<f64>,
    config: &TrialConfig,
    streams: Streams,
) -> Result<TrialOutcome, ConfigError> {
    let mut trial = Trial::new(world, start, goal, config, streams)?;
    let speed_m_per_s = config.wheel_speed_m_per_s_max;
    let planner = planner::Planner::new(terrain, goal, speed_m_per_s, knowledge);
    while trial.end().is_none() {
        let (action, _) = planner.plan(&trial);
        trial.drive(action);
    }
    Ok(trial.into_outcome())
}

#[cfg(test)]
#[path = "closed_loop_tests.rs"]
mod tests;
