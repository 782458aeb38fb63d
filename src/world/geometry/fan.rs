//! Many evenly spaced rays from one point.
//!
//! A laser scan asks for hundreds of rays from the same pose. It is cheaper to find, per
//! obstacle, the few rays that can meet it than to search the tree once per ray.

use core::f64::consts::TAU;

use nalgebra::{Point2, Vector2};

use super::{ConvexPolygon, Disc, Pose, direction, wrap_angle};

/// Rays at evenly spaced angles relative to a heading.
#[derive(Debug, Clone)]
pub struct RayFan {
    first_rad: f64,
    step_rad: f64,
    directions: Vec<Vector2<f64>>,
}

impl RayFan {
    /// `n` rays at `zero_rad + i * step_rad` for `i` from `first` on. All angles must be within
    /// `-2 pi..=2 pi` and the step positive.
    pub fn new(zero_rad: f64, step_rad: f64, first: usize, n: usize) -> Self {
        let angle_rad = |i: usize| zero_rad + i as f64 * step_rad;
        let within = |angle_rad: f64| angle_rad.abs() <= TAU + 1e-6;
        assert!(
            step_rad > 0.0 && n > 0 && within(angle_rad(first)) && within(angle_rad(first + n - 1)),
            "fan of {n} rays from {} rad in steps of {step_rad} rad leaves -2 pi..=2 pi",
            angle_rad(first)
        );
        let directions = (first..first + n).map(|i| direction(angle_rad(i))).collect();
        Self { first_rad: angle_rad(first), step_rad, directions }
    }

    /// Number of rays.
    pub fn n_rays(&self) -> usize {
        self.directions.len()
    }

    /// The fan at `pose`, before it has seen anything.
    pub fn scan(&self, pose: &Pose) -> FanScan<'_> {
        let (cosine, sine) = (libm::cos(pose.yaw_rad), libm::sin(pose.yaw_rad));
        let turned =
            |d: &Vector2<f64>| Vector2::new(d.x * cosine - d.y * sine, d.x * sine + d.y * cosine);
        FanScan {
            fan: self,
            origin: pose.position,
            yaw_rad: pose.yaw_rad,
            directions: self.directions.iter().map(turned).collect(),
            ranges_m: vec![f64::INFINITY; self.n_rays()],
        }
    }

    /// Rays between `right_rad` and `left_rad` (relative to the heading, up to one ray too many
    /// on either side), with the angles moved by `turns` full turns.
    fn rays_between(&self, right_rad: f64, left_rad: f64, turns: f64) -> core::ops::Range<usize> {
        let ray = |angle_rad: f64| (angle_rad + turns * TAU - self.first_rad) / self.step_rad;
        let n_rays = self.n_rays() as f64;
        let start = ray(right_rad).floor().clamp(0.0, n_rays);
        let end = (ray(left_rad).ceil() + 1.0).clamp(start, n_rays);
        start as usize..end as usize
    }
}

/// A fan at one pose and what it has seen so far.
#[derive(Debug, Clone)]
pub struct FanScan<'f> {
    fan: &'f RayFan,
    origin: Point2<f64>,
    yaw_rad: f64,
    directions: Vec<Vector2<f64>>,
    ranges_m: Vec<f64>,
}

impl FanScan<'_> {
    /// Range of every ray to the nearest outline seen, infinite for none.
    pub fn ranges_m(&self) -> &[f64] {
        &self.ranges_m
    }

    /// Shortens the rays that meet `polygon`.
    pub fn see_polygon(&mut self, polygon: &ConvexPolygon) {
        let window = polygon.bearing_window(self.origin);
        self.see(window, |origin, direction| polygon.ray_range_m(origin, direction));
    }

    /// Shortens the rays that meet `disc`.
    pub fn see_disc(&mut self, disc: &Disc) {
        let window = disc.bearing_window(self.origin);
        self.see(window, |origin, direction| disc.ray_range_m(origin, direction));
    }

    /// `window`: direction in the world frame and offsets to the right and to the left of it.
    fn see(
        &mut self,
        window: Option<(f64, f64, f64)>,
        range_m: impl Fn(Point2<f64>, Vector2<f64>) -> Option<f64>,
    ) {
        let Some((middle_rad, right_rad, left_rad)) = window else {
            return self.see_with(0..self.ranges_m.len(), range_m);
        };
        let middle_rad = wrap_angle(middle_rad - self.yaw_rad);
        // The window and the rays are all within -2 pi..=2 pi.
        for turns in [-1.0, 0.0, 1.0] {
            let rays = self.fan.rays_between(middle_rad + right_rad, middle_rad + left_rad, turns);
            self.see_with(rays, &range_m);
        }
    }

    fn see_with(
        &mut self,
        rays: core::ops::Range<usize>,
        range_m: impl Fn(Point2<f64>, Vector2<f64>) -> Option<f64>,
    ) {
        for ray in rays {
            if let Some(range_m) = range_m(self.origin, self.directions[ray]) {
                self.ranges_m[ray] = self.ranges_m[ray].min(range_m);
            }
        }
    }
}

#[cfg(test)]
#[path = "fan_tests.rs"]
mod tests;
