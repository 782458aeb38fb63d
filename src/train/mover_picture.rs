//! Where movers are and how they move, as a picture that a decoder can learn to show.
//!
//! Columns are those of the camera. A mover in view stands in the columns that it covers and some
//! more, in each of four bands of rows with another brightness: how near it is, and that times how
//! fast it comes nearer, goes to the left and goes to the right.

use std::ops::Range;

use crate::closed_loop::sighted::{CAMERA_M, Sighted};
use crate::policy::{FRAME_COLUMNS, FRAME_PIXELS};

/// Rows of each band, and what it shows. How near is the most of the picture: what else there is to
/// say about a mover begins with where it is.
pub const BANDS: [(&str, Range<usize>); 4] = [
    ("nearness", 0..64),
    ("closing", 64..80),
    ("to the left", 80..104),
    ("to the right", 104..128),
];

/// Columns that a mover stands in beside those that it covers, on either side.
const MARGIN_COLUMNS: f64 = 4.0;

/// A speed as bright as can be, m/s: the robot's own.
const FULL_M_PER_S: f64 = 1.0;

/// Draws `movers` into `picture` ([rows, columns]), which may have shown something else. Where
/// several stand in one place, the brightest shows.
pub fn draw(movers: impl Iterator<Item = Sighted>, picture: &mut [f32]) {
    assert_eq!(picture.len(), FRAME_PIXELS, "pixels of a picture");
    picture.fill(0.0);
    for mover in movers {
        let brightness = brightness(&mover);
        let columns = columns(&mover);
        for ((_, rows), brightness) in BANDS.iter().zip(brightness) {
            for row in rows.clone() {
                let line = &mut picture[row * FRAME_COLUMNS..][..FRAME_COLUMNS];
                line[columns.clone()].iter_mut().for_each(|pixel| *pixel = pixel.max(brightness));
            }
        }
    }
}

/// By band, 0 to 1.
fn brightness(mover: &Sighted) -> [f32; 4] {
    let near = (1.0 - mover.distance_m / CAMERA_M) as f32;
    let [ahead, left] = mover.way_m.map(|m| m / mover.distance_m);
    let [to_ahead, to_left] = mover.velocity_m_per_s;
    let closing = -(to_ahead * ahead + to_left * left);
    let leftward = -to_ahead * left + to_left * ahead;
    let share = |speed: f64| (speed / FULL_M_PER_S).clamp(0.0, 1.0) as f32;
    [near, near * share(closing), near * share(leftward), near * share(-leftward)]
}

/// Columns of the picture, 90 degrees wide.
fn columns(mover: &Sighted) -> Range<usize> {
    let half = FRAME_COLUMNS as f64 / 2.0;
    let [ahead_m, left_m] = mover.way_m;
    let middle = half - half * left_m / ahead_m;
    let reach = half * mover.radius_m / ahead_m + MARGIN_COLUMNS;
    let first = ((middle - reach).max(0.0) as usize).min(FRAME_COLUMNS);
    first..((middle + reach) as usize).clamp(first, FRAME_COLUMNS)
}

#[cfg(test)]
#[path = "mover_picture_tests.rs"]
mod tests;
