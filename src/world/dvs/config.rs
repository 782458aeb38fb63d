//! Settings of the event camera.

use crate::world::arena::HEIGHT_M_MIN;
use crate::world::shown::shown;

/// Smallest threshold of a pixel, ln units: the Gaussian's tail must not make a pixel fire always.
pub const THRESHOLD_MIN: f64 = 0.01;

/// Least and largest field of view.
pub const FIELD_OF_VIEW_DEG: (f64, f64) = (10.0, 150.0);

/// That of the robot's camera.
pub const CAMERA_DEG: u16 = 90;

/// View, texture and pixels of an [`super::EventCamera`].
#[derive(Debug, Clone, PartialEq)]
pub struct CameraConfig {
    /// Horizontal field of view; the vertical one is the same, since the picture is square.
    pub field_of_view_deg: f64,
    /// Height of the lens above the floor.
    pub height_m: f64,
    /// Standard deviation of ln intensity over the surfaces of the arena that stand still.
    pub contrast: f64,
    /// The same over movers.
    pub mover_contrast: f64,
    /// Number of the paint job: another number paints the same arena otherwise.
    pub texture: u64,
    /// Number of the sensor: another number has other thresholds and other hot pixels. What
    /// changes from trial to trial is drawn from the trial's streams instead.
    pub device: u64,
    /// How pixels turn light into events.
    pub pixels: PixelConfig,
}

/// The pixel circuit, in the terms of v2e (Hu, Liu and Delbruck 2021, SensorsINI/v2e).
#[derive(Debug, Clone, PartialEq)]
pub struct PixelConfig {
    /// Mean change of ln intensity that makes an event, the same for ON and OFF.
    pub threshold: f64,
    /// Standard deviation of the threshold over the pixels.
    pub threshold_sigma: f64,
    /// Cut-off of the photoreceptor in full light; darker pixels are slower.
    pub cutoff_hz: f64,
    /// Time after an event in which the pixel makes no other.
    pub refractory_us: u64,
    /// ON events per second of a pixel that sees no change.
    pub leak_hz: f64,
    /// Noise events per second of a pixel in the dark, half of them ON.
    pub shot_noise_hz: f64,
    /// Pixels that fire by themselves.
    pub n_hot_pixels: usize,
    /// Their rate, all ON, at most one per step.
    pub hot_pixel_hz: f64,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            field_of_view_deg: f64::from(CAMERA_DEG),
            height_m: 0.4,
            contrast: 0.5,
            mover_contrast: 1.0,
            texture: 0,
            device: 0,
            pixels: PixelConfig::default(),
        }
    }
}

impl Default for PixelConfig {
    /// v2e's threshold, mismatch, bandwidth, leak and refractory time; noise of a lit room.
    fn default() -> Self {
        Self {
            threshold: 0.2,
            threshold_sigma: 0.03,
            cutoff_hz: 300.0,
            refractory_us: 500,
            leak_hz: 0.01,
            shot_noise_hz: 0.01,
            n_hot_pixels: 10,
            hot_pixel_hz: 10.0,
        }
    }
}

impl PixelConfig {
    /// Equal pixels without noise, leak or refractory time: events come from changes alone.
    pub fn quiet() -> Self {
        Self {
            threshold_sigma: 0.0,
            refractory_us: 0,
            leak_hz: 0.0,
            shot_noise_hz: 0.0,
            n_hot_pixels: 0,
            ..Self::default()
        }
    }
}

/// A setting outside of its limits.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("event camera: {name} is {}, must be {min}..={max}; change the camera's settings", shown(*value))]
pub struct CameraError {
    /// Which setting, with its unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

impl CameraConfig {
    /// Errs for the first setting outside of its limits.
    pub fn check(&self) -> Result<(), CameraError> {
        let (min, max) = FIELD_OF_VIEW_DEG;
        in_range("field of view (deg)", self.field_of_view_deg, min, max)?;
        // The tops of all things are above the lens, so that none is ever seen from above.
        in_range("height (m)", self.height_m, 0.05, HEIGHT_M_MIN)?;
        in_range("contrast (ln)", self.contrast, 0.0, 3.0)?;
        in_range("contrast of movers (ln)", self.mover_contrast, 0.0, 3.0)?;
        self.pixels.check()
    }
}

impl PixelConfig {
    fn check(&self) -> Result<(), CameraError> {
        in_range("threshold (ln)", self.threshold, THRESHOLD_MIN, 5.0)?;
        in_range("threshold sigma (ln)", self.threshold_sigma, 0.0, 1.0)?;
        in_range("cut-off (Hz)", self.cutoff_hz, 0.1, 1e5)?;
        in_range("refractory time (us)", self.refractory_us as f64, 0.0, 1e6)?;
        in_range("leak (Hz)", self.leak_hz, 0.0, 50.0)?;
        in_range("shot noise (Hz)", self.shot_noise_hz, 0.0, 50.0)?;
        in_range("number of hot pixels", self.n_hot_pixels as f64, 0.0, 1000.0)?;
        in_range("hot pixel rate (Hz)", self.hot_pixel_hz, 0.0, 100.0)
    }
}

fn in_range(name: &'static str, value: f64, min: f64, max: f64) -> Result<(), CameraError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(CameraError { name, value, min, max }) }
}

#[cfg(test)]
#[path = "config_tests.rs"]
mod tests;
