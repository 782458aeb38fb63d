//! The matrix product, in one place.
//!
//! Large products go through nalgebra, which is a safe door to `matrixmultiply::sgemm` (itself an
//! unsafe function); thin ones, where packing costs more than it saves, are plain loops.

use nalgebra::{DMatrixViewMut, Dyn, MatrixView};

/// Products with an extent up to this one are plain loops.
const THIN: usize = 5;

/// A matrix in a slice: row-major, or the transpose of a row-major one.
#[derive(Debug, Clone, Copy)]
pub struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'a> Matrix<'a> {
    /// Row-major matrix over all of `values`. Panics when there are not `rows * columns`.
    pub fn new(values: &'a [f32], rows: usize, columns: usize) -> Self {
        assert_eq!(values.len(), rows * columns, "elements of a {rows}x{columns} matrix");
        Self { values, rows, columns, row_stride: columns, column_stride: 1 }
    }

    /// Rows and columns exchanged; nothing is moved.
    pub fn transposed(self) -> Self {
        Self {
            values: self.values,
            rows: self.columns,
            columns: self.rows,
            row_stride: self.column_stride,
            column_stride: self.row_stride,
        }
    }

    fn at(&self, row: usize, column: usize) -> f32 {
        self.values[row * self.row_stride + column * self.column_stride]
    }

    fn view(&self) -> MatrixView<'a, f32, Dyn, Dyn, Dyn, Dyn> {
        MatrixView::from_slice_with_strides_generic(
            self.values,
            Dyn(self.rows),
            Dyn(self.columns),
            Dyn(self.row_stride),
            Dyn(self.column_stride),
        )
    }
}

/// `out = a b`, or `out += a b` when `add`.
///
/// Shapes: a m x k, b k x n, `out` row-major m x n. Panics when they do not fit.
pub fn multiply(a: Matrix, b: Matrix, out: &mut [f32], add: bool) {
    assert_eq!(a.columns, b.rows, "inner extents of a matrix product");
    assert_eq!(out.len(), a.rows * b.columns, "elements of a matrix product");
    if !add {
        out.fill(0.0);
    }
    if a.rows.min(a.columns).min(b.columns) <= THIN {
        return thin(a, b, out);
    }
    let (rows, columns) = (a.rows, b.columns);
    let mut view: DMatrixViewMut<f32, Dyn, Dyn> =
        DMatrixViewMut::from_slice_with_strides_mut(out, rows, columns, columns, 1);
    view.gemm(1.0, &a.view(), &b.view(), 1.0);
}

/// `out += a b` by dot products where both run along memory, by rows of `b` otherwise.
fn thin(a: Matrix, b: Matrix, out: &mut [f32]) {
    if out.is_empty() || a.columns == 0 {
        return;
    }
    if b.row_stride == 1 && a.column_stride == 1 {
        thin_dots(a, b, out);
    } else if b.column_stride == 1 {
        thin_rows(a, b, out);
    } else {
        for (at, sum) in out.iter_mut().enumerate() {
            let (row, column) = (at / b.columns, at % b.columns);
            *sum += (0..a.columns).map(|k| a.at(row, k) * b.at(k, column)).sum::<f32>();
        }
    }
}

fn thin_dots(a: Matrix, b: Matrix, out: &mut [f32]) {
    for (row, sums) in out.chunks_exact_mut(b.columns).enumerate() {
        let left = &a.values[row * a.row_stride..][..a.columns];
        for (column, sum) in sums.iter_mut().enumerate() {
            *sum += dot(left, &b.values[column * b.column_stride..][..a.columns]);
        }
    }
}

fn thin_rows(a: Matrix, b: Matrix, out: &mut [f32]) {
    // Few rows of `out`: each row of `b` is read once.
    for k in 0..a.columns {
        let right = &b.values[k * b.row_stride..][..b.columns];
        for (row, sums) in out.chunks_exact_mut(b.columns).enumerate() {
            let factor = a.at(row, k);
            if factor != 0.0 {
                sums.iter_mut().zip(right).for_each(|(sum, value)| *sum += factor * value);
            }
        }
    }
}

/// Dot product in eight partial sums, in a fixed order.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (left, right) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f32 = left.remainder().iter().zip(right.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in left.zip(right) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f32>() + rest
}

#[cfg(test)]
#[path = "gemm_tests.rs"]
mod tests;
