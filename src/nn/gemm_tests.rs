use super::*;
use crate::rng::{Streams, stream};
use proptest::prelude::*;

fn values(seed: u64, count: usize) -> Vec<f32> {
    let mut draw = Streams::new(seed, 0).at(stream::STIMULUS, 0);
    (0..count).map(|_| draw.gaussian() as f32).collect()
}

fn plain(a: Matrix, b: Matrix) -> Vec<f32> {
    let sum = |row: usize, column: usize| {
        (0..a.columns).map(|k| f64::from(a.at(row, k)) * f64::from(b.at(k, column))).sum::<f64>()
    };
    (0..a.rows * b.columns).map(|at| sum(at / b.columns, at % b.columns) as f32).collect()
}

proptest! {
    #[test]
    fn product_equals_the_sum_of_products_in_every_layout(
        m in 1usize..20, k in 1usize..20, n in 1usize..20, seed in 0u64..1000,
        left_transposed: bool, right_transposed: bool,
    ) {
        let (left, right) = (values(seed, m * k), values(seed + 1, k * n));
        let a = if left_transposed {
            Matrix::new(&left, k, m).transposed()
        } else {
            Matrix::new(&left, m, k)
        };
        let b = if right_transposed {
            Matrix::new(&right, n, k).transposed()
        } else {
            Matrix::new(&right, k, n)
        };
        let mut out = vec![1.0; m * n];
        multiply(a, b, &mut out, true);
        for (found, expected) in out.iter().zip(plain(a, b)) {
            prop_assert!((found - expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
        multiply(a, b, &mut out, false);
        for (found, expected) in out.iter().zip(plain(a, b)) {
            prop_assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }
}

#[test]
fn product_with_an_empty_side_is_empty_or_zero() {
    let mut out = vec![3.0; 4];
    multiply(Matrix::new(&[], 2, 0), Matrix::new(&[], 0, 2), &mut out, false);
    assert_eq!(out, [0.0; 4]);
    multiply(Matrix::new(&[], 0, 2), Matrix::new(&[1.0, 2.0], 2, 1), &mut [], false);
}
