//! Weights: mantissa, sign mode, precision, exponent, and what they amount to.
//!
//! The chip stores a mantissa of up to 8 bits per synapse and a format for all synapses of an
//! entry. On the grid of the format and with an exponent of 0 or more the effective weight is
//! `mantissa << (6 + exponent)` and all public models agree. Off the grid they do not
//! ([`OffGrid`]), so a core map holds on-grid mantissas only.

use serde::{Deserialize, Serialize};

/// Bits of the largest weight mantissa.
pub const MANTISSA_BITS: u32 = 8;

/// Which signs the weights of a format may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SignMode {
    /// Both; one bit of precision goes to the sign.
    Mixed,
    /// Zero or positive.
    Excitatory,
    /// Zero or negative.
    Inhibitory,
}

/// How the weights of a synapse entry are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SynapseFormat {
    /// Which signs may occur.
    pub sign_mode: SignMode,
    /// Bits per weight, the sign of mixed mode included.
    pub weight_bits: u8,
    /// Power of two that multiplies every mantissa.
    pub exponent: i8,
}

impl SynapseFormat {
    /// Distance between two mantissas that can be told apart: `2^(8 - (bits - is_mixed))`.
    ///
    /// Source: nengo-loihi `block.py` (`shift_bits`); brian2_loihi and lava use the same.
    pub fn mantissa_step(&self) -> i32 {
        let real_bits = u32::from(self.weight_bits) - u32::from(self.sign_mode == SignMode::Mixed);
        1 << (MANTISSA_BITS - real_bits.min(MANTISSA_BITS))
    }

    /// Smallest and largest mantissa of the format, both on its grid.
    pub fn mantissa_range(&self) -> (i32, i32) {
        let top = (1 << MANTISSA_BITS) - self.mantissa_step();
        match self.sign_mode {
            SignMode::Mixed => (-(1 << MANTISSA_BITS), top),
            SignMode::Excitatory => (0, top),
            SignMode::Inhibitory => (-top, 0),
        }
    }

    /// True when the format can hold `mantissa` exactly.
    pub fn holds(&self, mantissa: i32) -> bool {
        let (low, high) = self.mantissa_range();
        (low..=high).contains(&mantissa) && mantissa % self.mantissa_step() == 0
    }

    /// True when it [`Self::holds`] each of them.
    pub fn holds_all(&self, mantissas: &[i16]) -> bool {
        let (low, high) = self.mantissa_range();
        let (low, high, below_step) = (low as i16, high as i16, self.mantissa_step() as i16 - 1);
        let bad = |m: i16| (m < low) | (m > high) | (m & below_step != 0);
        !mantissas.iter().fold(false, |any, m| any | bad(*m))
    }

    /// Effective weight of an on-grid mantissa in units of 64 (one mantissa step at exponent 0).
    ///
    /// A negative exponent shifts right and floors, as brian2_loihi and lava do (rounding of
    /// negative weights with a negative exponent on silicon is not settled by public sources).
    /// The result fits 16 bit: `|w| <= 256 << 7`, clipped to `2^15 - 1` as brian2_loihi clips
    /// to `2^21 - 64` in chip units.
    pub fn effective_steps(&self, mantissa: i16) -> i16 {
        let mantissa = i32::from(mantissa);
        let shifted = match self.exponent {
            e @ 0.. => mantissa << e,
            e => mantissa >> (-e),
        };
        shifted.clamp(-i32::from(i16::MAX), i32::from(i16::MAX)) as i16
    }
}

/// What becomes of a weight that its format cannot hold: the rule of one of the public models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OffGrid {
    /// Refuse it.
    Reject,
    /// nengo-loihi's builder: half to even on the grid, again on the grid of the negative
    /// exponent, clipped symmetrically, then shifted.
    Nengo,
    /// brian2_loihi: toward zero on the grid, floor after the exponent; out of range is refused.
    Brian2Loihi,
    /// lava: floor (mixed) or magnitude toward zero (split) on the grid, floor after the exponent.
    Lava,
}

/// Effective weight in chip units (a multiple of 64) of any integer weight, or `None` when the
/// rule refuses it.
///
/// For mantissas on the grid of `format` and exponents of 0 or more every rule gives
/// `64 * format.effective_steps(weight)`, except that [`OffGrid::Nengo`] never yields -256 and
/// only [`OffGrid::Lava`] takes a weight of the wrong range (it clips).
pub fn effective_weight(weight: i32, format: &SynapseFormat, rule: OffGrid) -> Option<i32> {
    let mantissa = match rule {
        OffGrid::Reject => Some(weight).filter(|w| format.holds(*w)),
        OffGrid::Nengo => return Some(64 * nengo_steps(weight, format)),
        OffGrid::Brian2Loihi => brian_mantissa(weight, format),
        OffGrid::Lava => Some(lava_mantissa(weight, format)),
    }?;
    Some(64 * i32::from(format.effective_steps(mantissa as i16)))
}

fn nengo_steps(weight: i32, format: &SynapseFormat) -> i32 {
    let step = format.mantissa_step();
    let limit = (1 << MANTISSA_BITS) - step;
    let on_grid = |w: i32, step: i32| (round_half_even(w, step) * step).clamp(-limit, limit);
    let mantissa = on_grid(weight, step);
    match format.exponent {
        e @ 0.. => mantissa << e,
        e => on_grid(mantissa, 1 << -e) >> -e,
    }
}

fn brian_mantissa(weight: i32, format: &SynapseFormat) -> Option<i32> {
    let step = format.mantissa_step();
    let (low, high) = match format.sign_mode {
        SignMode::Mixed => (-256, 254),
        SignMode::Excitatory => (0, 255),
        SignMode::Inhibitory => (-255, 0),
    };
    (low..=high).contains(&weight).then_some(weight / step * step)
}

fn lava_mantissa(weight: i32, format: &SynapseFormat) -> i32 {
    let step = format.mantissa_step();
    match format.sign_mode {
        SignMode::Mixed => weight.clamp(-256, 255).div_euclid(step) * step,
        SignMode::Excitatory => weight.clamp(0, 255) / step * step,
        SignMode::Inhibitory => weight.clamp(-255, 0) / step * step,
    }
}

/// `value / step` rounded to the nearest integer, ties to even. `step` is positive.
fn round_half_even(value: i32, step: i32) -> i32 {
    let floor = value.div_euclid(step);
    let twice_rest = 2 * value.rem_euclid(step);
    match twice_rest.cmp(&step) {
        std::cmp::Ordering::Less => floor,
        std::cmp::Ordering::Greater => floor + 1,
        std::cmp::Ordering::Equal => floor + (floor & 1),
    }
}

#[cfg(test)]
#[path = "weight_tests.rs"]
mod tests;
