//! Painted sides of obstacles and movers, and which columns see them at which depth.

use nalgebra::{Point2, Vector2};

use super::column::{Column, Hit, Patch};
use super::projection::{DEPTH_M_MIN, Projection, Standpoint};
use crate::world::arena::Obstacle;
use crate::world::dvs::texture::{self, Paint};
use crate::world::dvs::{COLUMNS, CameraConfig};
use crate::world::geometry::Shape;
use crate::world::mover::Mover;

/// Patches of obstacles: coarse panels.
const PANEL: Patch = Patch { width_m: 1.0, height_m: 0.5 };

/// Patches of movers: finer, so that they stand out by the events that they make.
const MOVER_PATCH: Patch = Patch { width_m: 0.1, height_m: 0.1 };

/// Paints the things of one arena.
#[derive(Debug)]
pub(super) struct Painter<'a> {
    arena: &'a str,
    texture: u64,
    contrast: f64,
    mover_contrast: f64,
}

impl<'a> Painter<'a> {
    pub(super) fn new(arena: &'a str, config: &CameraConfig) -> Self {
        Self {
            arena,
            texture: config.texture,
            contrast: config.contrast,
            mover_contrast: config.mover_contrast,
        }
    }

    /// The paint of the thing with these names.
    pub(super) fn paint(&self, names: &[&str]) -> Paint {
        Paint::new(self.key(names), self.contrast)
    }

    fn key(&self, names: &[&str]) -> u64 {
        let names: Vec<&str> = [self.arena].iter().chain(names).copied().collect();
        texture::key(&names) ^ texture::hash(0, self.texture, 0)
    }
}

/// One side of a polygon, seen from its right.
#[derive(Debug, Clone)]
pub(super) struct Wall {
    from: Point2<f64>,
    to: Point2<f64>,
    length_m: f64,
    height_m: f64,
    paint: Paint,
}

/// The sides of a polygon; none of a disc.
pub(super) fn walls_of(obstacle: &Obstacle, painter: &Painter<'_>) -> Vec<Wall> {
    let Shape::Polygon(polygon) = &obstacle.shape else { return Vec::new() };
    let corners = polygon.vertices();
    let wall = |i: usize| {
        let (from, to) = (corners[i], corners[(i + 1) % corners.len()]);
        let paint = painter.paint(&["obstacle", &obstacle.name, &i.to_string()]);
        Wall { from, to, length_m: (to - from).norm(), height_m: obstacle.height_m, paint }
    };
    (0..corners.len()).map(wall).collect()
}

impl Wall {
    /// Tells every column that sees this side.
    pub(super) fn cast(&self, at: &Standpoint, projection: &Projection, columns: &mut [Column]) {
        if (self.to - self.from).perp(&(at.position - self.from)) >= 0.0 {
            return;
        }
        let (a, b) = (at.see(self.from), at.see(self.to));
        let Some([left, right]) = clip(a, b) else { return };
        let along = Vector2::new(b.0 - a.0, b.1 - a.1) / self.length_m;
        let seen = projection.column(left.0, left.1)..projection.column(right.0, right.1);
        for x in seen {
            let slope = projection.slope(x);
            let across = along.x - slope * along.y;
            let along_m = (slope * a.1 - a.0) / across;
            let depth_m = a.1 + along_m * along.y;
            let footprint_m = depth_m / (projection.focal_px() * across.abs());
            let (height_m, paint) = (self.height_m, self.paint);
            columns[x].add(Hit {
                depth_m,
                height_m,
                along_m,
                footprint_m,
                paint,
                patch: PANEL,
                moves: false,
            });
        }
    }
}

/// The part of `a`-`b` in front of the lens, left end first. Sides are seen with their outer side,
/// so the left end in the picture is `a`.
fn clip(a: (f64, f64), b: (f64, f64)) -> Option<[(f64, f64); 2]> {
    let cut = |near: (f64, f64), far: (f64, f64)| {
        let share = (DEPTH_M_MIN - near.1) / (far.1 - near.1);
        (near.0 + share * (far.0 - near.0), DEPTH_M_MIN)
    };
    match (a.1 >= DEPTH_M_MIN, b.1 >= DEPTH_M_MIN) {
        (true, true) => Some([a, b]),
        (true, false) => Some([a, cut(b, a)]),
        (false, true) => Some([cut(a, b), b]),
        (false, false) => None,
    }
}

/// The side of a cylinder.
#[derive(Debug, Clone)]
pub(super) struct Pillar {
    pub(super) centre: Point2<f64>,
    radius_m: f64,
    height_m: f64,
    paint: Paint,
    patch: Patch,
    moves: bool,
}

impl Pillar {
    /// The side of a disc; none of a polygon.
    pub(super) fn of(obstacle: &Obstacle, painter: &Painter<'_>) -> Option<Self> {
        let Shape::Disc(disc) = &obstacle.shape else { return None };
        let paint = painter.paint(&["obstacle", &obstacle.name]);
        let (centre, radius_m) = (disc.centre(), disc.radius_m());
        Some(Self {
            centre,
            radius_m,
            height_m: obstacle.height_m,
            paint,
            patch: PANEL,
            moves: false,
        })
    }

    /// The side of a mover, which carries its paint along.
    pub(super) fn of_mover(mover: &Mover, painter: &Painter<'_>) -> Self {
        let paint = Paint::new(painter.key(&["mover", &mover.name]), painter.mover_contrast);
        let (centre, radius_m) = (mover.from(), mover.radius_m());
        Self { centre, radius_m, height_m: mover.height_m, paint, patch: MOVER_PATCH, moves: true }
    }

    /// Tells every column that sees this cylinder.
    pub(super) fn cast(&self, at: &Standpoint, projection: &Projection, columns: &mut [Column]) {
        let (right_m, ahead_m) = at.see(self.centre);
        let outside_m2 = right_m * right_m + ahead_m * ahead_m - self.radius_m * self.radius_m;
        if ahead_m + self.radius_m < DEPTH_M_MIN || outside_m2 <= 0.0 {
            return;
        }
        for x in self.columns(right_m, ahead_m, projection) {
            let slope = projection.slope(x);
            let square = slope * slope + 1.0;
            let half = slope * right_m + ahead_m;
            let root2 = half * half - square * outside_m2;
            if root2 < 0.0 || half <= 0.0 {
                continue;
            }
            let depth_m = (half - root2.sqrt()) / square;
            let (nx, nz) = (slope * depth_m - right_m, depth_m - ahead_m);
            let across = (nz + slope * nx).abs() / self.radius_m;
            let footprint_m = depth_m / (projection.focal_px() * across.max(1e-6));
            let out = at.right * nx + at.ahead * nz;
            let along_m = self.radius_m * libm::atan2(out.y, out.x);
            let (height_m, paint, patch, moves) =
                (self.height_m, self.paint, self.patch, self.moves);
            columns[x].add(Hit { depth_m, height_m, along_m, footprint_m, paint, patch, moves });
        }
    }

    /// Columns that may see the cylinder: those of the square around it.
    fn columns(
        &self,
        right_m: f64,
        ahead_m: f64,
        projection: &Projection,
    ) -> core::ops::Range<usize> {
        let near_m = ahead_m - self.radius_m;
        if near_m < DEPTH_M_MIN {
            return 0..COLUMNS;
        }
        let far_m = ahead_m + self.radius_m;
        let (left_m, far_right_m) = (right_m - self.radius_m, right_m + self.radius_m);
        let left_depth_m = if left_m < 0.0 { near_m } else { far_m };
        let right_depth_m = if far_right_m > 0.0 { near_m } else { far_m };
        projection.column(left_m, left_depth_m)..projection.column(far_right_m, right_depth_m)
    }
}
