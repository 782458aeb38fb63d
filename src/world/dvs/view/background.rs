//! What shows above the walls: a far panorama that moves with the heading only.

use core::f64::consts::TAU;

use super::projection::{Projection, Standpoint};
use crate::world::dvs::texture::{Paint, floor};
use crate::world::dvs::{COLUMNS, ROWS};

/// Patches of a full turn.
const PATCHES: f64 = 36.0;

/// Patches per unit of rise (height over distance).
const PATCHES_PER_RISE: f64 = 5.0;

/// Share of the contrast of walls that the background has.
const CONTRAST: f64 = 0.6;

/// A painted panorama.
#[derive(Debug, Clone)]
pub(super) struct Background {
    paint: Paint,
    columns: Vec<Sight>,
}

/// Where a column looks.
#[derive(Debug, Clone)]
struct Sight {
    /// Right of the heading.
    angle_rad: f64,
    /// Row of patches at every row above the horizon.
    patch_rows: Vec<i64>,
}

impl Background {
    pub(super) fn new(projection: &Projection, paint: Paint) -> Self {
        let sight = |x: usize| {
            let slope = projection.slope(x);
            let shortening = 1.0 / libm::sqrt(1.0 + slope * slope);
            let patch_row = |y| floor(projection.rise(y) * shortening * PATCHES_PER_RISE);
            Sight {
                angle_rad: libm::atan(slope),
                patch_rows: (0..ROWS / 2).map(patch_row).collect(),
            }
        };
        Self { paint, columns: (0..COLUMNS).map(sight).collect() }
    }

    /// Draws the rows of column `x` above `end`.
    pub(super) fn draw(&self, at: &Standpoint, x: usize, end: usize, shades: &mut [u8]) {
        let sight = &self.columns[x];
        let turns = (at.yaw_rad - sight.angle_rad) / TAU;
        let (mut patch_row, mut shade) = (i64::MIN, 0);
        for y in 0..end {
            if sight.patch_rows[y] != patch_row {
                patch_row = sight.patch_rows[y];
                shade = self.shade(turns, patch_row);
            }
            shades[y * COLUMNS + x] = shade;
        }
    }

    fn shade(&self, turns: f64, patch_row: i64) -> u8 {
        let patch = floor(turns * PATCHES).rem_euclid(PATCHES as i64);
        self.paint.shade(patch, patch_row, CONTRAST)
    }
}
