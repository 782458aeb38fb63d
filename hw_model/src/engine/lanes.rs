//! Many compartments of equal parameters at once: the arithmetic of [`crate::compartment`]
//! without branches, in 32 bit, so that a compiler can use vector instructions.
//!
//! Equal to [`update`] bit for bit wherever [`fits`] says that 32 bit are enough and no register
//! overflows; blocks where one does are done again by [`update`]. The differential tests hold both
//! against the dense engine.

use crate::compartment::{CompartmentParams, CompartmentState, Widths, update};
use crate::fixed::{Overflow, decay_toward_zero};

/// Compartments of one spike word.
pub(super) const BLOCK: usize = 64;
/// Largest register width for which no sum of two registers leaves 32 bit.
const BITS_MAX: u32 = 29;

/// What happened in a core's blocks.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BlockCounts {
    pub(super) inactive: u32,
    pub(super) accumulator_overflows: u32,
    pub(super) current_overflows: u32,
    pub(super) bias_sum_overflows: u32,
    pub(super) voltage_clips: u32,
}

/// State of some compartments, each slice of one length of at most [`BLOCK`].
#[derive(Debug)]
pub(super) struct Lanes<'a, S> {
    /// Bias of each compartment; that of the parameters is not looked at.
    pub(super) bias: &'a [i32],
    /// Summed weights in units of `64 << unit_shift`; left at zero.
    pub(super) sums: &'a mut [S],
    pub(super) unit_shift: u32,
    pub(super) current: &'a mut [i32],
    pub(super) voltage: &'a mut [i32],
    pub(super) refractory: &'a mut [u8],
}

/// What a block has done.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockDone {
    /// Bit `i` says whether compartment `i` spiked.
    pub(super) spikes: u64,
    /// Whether any compartment has state or a bias left.
    pub(super) awake: bool,
}

/// Whether the fast path computes the same as [`update`] for these widths.
pub(super) fn fits(widths: &Widths) -> bool {
    (6..=BITS_MAX).contains(&widths.accumulator_bits)
        && widths.accumulator_overflow == Overflow::Wrap
        && widths.current_bits <= BITS_MAX
        && widths.voltage_bits <= BITS_MAX
}

/// One step of a whole block, of which `len` compartments exist and the rest have no state, input
/// or bias. No compartment may have a refractory count. `None`, and nothing done, when a register
/// would overflow.
#[inline(always)]
pub(super) fn update_whole<S: Copy + Default>(
    params: &CompartmentParams,
    widths: &Widths,
    lanes: &mut Lanes<'_, S>,
    len: usize,
    counts: &mut BlockCounts,
) -> Option<BlockDone>
where
    i32: From<S>,
{
    let bias = lanes.bias.first_chunk::<BLOCK>()?;
    let sums = lanes.sums.first_chunk_mut::<BLOCK>()?;
    let current = lanes.current.first_chunk_mut::<BLOCK>()?;
    let voltage = lanes.voltage.first_chunk_mut::<BLOCK>()?;
    // Sums are looked at in units of 64: six bits less.
    let mut sum_range = Range::new(widths.accumulator_bits - 6, Overflow::Wrap);
    let mut current_range = Range::new(widths.current_bits, widths.current_overflow);
    let mut drive_range = Range::new(widths.current_bits, widths.current_plus_bias_overflow);
    let mut voltage_range = Range::new(widths.voltage_bits, Overflow::Clip);
    let mut new_current = [0i32; BLOCK];
    let mut new_voltage = [0i32; BLOCK];
    let mut spiked = [0u8; BLOCK];
    let (mut idle, mut alive) = (0i32, 0i32);
    for i in 0..BLOCK {
        let sum = i32::from(sums[i]) << lanes.unit_shift;
        sum_range.meet(sum);
        idle += ((sum | current[i] | voltage[i] | bias[i]) == 0) as i32;
        let u = decay_toward_zero(current[i], params.current_keep).wrapping_add(sum << 6);
        current_range.meet(u);
        let drive = u.wrapping_add(bias[i]);
        drive_range.meet(drive);
        let v = decay_toward_zero(voltage[i], params.voltage_keep).wrapping_add(drive);
        voltage_range.meet(v);
        let spike = v > params.threshold;
        spiked[i] = u8::from(spike);
        new_current[i] = u;
        new_voltage[i] = if spike { 0 } else { v };
        alive |= new_current[i] | new_voltage[i] | bias[i];
    }
    if [sum_range, current_range, drive_range, voltage_range].iter().any(Range::was_left) {
        return None;
    }
    *sums = [S::default(); BLOCK];
    *current = new_current;
    *voltage = new_voltage;
    counts.inactive += idle as u32 - (BLOCK - len) as u32;
    Some(BlockDone { spikes: packed(&spiked), awake: alive != 0 })
}

/// Whether values stay within a register, found out with two additions each.
#[derive(Debug, Clone, Copy)]
struct Range {
    /// What moves the lowest value to 0, and what moves the highest to the end of the register.
    offsets: [i32; 2],
    /// Bits above the register.
    above: i32,
    met: i32,
}

impl Range {
    #[inline(always)]
    fn new(bits: u32, overflow: Overflow) -> Self {
        let end = 1i32 << bits;
        let offsets = match overflow {
            Overflow::Wrap => [end, end],
            Overflow::Clip => [end - 1, end],
        };
        Self { offsets, above: -(2 << bits), met: 0 }
    }

    #[inline(always)]
    fn meet(&mut self, x: i32) {
        self.met |= x.wrapping_add(self.offsets[0]) | x.wrapping_add(self.offsets[1]);
    }

    #[inline(always)]
    fn was_left(&self) -> bool {
        self.met & self.above != 0
    }
}

/// One bit for each of the flags, which are 0 or 1.
#[inline(always)]
fn packed(flags: &[u8; BLOCK]) -> u64 {
    // The product brings flag `i` of eight to bit 56 + i; no two terms meet.
    const GATHER: u64 = 0x0102_0408_1020_4080;
    let bytes = flags.as_chunks::<8>().0.iter().enumerate();
    bytes.fold(0, |bits, (index, flags)| {
        bits | (u64::from_le_bytes(*flags).wrapping_mul(GATHER) >> 56) << (8 * index)
    })
}

/// One compartment after the other by the plain rule.
#[inline(never)]
pub(super) fn update_each<S: Copy + Default>(
    params: &CompartmentParams,
    widths: &Widths,
    lanes: &mut Lanes<'_, S>,
    len: usize,
    counts: &mut BlockCounts,
) -> BlockDone
where
    i32: From<S>,
{
    let mut block = BlockDone { spikes: 0, awake: false };
    for i in 0..len {
        let sum = i64::from(i32::from(std::mem::take(&mut lanes.sums[i])));
        let before = CompartmentState {
            current: lanes.current[i],
            voltage: lanes.voltage[i],
            refractory_left: lanes.refractory[i],
        };
        let params = CompartmentParams { bias: lanes.bias[i], ..*params };
        let done = update(&params, widths, before, (sum << lanes.unit_shift) << 6);
        lanes.current[i] = done.state.current;
        lanes.voltage[i] = done.state.voltage;
        lanes.refractory[i] = done.state.refractory_left;
        counts.inactive += u32::from(done.inactive);
        counts.accumulator_overflows += u32::from(done.accumulator_overflowed);
        counts.current_overflows += u32::from(done.current_overflowed);
        counts.bias_sum_overflows += u32::from(done.bias_sum_overflowed);
        counts.voltage_clips += u32::from(done.voltage_clipped);
        block.awake |= done.state != CompartmentState::default() || params.bias != 0;
        block.spikes |= u64::from(done.spike) << i;
    }
    block
}
