//! The floor: square tiles in world coordinates.

use super::column::first_from;
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
    pub(super) fn draw(&self, at: &Standpoint, from: &[u8; COLUMNS], shades: &mut [u8]) {
        let top = from.iter().fold(u8::MAX, |top, from| top.min(*from));
        debug_assert!(usize::from(top) >= ROWS / 2, "floor above the horizon");
        let picture = shades.as_chunks_mut::<COLUMNS>().0.iter_mut().enumerate();
        let rows = picture.skip(ROWS / 2).zip(&self.rows).skip(usize::from(top) - ROWS / 2);
        for ((y, pixels), row) in rows {
            let (y, tiles) = (y as u8, self.tiles(at, row));
            for x in 0..COLUMNS {
                pixels[x] = if from[x] <= y { tiles[x] } else { pixels[x] };
            }
        }
    }

    /// Shades of a whole row, tile by tile.
    fn tiles(&self, at: &Standpoint, row: &Row) -> [u8; COLUMNS] {
        let first = at.ahead + at.right * self.slope_first;
        let tile = (at.position.coords + first * row.depth_m) / TILE_M;
        let step = at.right * (row.depth_m * self.slope_step / TILE_M);
        let [mut along_x, mut along_y] = [Steps::new(tile.x, step.x), Steps::new(tile.y, step.y)];
        let mut shades = [0; COLUMNS];
        let mut x = 0;
        while x < COLUMNS {
            let end = along_x.end(x).min(along_y.end(x));
            shades[x..end].fill(self.paint.shade(along_x.tile, along_y.tile, row.kept));
            x = end;
        }
        shades
    }
}

/// One coordinate of the floor along a row, in tiles: `first + step * x` at column `x`.
#[derive(Debug, Clone, Copy)]
struct Steps {
    first: f64,
    step: f64,
    columns_per_tile: f64,
    tile: i64,
    end: usize,
}

impl Steps {
    fn new(first: f64, step: f64) -> Self {
        Self { first, step, columns_per_tile: 1.0 / step, tile: 0, end: 0 }
    }

    /// Where the tile of column `x` ends; columns must be asked for from left to right.
    fn end(&mut self, x: usize) -> usize {
        if x >= self.end {
            let at = |x: usize| self.first + self.step * x as f64;
            self.tile = floor(at(x));
            let (tile, rises) = (self.tile as f64, self.step > 0.0);
            let edge = if rises { tile + 1.0 } else { tile };
            let near = ((edge - self.first) * self.columns_per_tile) as usize;
            let left = |x: usize| if rises { at(x) >= edge } else { at(x) < edge };
            self.end = first_from(near, x + 1..COLUMNS, left);
        }
        self.end
    }
}
