//! Between numbers and spikes: observations to input spikes, output counts to wheel speeds.
//!
//! Float reference and chip share this code and its random draws, so that on equal seeds they see
//! equal spikes.

use crate::net::RateEncoder;
use crate::net::eem_san::ROBOT_STATE;
use crate::policy::{Action, Observation};
use crate::rng::{Draw, Streams, stream};

/// The goal term is 1 at this distance and nearer.
const GOAL_M: f64 = 0.3;

/// A laser term is 1 at this range and nearer.
const LASER_M: f64 = 0.35;

/// Distance between the wheels, as the action decoder has it.
const WHEEL_BASE_M: f64 = 0.25;

/// Spikes of one decision: for each step, one flag per input.
pub type InputSpikes = Vec<Vec<bool>>;

/// Spikes of several layers in the steps of their windows: `[layer][step]`, the numbers of the
/// neurons that spiked, rising. A picture counts channel by channel, row by row.
pub type LayerSpikes = Vec<Vec<Vec<u32>>>;

/// Input spikes of one decision: one Bernoulli draw per step and input.
///
/// Shapes: `steps` rows of one flag per input; drawn step by step, input by input.
pub fn encode(
    encoder: &RateEncoder,
    observation: &Observation,
    steps: u32,
    streams: &Streams,
    tick: u64,
) -> InputSpikes {
    let probabilities = encoder.probabilities(observation);
    let mut draw = streams.at(stream::ENCODER_SPIKES, tick);
    (0..steps).map(|_| probabilities.iter().map(|p| draw.bernoulli(*p)).collect()).collect()
}

/// Spike counts of the two output neurons as wheel speeds: count / T, left then right.
pub fn decode(counts: &[u32], steps: u32) -> Action {
    let rate = |neuron: usize| f64::from(counts[neuron]) / f64::from(steps);
    Action { left: rate(0), right: rate(1) }
}

/// Robot and laser state of EEM-SAN, each number scaled by its range: goal direction / pi, goal
/// term `min(1, 0.3 / d)`, speed / v_max, turning speed / (2 v_max / wheel base), 18 laser terms
/// `clip(0.35 / r, 0, 1)` from left to right.
pub fn robot_state(o: &Observation) -> [f32; ROBOT_STATE] {
    let v_max = o.wheel_speed_m_per_s_max;
    let mut state = [0.0f32; ROBOT_STATE];
    state[0] = (o.goal_direction_rad / std::f64::consts::PI) as f32;
    state[1] = (GOAL_M / o.goal_distance_m.max(GOAL_M)) as f32;
    state[2] = (o.linear_m_per_s / v_max) as f32;
    state[3] = (o.angular_rad_per_s / (2.0 * v_max / WHEEL_BASE_M)) as f32;
    for (term, range) in state[4..].iter_mut().zip(o.laser_m) {
        *term = (LASER_M / range.max(LASER_M)) as f32;
    }
    state
}

/// Spikes of a population code, for each step one flag per neuron; draws in that order.
pub fn population_spikes(activity: &[f64], steps: u32, draw: &mut Draw) -> InputSpikes {
    (0..steps).map(|_| activity.iter().map(|p| draw.bernoulli(*p)).collect()).collect()
}
