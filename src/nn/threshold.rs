//! Learnable firing thresholds, `H = tanh(r)` (eq. 10).

/// Smallest threshold that projection leaves: a chip has no threshold at or below zero.
pub const THRESHOLD_MIN: f32 = 0.02;

/// `H = tanh(r)`.
pub fn threshold(r: f32) -> f32 {
    libm::tanhf(r)
}

/// The `r` of a threshold in 0 to 1, exclusive.
pub fn r_of(threshold: f32) -> f32 {
    libm::atanhf(threshold)
}

/// `dL/dr` from `dL/dH` (eq. 10): times `1 - tanh^2(r)`.
pub fn r_gradient(r: f32, d_threshold: f32) -> f32 {
    let height = threshold(r);
    d_threshold * (1.0 - height * height)
}

/// Moves `r` so that `tanh(r)` is at least [`THRESHOLD_MIN`].
pub fn project(r: &mut f32) {
    let mut least = r_of(THRESHOLD_MIN);
    while threshold(least) < THRESHOLD_MIN {
        least = least.next_up();
    }
    *r = r.max(least);
}
