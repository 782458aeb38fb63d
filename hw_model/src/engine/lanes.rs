//! Many compartments of equal parameters at once: the arithmetic of [`crate::compartment`]
//! without branches, in 32 bit, so that a compiler can use vector instructions.
//!
//! Equal to [`update`] bit for bit wherever [`fits`] says that 32 bit are enough; the engine falls
//! back to [`update`] elsewhere. The differential tests hold both against the dense engine.

use crate::compartment::{CompartmentParams, CompartmentState, Widths, update};
use crate::fixed::{Overflow, decay_toward_zero};

/// Compartments of one spike word.
pub(super) const BLOCK: usize = 64;
/// Largest register width for which no sum of two registers leaves 32 bit.
const BITS_MAX: u32 = 29;

/// What happened in a block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BlockCounts {
    pub(super) inactive: u32,
    pub(super) accumulator_overflows: u32,
    pub(super) current_overflows: u32,
    pub(super) bias_sum_overflows: u32,
    pub(super) voltage_clips: u32,
    /// Whether any compartment has state left.
    pub(super) awake: bool,
}

/// State of some compartments, each slice of one length of at most [`BLOCK`].
#[derive(Debug)]
pub(super) struct Lanes<'a> {
    /// Bias of each compartment; that of the parameters is not looked at.
    pub(super) bias: &'a [i32],
    /// Summed weights in units of 64; left at zero.
    pub(super) accumulators: &'a mut [i32],
    pub(super) current: &'a mut [i32],
    pub(super) voltage: &'a mut [i32],
    pub(super) refractory: &'a mut [u8],
}

/// Whether the fast path computes the same as [`update`] for these widths.
pub(super) fn fits(widths: &Widths) -> bool {
    (6..=BITS_MAX).contains(&widths.accumulator_bits)
        && widths.accumulator_overflow == Overflow::Wrap
        && widths.current_bits <= BITS_MAX
        && widths.voltage_bits <= BITS_MAX
}

/// One step of a block; bit `i` of the result says whether compartment `i` spiked.
pub(super) fn update_block(
    params: &CompartmentParams,
    widths: &Widths,
    fast: bool,
    lanes: Lanes<'_>,
    counts: &mut BlockCounts,
) -> u64 {
    // A bias has at most 15 + 8 bits, whatever the chip.
    if fast && params.refractory_steps == 1 {
        update_fast(params, widths, lanes, counts)
    } else {
        update_each(params, widths, lanes, counts)
    }
}

/// No refractory count is ever left, so there is none to look at.
fn update_fast(
    params: &CompartmentParams,
    widths: &Widths,
    lanes: Lanes<'_>,
    counts: &mut BlockCounts,
) -> u64 {
    let n = lanes.accumulators.len();
    let (current, voltage) = (&mut lanes.current[..n], &mut lanes.voltage[..n]);
    let bias = &lanes.bias[..n];
    let mut spiked = [0u8; BLOCK];
    let spiked = &mut spiked[..n];
    // Units of 64 have six bits less; wrapping drops the same upper bits.
    let unused = 31 + 6 - widths.accumulator_bits;
    let limit = (1i32 << widths.voltage_bits) - 1;
    let mut alive = 0i32;
    let (mut idle, mut q_over, mut u_over, mut bias_over, mut clips) =
        (0u32, 0u32, 0u32, 0u32, 0u32);
    for i in 0..n {
        let sum = std::mem::take(&mut lanes.accumulators[i]);
        idle += u32::from((sum | current[i] | voltage[i] | bias[i]) == 0);
        let wrapped = (sum << unused) >> unused;
        q_over += u32::from(wrapped != sum);
        let u = decay_toward_zero(current[i], params.current_keep) + wrapped * 64;
        let stored = narrow(u, widths.current_bits, widths.current_overflow);
        u_over += u32::from(stored != u);
        let drive = stored + bias[i];
        let driven = narrow(drive, widths.current_bits, widths.current_plus_bias_overflow);
        bias_over += u32::from(driven != drive);
        let v = decay_toward_zero(voltage[i], params.voltage_keep) + driven;
        let clipped = v.clamp(-limit, limit);
        clips += u32::from(clipped != v);
        let spike = clipped > params.threshold;
        spiked[i] = u8::from(spike);
        current[i] = stored;
        voltage[i] = if spike { 0 } else { clipped };
        alive |= current[i] | voltage[i] | bias[i];
    }
    counts.inactive += idle;
    counts.accumulator_overflows += q_over;
    counts.current_overflows += u_over;
    counts.bias_sum_overflows += bias_over;
    counts.voltage_clips += clips;
    counts.awake |= alive != 0;
    spiked.iter().enumerate().fold(0, |bits, (i, spike)| bits | u64::from(*spike) << i)
}

/// [`crate::fixed::narrow`] for sums that fit 32 bit.
#[inline]
fn narrow(x: i32, bits: u32, overflow: Overflow) -> i32 {
    let shift = 31 - bits;
    let limit = (1i32 << bits) - 1;
    match overflow {
        Overflow::Wrap => (x << shift) >> shift,
        Overflow::Clip => x.clamp(-limit, limit),
    }
}

/// One compartment after the other by the plain rule.
fn update_each(
    params: &CompartmentParams,
    widths: &Widths,
    lanes: Lanes<'_>,
    counts: &mut BlockCounts,
) -> u64 {
    let mut bits = 0;
    for i in 0..lanes.accumulators.len() {
        let input = 64 * i64::from(std::mem::take(&mut lanes.accumulators[i]));
        let before = CompartmentState {
            current: lanes.current[i],
            voltage: lanes.voltage[i],
            refractory_left: lanes.refractory[i],
        };
        let params = CompartmentParams { bias: lanes.bias[i], ..*params };
        let done = update(&params, widths, before, input);
        lanes.current[i] = done.state.current;
        lanes.voltage[i] = done.state.voltage;
        lanes.refractory[i] = done.state.refractory_left;
        counts.inactive += u32::from(done.inactive);
        counts.accumulator_overflows += u32::from(done.accumulator_overflowed);
        counts.current_overflows += u32::from(done.current_overflowed);
        counts.bias_sum_overflows += u32::from(done.bias_sum_overflowed);
        counts.voltage_clips += u32::from(done.voltage_clipped);
        counts.awake |= done.state != CompartmentState::default() || params.bias != 0;
        bits |= u64::from(done.spike) << i;
    }
    bits
}
