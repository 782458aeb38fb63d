//! Blocks of a layer that share a core.
//!
//! Neurons of a tile lie pixel by pixel with all channels of a pixel together, so that the weights
//! from one input to a row of neighbouring pixels are one run of compartments.

use std::ops::Range;

use crate::net::conv2d::Shape;

/// A box of a layer: some channels of some rows and columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tile {
    pub(super) channels: Range<usize>,
    pub(super) rows: Range<usize>,
    pub(super) columns: Range<usize>,
}

impl Tile {
    /// Neurons `range` of a layer that is no picture.
    pub(super) fn flat(range: Range<usize>) -> Self {
        Self { channels: range, rows: 0..1, columns: 0..1 }
    }

    /// Number of neurons.
    pub(super) fn len(&self) -> usize {
        self.channels.len() * self.rows.len() * self.columns.len()
    }

    /// Numbers of the neurons in the order of their compartments.
    pub(super) fn neurons(&self, shape: Shape) -> Vec<usize> {
        let pixels = self.rows.clone().flat_map(|y| self.columns.clone().map(move |x| (y, x)));
        let neurons =
            pixels.flat_map(|(y, x)| self.channels.clone().map(move |c| shape.neuron(c, y, x)));
        neurons.collect()
    }

    /// Compartment of the tile's first channel at row `y`, column `x`.
    pub(super) fn pixel(&self, y: usize, x: usize) -> usize {
        let (row, column) = (y - self.rows.start, x - self.columns.start);
        (row * self.columns.len() + column) * self.channels.len()
    }

    /// Name of what lies on the core.
    pub(super) fn label(&self, name: &str, shape: Shape) -> String {
        let Range { start, end } = self.channels;
        let (rows, columns) = (&self.rows, &self.columns);
        if self.len() == shape.neurons() {
            name.to_owned()
        } else if shape == Shape::flat(shape.channels) {
            format!("{name}[{start}..{end}]")
        } else {
            let (y0, y1) = (rows.start, rows.end);
            let (x0, x1) = (columns.start, columns.end);
            format!("{name}[c{start}..{end},y{y0}..{y1},x{x0}..{x1}]")
        }
    }
}

/// A layer cut into tiles of equal size, but for those at the end of a dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tiling {
    /// Channels, rows and columns of a tile.
    pub(super) size: [usize; 3],
    /// Number of tiles.
    pub(super) n_tiles: usize,
}

impl Tiling {
    fn new(shape: Shape, size: [usize; 3]) -> Self {
        let along = |n: usize, size: usize| n.div_ceil(size);
        let n_tiles = along(shape.channels, size[0])
            * along(shape.height, size[1])
            * along(shape.width, size[2]);
        Self { size, n_tiles }
    }

    /// The tiles: row by row, then column by column, then by channels.
    pub(super) fn tiles(&self, shape: Shape) -> impl Iterator<Item = Tile> + use<> {
        let cut = |n: usize, size: usize| {
            (0..n).step_by(size).map(move |first| first..n.min(first + size))
        };
        let [channels, rows, columns] = self.size;
        cut(shape.height, rows).flat_map(move |rows| {
            cut(shape.width, columns).flat_map(move |columns| {
                let rows = rows.clone();
                cut(shape.channels, channels).map(move |channels| Tile {
                    channels,
                    rows: rows.clone(),
                    columns: columns.clone(),
                })
            })
        })
    }
}

/// All ways to cut `shape` into at most `n_tiles_max` tiles of at most `len_max` neurons, fewest
/// tiles first; of those with equally many, the one that `cost` says takes least.
pub(super) fn tilings(
    shape: Shape,
    len_max: usize,
    n_tiles_max: usize,
    cost: impl Fn(&[usize; 3]) -> usize,
) -> Vec<Tiling> {
    let mut found = Vec::new();
    for channels in sizes(shape.channels) {
        for rows in sizes(shape.height) {
            for columns in sizes(shape.width) {
                let tiling = Tiling::new(shape, [channels, rows, columns]);
                if channels * rows * columns <= len_max && tiling.n_tiles <= n_tiles_max {
                    found.push(tiling);
                }
            }
        }
    }
    found.sort_by_key(|tiling| (tiling.n_tiles, cost(&tiling.size), tiling.size));
    found
}

/// Sizes of `n` things in equal parts, for every number of parts; largest first.
fn sizes(n: usize) -> Vec<usize> {
    // The fewest parts that are smaller than the size before: none is smaller than 1.
    let smaller =
        |size: &usize| size.checked_sub(1).filter(|s| *s > 0).map(|s| n.div_ceil(n.div_ceil(s)));
    std::iter::successors(Some(n), smaller).collect()
}

#[cfg(test)]
#[path = "tile_tests.rs"]
mod tests;
