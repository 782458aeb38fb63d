//! How much of a difference between success rates is chance.

/// Quantile of the standard normal for two-sided 95 %.
const Z_95: f64 = 1.959_963_984_540_054;

/// 95 % interval of a share by Wilson's score: `successes` of `trials`. (0, 1) for no trials.
///
/// Source: E. B. Wilson 1927, J. Am. Stat. Assoc. 22:209.
pub fn wilson_95(successes: usize, trials: usize) -> (f64, f64) {
    if trials == 0 {
        return (0.0, 1.0);
    }
    let (n, p) = (trials as f64, successes as f64 / trials as f64);
    let (z2, shrink) = (Z_95 * Z_95, 1.0 / (1.0 + Z_95 * Z_95 / n));
    let centre = shrink * (p + z2 / (2.0 * n));
    let half = shrink * Z_95 * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    ((centre - half).max(0.0), (centre + half).min(1.0))
}

/// How likely `gained` against `lost`, or something as uneven, is when either is as likely: the
/// two-sided sign test of trials that ended otherwise (McNemar's, exact).
pub fn sign_test(gained: usize, lost: usize) -> f64 {
    let (n, fewer) = (gained + lost, gained.min(lost));
    // Ways to be as uneven, of all ways: both in units of the most even one, which no n makes too small.
    let (mut ways, mut tail, mut lower) = (1.0, 0.0, 0.0);
    for k in (0..=n / 2).rev() {
        lower += ways;
        tail += if k <= fewer { ways } else { 0.0 };
        ways *= k as f64 / (n - k + 1) as f64;
    }
    // The even split, where there is one, is its own mirror image.
    let all = 2.0 * lower - if n.is_multiple_of(2) { 1.0 } else { 0.0 };
    (2.0 * tail / all).min(1.0)
}

#[cfg(test)]
#[path = "interval_tests.rs"]
mod tests;
