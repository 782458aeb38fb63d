//! Static clearance on a grid, and the time to a goal from every place and heading.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Point2;

use crate::world::World;
use crate::world::geometry::Pose;

/// Distance of neighbouring grid points.
const GRID_M: f64 = 0.12;

/// Cells nearer to an obstacle than this cannot be crossed. They have a time all the same, a very
/// long one, so that the value of a place beside them is no cliff.
const CLOSED_M: f64 = 0.21;

/// Price of a step in such a cell.
const CLOSED_PRICE: f64 = 40.0;

/// Ways that come nearer to an obstacle than this cost more.
const ROOMY_M: f64 = 0.55;

/// Price of a step right at a closed cell, added to 1.
const NARROW_PRICE: f64 = 3.0;

/// A bend takes longer than a straight step by this factor.
const BEND_PRICE: f64 = 1.2;

/// Speed of turning on the spot: one wheel at full speed, the other one nearly at rest.
const SPOT_RAD_PER_S: f64 = 3.0;

/// Steps of the 16 headings, in grid points: the directions nearest to even spacing.
const HEADINGS: [(i64, i64); 16] = [
    (1, 0),
    (2, 1),
    (1, 1),
    (1, 2),
    (0, 1),
    (-1, 2),
    (-1, 1),
    (-2, 1),
    (-1, 0),
    (-2, -1),
    (-1, -1),
    (-1, -2),
    (0, -1),
    (1, -2),
    (1, -1),
    (2, -1),
];

/// Time from a place that the search has not reached.
const FAR_S: f32 = 1e3;

/// Distance to the nearest static obstacle at every grid point of an arena.
#[derive(Debug, Clone)]
pub struct Terrain {
    corner: Point2<f64>,
    columns: usize,
    rows: usize,
    clearance_m: Vec<f32>,
    angles_rad: Vec<f64>,
}

/// Time to a goal at full speed, by place and heading.
#[derive(Debug, Clone)]
pub struct Ways {
    /// Heading fastest, then column, then row.
    time_s: Vec<f32>,
}

impl Terrain {
    /// Measures the static obstacles of `world`.
    pub fn new(world: &World) -> Self {
        let bounds = world.arena().bounds();
        let size = bounds.max - bounds.min;
        let points = |length_m: f64| (length_m / GRID_M) as usize + 2;
        let (columns, rows) = (points(size.x), points(size.y));
        let angle = |(x, y): (i64, i64)| libm::atan2(y as f64, x as f64).rem_euclid(TAU);
        let angles_rad = HEADINGS.map(angle).to_vec();
        let corner = bounds.min;
        let mut terrain = Self { corner, columns, rows, clearance_m: Vec::new(), angles_rad };
        terrain.clearance_m = (0..columns * rows)
            .map(|cell| {
                let point = terrain.point(cell);
                let inside = bounds.contains(point);
                if inside { world.scene().clearance_m(point).min(100.0) as f32 } else { 0.0 }
            })
            .collect();
        terrain
    }

    /// Distance from `point` to the nearest static obstacle, by interpolation; 0 outside.
    pub fn clearance_m(&self, point: Point2<f64>) -> f64 {
        let Some((cell, x, y)) = self.place(point) else { return 0.0 };
        self.blend(cell, x, y, |cell| f64::from(self.clearance_m[cell]))
    }

    /// Times to `goal` from everywhere, longer where it is narrow (Dijkstra's algorithm, backwards
    /// from the goal).
    pub fn ways_to(&self, goal: Point2<f64>, speed_m_per_s: f64) -> Ways {
        let mut time_s = vec![FAR_S; self.clearance_m.len() * HEADINGS.len()];
        let mut open = BinaryHeap::new();
        if let Some((cell, ..)) = self.place(goal) {
            for heading in 0..HEADINGS.len() {
                time_s[cell * HEADINGS.len() + heading] = 0.0;
                open.push((Reverse(0u32), cell * HEADINGS.len() + heading));
            }
        }
        while let Some((Reverse(time), state)) = open.pop() {
            if time > ticks(time_s[state]) {
                continue;
            }
            self.before(state, speed_m_per_s, |from, step_s| {
                let longer_s = time_s[state] + step_s as f32;
                if ticks(longer_s) < ticks(time_s[from]) {
                    time_s[from] = longer_s;
                    open.push((Reverse(ticks(longer_s)), from));
                }
            });
        }
        Ways { time_s }
    }

    /// Time to the goal from `pose`, by interpolation; `None` outside.
    pub fn time_s(&self, ways: &Ways, pose: &Pose) -> Option<f64> {
        let (cell, x, y) = self.place(pose.position)?;
        let yaw_rad = pose.yaw_rad.rem_euclid(TAU);
        let n = HEADINGS.len();
        let low = (0..n).rev().find(|h| self.angles_rad[*h] <= yaw_rad).unwrap_or(0);
        let high = (low + 1) % n;
        let end_rad = if high == 0 { TAU } else { self.angles_rad[high] };
        let share = (yaw_rad - self.angles_rad[low]) / (end_rad - self.angles_rad[low]);
        let at =
            |heading| self.blend(cell, x, y, |cell| f64::from(ways.time_s[cell * n + heading]));
        Some(at(low) * (1.0 - share) + at(high) * share)
    }

    /// States from which one step leads to `state`, and the time of the step.
    fn before(&self, state: usize, speed_m_per_s: f64, mut each: impl FnMut(usize, f64)) {
        let n = HEADINGS.len();
        let (cell, heading) = (state / n, state % n);
        let price = self.price(cell);
        let turns = [(heading + 1) % n, (heading + n - 1) % n];
        for other in turns {
            let turn_rad = (self.angles_rad[heading] - self.angles_rad[other]).abs();
            let turn_rad = turn_rad.min(TAU - turn_rad);
            each(cell * n + other, price * turn_rad / SPOT_RAD_PER_S);
        }
        for from in [heading, turns[0], turns[1]] {
            let (x, y) = HEADINGS[from];
            let (column, row) =
                ((cell % self.columns) as i64 - x, (cell / self.columns) as i64 - y);
            let inside =
                (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
            if !inside {
                continue;
            }
            let length_m = GRID_M * ((x * x + y * y) as f64).sqrt();
            let bend = if from == heading { 1.0 } else { BEND_PRICE };
            let before = row as usize * self.columns + column as usize;
            each(before * n + from, price * bend * length_m / speed_m_per_s);
        }
    }

    /// Cell below and left of `point`, and how far across it the point is.
    fn place(&self, point: Point2<f64>) -> Option<(usize, f64, f64)> {
        let at = (point - self.corner) / GRID_M;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return None;
        }
        let (column, row) = (at.x as usize, at.y as usize);
        let inside = column + 1 < self.columns && row + 1 < self.rows;
        inside.then(|| (row * self.columns + column, at.x - column as f64, at.y - row as f64))
    }

    fn blend(&self, cell: usize, x: f64, y: f64, value: impl Fn(usize) -> f64) -> f64 {
        let lower = value(cell) * (1.0 - x) + value(cell + 1) * x;
        let above = cell + self.columns;
        let upper = value(above) * (1.0 - x) + value(above + 1) * x;
        lower * (1.0 - y) + upper * y
    }

    fn point(&self, cell: usize) -> Point2<f64> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        Point2::new(self.corner.x + column as f64 * GRID_M, self.corner.y + row as f64 * GRID_M)
    }

    fn price(&self, cell: usize) -> f64 {
        let clearance_m = f64::from(self.clearance_m[cell]);
        if clearance_m < CLOSED_M {
            return CLOSED_PRICE;
        }
        let narrow = ((ROOMY_M - clearance_m) / (ROOMY_M - CLOSED_M)).clamp(0.0, 1.0);
        1.0 + NARROW_PRICE * narrow * narrow
    }
}

const TAU: f64 = core::f64::consts::TAU;

/// Tenths of a millisecond: whole numbers order without surprises.
fn ticks(seconds: f32) -> u32 {
    (seconds * 1e4) as u32
}
