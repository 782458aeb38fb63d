//! Fixed-point rules of the chip: every rounding, wrap and clip, each named once.
//!
//! All state is integer. `u` (current) and `v` (voltage) are signed with 23 magnitude bits, one
//! weight-mantissa step at exponent 0 is 64 units. Sources: nengo-loihi
//! `builder/discretize.py:122-136` and `emulator/interface.py:277-340`, lava
//! `lif/models.py:89-171`, brian2_loihi `loihi_neuron_group.py`, which agree on these rules except
//! where [`wrap_signed`] says otherwise.

use serde::{Deserialize, Serialize};

/// Largest decay: the state is forgotten within one step.
pub const DECAY_UNIT: u32 = 4096;

/// What a register does with a value that it cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Overflow {
    /// Two's complement: the upper bits are lost.
    Wrap,
    /// The nearest of `-(2^bits - 1)` and `2^bits - 1`.
    Clip,
}

/// `x` reduced by `decay` 4096ths: `sgn(x) * ((|x| * (4096 - decay)) >> 12)`.
///
/// The magnitude is floored, so the result moves toward zero for both signs and reaches zero in
/// finite time. `keep` is `4096 - decay` and at most 4096; `|x|` must be below 2^31.
///
/// Why the split: `|x| * keep` needs more than 32 bit. With `|x| = high * 4096 + low` the shifted
/// product is `high * keep + (low * keep >> 12)` without any loss.
#[inline]
pub fn decay_toward_zero(x: i32, keep: u32) -> i32 {
    let magnitude = x.unsigned_abs();
    let kept = (magnitude >> 12) * keep + (((magnitude & 0xfff) * keep) >> 12);
    if x < 0 { -(kept as i32) } else { kept as i32 }
}

/// `x` in two's complement of `bits` magnitude bits and a sign: range `-2^bits ..= 2^bits - 1`.
///
/// `-2^bits` stays as it is and `+2^bits` becomes `-2^bits`, as in nengo-loihi, whose rule was
/// compared with the chip (its issue 106 and pull request 111). Lava has it the other way round
/// (`+2^23` stands, `-2^23` becomes `+2^23`), outside what a signed 24-bit register can hold.
#[inline]
pub fn wrap_signed(x: i64, bits: u32) -> i32 {
    let shift = 63 - bits;
    ((x << shift) >> shift) as i32
}

/// `x` clipped to `-(2^bits - 1) ..= 2^bits - 1`.
#[inline]
pub fn clip_signed(x: i64, bits: u32) -> i32 {
    let limit = (1i64 << bits) - 1;
    x.clamp(-limit, limit) as i32
}

/// `x` put into a register of `bits` magnitude bits by `overflow`; true when it did not fit.
#[inline]
pub fn narrow(x: i64, bits: u32, overflow: Overflow) -> (i32, bool) {
    let stored = match overflow {
        Overflow::Wrap => wrap_signed(x, bits),
        Overflow::Clip => clip_signed(x, bits),
    };
    (stored, i64::from(stored) != x)
}

#[cfg(test)]
#[path = "fixed_tests.rs"]
mod tests;
