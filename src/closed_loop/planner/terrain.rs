//! Static clearance and way to a goal on a grid.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Point2;

use crate::world::World;

/// Distance of neighbouring grid points.
const GRID_M: f64 = 0.1;

/// Cells nearer to an obstacle than this cannot be crossed. They have a way all the same, a very
/// long one, so that the value of a place beside them is no cliff.
const CLOSED_M: f64 = 0.2;

/// Price of a step in such a cell.
const CLOSED_PRICE: f64 = 50.0;

/// Ways that come nearer to an obstacle than this cost more.
const ROOMY_M: f64 = 0.6;

/// Price of a step right at a closed cell, in steps.
const NARROW_PRICE: f64 = 4.0;

/// Value of a cell from which the goal cannot be reached.
const FAR_M: f32 = 1e4;

/// Distance to the nearest static obstacle at every grid point of an arena.
#[derive(Debug, Clone)]
pub struct Terrain {
    corner: Point2<f64>,
    columns: usize,
    rows: usize,
    clearance_m: Vec<f32>,
}

impl Terrain {
    /// Measures the static obstacles of `world`.
    pub fn new(world: &World) -> Self {
        let bounds = world.arena().bounds();
        let size = bounds.max - bounds.min;
        let points = |length_m: f64| (length_m / GRID_M) as usize + 2;
        let (columns, rows) = (points(size.x), points(size.y));
        let mut terrain = Self { corner: bounds.min, columns, rows, clearance_m: Vec::new() };
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
        self.interpolate(&self.clearance_m, point).unwrap_or(0.0)
    }

    /// Way to `goal` from every grid point, longer where it is narrow (Dijkstra's algorithm).
    pub fn ways_to(&self, goal: Point2<f64>) -> Vec<f32> {
        let mut way_m = vec![FAR_M; self.clearance_m.len()];
        let mut open = BinaryHeap::new();
        if let Some(cell) = self.cell(goal) {
            way_m[cell] = 0.0;
            open.push((Reverse(0u32), cell));
        }
        while let Some((Reverse(way_mm), cell)) = open.pop() {
            if way_mm > mm(way_m[cell]) {
                continue;
            }
            for (next, step_m) in self.neighbours(cell) {
                let longer_m = way_m[cell] + (step_m * self.price(next)) as f32;
                if mm(longer_m) < mm(way_m[next]) {
                    way_m[next] = longer_m;
                    open.push((Reverse(mm(longer_m)), next));
                }
            }
        }
        way_m
    }

    /// Value of a grid at `point`, by interpolation; `None` outside.
    pub fn interpolate(&self, grid: &[f32], point: Point2<f64>) -> Option<f64> {
        let at = (point - self.corner) / GRID_M;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return None;
        }
        let (column, row) = (at.x as usize, at.y as usize);
        if column + 1 >= self.columns || row + 1 >= self.rows {
            return None;
        }
        let (x, y) = (at.x - column as f64, at.y - row as f64);
        let value = |column: usize, row: usize| f64::from(grid[row * self.columns + column]);
        let lower = value(column, row) * (1.0 - x) + value(column + 1, row) * x;
        let upper = value(column, row + 1) * (1.0 - x) + value(column + 1, row + 1) * x;
        Some(lower * (1.0 - y) + upper * y)
    }

    fn point(&self, cell: usize) -> Point2<f64> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        Point2::new(
            self.corner.x + column as f64 * GRID_M,
            self.corner.y + row as f64 * GRID_M,
        )
    }

    fn cell(&self, point: Point2<f64>) -> Option<usize> {
        let at = (point - self.corner) / GRID_M;
        let (column, row) = (libm::round(at.x), libm::round(at.y));
        let inside = column >= 0.0
            && row >= 0.0
            && (column as usize) < self.columns
            && (row as usize) < self.rows;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    fn price(&self, cell: usize) -> f64 {
        let clearance_m = f64::from(self.clearance_m[cell]);
        if clearance_m < CLOSED_M {
            return CLOSED_PRICE;
        }
        let narrow = ((ROOMY_M - clearance_m) / (ROOMY_M - CLOSED_M)).clamp(0.0, 1.0);
        1.0 + NARROW_PRICE * narrow * narrow
    }

    fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (column, row) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
        let around = (-1..=1i64).flat_map(|y| (-1..=1i64).map(move |x| (x, y)));
        around.filter(|offset| *offset != (0, 0)).filter_map(move |(x, y)| {
            let (column, row) = (column + x, row + y);
            let inside = (0..self.columns as i64).contains(&column)
                && (0..self.rows as i64).contains(&row);
            let next = inside.then(|| row as usize * self.columns + column as usize)?;
            let step_m = if x != 0 && y != 0 { GRID_M * core::f64::consts::SQRT_2 } else { GRID_M };
            Some((next, step_m))
        })
    }
}

fn mm(metres: f32) -> u32 {
    (metres * 1000.0) as u32
}
