//! Events that no change of light made.

use super::config::PixelConfig;
use super::frame::Event;
use super::pixels::Pixels;
use super::texture::ln_intensity;
use super::{COLUMNS, PIXELS, STEP_S, STEP_US};
use crate::policy::EventFrame;
use crate::rng::{Draw, Streams, stream};

/// Share of the shot noise that full light takes away (v2e).
const SHOT_NOISE_LESS_IN_LIGHT: f64 = 0.75;

/// Intensity of full light.
const WHITE: f64 = 255.0;

/// Shot noise and hot pixels of one trial.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    streams: Streams,
    shot_noise_hz: f64,
    hot_share: f64,
    hot_pixels: Vec<usize>,
}

impl Noise {
    /// Hot pixels belong to the device, the times of the events to the trial.
    pub(super) fn new(config: &PixelConfig, device: u64, streams: Streams) -> Self {
        let mut drawn = Streams::new(device, 0).at(stream::DVS_HOT_PIXELS, 0);
        Self {
            streams,
            shot_noise_hz: config.shot_noise_hz,
            hot_share: config.hot_pixel_hz * STEP_S,
            hot_pixels: (0..config.n_hot_pixels)
                .map(|_| drawn.below(PIXELS as u64) as usize)
                .collect(),
        }
    }

    /// Appends the noise of one step. All draws are of the step's own stream, in a fixed order:
    /// first the hot pixels, then shot noise in the order of time. A pixel that fired in this step
    /// already makes no noise.
    pub(super) fn disturb(
        &self,
        pixels: &mut Pixels,
        shades: &[u8],
        step: u64,
        events: &mut Vec<Event>,
    ) {
        let mut draw = self.streams.at(stream::DVS_NOISE, step);
        let mut fired = EventFrame::of_events(events.iter());
        let start_us = step * STEP_US;
        for pixel in &self.hot_pixels {
            let (fires, at) = (draw.bernoulli(self.hot_share), draw.uniform());
            if fires && mark(&mut fired, *pixel) {
                pixels.disturb(*pixel, start_us + time_us(at), true, events);
            }
        }
        let rate_hz = self.shot_noise_hz * PIXELS as f64;
        if rate_hz == 0.0 {
            return;
        }
        let mut passed_s = wait_s(&mut draw, rate_hz);
        while passed_s < STEP_S {
            let (pixel, on, kept) =
                (draw.below(PIXELS as u64) as usize, draw.uniform() < 0.5, draw.uniform());
            if kept < shot_share(shades[pixel]) && mark(&mut fired, pixel) {
                pixels.disturb(pixel, start_us + time_us(passed_s / STEP_S), on, events);
            }
            passed_s += wait_s(&mut draw, rate_hz);
        }
    }
}

/// Marks a pixel; false when it was marked.
fn mark(fired: &mut EventFrame, pixel: usize) -> bool {
    let (x, y) = (pixel % COLUMNS, pixel / COLUMNS);
    let first = !fired.get(x, y);
    fired.set(x, y);
    first
}

/// Time to the next event of a Poisson process.
fn wait_s(draw: &mut Draw, rate_hz: f64) -> f64 {
    -libm::log(1.0 - draw.uniform()) / rate_hz
}

/// A share of the step in whole microseconds `1..=STEP_US`.
fn time_us(share: f64) -> u64 {
    (share * STEP_US as f64) as u64 + 1
}

/// Share of the shot noise that is left at a shade.
fn shot_share(shade: u8) -> f64 {
    1.0 - SHOT_NOISE_LESS_IN_LIGHT * libm::exp(ln_intensity(shade)) / WHITE
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
