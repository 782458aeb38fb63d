//! One compartment, one time step: current-based leaky integrate-and-fire (CUBA LIF).
//!
//! ```text
//! q = sum of the effective weights of all synapses that received a spike
//! u = decay(u) + q                        current, the paper's c
//! v = decay(v) + u + bias                 voltage: the new u enters in the same step
//! v = clip(v);  v = 0 while refractory
//! spike = v > threshold                   strict
//! if spike: v = 0, refractory count = R   u is not touched
//! ```
//! Order and signs as in nengo-loihi `emulator/interface.py`, brian2_loihi and lava, which agree.

use crate::fixed::{DECAY_UNIT, Overflow, clip_signed, decay_toward_zero, narrow};
use crate::spec::Arithmetic;

/// Parameters of a compartment, resolved for execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompartmentParams {
    /// `4096 - decay_u`: what is kept of the current per step.
    pub current_keep: u32,
    /// `4096 - decay_v`: what is kept of the voltage per step.
    pub voltage_keep: u32,
    /// Spikes when the voltage is above this, in chip units (mantissa << 6).
    pub threshold: i32,
    /// Added to the voltage every step, in chip units (mantissa << exponent, not << 6).
    pub bias: i32,
    /// `R`: a spike is followed by `R - 1` steps with the voltage held at 0.
    pub refractory_steps: u8,
}

/// Widths of the registers, resolved for execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Widths {
    pub(crate) accumulator_bits: u32,
    pub(crate) accumulator_overflow: Overflow,
    pub(crate) current_bits: u32,
    pub(crate) current_overflow: Overflow,
    pub(crate) current_plus_bias_overflow: Overflow,
    pub(crate) voltage_bits: u32,
}

impl Widths {
    /// The widths that a chip's arithmetic prescribes.
    pub fn new(arithmetic: &Arithmetic) -> Self {
        Self {
            accumulator_bits: u32::from(arithmetic.accumulator_bits),
            accumulator_overflow: arithmetic.accumulator_overflow,
            current_bits: u32::from(arithmetic.current_bits),
            current_overflow: arithmetic.current_overflow,
            current_plus_bias_overflow: arithmetic.current_plus_bias_overflow,
            voltage_bits: u32::from(arithmetic.voltage_bits),
        }
    }
}

/// State of a compartment between two steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CompartmentState {
    /// `u`, chip units.
    pub current: i32,
    /// `v`, chip units, after reset.
    pub voltage: i32,
    /// Steps for which the voltage stays at 0.
    pub refractory_left: u8,
}

/// What happened in an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Update {
    /// State after the step.
    pub state: CompartmentState,
    /// Voltage that was compared with the threshold.
    pub voltage_before_reset: i32,
    /// Whether the compartment spiked.
    pub spike: bool,
    /// Whether there was nothing to do: no state, no input, no bias.
    pub inactive: bool,
    /// Whether the accumulated input did not fit its register.
    pub accumulator_overflowed: bool,
    /// Whether the current did not fit its register.
    pub current_overflowed: bool,
    /// Whether current plus bias did not fit.
    pub bias_sum_overflowed: bool,
    /// Whether the voltage was clipped.
    pub voltage_clipped: bool,
}

/// Advances one compartment by one step. `input` is the plain sum of the effective weights.
#[inline]
pub fn update(
    params: &CompartmentParams,
    widths: &Widths,
    state: CompartmentState,
    input: i64,
) -> Update {
    let (q, accumulator_overflowed) =
        narrow(input, widths.accumulator_bits, widths.accumulator_overflow);
    let decayed = decay_toward_zero(state.current, params.current_keep);
    let (u, current_overflowed) =
        narrow(i64::from(decayed) + i64::from(q), widths.current_bits, widths.current_overflow);
    let (v, bias_sum_overflowed, voltage_clipped) = new_voltage(params, widths, state, u);
    let spike = v > params.threshold;
    let refractory_left = if spike { params.refractory_steps } else { state.refractory_left };
    Update {
        state: CompartmentState {
            current: u,
            voltage: if spike { 0 } else { v },
            refractory_left: refractory_left.saturating_sub(1),
        },
        voltage_before_reset: v,
        spike,
        inactive: state == CompartmentState::default() && input == 0 && params.bias == 0,
        accumulator_overflowed,
        current_overflowed,
        bias_sum_overflowed,
        voltage_clipped,
    }
}

/// The voltage that was compared with the threshold in a step, from the state before the step and
/// the current after it: a spike takes it away from the state, and whoever reads both gets it back.
pub fn voltage_before_reset(
    params: &CompartmentParams,
    widths: &Widths,
    before: CompartmentState,
    current_after: i32,
) -> i32 {
    new_voltage(params, widths, before, current_after).0
}

/// Voltage before reset, whether current plus bias did not fit, whether the voltage was clipped.
#[inline]
fn new_voltage(
    params: &CompartmentParams,
    widths: &Widths,
    state: CompartmentState,
    u: i32,
) -> (i32, bool, bool) {
    let (drive, bias_sum_overflowed) = narrow(
        i64::from(u) + i64::from(params.bias),
        widths.current_bits,
        widths.current_plus_bias_overflow,
    );
    let sum = i64::from(decay_toward_zero(state.voltage, params.voltage_keep)) + i64::from(drive);
    let clipped = clip_signed(sum, widths.voltage_bits);
    let v = if state.refractory_left > 0 { 0 } else { clipped };
    (v, bias_sum_overflowed, i64::from(clipped) != sum)
}

impl CompartmentParams {
    /// Parameters from the effective decays (0..=4096), threshold mantissa and bias.
    pub fn new(
        decay_current: u16,
        decay_voltage: u16,
        threshold: i32,
        bias: i32,
        refractory_steps: u8,
    ) -> Self {
        Self {
            current_keep: DECAY_UNIT - u32::from(decay_current),
            voltage_keep: DECAY_UNIT - u32::from(decay_voltage),
            threshold,
            bias,
            refractory_steps,
        }
    }
}
