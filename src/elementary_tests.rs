use super::*;

fn numbers() -> impl Iterator<Item = f32> {
    (-8_000..=8_000).map(|n| n as f32 * 0.01 + 0.001 * (n % 7) as f32).filter(|x| x.abs() <= 80.0)
}

#[test]
fn exponential_is_close_everywhere() {
    for x in numbers() {
        let (found, expected) = (f64::from(exp(x)), f64::from(x).exp());
        assert!((found / expected - 1.0).abs() < 3e-7, "{x}: {found}, {expected}");
    }
    assert_eq!(exp(0.0), 1.0);
}

#[test]
fn softplus_is_close_everywhere() {
    for x in numbers() {
        let (found, expected) = (f64::from(softplus(x)), f64::from(x).exp().ln_1p());
        assert!((found / expected - 1.0).abs() < 5e-7, "{x}: {found}, {expected}");
    }
}

#[test]
fn sum_and_bounds_are_of_all_numbers() {
    for n in [1usize, 7, 8, 9, 256] {
        let values: Vec<f32> = (0..n).map(|i| (i as f32 - 3.0) * 0.5).collect();
        let (sum, least, most) = sum_and_bounds(&values);
        assert_eq!((least, most), (values[0], values[n - 1]));
        assert_eq!(sum, values.iter().sum::<f32>());
    }
    assert_eq!(sum_and_bounds(&[]), (0.0, f32::INFINITY, f32::NEG_INFINITY));
}
