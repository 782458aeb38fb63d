//! Light of a picture as the pixel circuit sees it.

use super::texture::{SHADES, ln_intensity};
use super::{PIXELS, STEP_S, SUBFRAMES_MAX};

/// v2e's brightness scale of the cut-off: `(I + 20) / 275`, 1 for a white 8-bit pixel.
const CUTOFF_OFFSET: f64 = 20.0;
const CUTOFF_SCALE: f64 = 275.0;

/// Pixels whose shades are compared at once.
const BLOCK: usize = 16;

/// What the low-pass of every pixel goes to, and how far it goes.
#[derive(Debug, Clone)]
pub(super) struct Light {
    /// `ln(I + 1)` of every pixel.
    pub(super) ln: Vec<f32>,
    /// Share of the way to it that the low-pass goes from picture to picture.
    pub(super) share: Vec<f32>,
    shades: Vec<u8>,
    per_step: usize,
    ln_of: [f32; SHADES],
    /// For each number of pictures per step, from one on.
    share_of: Vec<[f32; SHADES]>,
}

impl Light {
    /// Of pixels with the given cut-off, which have seen nothing yet.
    pub(super) fn new(cutoff_hz: f64) -> Self {
        Self {
            ln: vec![0.0; PIXELS],
            share: vec![0.0; PIXELS],
            shades: vec![0; PIXELS],
            per_step: 0,
            ln_of: core::array::from_fn(|shade| ln_of_shade(shade as u8)),
            share_of: (1..=SUBFRAMES_MAX).map(|n| shares(cutoff_hz, n)).collect(),
        }
    }

    /// Takes a picture, one of `per_step` in a step; looks up what is new in it.
    pub(super) fn show(&mut self, shades: &[u8], per_step: usize) {
        let same = self.per_step == per_step;
        self.per_step = per_step;
        let share_of = &self.share_of[per_step - 1];
        let seen = shades.as_chunks::<BLOCK>().0.iter().zip(self.shades.as_chunks_mut().0);
        let light = self.ln.as_chunks_mut::<BLOCK>().0.iter_mut();
        let light = light.zip(self.share.as_chunks_mut::<BLOCK>().0);
        for ((new, old), (ln, share)) in seen.zip(light) {
            if same && *new == *old {
                continue;
            }
            *old = *new;
            for i in 0..BLOCK {
                ln[i] = self.ln_of[usize::from(new[i])];
                share[i] = share_of[usize::from(new[i])];
            }
        }
    }
}

/// By shade.
fn shares(cutoff_hz: f64, per_step: usize) -> [f32; SHADES] {
    let interval_s = STEP_S / per_step as f64;
    core::array::from_fn(|shade| {
        let light = (libm::exp(ln_intensity(shade as u8)) + CUTOFF_OFFSET) / CUTOFF_SCALE;
        let turns = core::f64::consts::TAU * cutoff_hz * light * interval_s;
        (1.0 - libm::exp(-turns)) as f32
    })
}

/// `ln(I + 1)` of a shade.
pub(super) fn ln_of_shade(shade: u8) -> f32 {
    libm::log(libm::exp(ln_intensity(shade)) + 1.0) as f32
}

#[cfg(test)]
#[path = "light_tests.rs"]
mod tests;
