//! What the robot's sensors could show of the movers, to a perfect reader of theirs.

use nalgebra::{Point2, Vector2};

use super::Trial;
use crate::world::World;
use crate::world::dvs::CAMERA_DEG;
use crate::world::geometry::Pose;
use crate::world::mover::Mover;

/// Movers farther away than this are not known from a camera.
pub const CAMERA_M: f64 = 6.0;

/// A mover that nothing hides, in front of the robot and in its frame: the laser sees it.
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
    /// How `mover` is seen from `pose` after `step` physics steps, if it is.
    pub fn of(world: &World, pose: &Pose, mover: &Mover, step: u64) -> Option<Self> {
        let way = mover.position(step) - pose.position;
        let way_m = pose.ahead_and_left(way);
        if way_m[0] <= 0.0 || hidden(world, pose.position, way, mover.radius_m()) {
            return None;
        }
        Some(Self {
            way_m,
            distance_m: way.norm(),
            velocity_m_per_s: pose.ahead_and_left(mover.velocity_m_per_s(step)),
            radius_m: mover.radius_m(),
        })
    }

    /// Whether its centre is in a camera's field of view and within [`CAMERA_M`].
    pub fn by_camera(&self, field_of_view_deg: u16) -> bool {
        let [ahead_m, left_m] = self.way_m;
        let edge = libm::tan(0.5 * f64::from(field_of_view_deg).to_radians());
        edge * ahead_m > left_m.abs() && self.distance_m < CAMERA_M
    }
}

/// The movers that a perfect reader of the event camera would see.
pub fn in_view<'t>(trial: &'t Trial<'_>) -> impl Iterator<Item = Sighted> + 't {
    let (pose, now) = (trial.robot().pose(), trial.steps());
    let movers = trial.world().arena().movers().iter();
    let seen = movers.filter_map(move |mover| Sighted::of(trial.world(), &pose, mover, now));
    seen.filter(|sighted| sighted.by_camera(CAMERA_DEG))
}

/// Whether a static obstacle is between a place and the outline of a mover.
fn hidden(world: &World, from: Point2<f64>, way: Vector2<f64>, radius_m: f64) -> bool {
    let distance_m = way.norm();
    let range_m = (distance_m - radius_m).max(0.01);
    world.scene().ray_hit(from, way / distance_m, range_m).is_some()
}
