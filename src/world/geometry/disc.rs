//! A circle: the outline of cylinders and of the robot.

use nalgebra::{Point2, Vector2};

use super::{ShapeError, check_point, distance_point_to_segment_m};

/// Smallest radius of an obstacle.
pub(super) const RADIUS_M_MIN: f64 = 0.01;

/// Largest radius of an obstacle.
pub(super) const RADIUS_M_MAX: f64 = 100.0;

/// A filled circle in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    centre: Point2<f64>,
    radius_m: f64,
}

impl Disc {
    /// Errs when a coordinate or the radius is outside of its limits.
    pub fn new(centre: Point2<f64>, radius_m: f64) -> Result<Self, ShapeError> {
        check_point(centre)?;
        if !(RADIUS_M_MIN..=RADIUS_M_MAX).contains(&radius_m) {
            return Err(ShapeError::Radius { radius_m });
        }
        Ok(Self { centre, radius_m })
    }

    /// The centre, m.
    pub fn centre(&self) -> Point2<f64> {
        self.centre
    }

    /// The radius.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The same disc around another centre.
    pub(crate) fn moved_to(&self, centre: Point2<f64>) -> Self {
        Self { centre, ..*self }
    }

    /// As [`super::Shape::ray_range_m`].
    pub fn ray_range_m(&self, origin: Point2<f64>, direction: Vector2<f64>) -> Option<f64> {
        let to_centre = self.centre - origin;
        let ahead_m = to_centre.dot(&direction);
        let outside_m2 = to_centre.norm_squared() - self.radius_m * self.radius_m;
        if outside_m2 <= 0.0 {
            return Some(0.0);
        }
        let half_chord_m2 = ahead_m * ahead_m - outside_m2;
        if ahead_m <= 0.0 || half_chord_m2 < 0.0 {
            return None;
        }
        // The nearer root of the quadratic, in the form that does not cancel.
        Some(outside_m2 / (ahead_m + half_chord_m2.sqrt()))
    }

    /// As [`super::Shape::distance_m`].
    pub fn distance_m(&self, point: Point2<f64>) -> f64 {
        ((point - self.centre).norm() - self.radius_m).max(0.0)
    }

    /// As [`super::Shape::distance_to_segment_m`].
    pub fn distance_to_segment_m(&self, from: Point2<f64>, to: Point2<f64>) -> f64 {
        (distance_point_to_segment_m(self.centre, from, to) - self.radius_m).max(0.0)
    }

    /// As [`super::Shape::extent`].
    pub fn extent(&self) -> (Point2<f64>, Point2<f64>) {
        let reach = Vector2::repeat(self.radius_m);
        (self.centre - reach, self.centre + reach)
    }

    /// Directions from `origin` in which the disc is seen: their middle and the half width. `None`
    /// from inside, where it is everywhere.
    pub(super) fn bearing_window(&self, origin: Point2<f64>) -> Option<(f64, f64, f64)> {
        let to_centre = self.centre - origin;
        let sine = self.radius_m / to_centre.norm();
        if sine >= 1.0 {
            return None;
        }
        let half_rad = libm::asin(sine);
        Some((libm::atan2(to_centre.y, to_centre.x), -half_rad, half_rad))
    }
}
