//! Where the movers will be, as far as somebody knows.

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use super::{PHYSICS_STEPS, STEP_S, STEPS};
use crate::closed_loop::Trial;
use crate::world::World;
use crate::world::mover::Mover;

/// Movers farther away than this are not known from the camera.
pub const CAMERA_M: f64 = 6.0;

/// What a planner knows of the movers; it always knows the static obstacles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Knowledge {
    /// Where all of them will be.
    #[default]
    Everything,
    /// What a perfect reader of the event camera and the laser would: place and velocity of those
    /// within the camera's 90 degrees and 6 m, the place of those that only the laser sees. Of the
    /// others nothing.
    Camera,
    /// What a scan of the laser shows: the place of those in front, as if they stood.
    Laser,
}

/// Step by step, centre and radius of what is known.
pub(super) type Forecast = Vec<Vec<(Point2<f64>, f64)>>;

/// The next [`STEPS`] steps.
pub(super) fn forecast(trial: &Trial<'_>, knowledge: Knowledge) -> Forecast {
    let (movers, now) = (trial.world().arena().movers(), trial.steps());
    if knowledge == Knowledge::Everything {
        let at = |mover: &Mover, step| mover.position(now + step * PHYSICS_STEPS);
        let all = |step| movers.iter().map(|mover| (at(mover, step), mover.radius_m())).collect();
        return (1..=STEPS as u64).map(all).collect();
    }
    let known: Vec<_> = movers
        .iter()
        .filter_map(|mover| {
            let velocity = velocity_seen(trial, mover, knowledge)?;
            Some((mover.position(now), velocity, mover.radius_m()))
        })
        .collect();
    let after = |time_s: f64| {
        known.iter().map(move |(place, velocity, radius_m)| (place + velocity * time_s, *radius_m))
    };
    (1..=STEPS).map(|step| after(step as f64 * STEP_S).collect()).collect()
}

/// Velocity that the sensors give a mover, m/s; `None` for one that they do not see.
fn velocity_seen(trial: &Trial<'_>, mover: &Mover, knowledge: Knowledge) -> Option<Vector2<f64>> {
    let sighted = Sighted::of(trial, mover)?;
    match knowledge == Knowledge::Camera && sighted.by_camera() {
        true => Some(mover.velocity_m_per_s(trial.steps())),
        false => Some(Vector2::zeros()),
    }
}

/// A mover that nothing hides, in front of the robot and in its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighted {
    /// Way to its centre, m ahead and m to the left.
    pub way_m: [f64; 2],
    /// How far its centre is.
    pub distance_m: f64,
    /// Its velocity ahead and to the left.
    pub velocity_m_per_s: [f64; 2],
    /// Its radius.
    pub radius_m: f64,
}

impl Sighted {
    fn of(trial: &Trial<'_>, mover: &Mover) -> Option<Self> {
        let (pose, now) = (trial.robot().pose(), trial.steps());
        let way = mover.position(now) - pose.position;
        let way_m = pose.ahead_and_left(way);
        if way_m[0] <= 0.0 || hidden(trial.world(), pose.position, way, mover.radius_m()) {
            return None;
        }
        let velocity = mover.velocity_m_per_s(now);
        Some(Self {
            way_m,
            distance_m: way.norm(),
            velocity_m_per_s: pose.ahead_and_left(velocity),
            radius_m: mover.radius_m(),
        })
    }

    /// Whether it is within the camera's 90 degrees and [`CAMERA_M`].
    fn by_camera(&self) -> bool {
        let [ahead_m, left_m] = self.way_m;
        ahead_m > left_m.abs() && self.distance_m < CAMERA_M
    }
}

/// The movers that a perfect reader of the event camera would see.
pub fn in_view<'t>(trial: &'t Trial<'_>) -> impl Iterator<Item = Sighted> + 't {
    let movers = trial.world().arena().movers().iter();
    movers.filter_map(|mover| Sighted::of(trial, mover)).filter(Sighted::by_camera)
}

/// Whether a static obstacle is between a place and the outline of a mover.
fn hidden(world: &World, from: Point2<f64>, way: Vector2<f64>, radius_m: f64) -> bool {
    let distance_m = way.norm();
    let range_m = (distance_m - radius_m).max(0.01);
    world.scene().ray_hit(from, way / distance_m, range_m).is_some()
}

#[cfg(test)]
#[path = "forecast_tests.rs"]
mod tests;
