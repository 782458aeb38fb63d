//! How a mover came to touch the robot.

use serde::{Deserialize, Serialize};

use super::sighted::Sighted;
use super::{End, Trial};
use crate::world::dvs::CAMERA_DEG;
use crate::world::geometry::Pose;

/// Contact with a mover: where it came from, and whether sensors could have shown it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MoverContact {
    /// Direction of its centre at contact, from the robot's heading, left positive.
    pub bearing_mrad: i32,
    /// Control ticks that began within the second before contact; fewer in a shorter flight.
    pub ticks: u32,
    /// Those of them at whose beginning the event camera had it in view: within 90 degrees and 6 m,
    /// hidden by nothing. The same for a robot without a camera.
    pub camera_ticks: u32,
    /// Those at whose beginning it was in front and hidden by nothing, as the laser sees.
    pub laser_ticks: u32,
}

/// From which side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Within 45 degrees of the heading.
    Ahead,
    /// From there to 90 degrees.
    Beside,
    /// Beyond.
    Behind,
}

impl MoverContact {
    /// That of a trial that ended so; `None` for one that ended otherwise or goes on.
    pub(super) fn of(trial: &Trial<'_>) -> Option<Self> {
        let Some(End::Hit(name)) = trial.end() else { return None };
        let (world, ticks) = (trial.world(), trial.ticks());
        let mover = world.arena().movers().iter().find(|mover| mover.name == *name)?;
        let bearing_rad = trial.robot().pose().bearing_rad(mover.position(trial.steps()));
        let (mut camera_ticks, mut laser_ticks) = (0, 0);
        let looked_back = ticks.saturating_sub(u64::from(trial.config().control_hz))..ticks;
        for tick in looked_back.clone() {
            let [x, y, yaw] = trial.trajectory()[tick as usize].map(|milli| f64::from(milli) / 1e3);
            let step = tick * trial.config().steps_per_tick();
            let seen = Sighted::of(world, &Pose::new(x, y, yaw), mover, step);
            laser_ticks += u32::from(seen.is_some());
            camera_ticks += u32::from(seen.is_some_and(|seen| seen.by_camera(CAMERA_DEG)));
        }
        let bearing_mrad = libm::round(1e3 * bearing_rad) as i32;
        Some(Self { bearing_mrad, ticks: looked_back.count() as u32, camera_ticks, laser_ticks })
    }

    /// From which side it came.
    pub fn side(&self) -> Side {
        let right_angle_mrad = 500.0 * core::f64::consts::PI;
        match f64::from(self.bearing_mrad).abs() {
            angle if angle < 0.5 * right_angle_mrad => Side::Ahead,
            angle if angle < right_angle_mrad => Side::Beside,
            _ => Side::Behind,
        }
    }
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
