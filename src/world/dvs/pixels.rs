//! The pixel circuit: from pictures to events.
//!
//! Per pixel, as in v2e (SensorsINI/v2e) with the exact crossing times of ESIM (Rebecq, Gehrig and
//! Scaramuzza 2018): `ln(I + 1)` passes a first-order low-pass whose cut-off grows with
//! brightness; the pixel remembers the level of its last event, and each time the filtered value
//! is a threshold away from it, an event is made and the memory moves by that threshold. Between
//! two pictures the filtered value is taken to change linearly.

use pulp::{Arch, NullaryFnOnce};

use super::config::{PixelConfig, THRESHOLD_MIN};
use super::frame::Event;
use super::light::{Light, ln_of_shade};
use super::{COLUMNS, PIXELS, STEP_S};
use crate::rng::{Streams, stream};

/// Pixels that are looked at together.
const BLOCK: usize = 64;

/// All pixels of one sensor in one trial.
#[derive(Debug, Clone)]
pub(super) struct Pixels {
    value: Vec<f32>,
    memory: Vec<f32>,
    threshold_on: Vec<f32>,
    threshold_off: Vec<f32>,
    ready_us: Vec<u64>,
    light: Light,
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
        let value: Vec<f32> = shades.iter().map(|shade| ln_of_shade(*shade)).collect();
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
            light: Light::new(config.cutoff_hz),
            leak_per_s: config.leak_hz,
            refractory_us: config.refractory_us,
        }
    }

    /// Looks at the next picture and appends the events since the last one, pixel by pixel.
    pub(super) fn look(&mut self, shades: &[u8], interval: Interval, events: &mut Vec<Event>) {
        self.light.show(shades, interval.per_step);
        let leak_share = (self.leak_per_s * STEP_S / interval.per_step as f64) as f32;
        // Compiled for several instruction sets, the machine's is taken.
        Arch::new().dispatch(Look { pixels: self, leak_share, interval, events });
    }

    /// A noise event: as a real one, and the memory is set to the present value.
    pub(super) fn disturb(&mut self, pixel: usize, t_us: u64, on: bool, events: &mut Vec<Event>) {
        self.emit(pixel, t_us, on, events);
        self.memory[pixel] = self.value[pixel];
    }

    /// An event unless the pixel rests; the memory moves all the same.
    #[inline(always)]
    fn emit(&mut self, pixel: usize, t_us: u64, on: bool, events: &mut Vec<Event>) {
        if t_us >= self.ready_us[pixel] {
            self.ready_us[pixel] = t_us + self.refractory_us;
            let (x, y) = ((pixel % COLUMNS) as u8, (pixel / COLUMNS) as u8);
            events.push(Event { t_us, y, x, on });
        }
    }
}

/// One look of all pixels.
struct Look<'a> {
    pixels: &'a mut Pixels,
    leak_share: f32,
    interval: Interval,
    events: &'a mut Vec<Event>,
}

impl NullaryFnOnce for Look<'_> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for first in (0..PIXELS).step_by(BLOCK) {
            self.block(first);
        }
    }
}

impl Look<'_> {
    /// Moves the pixels of a block on and lets those fire that are a threshold away.
    #[inline(always)]
    fn block(&mut self, first: usize) {
        let pixels = &mut *self.pixels;
        let value = block_mut(&mut pixels.value, first);
        let memory = block_mut(&mut pixels.memory, first);
        let (ln, share) = (block(&pixels.light.ln, first), block(&pixels.light.share, first));
        let (on, off) = (block(&pixels.threshold_on, first), block(&pixels.threshold_off, first));
        let (before, remembered) = (*value, *memory);
        let mut fires = [0u8; BLOCK];
        for i in 0..BLOCK {
            value[i] = before[i] + share[i] * (ln[i] - before[i]);
            memory[i] = remembered[i] - self.leak_share * on[i];
            let change = value[i] - memory[i];
            fires[i] = u8::from(change >= on[i]) | u8::from(change <= -off[i]);
        }
        for (index, flags) in fires.as_chunks::<8>().0.iter().enumerate() {
            let mut left = u64::from_le_bytes(*flags);
            while left != 0 {
                let i = 8 * index + left.trailing_zeros() as usize / 8;
                left &= left - 1;
                self.fire(first + i, before[i] - remembered[i]);
            }
        }
    }

    /// Makes the events of one pixel, which was `from` away from its memory before.
    #[inline(always)]
    fn fire(&mut self, pixel: usize, from: f32) {
        let pixels = &mut *self.pixels;
        let to = pixels.value[pixel] - pixels.memory[pixel];
        let on = to >= pixels.threshold_on[pixel];
        let threshold = if on { pixels.threshold_on[pixel] } else { -pixels.threshold_off[pixel] };
        let ramp = Ramp { from, to, threshold };
        let n = ramp.n_crossings();
        for crossing in 1..=n {
            let t_us = self.interval.start_us + ramp.crossing_us(crossing, self.interval.length_us);
            pixels.emit(pixel, t_us, on, self.events);
        }
        pixels.memory[pixel] += n as f32 * threshold;
    }
}

/// Numbers of the block that begins with pixel `first`.
#[inline(always)]
fn block(all: &[f32], first: usize) -> &[f32; BLOCK] {
    all[first..].first_chunk().expect("the pixels are whole blocks")
}

#[inline(always)]
fn block_mut(all: &mut [f32], first: usize) -> &mut [f32; BLOCK] {
    all[first..].first_chunk_mut().expect("the pixels are whole blocks")
}

/// How far a pixel is from its memory at both ends of an interval, and the threshold with its sign.
#[derive(Debug, Clone, Copy)]
struct Ramp {
    from: f32,
    to: f32,
    threshold: f32,
}

impl Ramp {
    #[inline(always)]
    fn n_crossings(&self) -> u32 {
        (self.to / self.threshold) as u32
    }

    /// Time of a crossing after the beginning, in whole microseconds `1..=length_us`.
    #[inline(always)]
    fn crossing_us(&self, crossing: u32, length_us: u64) -> u64 {
        let share = (crossing as f32 * self.threshold - self.from) / (self.to - self.from);
        let t_us = (f64::from(share) * length_us as f64).ceil();
        t_us.clamp(1.0, length_us as f64) as u64
    }
}

#[cfg(test)]
#[path = "pixels_tests.rs"]
mod tests;
