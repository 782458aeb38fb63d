//! `reflex`: a hand-wired controller that needs no weights file.
//!
//! Twelve hidden integrate-and-fire neurons and two outputs, wired like a Braitenberg vehicle:
//! obstacles on one side speed up the wheel of that side, the goal on one side slows it down, and
//! something straight ahead turns the robot to the side with more room. It is there so that every
//! command has a network to work on; it is no rival of a trained one.

use crate::net::encoder::{RATE_INPUTS, RateEncoder};
use crate::net::network::{Layer, Network};

const STEPS: u32 = 16;
/// Inputs of the rate code.
const DIRECTION_LEFT: usize = 0;
const DIRECTION_RIGHT: usize = 1;
const LASER: usize = 6;

/// Hidden neurons: each pools what its name says, on the left and on the right.
const HIDDEN: usize = 6;
const SIDE_LEFT: usize = 0;
const SIDE_RIGHT: usize = 1;
const AHEAD_LEFT: usize = 2;
const AHEAD_RIGHT: usize = 3;
const GOAL_LEFT: usize = 4;
const GOAL_RIGHT: usize = 5;

/// Weight of a laser sector, from straight ahead (8) to the side (0), in the side pool.
const SIDE_WEIGHTS: [f32; 9] = [0.10, 0.15, 0.20, 0.30, 0.40, 0.50, 0.55, 0.45, 0.30];
/// The same in the pool of what lies ahead.
const AHEAD_WEIGHTS: [f32; 9] = [0.0, 0.0, 0.0, 0.0, 0.1, 0.3, 0.6, 0.9, 1.0];
/// Part of each pool that is far enough away to be ignored.
const SIDE_IGNORED: f32 = 0.45;
const AHEAD_IGNORED: f32 = 0.35;
const GOAL_GAIN: f32 = 4.0;
const CRUISE: f32 = 0.62;

/// The network: 24 inputs, 6 hidden neurons, 2 wheels, T = 16.
pub(super) fn network() -> Network {
    Network {
        name: "reflex".to_owned(),
        steps: STEPS,
        encoder: RateEncoder {
            goal_distance_scale_m: 0.3,
            linear_scale_m_per_s: 0.5,
            angular_scale_rad_per_s: 2.0,
            laser_scale_m: 0.35,
        },
        relay: false,
        layers: vec![hidden(), wheels()],
    }
}

/// A layer of perfect integrators: the rate of a neuron is its drive, between 0 and 1.
fn integrators(name: &str, inputs: usize, neurons: usize) -> Layer {
    Layer {
        name: name.to_owned(),
        inputs,
        neurons,
        weights: vec![0.0; inputs * neurons],
        bias: vec![0.0; neurons],
        keep_current: 0.0,
        keep_voltage: 1.0,
        threshold: 1.0,
    }
}

fn hidden() -> Layer {
    let mut layer = integrators("pools", RATE_INPUTS, HIDDEN);
    let mut set = |neuron: usize, input: usize, weight: f32| {
        layer.weights[neuron * RATE_INPUTS + input] = weight;
    };
    for sector in 0..9 {
        let (left, right) = (LASER + sector, LASER + 17 - sector);
        set(SIDE_LEFT, left, SIDE_WEIGHTS[sector]);
        set(SIDE_RIGHT, right, SIDE_WEIGHTS[sector]);
        set(AHEAD_LEFT, left, AHEAD_WEIGHTS[sector]);
        set(AHEAD_RIGHT, right, AHEAD_WEIGHTS[sector]);
    }
    set(GOAL_LEFT, DIRECTION_LEFT, GOAL_GAIN);
    set(GOAL_RIGHT, DIRECTION_RIGHT, GOAL_GAIN);
    layer.bias[SIDE_LEFT..=SIDE_RIGHT].fill(-SIDE_IGNORED);
    layer.bias[AHEAD_LEFT..=AHEAD_RIGHT].fill(-AHEAD_IGNORED);
    layer
}

fn wheels() -> Layer {
    let mut layer = integrators("wheels", HIDDEN, 2);
    let left = [0.5, -0.5, 0.2, -0.9, -0.35, 0.25];
    let right = [-0.5, 0.5, -1.0, 0.1, 0.25, -0.35];
    layer.weights = [left, right].concat();
    layer.bias = vec![CRUISE; 2];
    layer
}
