//! Random pairs, clear of everything at the start.

use core::f64::consts::TAU;

use nalgebra::Point2;

use super::{PAIRS_MAX, Pair, PairsError};
use crate::rng::{Draw, Streams, stream};
use crate::world::World;
use crate::world::geometry::{COORDINATE_M_MAX, Pose};

/// Points drawn for one pair before giving up.
pub const TRIES_MAX: usize = 10_000;

/// What a drawn pair must keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairRules {
    /// Shortest straight distance from start to goal.
    pub distance_m_min: f64,
    /// Distance of start and goal to every obstacle, and to movers at time 0.
    pub clearance_m: f64,
}

impl Default for PairRules {
    /// At least 6 m apart and 0.5 m clear, as SAN's evaluation and training sets.
    fn default() -> Self {
        Self { distance_m_min: 6.0, clearance_m: 0.5 }
    }
}

/// Draws `n` pairs. Each has its own stream (counter: number of the pair), so the first pairs are
/// the same for any `n`. Coordinates are whole millimetres, headings whole milliradians.
///
/// Errors: [`PairsError`] for rules out of range and when [`TRIES_MAX`] points do not do.
pub fn generate_pairs(
    world: &World,
    n: usize,
    rules: PairRules,
    streams: Streams,
) -> Result<Vec<Pair>, PairsError> {
    if n > PAIRS_MAX {
        return Err(PairsError::Many { file: world.arena().name().to_owned(), n });
    }
    check_rule("distance_m_min", rules.distance_m_min)?;
    check_rule("clearance_m", rules.clearance_m)?;
    (0..n)
        .map(|trial| {
            let draw = streams.at(stream::TRIAL_PAIRS, trial as u64);
            draw_pair(world, trial, rules, draw)
        })
        .collect()
}

/// A new start is drawn with every goal that is too near: a start without a far goal is left.
fn draw_pair(
    world: &World,
    trial: usize,
    rules: PairRules,
    mut draw: Draw,
) -> Result<Pair, PairsError> {
    let mut tries_left = TRIES_MAX;
    let (arena, clearance_m) = (|| world.arena().name().to_owned(), rules.clearance_m);
    let Some(mut start) = free_point(world, clearance_m, &mut draw, &mut tries_left) else {
        return Err(PairsError::NoFreeStart { arena: arena(), clearance_m });
    };
    while let Some(goal) = free_point(world, clearance_m, &mut draw, &mut tries_left) {
        if (goal - start).norm() >= rules.distance_m_min {
            let yaw_rad = to_milli(draw.uniform_in(0.0, TAU));
            return Ok(Pair { start: Pose::new(start.x, start.y, yaw_rad), goal });
        }
        start = goal;
    }
    let distance_m_min = rules.distance_m_min;
    Err(PairsError::NoPair { arena: arena(), trial, distance_m_min, clearance_m })
}

/// A uniform point of the free area; `None` when the tries are used up.
fn free_point(
    world: &World,
    clearance_m: f64,
    draw: &mut Draw,
    tries_left: &mut usize,
) -> Option<Point2<f64>> {
    let bounds = world.arena().bounds();
    while *tries_left > 0 {
        *tries_left -= 1;
        let x_m = to_milli(draw.uniform_in(bounds.min.x, bounds.max.x));
        let y_m = to_milli(draw.uniform_in(bounds.min.y, bounds.max.y));
        let point = Point2::new(x_m, y_m);
        if world.nearest(point, 0).is_none_or(|nearest| nearest.distance_m >= clearance_m) {
            return Some(point);
        }
    }
    None
}

fn to_milli(value: f64) -> f64 {
    libm::round(value * 1000.0) / 1000.0
}

fn check_rule(name: &'static str, value: f64) -> Result<(), PairsError> {
    if (0.0..=COORDINATE_M_MAX).contains(&value) {
        Ok(())
    } else {
        Err(PairsError::Rule { name, value })
    }
}
