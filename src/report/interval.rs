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
    let n = gained + lost;
    let mut ways = 0.5f64.powi(n as i32);
    let mut tail = 0.0;
    for k in 0..=gained.min(lost) {
        tail += ways;
        ways *= (n - k) as f64 / (k + 1) as f64;
    }
    (2.0 * tail).min(1.0)
}

#[cfg(test)]
#[path = "interval_tests.rs"]
mod tests;
