//! The floor: square tiles in world coordinates.

use super::projection::{Projection, Standpoint};
use crate::world::dvs::texture::{Paint, floor, kept_contrast};
use crate::world::dvs::{COLUMNS, ROWS};

/// Side of a tile.
pub(super) const TILE_M: f64 = 1.0;

/// Share of the contrast of walls that floors have.
const CONTRAST: f64 = 0.6;

/// A painted floor.
#[derive(Debug, Clone)]
pub(super) struct Floor {
    paint: Paint,
    rows: Vec<Row>,
    slope_first: f64,
    slope_step: f64,
}

/// A row of the picture below the horizon.
#[derive(Debug, Clone, Copy)]
struct Row {
    depth_m: f64,
    kept: f64,
}

impl Floor {
    pub(super) fn new(projection: &Projection, paint: Paint) -> Self {
        let row = |y: usize| {
            let depth_m = projection.height_m() / -projection.rise(y);
            // A pixel covers more along the depth than across it.
            let footprint_m = depth_m * depth_m / (projection.focal_px() * projection.height_m());
            Row { depth_m, kept: CONTRAST * kept_contrast(TILE_M, footprint_m) }
        };
        Self {
            paint,
            rows: (ROWS / 2..ROWS).map(row).collect(),
            slope_first: projection.slope(0),
            slope_step: projection.slope(1) - projection.slope(0),
        }
    }

    /// Draws the rows of every column from `from` down.
    pub(super) fn draw(&self, at: &Standpoint, from: &[usize; COLUMNS], shades: &mut [u8]) {
        for (below, row) in self.rows.iter().enumerate() {
            let y = ROWS / 2 + below;
            let first = at.ahead + at.right * self.slope_first;
            let tile = (at.position.coords + first * row.depth_m) / TILE_M;
            let step = at.right * (row.depth_m * self.slope_step / TILE_M);
            let (mut last, mut shade) = ((i64::MIN, i64::MIN), 0);
            for (x, from) in from.iter().enumerate().filter(|(_, from)| **from <= y) {
                debug_assert!(*from >= ROWS / 2, "column {x} has floor above the horizon");
                let here = tile + step * x as f64;
                let tile = (floor(here.x), floor(here.y));
                if tile != last {
                    last = tile;
                    shade = self.paint.shade(tile.0, tile.1, row.kept);
                }
                shades[y * COLUMNS + x] = shade;
            }
        }
    }
}
