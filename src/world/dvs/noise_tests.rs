use super::*;

/// Noise of `steps` steps over a picture of one shade.
fn noise(config: &PixelConfig, shade: u8, seed: u64, steps: u64) -> Vec<Event> {
    let streams = Streams::new(seed, 0);
    let shades = [shade; PIXELS];
    let mut pixels = Pixels::new(config, 0, streams, &shades);
    let source = Noise::new(config, 0, streams);
    let mut all = Vec::new();
    for step in 0..steps {
        let mut events = Vec::new();
        source.disturb(&mut pixels, &shades, step, &mut events);
        assert!(events.iter().all(|e| e.t_us > step * STEP_US && e.t_us <= (step + 1) * STEP_US));
        all.extend(events);
    }
    all
}

#[test]
fn shot_noise_has_its_rate_both_polarities_and_is_less_in_light() {
    let config = PixelConfig { shot_noise_hz: 0.5, ..PixelConfig::quiet() };
    let dark = noise(&config, 0, 1, 200);
    let expected = 0.5 * 2.0 * PIXELS as f64;
    assert!((dark.len() as f64 / expected - 1.0).abs() < 0.03, "{} {expected}", dark.len());
    let on = dark.iter().filter(|event| event.on).count() as f64 / dark.len() as f64;
    assert!((on - 0.5).abs() < 0.02, "{on}");
    let light = noise(&config, 255, 1, 200).len() as f64;
    assert!((light / expected - 0.25).abs() < 0.02, "{light} {expected}");
}

#[test]
fn hot_pixels_are_few_and_the_same_in_every_trial() {
    let config = PixelConfig { n_hot_pixels: 10, hot_pixel_hz: 20.0, ..PixelConfig::quiet() };
    let pixels_of = |seed| -> Vec<usize> {
        EventFrame::of_events(&noise(&config, 100, seed, 200)).active().collect()
    };
    assert_eq!(pixels_of(1), pixels_of(2));
    assert_eq!(pixels_of(1).len(), 10);
    let n = noise(&config, 100, 1, 1000).len();
    assert!((1800..2200).contains(&n), "{n}");
}

#[test]
fn a_pixel_that_fired_in_the_step_makes_no_noise() {
    let config = PixelConfig { n_hot_pixels: 1, hot_pixel_hz: 100.0, ..PixelConfig::quiet() };
    let streams = Streams::new(1, 0);
    let shades = [100; PIXELS];
    let mut pixels = Pixels::new(&config, 0, streams, &shades);
    let source = Noise::new(&config, 0, streams);
    let hot = source.hot_pixels[0];
    let fired = Event { t_us: 5, y: (hot / 128) as u8, x: (hot % 128) as u8, on: false };
    let mut events = vec![fired];
    source.disturb(&mut pixels, &shades, 0, &mut events);
    assert_eq!(events, [fired]);
}
