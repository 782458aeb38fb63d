//! Points, poses, outlines, and the questions asked of them.
//!
//! World state is `f64` with nalgebra types. [`StaticScene`] is the only place that touches
//! parry2d: its bounding-volume tree (in `f32`, boxes enlarged to cover the rounding) narrows a
//! query down to few obstacles, and the exact answer is computed here in `f64`. Answers therefore
//! equal those of a plain loop over all obstacles bit for bit; a test holds that.

mod disc;
mod fan;
mod polygon;
mod pose;
mod scene;

pub use disc::Disc;
pub use fan::{FanScan, RayFan};
pub use polygon::{AREA_M2_MIN, ConvexPolygon, EDGE_M_MIN, VERTICES_MAX};
pub use pose::{Pose, wrap_angle};
pub use scene::{RayHit, StaticScene};

use nalgebra::{Point2, Vector2};

/// Largest coordinate of anything in an arena.
pub const COORDINATE_M_MAX: f64 = 1000.0;

/// The outline of an obstacle, in world coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Convex polygon; boxes are polygons too.
    Polygon(ConvexPolygon),
    /// Circle, the outline of a cylinder.
    Disc(Disc),
}

/// Why an outline was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// Fewer than three vertices, or more than the limit.
    #[error(
        "{n} vertices, must be 3..={limit} (VERTICES_MAX); split or thin the polygon",
        limit = VERTICES_MAX
    )]
    Vertices {
        /// Vertices given.
        n: usize,
    },
    /// A coordinate is not a number or too large.
    #[error(
        "coordinate {value_m} m, must be within +-{limit} m (COORDINATE_M_MAX); \
         arenas are in metres",
        limit = COORDINATE_M_MAX
    )]
    Coordinate {
        /// The coordinate.
        value_m: f64,
    },
    /// Two neighbouring vertices (nearly) coincide.
    #[error(
        "edge from vertex {vertex} is {length_m} m long, at least {limit} m (EDGE_M_MIN); \
         drop the vertex",
        limit = EDGE_M_MIN
    )]
    Edge {
        /// First vertex of the edge, from 0.
        vertex: usize,
        /// Its length.
        length_m: f64,
    },
    /// The area is (nearly) zero.
    #[error(
        "area {area_m2} m2, at least {limit} m2 (AREA_M2_MIN); the vertices are on one line, or \
         the outline crosses itself",
        limit = AREA_M2_MIN
    )]
    Area {
        /// The area.
        area_m2: f64,
    },
    /// A corner points inwards, or the outline crosses itself.
    #[error("not convex at vertex {vertex}; split the outline into convex polygons")]
    NotConvex {
        /// The vertex, from 0 in the order given.
        vertex: usize,
    },
    /// A radius is not within its limits.
    #[error("radius {radius_m} m, must be {min}..={max} m", min = disc::RADIUS_M_MIN, max = disc::RADIUS_M_MAX)]
    Radius {
        /// The radius.
        radius_m: f64,
    },
}

impl Shape {
    /// Distance along a ray (`direction` of length 1) to the outline, 0 from inside, `None` for
    /// a miss.
    pub fn ray_range_m(&self, origin: Point2<f64>, direction: Vector2<f64>) -> Option<f64> {
        match self {
            Self::Polygon(polygon) => polygon.ray_range_m(origin, direction),
            Self::Disc(disc) => disc.ray_range_m(origin, direction),
        }
    }

    /// Distance from a point to the outline, 0 inside.
    pub fn distance_m(&self, point: Point2<f64>) -> f64 {
        match self {
            Self::Polygon(polygon) => polygon.distance_m(point),
            Self::Disc(disc) => disc.distance_m(point),
        }
    }

    /// Distance from the straight line `from`-`to` to the outline, 0 when they touch.
    pub fn distance_to_segment_m(&self, from: Point2<f64>, to: Point2<f64>) -> f64 {
        match self {
            Self::Polygon(polygon) => polygon.distance_to_segment_m(from, to),
            Self::Disc(disc) => disc.distance_to_segment_m(from, to),
        }
    }

    /// Smallest and largest coordinates of the outline.
    pub fn extent(&self) -> (Point2<f64>, Point2<f64>) {
        match self {
            Self::Polygon(polygon) => polygon.extent(),
            Self::Disc(disc) => disc.extent(),
        }
    }
}

/// Errs unless both coordinates are finite and within [`COORDINATE_M_MAX`].
pub fn check_point(point: Point2<f64>) -> Result<(), ShapeError> {
    match point.iter().find(|value| value.is_nan() || value.abs() > COORDINATE_M_MAX) {
        Some(value) => Err(ShapeError::Coordinate { value_m: *value }),
        None => Ok(()),
    }
}

/// Distance from `point` to the straight line `from`-`to`.
pub fn distance_point_to_segment_m(point: Point2<f64>, from: Point2<f64>, to: Point2<f64>) -> f64 {
    let along = to - from;
    let length_squared = along.norm_squared();
    if length_squared == 0.0 {
        return (point - from).norm();
    }
    let fraction = ((point - from).dot(&along) / length_squared).clamp(0.0, 1.0);
    (point - (from + along * fraction)).norm()
}

/// Unit vector at `angle_rad` counter-clockwise from the x axis.
pub fn direction(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(libm::cos(angle_rad), libm::sin(angle_rad))
}

#[cfg(test)]
#[path = "geometry_tests.rs"]
mod tests;
