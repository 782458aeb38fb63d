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

/// What pictures say of velocities beyond what follows from where the movers are.
///
/// Movers that a picture shows in their places, each with the mean speed, explain much of the variance
/// of the bands of speeds. So from closing, and from left less right, that part is taken which is
/// proportional to nearness in the wanted pictures, and the shares of variance are those of the rest.
#[derive(Debug, Clone, Default)]
pub(super) struct Beyond {
    /// Closing, and left less right.
    kinds: [Moments; 2],
}

/// Sums over columns: of a speed `s`, of nearness `n`, and of their errors.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    wanted: Products,
    error: Products,
}

#[derive(Debug, Clone, Copy, Default)]
struct Products {
    s_s: f64,
    s_n: f64,
    n_n: f64,
}

impl Products {
    fn add(&mut self, s: f64, n: f64) {
        self.s_s += s * s;
        self.s_n += s * n;
        self.n_n += n * n;
    }

    /// Sum of the squares of `s - part * n`.
    fn rest(&self, part: f64) -> f64 {
        self.s_s - 2.0 * part * self.s_n + part * part * self.n_n
    }
}

impl Beyond {
    /// Adds a picture that was made and the one that was wanted.
    pub(super) fn add(&mut self, made: &[f32], wanted: &[f32]) {
        for column in 0..FRAME_COLUMNS {
            let [wanted, made] = [wanted, made].map(|picture| levels(picture, column));
            for (kind, moments) in self.kinds.iter_mut().enumerate() {
                let (s, n) = (wanted[1 + kind], wanted[0]);
                moments.wanted.add(s, n);
                moments.error.add(s - made[1 + kind], n - made[0]);
            }
        }
    }

    /// Share of the variance of the rest that was explained; `None` where there is none.
    pub(super) fn explained(&self) -> [(&'static str, Option<f64>); 2] {
        let share = |moments: &Moments| {
            let Moments { wanted, error } = moments;
            let part = if wanted.n_n > 0.0 { wanted.s_n / wanted.n_n } else { 0.0 };
            // What is left by rounding alone is no variance.
            let all = wanted.rest(part);
            (all > 1e-9 * wanted.s_s).then(|| 1.0 - error.rest(part) / all)
        };
        [("closing", share(&self.kinds[0])), ("left less right", share(&self.kinds[1]))]
    }
}

/// Nearness, closing, and left less right in a column: means over their bands.
fn levels(picture: &[f32], column: usize) -> [f64; 3] {
    let [near, closing, left, right] = BANDS.map(|(_, rows)| {
        let n = rows.len() as f64;
        rows.map(|row| f64::from(picture[row * FRAME_COLUMNS + column])).sum::<f64>() / n
    });
    [near, closing, left - right]
}

#[cfg(test)]
#[path = "mover_picture_tests.rs"]
mod tests;
