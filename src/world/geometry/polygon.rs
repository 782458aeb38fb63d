//! A convex polygon, checked once when it is made.

use core::f64::consts::TAU;

use nalgebra::{Point2, Vector2};

use super::{ShapeError, check_point, distance_point_to_segment_m};

/// Most vertices of one polygon.
pub const VERTICES_MAX: usize = 64;

/// Shortest edge.
pub const EDGE_M_MIN: f64 = 1e-3;

/// Smallest area.
pub const AREA_M2_MIN: f64 = 1e-4;

/// Corners may turn inwards by this much: rounding of vertices that lie on one line.
const TURN_RAD_SLACK: f64 = 1e-6;

/// A filled convex polygon in world coordinates, vertices counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexPolygon {
    vertices: Vec<Point2<f64>>,
    edges: Vec<Edge>,
}

/// The line of one edge: points with `normal . p <= offset_m` are on the inner side.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    normal: Vector2<f64>,
    offset_m: f64,
}

impl Edge {
    fn new(from: Point2<f64>, to: Point2<f64>) -> Self {
        let along = to - from;
        let normal = Vector2::new(along.y, -along.x) / along.norm();
        Self { normal, offset_m: normal.dot(&from.coords) }
    }

    /// Signed distance from the edge's line, positive outside.
    fn outside_m(&self, point: Point2<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset_m
    }
}

impl ConvexPolygon {
    /// Takes vertices in either winding order.
    ///
    /// Errors: [`ShapeError`] for too few or many vertices, coordinates outside of the limits, a
    /// repeated vertex, no area, an inward corner or an outline that crosses itself.
    pub fn new(mut vertices: Vec<Point2<f64>>) -> Result<Self, ShapeError> {
        let n = vertices.len();
        if !(3..=VERTICES_MAX).contains(&n) {
            return Err(ShapeError::Vertices { n });
        }
        vertices.iter().try_for_each(|vertex| check_point(*vertex))?;
        check_edges(&vertices)?;
        let area_m2 = signed_area_m2(&vertices);
        if area_m2.abs() < AREA_M2_MIN {
            return Err(ShapeError::Area { area_m2: area_m2.abs() });
        }
        check_convex(&vertices, area_m2.signum())?;
        if area_m2 < 0.0 {
            vertices.reverse();
        }
        let edges = (0..n).map(|i| Edge::new(vertices[i], vertices[(i + 1) % n])).collect();
        Ok(Self { vertices, edges })
    }

    /// A rectangle of full size `size_m` around `centre`, turned by `yaw_rad`.
    pub fn rectangle(
        centre: Point2<f64>,
        yaw_rad: f64,
        size_m: Vector2<f64>,
    ) -> Result<Self, ShapeError> {
        let (cosine, sine) = (libm::cos(yaw_rad), libm::sin(yaw_rad));
        let corner = |x: f64, y: f64| {
            let (x_m, y_m) = (0.5 * x * size_m.x, 0.5 * y * size_m.y);
            centre + Vector2::new(x_m * cosine - y_m * sine, x_m * sine + y_m * cosine)
        };
        Self::new(vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }

    /// The vertices, counter-clockwise, m.
    pub fn vertices(&self) -> &[Point2<f64>] {
        &self.vertices
    }

    /// As [`super::Shape::ray_range_m`]: the ray is clipped by the line of every edge.
    pub fn ray_range_m(&self, origin: Point2<f64>, direction: Vector2<f64>) -> Option<f64> {
        let (mut enter_m, mut exit_m) = (0.0_f64, f64::INFINITY);
        for edge in &self.edges {
            let outside_m = edge.outside_m(origin);
            let approach = -edge.normal.dot(&direction);
            if approach > 0.0 {
                enter_m = enter_m.max(outside_m / approach);
            } else if approach < 0.0 {
                exit_m = exit_m.min(outside_m / approach);
            } else if outside_m > 0.0 {
                return None;
            }
        }
        (enter_m <= exit_m).then_some(enter_m)
    }

    /// As [`super::Shape::distance_m`].
    pub fn distance_m(&self, point: Point2<f64>) -> f64 {
        if self.contains(point) {
            return 0.0;
        }
        self.sides().map(|[a, b]| distance_point_to_segment_m(point, a, b)).fold(INFINITY, f64::min)
    }

    /// As [`super::Shape::distance_to_segment_m`].
    pub fn distance_to_segment_m(&self, from: Point2<f64>, to: Point2<f64>) -> f64 {
        let along = to - from;
        let length_m = along.norm();
        let nearer_end_m = self.distance_m(from).min(self.distance_m(to));
        if length_m == 0.0 {
            return nearer_end_m;
        }
        if self.ray_range_m(from, along / length_m).is_some_and(|range_m| range_m <= length_m) {
            return 0.0;
        }
        self.vertices
            .iter()
            .map(|vertex| distance_point_to_segment_m(*vertex, from, to))
            .fold(nearer_end_m, f64::min)
    }

    /// As [`super::Shape::extent`].
    pub fn extent(&self) -> (Point2<f64>, Point2<f64>) {
        let first = self.vertices[0];
        self.vertices
            .iter()
            .fold((first, first), |(low, high), vertex| (low.inf(vertex), high.sup(vertex)))
    }

    /// Directions from `origin` in which the polygon is seen: a direction towards its inside and
    /// the offsets of both sides from it. `None` from inside or on the edge.
    pub(super) fn bearing_window(&self, origin: Point2<f64>) -> Option<(f64, f64, f64)> {
        if self.edges.iter().all(|edge| edge.outside_m(origin) < 1e-9) {
            return None;
        }
        let to_inside = self.centre() - origin;
        let (mut right_rad, mut left_rad) = (0.0_f64, 0.0_f64);
        for vertex in &self.vertices {
            let offset_rad = turn_rad(to_inside, vertex - origin);
            right_rad = right_rad.min(offset_rad);
            left_rad = left_rad.max(offset_rad);
        }
        Some((libm::atan2(to_inside.y, to_inside.x), right_rad, left_rad))
    }

    fn contains(&self, point: Point2<f64>) -> bool {
        self.edges.iter().all(|edge| edge.outside_m(point) <= 0.0)
    }

    fn centre(&self) -> Point2<f64> {
        let sum: Vector2<f64> = self.vertices.iter().map(|vertex| vertex.coords).sum();
        Point2::from(sum / self.vertices.len() as f64)
    }

    fn sides(&self) -> impl Iterator<Item = [Point2<f64>; 2]> + '_ {
        let n = self.vertices.len();
        (0..n).map(move |i| [self.vertices[i], self.vertices[(i + 1) % n]])
    }
}

const INFINITY: f64 = f64::INFINITY;

/// Angle from `a` to `b`, left positive.
fn turn_rad(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    libm::atan2(a.perp(&b), a.dot(&b))
}

/// Area, positive for counter-clockwise vertices.
fn signed_area_m2(vertices: &[Point2<f64>]) -> f64 {
    let n = vertices.len();
    let origin = vertices[0];
    let cross = |i: usize| (vertices[i] - origin).perp(&(vertices[(i + 1) % n] - origin));
    0.5 * (1..n).map(cross).sum::<f64>()
}

fn check_edges(vertices: &[Point2<f64>]) -> Result<(), ShapeError> {
    let n = vertices.len();
    for vertex in 0..n {
        let length_m = (vertices[(vertex + 1) % n] - vertices[vertex]).norm();
        if length_m < EDGE_M_MIN {
            return Err(ShapeError::Edge { vertex, length_m });
        }
    }
    Ok(())
}

/// A closed outline is simple and convex when no corner turns inwards and the corners turn by one
/// full turn in all (a pentagram turns by two). A spike folds back and then turns inwards.
fn check_convex(vertices: &[Point2<f64>], winding: f64) -> Result<(), ShapeError> {
    let n = vertices.len();
    let mut turned_rad = 0.0;
    for before in 0..n {
        let [a, b, c] = [before, before + 1, before + 2].map(|i| vertices[i % n]);
        let corner_rad = winding * turn_rad(b - a, c - b);
        let vertex = (before + 1) % n;
        turned_rad += corner_rad;
        if corner_rad < -TURN_RAD_SLACK || turned_rad > TAU + 2.0 * TURN_RAD_SLACK * n as f64 {
            return Err(ShapeError::NotConvex { vertex });
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "polygon_tests.rs"]
mod tests;
