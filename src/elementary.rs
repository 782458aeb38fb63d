//! Elementary functions of floats: the same bits on every machine, and no branches, so that loops
//! over them run in vectors.

/// 1.5 x 2^23: what is added to it is rounded to a whole number.
const ROUNDS: f32 = 12_582_912.0;

/// `ln 2` in two parts; a whole number of up to eight bits times the first is exact.
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];

/// Partial sums of a sum.
const LANES: usize = 8;

/// `e^x` for `x` within 80 of 0, to 3e-7 of it.
#[inline]
pub fn exp(x: f32) -> f32 {
    // x = n ln 2 + r, with r within half of ln 2: e^r by its series, 2^n by its bits.
    let shifted = x * std::f32::consts::LOG2_E + ROUNDS;
    let n = shifted - ROUNDS;
    let r = x - n * LN_2[0] - n * LN_2[1];
    let tail = r * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let tail = r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + tail)));
    let power = 1.0 + r * (1.0 + r * (0.5 + tail));
    let exponent = shifted.to_bits().wrapping_sub(ROUNDS.to_bits()).wrapping_add(127);
    power * f32::from_bits(exponent << 23)
}

/// `ln(1 + e^x)` for `x` within 80 of 0, to 5e-7 of it.
#[inline]
pub fn softplus(x: f32) -> f32 {
    // ln(1 + z) = 2 artanh(s), s = z / (2 + z), with z from 0 to 1.
    let z = exp(-x.abs());
    let s = z / (2.0 + z);
    let q = s * s;
    let tail = q * (1.0 / 9.0 + q * (1.0 / 11.0 + q * (1.0 / 13.0)));
    let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + tail)));
    x.max(0.0) + 2.0 * s * series
}

/// Sum, least and largest of some numbers; the sum is of partial sums in a fixed order.
pub fn sum_and_bounds(values: &[f32]) -> (f32, f32, f32) {
    let mut sums = [0.0f32; LANES];
    let (mut least, mut most) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    for chunk in values.chunks(LANES) {
        let lanes = sums.iter_mut().zip(&mut least).zip(&mut most);
        for (((sum, least), most), value) in lanes.zip(chunk) {
            *sum += value;
            *least = least.min(*value);
            *most = most.max(*value);
        }
    }
    let fold = |lanes: [f32; LANES], of: fn(f32, f32) -> f32| lanes.into_iter().reduce(of);
    let sum = sums.into_iter().sum();
    let [least, most] = [fold(least, f32::min), fold(most, f32::max)];
    (sum, least.unwrap_or(f32::INFINITY), most.unwrap_or(f32::NEG_INFINITY))
}

#[cfg(test)]
#[path = "elementary_tests.rs"]
mod tests;
