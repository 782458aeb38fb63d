//! An event camera (dynamic vision sensor) on the robot: 128 x 128 pixels, 100 frames of events
//! per second.
//!
//! Each physics step of 10 ms the arena is drawn from the robot's pose ([`CameraConfig`] says how
//! high and how wide), and the pixels ([`PixelConfig`]) compare the picture with what they
//! remember. When the picture moves by more than two pixels in a step, up to four pictures are
//! drawn within it, so that narrow things are not jumped over. The events of a step, as bits, are
//! one [`EventFrame`]; five of them make a control tick at 20 Hz.
//!
//! A run replays exactly: paint is a function of names, thresholds are drawn once per device, and
//! noise has a stream per step. `exp` and `ln` go through `libm`.

mod config;
mod frame;
mod light;
mod noise;
pub mod picture;
mod pixels;
mod statistics;
mod stream_file;
mod texture;
mod view;

pub use crate::policy::EventFrame;
pub use config::{
    CAMERA_DEG, CameraConfig, CameraError, FIELD_OF_VIEW_DEG, PixelConfig, THRESHOLD_MIN,
};
pub use frame::Event;
pub use statistics::{Activity, Summary};
pub use stream_file::{EVENTS_MAX, EventStream, EventStreamError};

use crate::policy::{FRAME_COLUMNS, FRAME_ROWS};
use crate::rng::Streams;
use crate::world::geometry::{Pose, wrap_angle};
use crate::world::{PHYSICS_STEP_S, World};
use noise::Noise;
use pixels::{Interval, Pixels};
use view::View;

/// Columns of the picture.
pub const COLUMNS: usize = FRAME_COLUMNS;

/// Rows of the picture.
pub const ROWS: usize = FRAME_ROWS;

/// Pixels of the picture.
pub const PIXELS: usize = COLUMNS * ROWS;

/// Time of one event frame, in microseconds: one physics step.
pub const STEP_US: u64 = 10_000;

/// The same in seconds.
const STEP_S: f64 = PHYSICS_STEP_S;

/// Most pictures drawn per step.
pub const SUBFRAMES_MAX: usize = 4;

/// A picture may move by this much before another is drawn within the step.
pub const DISPLACEMENT_PX_MAX: f64 = 2.0;

/// The camera of one trial.
#[derive(Debug, Clone)]
pub struct EventCamera<'w> {
    view: View<'w>,
    pixels: Pixels,
    noise: Noise,
    pose: Pose,
    steps: u64,
    /// Of the last step, in no order.
    events: Vec<Event>,
    subframes_max: usize,
    n_pictures: u64,
}

impl<'w> EventCamera<'w> {
    /// A camera that has stood at `start` for long, at physics step 0 of the trial whose streams
    /// are given.
    ///
    /// Errors: [`CameraError`] for a setting outside of its limits.
    pub fn new(
        world: &'w World,
        config: &CameraConfig,
        streams: Streams,
        start: &Pose,
    ) -> Result<Self, CameraError> {
        config.check()?;
        let mut view = View::new(world, config);
        let shades = view.draw(start, 0, 0.0);
        Ok(Self {
            pixels: Pixels::new(&config.pixels, config.device, streams, shades),
            noise: Noise::new(&config.pixels, config.device, streams),
            view,
            pose: *start,
            steps: 0,
            events: Vec::new(),
            subframes_max: SUBFRAMES_MAX,
            n_pictures: 1,
        })
    }

    /// Moves on by one physics step, after which the robot is at `pose`; returns the events of the
    /// step as bits.
    ///
    /// The frame of step `n` holds the events of `10 (n - 1) ms < t <= 10 n ms`.
    pub fn advance(&mut self, pose: &Pose) -> EventFrame {
        self.events.clear();
        let n = self.subframes(pose);
        for part in 1..=n {
            let share = part as f64 / n as f64;
            let between = if part == n { *pose } else { between(&self.pose, pose, share) };
            let shades = self.view.draw(&between, self.steps, share);
            let interval = interval(self.steps, part, n);
            self.pixels.look(shades, interval, &mut self.events);
        }
        self.noise.disturb(&mut self.pixels, self.view.shades(), self.steps, &mut self.events);
        self.n_pictures += n as u64;
        self.steps += 1;
        self.pose = *pose;
        EventFrame::of_events(&self.events)
    }

    /// Events of the last step, by time, then row, then column.
    pub fn events(&self) -> Vec<Event> {
        let mut events = self.events.clone();
        events.sort_unstable();
        events
    }

    /// Physics steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Pictures drawn so far, the first one included.
    pub fn n_pictures(&self) -> u64 {
        self.n_pictures
    }

    /// The picture drawn last, row by row: 256 even steps of ln intensity, dark to light.
    pub fn picture(&self) -> &[u8] {
        self.view.shades()
    }

    fn subframes(&self, pose: &Pose) -> usize {
        let displacement_px = self.view.displacement_px(&self.pose, pose, STEP_S);
        let wanted = (displacement_px / DISPLACEMENT_PX_MAX).ceil();
        wanted.clamp(1.0, self.subframes_max as f64) as usize
    }
}

/// The pose `share` of the way along the straight line between two poses.
fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let turn_rad = wrap_angle(to.yaw_rad - from.yaw_rad);
    Pose {
        position: from.position + (to.position - from.position) * share,
        yaw_rad: wrap_angle(from.yaw_rad + share * turn_rad),
    }
}

/// Part `part` (from 1) of `n` of a step.
fn interval(step: u64, part: usize, n: usize) -> Interval {
    let end_us = |part: usize| STEP_US * part as u64 / n as u64;
    let start_us = end_us(part - 1);
    Interval {
        start_us: step * STEP_US + start_us,
        length_us: end_us(part) - start_us,
        per_step: n,
    }
}

#[cfg(test)]
#[path = "dvs_tests.rs"]
mod tests;
