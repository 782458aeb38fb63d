//! The pixel circuit: from pictures to events.
//!
//! Per pixel, as in v2e (SensorsINI/v2e) with the exact crossing times of ESIM (Rebecq, Gehrig and
//! Scaramuzza 2018): `ln(I + 1)` passes a first-order low-pass whose cut-off grows with
//! brightness; the pixel remembers the level of its last event, and each time the filtered value
//! is a threshold away from it, an event is made and the memory moves by that threshold. Between
//! two pictures the filtered value is taken to change linearly.

use super::config::{PixelConfig, THRESHOLD_MIN};
use super::frame::Event;
use super::texture::{SHADES, ln_intensity};
use super::{COLUMNS, PIXELS, STEP_S, SUBFRAMES_MAX};
use crate::rng::{Streams, stream};

/// v2e's brightness scale of the cut-off: `(I + 20) / 275`, 1 for a white 8-bit pixel.
const CUTOFF_OFFSET: f64 = 20.0;
const CUTOFF_SCALE: f64 = 275.0;

/// Light of a shade as the circuit sees it, for one number of pictures per step.
#[derive(Debug, Clone)]
struct Response {
    /// Share of the way to the new value that the low-pass goes from picture to picture.
    share: Vec<f32>,
}

/// All pixels of one sensor in one trial.
#[derive(Debug, Clone)]
pub(super) struct Pixels {
    value: Vec<f32>,
    memory: Vec<f32>,
    threshold_on: Vec<f32>,
    threshold_off: Vec<f32>,
    ready_us: Vec<u64>,
    ln: Vec<f32>,
    responses: Vec<Response>,
    leak_per_s: f64,
    refractory_us: u64,
}

/// The time between two pictures.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    /// Its beginning.
    pub(super) start_us: u64,
    /// Its length.
    pub(super) length_us: u64,
    /// How many of them make a step.
    pub(super) per_step: usize,
}

impl Pixels {
    /// Pixels that have looked at `shades` for long. Thresholds belong to the device; how far each
    /// pixel has leaked towards its next ON event is drawn for the trial.
    pub(super) fn new(config: &PixelConfig, device: u64, streams: Streams, shades: &[u8]) -> Self {
        let mut drawn = Streams::new(device, 0).at(stream::DVS_THRESHOLDS, 0);
        let mut threshold = || {
            let mismatch = if config.threshold_sigma > 0.0 { drawn.gaussian() } else { 0.0 };
            (config.threshold + config.threshold_sigma * mismatch).max(THRESHOLD_MIN) as f32
        };
        let threshold_on: Vec<f32> = (0..PIXELS).map(|_| threshold()).collect();
        let threshold_off: Vec<f32> = (0..PIXELS).map(|_| threshold()).collect();
        let ln: Vec<f32> = (0..SHADES).map(|shade| ln_of_shade(shade as u8)).collect();
        let value: Vec<f32> = shades.iter().map(|shade| ln[usize::from(*shade)]).collect();
        let mut leaked = streams.at(stream::DVS_START, 0);
        let below = |(value, on): (&f32, &f32)| value - on * leaked.uniform() as f32;
        let leaks = config.leak_hz > 0.0;
        let memory = match leaks {
            true => value.iter().zip(&threshold_on).map(below).collect(),
            false => value.clone(),
        };
        Self {
            value,
            memory,
            threshold_on,
            threshold_off,
            ready_us: vec![0; PIXELS],
            ln,
            responses: (1..=SUBFRAMES_MAX).map(|n| Response::new(config.cutoff_hz, n)).collect(),
            leak_per_s: config.leak_hz,
            refractory_us: config.refractory_us,
        }
    }

    /// Looks at the next picture and appends the events since the last one, pixel by pixel.
    pub(super) fn look(&mut self, shades: &[u8], interval: Interval, events: &mut Vec<Event>) {
        let leak_share = (self.leak_per_s * STEP_S / interval.per_step as f64) as f32;
        let response_idx = interval.per_step - 1;
        for (pixel, shade) in shades.iter().enumerate() {
            let shade = usize::from(*shade);
            let before = self.value[pixel];
            let value =
                before + self.responses[response_idx].share[shade] * (self.ln[shade] - before);
            let memory = self.memory[pixel];
            let leaked = memory - leak_share * self.threshold_on[pixel];
            self.value[pixel] = value;
            self.memory[pixel] = leaked;
            let change = value - leaked;
            let on = change >= self.threshold_on[pixel];
            if on || change <= -self.threshold_off[pixel] {
                let threshold =
                    if on { self.threshold_on[pixel] } else { -self.threshold_off[pixel] };
                let ramp = Ramp { from: before - memory, to: change, threshold };
                self.fire(pixel, on, ramp, interval, events);
            }
        }
    }

    /// Makes the events of one pixel in one interval.
    fn fire(
        &mut self,
        pixel: usize,
        on: bool,
        ramp: Ramp,
        interval: Interval,
        events: &mut Vec<Event>,
    ) {
        let n = ramp.n_crossings();
        for crossing in 1..=n {
            let t_us = interval.start_us + ramp.crossing_us(crossing, interval.length_us);
            self.emit(pixel, t_us, on, events);
        }
        self.memory[pixel] += n as f32 * ramp.threshold;
    }

    /// An event unless the pixel rests; the memory moves all the same.
    fn emit(&mut self, pixel: usize, t_us: u64, on: bool, events: &mut Vec<Event>) {
        if t_us >= self.ready_us[pixel] {
            self.ready_us[pixel] = t_us + self.refractory_us;
            let (x, y) = ((pixel % COLUMNS) as u8, (pixel / COLUMNS) as u8);
            events.push(Event { t_us, y, x, on });
        }
    }

    /// A noise event: as a real one, and the memory is set to the present value.
    pub(super) fn disturb(&mut self, pixel: usize, t_us: u64, on: bool, events: &mut Vec<Event>) {
        self.emit(pixel, t_us, on, events);
        self.memory[pixel] = self.value[pixel];
    }
}

/// How far a pixel is from its memory at both ends of an interval, and the threshold with its sign.
#[derive(Debug, Clone, Copy)]
struct Ramp {
    from: f32,
    to: f32,
    threshold: f32,
}

impl Ramp {
    fn n_crossings(&self) -> u32 {
        (self.to / self.threshold) as u32
    }

    /// Time of a crossing after the beginning, in whole microseconds `1..=length_us`.
    fn crossing_us(&self, crossing: u32, length_us: u64) -> u64 {
        let share = (crossing as f32 * self.threshold - self.from) / (self.to - self.from);
        let t_us = (f64::from(share) * length_us as f64).ceil();
        t_us.clamp(1.0, length_us as f64) as u64
    }
}

impl Response {
    fn new(cutoff_hz: f64, per_step: usize) -> Self {
        let interval_s = STEP_S / per_step as f64;
        let share = |shade: usize| {
            let light = (libm::exp(ln_intensity(shade as u8)) + CUTOFF_OFFSET) / CUTOFF_SCALE;
            let turns = core::f64::consts::TAU * cutoff_hz * light * interval_s;
            (1.0 - libm::exp(-turns)) as f32
        };
        Self { share: (0..SHADES).map(share).collect() }
    }
}

/// `ln(I + 1)` of a shade.
fn ln_of_shade(shade: u8) -> f32 {
    libm::log(libm::exp(ln_intensity(shade)) + 1.0) as f32
}

#[cfg(test)]
#[path = "pixels_tests.rs"]
mod tests;
