//! What shows above the walls: a far panorama that moves with the heading only.

use core::f64::consts::TAU;

use super::column::fill;
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
    columns: Vec<Sight>,
    /// Shades of every patch around, row by row from the horizon up.
    shades: Vec<[u8; PATCHES as usize]>,
}

/// Where a column looks.
#[derive(Debug, Clone)]
struct Sight {
    /// Right of the heading.
    angle_rad: f64,
    /// Rows of patches from the top down: number, and the first row of the picture below it.
    patch_rows: Vec<(usize, usize)>,
}

impl Background {
    pub(super) fn new(projection: &Projection, paint: Paint) -> Self {
        let columns: Vec<Sight> = (0..COLUMNS).map(|x| Sight::new(projection, x)).collect();
        let highest = columns.iter().flat_map(|sight| &sight.patch_rows).map(|(row, _)| *row);
        let row = |row: usize| {
            core::array::from_fn(|patch| paint.shade(patch as i64, row as i64, CONTRAST))
        };
        Self { shades: (0..=highest.max().unwrap_or(0)).map(row).collect(), columns }
    }

    /// Draws the rows of column `x` above `end`.
    pub(super) fn draw(&self, at: &Standpoint, x: usize, end: usize, shades: &mut [u8]) {
        let sight = &self.columns[x];
        let turns = (at.yaw_rad - sight.angle_rad) / TAU;
        let patch = floor(turns * PATCHES).rem_euclid(PATCHES as i64) as usize;
        let mut y = 0;
        for (patch_row, below) in &sight.patch_rows {
            if y >= end {
                break;
            }
            fill(shades, x, y..end.min(*below), self.shades[*patch_row][patch]);
            y = *below;
        }
    }
}

impl Sight {
    fn new(projection: &Projection, x: usize) -> Self {
        let slope = projection.slope(x);
        let shortening = 1.0 / libm::sqrt(1.0 + slope * slope);
        let mut patch_rows: Vec<(usize, usize)> = Vec::new();
        for y in 0..ROWS / 2 {
            // Above the horizon, so not negative.
            let row = floor(projection.rise(y) * shortening * PATCHES_PER_RISE) as usize;
            match patch_rows.last_mut() {
                Some((last, below)) if *last == row => *below = y + 1,
                _ => patch_rows.push((row, y + 1)),
            }
        }
        Self { angle_rad: libm::atan(slope), patch_rows }
    }
}
