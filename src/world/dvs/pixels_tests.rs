use super::*;
use crate::world::dvs::texture::ln_intensity;

const STEP: Interval = Interval { start_us: 0, length_us: 10_000, per_step: 1 };

fn quiet(threshold: f64) -> PixelConfig {
    PixelConfig { threshold, ..PixelConfig::quiet() }
}

/// Events of pixel 0 when all pixels go from one shade to another in a step.
fn step(config: &PixelConfig, from: u8, to: u8) -> Vec<Event> {
    let mut pixels = Pixels::new(config, 0, Streams::new(1, 0), &[from; PIXELS]);
    let mut events = Vec::new();
    pixels.look(&[to; PIXELS], STEP, &mut events);
    events.retain(|event| (event.x, event.y) == (0, 0));
    events
}

#[test]
fn a_change_makes_one_event_per_threshold_of_the_right_polarity() {
    let change = f64::from(ln_of_shade(200) - ln_of_shade(150));
    for threshold in [0.1, 0.2, 0.3] {
        let n = (change / threshold) as usize;
        assert!(n > 2);
        let (up, down) = (step(&quiet(threshold), 150, 200), step(&quiet(threshold), 200, 150));
        assert_eq!((up.len(), down.len()), (n, n), "threshold {threshold}");
        assert!(up.iter().all(|event| event.on) && down.iter().all(|event| !event.on));
    }
    assert_eq!(step(&quiet(0.2), 150, 155), []);
}

#[test]
fn times_are_where_the_ramp_crosses_the_thresholds() {
    let events = step(&quiet(0.2), 150, 200);
    let change = f64::from(ln_of_shade(200) - ln_of_shade(150));
    for (k, event) in events.iter().enumerate() {
        let expected_us = 1e4 * 0.2 * (k + 1) as f64 / change;
        assert!((event.t_us as f64 - expected_us).abs() <= 8.0, "{event:?} {expected_us}");
    }
}

#[test]
fn what_is_left_of_a_change_is_remembered() {
    // Each change is a little less than 0.7 of a threshold: none after the first, one after the
    // second.
    let threshold = 10.0 * (ln_intensity(1) - ln_intensity(0)) / 0.7;
    let mut pixels = Pixels::new(&quiet(threshold), 0, Streams::new(1, 0), &[120; PIXELS]);
    let counts: Vec<usize> = (1..=10_u8)
        .map(|i| {
            let mut events = Vec::new();
            let interval = Interval { start_us: 10_000 * u64::from(i), ..STEP };
            pixels.look(&[120 + 10 * i; PIXELS], interval, &mut events);
            events.len() / PIXELS
        })
        .collect();
    let change = f64::from(ln_of_shade(220) - ln_of_shade(120));
    assert_eq!(counts.iter().sum::<usize>(), (change / threshold) as usize);
    assert_eq!(counts[..2], [0, 1]);
}

#[test]
fn a_pixel_rests_after_an_event_and_its_memory_moves_on() {
    let busy = step(&quiet(0.02), 100, 250);
    let resting = PixelConfig { refractory_us: 1000, ..quiet(0.02) };
    let events = step(&resting, 100, 250);
    assert!(
        busy.len() > 100 && (8..=10).contains(&events.len()),
        "{} {}",
        busy.len(),
        events.len()
    );
    assert!(events.windows(2).all(|pair| pair[1].t_us - pair[0].t_us >= 1000));
    // Afterwards it is settled: the change is used up although most events were dropped.
    let mut pixels = Pixels::new(&resting, 0, Streams::new(1, 0), &[100; PIXELS]);
    let mut events = Vec::new();
    pixels.look(&[250; PIXELS], STEP, &mut events);
    events.clear();
    for step in 1..10 {
        let interval = Interval { start_us: 10_000 * step, ..STEP };
        pixels.look(&[250; PIXELS], interval, &mut events);
    }
    assert_eq!(events, []);
}

#[test]
fn thresholds_belong_to_the_device_and_scatter_as_asked() {
    let config = PixelConfig { threshold_sigma: 0.03, ..PixelConfig::quiet() };
    let shades = [100; PIXELS];
    let of =
        |device, seed| Pixels::new(&config, device, Streams::new(seed, 0), &shades).threshold_on;
    assert_eq!(of(3, 1), of(3, 2));
    assert_ne!(of(3, 1), of(4, 1));
    let thresholds = of(0, 1);
    let mean = thresholds.iter().sum::<f32>() / PIXELS as f32;
    let variance = thresholds.iter().map(|t| (t - mean) * (t - mean)).sum::<f32>() / PIXELS as f32;
    assert!((mean - 0.2).abs() < 0.002 && (variance.sqrt() - 0.03).abs() < 0.002, "{mean}");
    let wild = PixelConfig { threshold_sigma: 1.0, ..PixelConfig::quiet() };
    let wild = Pixels::new(&wild, 0, Streams::new(1, 0), &shades);
    assert_eq!(wild.threshold_on.iter().copied().fold(1.0, f32::min), THRESHOLD_MIN as f32);
}

#[test]
fn leaks_make_on_events_at_their_rate() {
    let config = PixelConfig { leak_hz: 1.0, ..PixelConfig::quiet() };
    let shades = [100; PIXELS];
    let mut pixels = Pixels::new(&config, 0, Streams::new(1, 0), &shades);
    let mut events = Vec::new();
    for step in 0..100 {
        pixels.look(&shades, Interval { start_us: 10_000 * step, ..STEP }, &mut events);
    }
    assert!(events.iter().all(|event| event.on));
    let per_pixel = events.len() as f64 / PIXELS as f64;
    assert!((per_pixel - 1.0).abs() < 0.01, "{per_pixel}");
}
