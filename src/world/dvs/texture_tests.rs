use super::*;

#[test]
fn the_hash_never_changes() {
    // Computed apart from this code, by the definition in its documentation.
    assert_eq!(hash(0, 0, 0), 0);
    assert_eq!(hash(1, 2, 3), HASH_1_2_3);
    assert_eq!(key(&["a", "b"]), KEY_A_B);
    assert_ne!(key(&["ab", ""]), key(&["a", "b"]));
}

const HASH_1_2_3: u64 = 1_071_744_834_027_327_053;
const KEY_A_B: u64 = 12_340_099_932_563_210_358;

#[test]
fn patches_have_the_deviation_asked_for() {
    let values: Vec<f64> = (0..10_000).map(|i| normal(hash(7, i, 1))).collect();
    let mean = values.iter().sum::<f64>() / 1e4;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 1e4;
    assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04, "{mean} {variance}");
    let ln: Vec<f64> = (0..4000)
        .map(|i| ln_intensity(Paint::new(key(&[&i.to_string()]), 0.5).shade(3, 4, 1.0)))
        .collect();
    let mean = ln.iter().sum::<f64>() / 4e3;
    let sigma = (ln.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 4e3).sqrt();
    assert!((mean - 3.8).abs() < 0.05 && (sigma - 0.5).abs() < 0.03, "{mean} {sigma}");
}

#[test]
fn shades_are_even_steps_of_ln_intensity_and_end_at_the_range() {
    assert_eq!((nearest_shade(-5.0), nearest_shade(9.0)), (0, 255));
    for shade in 0..=255 {
        assert_eq!(nearest_shade(ln_intensity(shade)), shade);
    }
}

#[test]
fn floor_rounds_down_on_both_sides_of_zero() {
    for (value, expected) in [(1.5, 1), (-0.5, -1), (-1.0, -1), (0.0, 0), (-7.2, -8)] {
        assert_eq!(floor(value), expected);
    }
}

#[test]
fn contrast_fades_where_patches_are_narrower_than_pixels() {
    assert_eq!(kept_contrast(0.5, 0.1), 1.0);
    assert_eq!(kept_contrast(0.5, 0.5), 0.5);
    assert_eq!(kept_contrast(0.5, 1.5), 0.0);
}

#[test]
fn another_paint_job_or_name_paints_otherwise() {
    let shades =
        |key: u64| -> Vec<u8> { (0..20).map(|i| Paint::new(key, 0.5).shade(i, 0, 1.0)).collect() };
    assert_eq!(shades(key(&["wall", "0"])), shades(key(&["wall", "0"])));
    assert_ne!(shades(key(&["wall", "0"])), shades(key(&["wall", "1"])));
}
