//! Position and heading.

use core::f64::consts::{PI, TAU};

use nalgebra::{Point2, Vector2};

use super::direction;

/// Where the robot is and where it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the centre, m.
    pub position: Point2<f64>,
    /// Heading, counter-clockwise from the x axis.
    pub yaw_rad: f64,
}

impl Pose {
    /// The pose at `(x_m, y_m)` with the heading wrapped to `(-pi, pi]`.
    pub fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { position: Point2::new(x_m, y_m), yaw_rad: wrap_angle(yaw_rad) }
    }

    /// Unit vector of the heading.
    pub fn heading(&self) -> Vector2<f64> {
        direction(self.yaw_rad)
    }

    /// `vector` as seen from here: its parts ahead and to the left.
    pub fn ahead_and_left(&self, vector: Vector2<f64>) -> [f64; 2] {
        let heading = self.heading();
        [vector.dot(&heading), vector.y * heading.x - vector.x * heading.y]
    }

    /// Direction of `point` relative to the heading, in `(-pi, pi]`, left positive; 0 for the
    /// pose's own position.
    pub fn bearing_rad(&self, point: Point2<f64>) -> f64 {
        let to_point = point - self.position;
        if to_point.norm_squared() == 0.0 {
            return 0.0;
        }
        wrap_angle(libm::atan2(to_point.y, to_point.x) - self.yaw_rad)
    }

    /// The pose after driving `distance_m` along an arc that turns the heading by `turn_rad`.
    ///
    /// Exact: the chord of the arc is `distance_m` times `sin(h) / h` with `h` half the turn, and
    /// points along the heading turned by `h`.
    pub fn after_arc(&self, distance_m: f64, turn_rad: f64) -> Self {
        let half_rad = 0.5 * turn_rad;
        let shortening = if half_rad == 0.0 { 1.0 } else { libm::sin(half_rad) / half_rad };
        let chord = direction(self.yaw_rad + half_rad) * (distance_m * shortening);
        Self { position: self.position + chord, yaw_rad: wrap_angle(self.yaw_rad + turn_rad) }
    }

    /// `[x, y, yaw]` rounded to whole millimetres and milliradians.
    pub fn rounded_mm_mrad(&self) -> [i32; 3] {
        [self.position.x, self.position.y, self.yaw_rad]
            .map(|value| libm::round(1000.0 * value) as i32)
    }
}

/// The same angle in `(-pi, pi]`.
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let within_turn = angle_rad % TAU;
    if within_turn > PI {
        within_turn - TAU
    } else if within_turn <= -PI {
        within_turn + TAU
    } else {
        within_turn
    }
}

#[cfg(test)]
#[path = "pose_tests.rs"]
mod tests;
