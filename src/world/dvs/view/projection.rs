//! The pinhole: from metres to rows and columns.

use nalgebra::{Point2, Vector2};

use crate::world::dvs::{COLUMNS, CameraConfig, ROWS};
use crate::world::geometry::{Pose, direction};

/// Things nearer to the lens than this are not drawn; the robot's disc is larger.
pub(super) const DEPTH_M_MIN: f64 = 0.02;

/// Row of the horizon: the lens looks level.
const HORIZON: f64 = ROWS as f64 / 2.0;

/// A pinhole of given focal length and height.
#[derive(Debug, Clone)]
pub(super) struct Projection {
    focal_px: f64,
    height_m: f64,
    slopes: Vec<f64>,
    rises: Vec<f64>,
}

impl Projection {
    pub(super) fn new(config: &CameraConfig) -> Self {
        let half_rad = 0.5 * config.field_of_view_deg.to_radians();
        let half_width = COLUMNS as f64 / 2.0;
        let focal_px = half_width * libm::cos(half_rad) / libm::sin(half_rad);
        let slope = |x: usize| (x as f64 + 0.5 - half_width) / focal_px;
        let rise = |y: usize| (HORIZON - 0.5 - y as f64) / focal_px;
        Self {
            focal_px,
            height_m: config.height_m,
            slopes: (0..COLUMNS).map(slope).collect(),
            rises: (0..ROWS).map(rise).collect(),
        }
    }

    /// Pixels per unit of slope.
    pub(super) fn focal_px(&self) -> f64 {
        self.focal_px
    }

    /// Height of the lens.
    pub(super) fn height_m(&self) -> f64 {
        self.height_m
    }

    /// Metres to the right per metre of depth at the middle of column `x`.
    pub(super) fn slope(&self, x: usize) -> f64 {
        self.slopes[x]
    }

    /// Metres above the lens per metre of depth at the middle of row `y`.
    pub(super) fn rise(&self, y: usize) -> f64 {
        self.rises[y]
    }

    /// First row whose middle is below `rise` metres above the lens per metre of depth, give or take
    /// one: where a search begins.
    pub(super) fn row_below(&self, rise: f64) -> usize {
        (HORIZON + 0.5 - self.focal_px * rise) as usize
    }

    /// First column whose middle is at or right of `right_m` at depth `depth_m`.
    pub(super) fn column(&self, right_m: f64, depth_m: f64) -> usize {
        let edge = COLUMNS as f64 / 2.0 + self.focal_px * (right_m / depth_m);
        (edge - 0.5).ceil().clamp(0.0, COLUMNS as f64) as usize
    }

    /// First row whose middle is at or below height `z_m` (above the floor) at depth `depth_m`.
    pub(super) fn row(&self, z_m: f64, depth_m: f64) -> usize {
        let edge = HORIZON - self.focal_px * ((z_m - self.height_m) / depth_m);
        (edge - 0.5).ceil().clamp(0.0, ROWS as f64) as usize
    }
}

/// Where the lens is and where it looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Standpoint {
    pub(super) position: Point2<f64>,
    pub(super) yaw_rad: f64,
    pub(super) ahead: Vector2<f64>,
    pub(super) right: Vector2<f64>,
}

impl Standpoint {
    pub(super) fn new(pose: &Pose) -> Self {
        let ahead = direction(pose.yaw_rad);
        let right = Vector2::new(ahead.y, -ahead.x);
        Self { position: pose.position, yaw_rad: pose.yaw_rad, ahead, right }
    }

    /// A point as (metres to the right, depth).
    pub(super) fn see(&self, point: Point2<f64>) -> (f64, f64) {
        let to_point = point - self.position;
        (to_point.dot(&self.right), to_point.dot(&self.ahead))
    }
}
