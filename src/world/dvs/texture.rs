//! Piecewise constant paint: every patch of every surface has a brightness that follows from the
//! names of the arena and of the surface alone.
//!
//! A picture holds *shades*, 256 steps of ln intensity. A step is a tenth of a usual threshold,
//! and whatever depends on intensity becomes a table.

/// Number of shades.
pub(super) const SHADES: usize = 256;

/// ln intensity of the darkest and of the lightest shade; intensity is that of an 8-bit picture.
const LN_RANGE: (f64, f64) = (0.7, 5.54);

/// ln intensity of the middle of all surfaces: about 45 of 255.
const LN_MEAN: f64 = 3.8;

/// How the variance of ln intensity splits: this share of the deviation is between surfaces, the
/// rest between the patches of a surface.
const BETWEEN_SURFACES: f64 = 0.6;
const WITHIN_SURFACE: f64 = 0.8;

/// ln intensity of a shade.
pub(super) fn ln_intensity(shade: u8) -> f64 {
    let (dark, light) = LN_RANGE;
    dark + f64::from(shade) * (light - dark) / (SHADES - 1) as f64
}

/// The nearest shade of a value of ln intensity.
fn nearest_shade(ln: f64) -> u8 {
    let (dark, light) = LN_RANGE;
    ((ln - dark) * ((SHADES - 1) as f64 / (light - dark)) + 0.5) as u8
}

/// Paint of one surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paint {
    key: u64,
    base_ln: f64,
    patch_ln: f64,
}

impl Paint {
    /// The paint of the surface `key`. `contrast` is the deviation of ln intensity over all.
    pub(super) fn new(key: u64, contrast: f64) -> Self {
        let base_ln = LN_MEAN + BETWEEN_SURFACES * contrast * normal(hash(key, 0, 0));
        Self { key, base_ln, patch_ln: WITHIN_SURFACE * contrast }
    }

    /// Shade of patch `(i, j)` when its contrast is faded to the share `kept`.
    pub(super) fn shade(&self, i: i64, j: i64, kept: f64) -> u8 {
        let patch = normal(hash(self.key, i as u64, j as u64 ^ PATCH));
        nearest_shade(self.base_ln + kept * self.patch_ln * patch)
    }

    /// Shade of patch `(i, j)` of bricks laid in rows: row `j` is shifted by a part of a patch.
    pub(super) fn brick(&self, along: f64, j: i64, kept: f64) -> u8 {
        let shift = (hash(self.key, j as u64, ROW_SHIFT) >> 56) as f64 / 256.0;
        self.shade(floor(along + shift), j, kept)
    }
}

/// Keep patch hashes apart from those of surfaces and rows.
const PATCH: u64 = 0x5bd1_e995_0000_0000;
const ROW_SHIFT: u64 = 0x1b87_3593_0000_0000;

/// Share of the contrast that is left where a pixel covers `footprint_m` of patches of `patch_m`:
/// all while a patch is wider than 1.5 pixels, nothing below half a pixel.
pub(super) fn kept_contrast(patch_m: f64, footprint_m: f64) -> f64 {
    (patch_m / footprint_m - 0.5).clamp(0.0, 1.0)
}

/// The largest whole number not above `value`, within the range of `i32`.
pub(super) fn floor(value: f64) -> i64 {
    let truncated = value as i32;
    i64::from(truncated) - i64::from(f64::from(truncated) > value)
}

/// Key of a thing by the names that lead to it.
pub(super) fn key(names: &[&str]) -> u64 {
    let mut state = 0xcbf2_9ce4_8422_2325_u64;
    for byte in names.iter().flat_map(|name| name.bytes().chain([0])) {
        state = (state ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    state
}

/// A well-mixed function of three numbers: two rounds of multiply and fold (odd constants of
/// SplitMix64, Steele, Lea and Flood 2014).
pub(super) fn hash(key: u64, i: u64, j: u64) -> u64 {
    let mut state = key
        ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ j.wrapping_mul(0xd1b5_4a32_d192_ed03).rotate_left(32);
    state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    state ^ (state >> 31)
}

/// Nearly standard normal (bounded by +-3.45): the sum of four bytes of a hash.
fn normal(hash: u64) -> f64 {
    let sum = (hash & 255) + (hash >> 8 & 255) + (hash >> 16 & 255) + (hash >> 24 & 255);
    (sum as f64 - 510.0) * (1.0 / 147.799)
}

#[cfg(test)]
#[path = "texture_tests.rs"]
mod tests;
