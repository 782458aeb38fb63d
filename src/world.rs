//! Robot, obstacles and range sensor: everything outside the controller.
//!
//! State is `f64` in metres, radians and seconds; time is counted in whole physics steps, so
//! nothing drifts. Trigonometry goes through `libm` and square roots are IEEE, so that a trial
//! has the same result on every machine. No network is known here.

pub mod arena;
mod bounded_file;
pub mod dvs;
pub mod geometry;
pub mod laser;
pub mod laser_fault;
pub mod mover;
pub mod pairs;
pub mod robot;
pub(crate) mod shown;
#[cfg(test)]
pub(crate) mod test_data;

use nalgebra::Point2;

use arena::Arena;
use geometry::{Disc, FanScan, StaticScene};

/// Length of a physics step (SAN evaluation, Gazebo: 100 Hz).
pub const PHYSICS_STEP_S: f64 = 0.01;

/// Physics steps per second.
pub const PHYSICS_HZ: u32 = 100;

/// Name that [`World::nearest`] gives to the edge of the arena.
pub const BOUNDS_NAME: &str = "bounds";

/// An arena made ready for queries. Shared read-only by all trials flown in it.
#[derive(Debug, Clone)]
pub struct World {
    arena: Arena,
    scene: StaticScene,
}

/// The thing closest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest<'a> {
    /// Name of the obstacle or mover, or [`BOUNDS_NAME`].
    pub name: &'a str,
    /// Distance from the point to its outline, 0 inside.
    pub distance_m: f64,
}

impl World {
    /// Builds the search structure over the arena's static obstacles.
    pub fn new(arena: Arena) -> Self {
        let scene = StaticScene::new(arena.obstacles().iter().map(|o| o.shape.clone()).collect());
        Self { arena, scene }
    }

    /// The arena this world was made of.
    pub fn arena(&self) -> &Arena {
        &self.arena
    }

    /// The static obstacles, in the arena's order.
    pub fn scene(&self) -> &StaticScene {
        &self.scene
    }

    /// Outlines of the movers after `step` physics steps.
    pub fn mover_discs(&self, step: u64) -> Vec<Disc> {
        self.arena.movers().iter().map(|mover| mover.disc(step)).collect()
    }

    /// Static obstacle, mover or (for a point outside of the arena) edge nearest to `point` after
    /// `step` physics steps; `None` in an arena with nothing in it.
    pub fn nearest(&self, point: Point2<f64>, step: u64) -> Option<Nearest<'_>> {
        if !self.arena.bounds().contains(point) {
            return Some(Nearest { name: BOUNDS_NAME, distance_m: 0.0 });
        }
        let closer = |a: Nearest<'_>, b: &Nearest<'_>| a.distance_m < b.distance_m;
        let mut nearest = self.nearest_obstacle(point);
        for mover in self.arena.movers() {
            let found =
                Nearest { name: &mover.name, distance_m: mover.disc(step).distance_m(point) };
            if nearest.as_ref().is_none_or(|nearest| closer(found, nearest)) {
                nearest = Some(found);
            }
        }
        nearest
    }

    fn nearest_obstacle(&self, point: Point2<f64>) -> Option<Nearest<'_>> {
        let (obstacle_idx, distance_m) = self.scene.nearest(point)?;
        Some(Nearest { name: &self.arena.obstacles()[obstacle_idx].name, distance_m })
    }

    /// Lets the rays of `scan` see the static obstacles and the movers after `step` physics steps.
    pub fn cast(&self, scan: &mut FanScan<'_>, step: u64) {
        self.scene.cast(scan);
        for disc in self.mover_discs(step) {
            scan.see_disc(&disc);
        }
    }
}

#[cfg(test)]
#[path = "world_tests.rs"]
mod tests;
