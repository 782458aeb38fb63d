use super::*;

fn refuse(change: impl FnOnce(&mut CameraConfig)) -> String {
    let mut config = CameraConfig::default();
    change(&mut config);
    config.check().unwrap_err().to_string()
}

#[test]
fn settings_outside_of_their_limits_are_named() {
    assert_eq!(CameraConfig::default().check(), Ok(()));
    assert_eq!(
        refuse(|config| config.field_of_view_deg = 180.0),
        "event camera: field of view (deg) is 180, must be 10..=150; change the camera's settings"
    );
    assert!(
        refuse(|config| config.height_m = 0.5).contains("height (m) is 0.5, must be 0.05..=0.44")
    );
    assert!(refuse(|config| config.contrast = f64::NAN).contains("contrast (ln) is NaN"));
    let error = refuse(|config| config.mover_contrast = 3.5);
    assert!(error.contains("contrast of movers (ln) is 3.5, must be 0..=3"), "{error}");
    assert!(refuse(|config| config.pixels.threshold = 0.0).contains("threshold (ln) is 0"));
    assert!(refuse(|config| config.pixels.threshold_sigma = -0.1).contains("sigma (ln) is -0.1"));
    assert!(refuse(|config| config.pixels.cutoff_hz = 0.0).contains("cut-off (Hz) is 0"));
    assert!(refuse(|config| config.pixels.refractory_us = 2_000_000).contains("refractory"));
    assert!(refuse(|config| config.pixels.leak_hz = -1.0).contains("leak (Hz) is -1"));
    assert!(refuse(|config| config.pixels.shot_noise_hz = 51.0).contains("shot noise (Hz)"));
    assert!(refuse(|config| config.pixels.n_hot_pixels = 1001).contains("number of hot pixels"));
    assert!(refuse(|config| config.pixels.hot_pixel_hz = 101.0).contains("hot pixel rate (Hz)"));
}
