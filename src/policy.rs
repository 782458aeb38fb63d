//! What drives the robot: one observation in, one action out.
//!
//! The float reference of a network and the emulated chip are two [`Policy`] types behind this
//! one trait; the closed loop cannot tell them apart.

mod event_frame;

pub use event_frame::{EventFrame, FRAME_COLUMNS, FRAME_PIXELS, FRAME_ROWS};

use crate::rng::{Draw, Streams};

/// Number of laser sectors that a policy sees.
pub const LASER_SECTORS: usize = 18;

/// Numbers that the simulator tells of movers, where it does: as many as HSVAE's DVS state has.
pub const TOLD: usize = 64;

/// What the robot senses at one control tick (the 22-number state of SAN and EEM-SAN, unscaled).
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Direction of the goal relative to the heading, in `(-pi, pi]`, left positive.
    pub goal_direction_rad: f64,
    /// Distance from the robot's centre to the goal's centre.
    pub goal_distance_m: f64,
    /// Speed along the heading (magnitude).
    pub linear_m_per_s: f64,
    /// Turning speed, left (counter-clockwise) positive.
    pub angular_rad_per_s: f64,
    /// Median range per sector, from left (+85.6 deg) to right (-84.6 deg).
    pub laser_m: [f64; LASER_SECTORS],
    /// Fastest wheel speed: what a component 1 of the action commands (`v_max`).
    pub wheel_speed_m_per_s_max: f64,
    /// Frames of the event camera since the last control tick, oldest first: five at 20 Hz, empty
    /// ones at the first tick; none at all without a camera.
    pub frames: Vec<EventFrame>,
    /// What the simulator tells of movers, [`TOLD`] numbers, in a trial whose driver is told; empty
    /// otherwise.
    pub told: Vec<f32>,
}

impl Observation {
    /// A random one with these frames, for traces, benches and tests: ranges of 0.3 to 3 m, a goal
    /// ahead at 0.3 to 5 m, fastest wheel speed 0.5 m/s.
    pub fn random(draw: &mut Draw, frames: Vec<EventFrame>) -> Self {
        let mut laser_m = [0.0; LASER_SECTORS];
        laser_m.iter_mut().for_each(|range| *range = draw.uniform_in(0.3, 3.0));
        Self {
            goal_direction_rad: draw.uniform_in(-1.0, 1.0),
            goal_distance_m: draw.uniform_in(0.3, 5.0),
            linear_m_per_s: 0.3,
            angular_rad_per_s: 0.1,
            laser_m,
            wheel_speed_m_per_s_max: 0.5,
            frames,
            told: Vec::new(),
        }
    }
}

/// Speeds of the two wheels as fractions of the allowed range, each in `0..=1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    /// Left wheel.
    pub left: f64,
    /// Right wheel.
    pub right: f64,
}

/// A controller in the loop.
pub trait Policy: Send {
    /// Forgets everything and takes the random streams of the trial that starts now.
    fn start_trial(&mut self, streams: Streams);

    /// One decision. `tick` counts the control ticks of the trial from 0.
    fn act(&mut self, observation: &Observation, tick: u64) -> Action;
}
