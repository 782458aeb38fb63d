//! Start and goal of every trial: read from a file, or drawn.

mod error;
mod generate;
mod read;

pub use error::PairsError;
pub use generate::{PairRules, TRIES_MAX, generate_pairs};
pub use read::{pairs_from_json, pairs_to_json, read_pairs};

use nalgebra::Point2;

use super::World;
use super::geometry::Pose;

/// Most pairs of one file or one draw.
pub const PAIRS_MAX: usize = 10_000;

/// Where one trial begins and where it should end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Pose of the robot at the start.
    pub start: Pose,
    /// Centre of the goal.
    pub goal: Point2<f64>,
}

impl Pair {
    /// Straight distance from start to goal.
    pub fn distance_m(&self) -> f64 {
        (self.goal - self.start.position).norm()
    }
}

/// Errs for the first start or goal outside of the arena, or nearer than `robot_radius_m` to a
/// static obstacle. Movers are not looked at: one that stands on a start is part of the trial.
pub fn check_pairs(
    pairs: &[Pair],
    world: &World,
    robot_radius_m: f64,
    file: &str,
) -> Result<(), PairsError> {
    for (trial, pair) in pairs.iter().enumerate() {
        for (end, point) in [("start", pair.start.position), ("goal", pair.goal)] {
            check_end(point, world, robot_radius_m, (file, trial, end))?;
        }
    }
    Ok(())
}

fn check_end(
    point: Point2<f64>,
    world: &World,
    robot_radius_m: f64,
    (file, trial, end): (&str, usize, &'static str),
) -> Result<(), PairsError> {
    let (file, x_m, y_m) = (file.to_owned(), point.x, point.y);
    if !world.arena().bounds().contains(point) {
        let arena = world.arena().name().to_owned();
        return Err(PairsError::Outside { file, trial, end, x_m, y_m, arena });
    }
    match world.scene().nearest(point) {
        Some((obstacle_idx, distance_m)) if distance_m < robot_radius_m => {
            let obstacle = world.arena().obstacles()[obstacle_idx].name.clone();
            let radius_m = robot_radius_m;
            Err(PairsError::Blocked { file, trial, end, x_m, y_m, distance_m, obstacle, radius_m })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
#[path = "pairs_tests.rs"]
mod tests;
