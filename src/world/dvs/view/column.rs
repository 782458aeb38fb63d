//! One column of the picture: the things it meets, near to far.

use core::ops::Range;

use super::projection::Projection;
use crate::world::dvs::texture::{Paint, floor, kept_contrast};
use crate::world::dvs::{COLUMNS, ROWS};

/// Size of painted patches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) width_m: f64,
    pub(super) height_m: f64,
}

/// Where a column meets the side of a thing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    /// Depth along the heading.
    pub(super) depth_m: f64,
    /// Height of the thing.
    pub(super) height_m: f64,
    /// Place along the side.
    pub(super) along_m: f64,
    /// Width of the side that one pixel covers.
    pub(super) footprint_m: f64,
    pub(super) paint: Paint,
    pub(super) patch: Patch,
    /// Whether it is a mover.
    pub(super) moves: bool,
}

/// All hits of one column.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    hits: Vec<Hit>,
}

impl Column {
    pub(super) fn clear(&mut self) {
        self.hits.clear();
    }

    pub(super) fn add(&mut self, hit: Hit) {
        self.hits.push(hit);
    }

    pub(super) fn hits(&self) -> &[Hit] {
        &self.hits
    }
}

/// Draws the things that column `x` meets. Returns the rows that they cover: background is above,
/// floor below. As no thing is lower than the lens, all that is behind the first one shows above
/// the horizon only, and the covered rows have no gaps.
pub(super) fn draw_column(
    column: &mut Column,
    projection: &Projection,
    x: usize,
    shades: &mut [u8],
) -> Range<usize> {
    column.hits.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    let mut covered = ROWS / 2..ROWS / 2;
    for (rank, hit) in column.hits.iter().enumerate() {
        let top = projection.row(hit.height_m, hit.depth_m);
        if rank == 0 {
            covered = top..projection.row(0.0, hit.depth_m);
            draw_hit(hit, projection, x, covered.clone(), shades);
        } else if top < covered.start {
            draw_hit(hit, projection, x, top..covered.start, shades);
            covered.start = top;
        }
    }
    covered
}

fn draw_hit(hit: &Hit, projection: &Projection, x: usize, rows: Range<usize>, shades: &mut [u8]) {
    let pixel_m = hit.depth_m / projection.focal_px();
    let Patch { width_m, height_m } = hit.patch;
    let kept = kept_contrast(width_m, hit.footprint_m).min(kept_contrast(height_m, pixel_m));
    let along = hit.along_m / width_m;
    let patches_up =
        |y: usize| (projection.height_m() + hit.depth_m * projection.rise(y)) / height_m;
    let mut y = rows.start;
    while y < rows.end {
        let row = floor(patches_up(y));
        // Patches count upwards, so they fall from row to row of the picture.
        let foot_m = row as f64 * height_m - projection.height_m();
        let near = projection.row_below(foot_m / hit.depth_m);
        let end = first_from(near, y + 1..rows.end, |y| patches_up(y) < row as f64);
        fill(shades, x, y..end, hit.paint.brick(along, row, kept));
        y = end;
    }
}

/// Gives rows of column `x` a shade.
pub(super) fn fill(shades: &mut [u8], x: usize, rows: Range<usize>, shade: u8) {
    for row in &mut shades.as_chunks_mut::<COLUMNS>().0[rows] {
        row[x] = shade;
    }
}

/// The first of `range` for which `is` holds, else its end; it must hold for all after the first.
/// Fast when `near` is close to it.
pub(super) fn first_from(near: usize, range: Range<usize>, is: impl Fn(usize) -> bool) -> usize {
    let mut first = near.clamp(range.start, range.end);
    while first > range.start && is(first - 1) {
        first -= 1;
    }
    while first < range.end && !is(first) {
        first += 1;
    }
    first
}

#[cfg(test)]
#[path = "column_tests.rs"]
mod tests;
