//! What stands and moves in an arena, its checks, its files, and the arenas that come built in.

mod check;
mod error;
mod named;
mod read;
mod record;
mod write;

pub use error::{ArenaError, ObstacleError};
pub use named::{EVALUATION_PAIRS, EVALUATION_SEED, list_named};
pub use read::split_room;

use nalgebra::Point2;

use super::geometry::Shape;
use super::mover::Mover;

/// Most obstacles of one arena, walls included.
pub const OBSTACLES_MAX: usize = 1000;

/// Most movers of one arena.
pub const MOVERS_MAX: usize = 100;

/// Lowest obstacle or mover: the laser's scan plane must meet it.
pub const HEIGHT_M_MIN: f64 = super::laser::LASER_HEIGHT_M;

/// Highest obstacle or mover.
pub const HEIGHT_M_MAX: f64 = 100.0;

/// How deep a mover may touch a static obstacle: published tracks end at contact, in centimetres.
pub const TRACK_OVERLAP_M_MAX: f64 = 0.01;

/// The rectangle that the robot must stay in, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lower left corner.
    pub min: Point2<f64>,
    /// Upper right corner.
    pub max: Point2<f64>,
}

impl Bounds {
    /// Whether `point` is inside or on the edge.
    pub fn contains(&self, point: Point2<f64>) -> bool {
        let within = |value: f64, min: f64, max: f64| (min..=max).contains(&value);
        within(point.x, self.min.x, self.max.x) && within(point.y, self.min.y, self.max.y)
    }
}

/// Something that does not move.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Name for reports, unique in its arena.
    pub name: String,
    /// Outline in world coordinates.
    pub shape: Shape,
    /// Height above the floor.
    pub height_m: f64,
}

/// A checked arena: names are unique, everything is within its limits, mover tracks are inside
/// the bounds and clear of static obstacles.
#[derive(Debug, Clone, PartialEq)]
pub struct Arena {
    name: String,
    bounds: Bounds,
    obstacles: Vec<Obstacle>,
    movers: Vec<Mover>,
}

impl Arena {
    /// Checks and assembles an arena; walls are obstacles.
    ///
    /// Errors: [`ArenaError`], with `name` in place of a file name.
    pub fn new(
        name: String,
        bounds: Bounds,
        obstacles: Vec<Obstacle>,
        movers: Vec<Mover>,
    ) -> Result<Self, ArenaError> {
        let arena = Self { name, bounds, obstacles, movers };
        check::arena(&arena, &arena.name)?;
        Ok(arena)
    }

    /// Its name, for reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same arena without its movers: the static condition.
    pub fn without_movers(self) -> Self {
        Self { movers: Vec::new(), ..self }
    }

    /// Where the robot must stay.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Static obstacles, walls included.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// Moving cylinders.
    pub fn movers(&self) -> &[Mover] {
        &self.movers
    }
}

#[cfg(test)]
#[path = "arena_tests.rs"]
mod tests;
