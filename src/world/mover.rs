//! Cylinders that go back and forth on a straight track.

use nalgebra::{Point2, Vector2};

use super::PHYSICS_STEP_S;
use super::geometry::{Disc, ShapeError, check_point};

/// Fastest mover.
pub const MOVER_SPEED_M_PER_S_MAX: f64 = 10.0;

/// Shortest track.
pub const TRACK_M_MIN: f64 = 0.01;

/// A cylinder that leaves `from` at time 0, reverses at `to`, and so on at constant speed (as the
/// moving obstacles of Zyunduo/dynamic-threshold and of EEM-SAN, without their pauses).
#[derive(Debug, Clone, PartialEq)]
pub struct Mover {
    /// Name for reports, unique in its arena.
    pub name: String,
    /// Height of the cylinder.
    pub height_m: f64,
    start: Disc,
    to: Point2<f64>,
    track_m: f64,
    speed_m_per_s: f64,
}

/// Why a mover was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MoverError {
    /// The speed is not within its limits.
    #[error(
        "speed {speed_m_per_s} m/s, must be above 0 and at most {limit} m/s \
         (MOVER_SPEED_M_PER_S_MAX); a standing cylinder is an obstacle",
        limit = MOVER_SPEED_M_PER_S_MAX
    )]
    Speed {
        /// The speed.
        speed_m_per_s: f64,
    },
    /// Both ends of the track are (nearly) the same.
    #[error(
        "track is {track_m} m long, at least {limit} m (TRACK_M_MIN); \
         a standing cylinder is an obstacle",
        limit = TRACK_M_MIN
    )]
    Track {
        /// Length of the track.
        track_m: f64,
    },
    /// The disc or an end of the track is not within its limits.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

impl Mover {
    /// Errs when the disc, the track or the speed is outside of its limits.
    pub fn new(
        name: String,
        start: Disc,
        to: Point2<f64>,
        speed_m_per_s: f64,
        height_m: f64,
    ) -> Result<Self, MoverError> {
        check_point(to)?;
        if !(speed_m_per_s > 0.0 && speed_m_per_s <= MOVER_SPEED_M_PER_S_MAX) {
            return Err(MoverError::Speed { speed_m_per_s });
        }
        let track_m = (to - start.centre()).norm();
        if track_m < TRACK_M_MIN {
            return Err(MoverError::Track { track_m });
        }
        Ok(Self { name, height_m, start, to, track_m, speed_m_per_s })
    }

    /// Centre at time 0, one end of the track.
    pub fn from(&self) -> Point2<f64> {
        self.start.centre()
    }

    /// The other end of the track.
    pub fn to(&self) -> Point2<f64> {
        self.to
    }

    /// Speed along the track.
    pub fn speed_m_per_s(&self) -> f64 {
        self.speed_m_per_s
    }

    /// Radius of the cylinder.
    pub fn radius_m(&self) -> f64 {
        self.start.radius_m()
    }

    /// Centre after `step` physics steps, from the step alone: no error adds up.
    pub fn position(&self, step: u64) -> Point2<f64> {
        let travelled_m = step as f64 * (self.speed_m_per_s * PHYSICS_STEP_S);
        let phase_m = travelled_m % (2.0 * self.track_m);
        let along_m = phase_m.min(2.0 * self.track_m - phase_m);
        self.from() + (self.to - self.from()) * (along_m / self.track_m)
    }

    /// Velocity in the physics step after `step`, m/s.
    pub fn velocity_m_per_s(&self, step: u64) -> Vector2<f64> {
        (self.position(step + 1) - self.position(step)) / PHYSICS_STEP_S
    }

    /// Outline after `step` physics steps.
    pub fn disc(&self, step: u64) -> Disc {
        self.start.moved_to(self.position(step))
    }
}

#[cfg(test)]
#[path = "mover_tests.rs"]
mod tests;
