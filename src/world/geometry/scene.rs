//! All static obstacles with parry2d's bounding-volume tree over them.

use core::cell::Cell;

use nalgebra::{Point2, Vector2};
use parry2d::bounding_volume::{Aabb, BoundingVolume};
use parry2d::math::Vector;
use parry2d::partitioning::{Bvh, BvhBuildStrategy};
use parry2d::query::{PointQuery, Ray};

use super::{FanScan, Shape, direction};

/// Boxes of the tree are larger than their obstacles by this much. It exceeds the rounding of
/// `COORDINATE_M_MAX` and of ray directions to `f32` many times, so the tree never prunes the
/// exact answer.
const BOX_SLACK_M: f32 = 2e-3;

/// The static obstacles of an arena.
#[derive(Debug, Clone)]
pub struct StaticScene {
    shapes: Vec<Shape>,
    tree: Bvh,
}

/// What a ray met first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Distance along the ray, 0 from inside an obstacle.
    pub range_m: f64,
    /// Index of the obstacle in the scene.
    pub obstacle_idx: usize,
}

impl StaticScene {
    /// Builds the tree.
    pub fn new(shapes: Vec<Shape>) -> Self {
        let boxes: Vec<Aabb> = shapes.iter().map(enlarged_box).collect();
        Self { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), shapes }
    }

    /// The outlines, in the order given.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// First obstacle along the ray from `origin` in `direction` (length 1), within `range_m_max`.
    /// Of two obstacles at the same range either may be named.
    pub fn ray_hit(
        &self,
        origin: Point2<f64>,
        direction: Vector2<f64>,
        range_m_max: f64,
    ) -> Option<RayHit> {
        let best = Best::below(range_m_max);
        let ray = Ray::new(to_parry(origin.coords), to_parry(direction));
        self.tree.find_best(
            f32::MAX,
            |node, best_m| node.cast_ray(&ray, best_m),
            |idx, _| best.offer(idx, self.shapes[idx as usize].ray_range_m(origin, direction)?),
        );
        best.found().map(|(obstacle_idx, range_m)| RayHit { range_m, obstacle_idx })
    }

    /// Range to the first obstacle at `angle_rad` (world frame) from `origin`; `None` when there
    /// is none within `range_m_max`.
    pub fn ray_range_m(
        &self,
        origin: Point2<f64>,
        angle_rad: f64,
        range_m_max: f64,
    ) -> Option<f64> {
        self.ray_hit(origin, direction(angle_rad), range_m_max).map(|hit| hit.range_m)
    }

    /// Index of the obstacle nearest to `point` and the distance to it, 0 inside; `None` in an
    /// empty scene.
    pub fn nearest(&self, point: Point2<f64>) -> Option<(usize, f64)> {
        let best = Best::below(f64::INFINITY);
        let centre = to_parry(point.coords);
        self.tree.find_best(
            f32::MAX,
            |node, _| node.aabb().distance_to_local_point(centre, true),
            |idx, _| best.offer(idx, self.shapes[idx as usize].distance_m(point)),
        );
        best.found()
    }

    /// Distance from `point` to the nearest obstacle, 0 inside, infinite in an empty scene.
    pub fn clearance_m(&self, point: Point2<f64>) -> f64 {
        self.nearest(point).map_or(f64::INFINITY, |(_, distance_m)| distance_m)
    }

    /// Lets the rays of `scan` see every obstacle.
    pub fn cast(&self, scan: &mut FanScan<'_>) {
        for shape in &self.shapes {
            match shape {
                Shape::Polygon(polygon) => scan.see_polygon(polygon),
                Shape::Disc(disc) => scan.see_disc(disc),
            }
        }
    }
}

/// The best leaf in `f64`; the tree itself compares in `f32`.
struct Best {
    idx: Cell<Option<u32>>,
    value: Cell<f64>,
}

impl Best {
    fn below(limit: f64) -> Self {
        Self { idx: Cell::new(None), value: Cell::new(limit) }
    }

    fn offer(&self, idx: u32, value: f64) -> Option<f32> {
        let first_at_limit = self.idx.get().is_none() && value <= self.value.get();
        if first_at_limit || value < self.value.get() {
            self.idx.set(Some(idx));
            self.value.set(value);
        }
        Some(value as f32)
    }

    fn found(&self) -> Option<(usize, f64)> {
        self.idx.get().map(|idx| (idx as usize, self.value.get()))
    }
}

/// The one conversion from world types to parry2d's.
fn to_parry(vector: Vector2<f64>) -> Vector {
    Vector::from(vector.cast::<f32>())
}

fn enlarged_box(shape: &Shape) -> Aabb {
    let (low, high) = shape.extent();
    Aabb::new(to_parry(low.coords), to_parry(high.coords)).loosened(BOX_SLACK_M)
}

#[cfg(test)]
#[path = "scene_tests.rs"]
mod tests;
