use super::*;

#[test]
fn first_draws_of_a_stream_never_change() {
    let mut draw = Streams::new(1, 2).at(stream::LASER_NOISE, 3);
    let bits: Vec<u64> = (0..4).map(|_| draw.bits()).collect();
    assert_eq!(bits, FIRST_BITS);
}

const FIRST_BITS: [u64; 4] = [
    10_919_409_397_835_254_535,
    14_444_057_305_166_984_179,
    5_587_292_146_803_818_047,
    897_199_014_016_868_462,
];

#[test]
fn streams_differ_by_seed_trial_name_and_counter() {
    let first = |seed, trial, name, counter| Streams::new(seed, trial).at(name, counter).bits();
    let base = first(1, 1, "a", 1);
    for other in
        [first(2, 1, "a", 1), first(1, 2, "a", 1), first(1, 1, "b", 1), first(1, 1, "a", 2)]
    {
        assert_ne!(base, other);
    }
}

#[test]
fn gaussian_has_zero_mean_and_unit_variance() {
    let mut draw = Streams::new(7, 0).at("test", 0);
    let values: Vec<f64> = (0..40_000).map(|_| draw.gaussian()).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance =
        values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64;
    assert!(mean.abs() < 0.02, "mean {mean}");
    assert!((variance - 1.0).abs() < 0.03, "variance {variance}");
}

#[test]
fn bernoulli_keeps_to_its_limits() {
    let mut draw = Streams::new(7, 0).at("test", 1);
    assert!((0..100).all(|_| draw.bernoulli(1.0)));
    assert!((0..100).all(|_| !draw.bernoulli(0.0)));
}
