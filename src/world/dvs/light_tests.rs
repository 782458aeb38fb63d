use super::*;
use crate::rng::{Streams, stream};

#[test]
fn what_is_looked_up_belongs_to_the_last_picture_shown() {
    let mut draw = Streams::new(1, 0).at(stream::STIMULUS, 0);
    let mut light = Light::new(300.0);
    let mut shades = vec![0u8; PIXELS];
    for per_step in [1, 1, 2, 2, 2, 1, 4] {
        for _ in 0..500 {
            shades[draw.below(PIXELS as u64) as usize] = draw.below(256) as u8;
        }
        light.show(&shades, per_step);
        let share = shares(300.0, per_step);
        for (pixel, shade) in shades.iter().enumerate() {
            let shade = usize::from(*shade);
            assert_eq!(light.ln[pixel], ln_of_shade(shade as u8), "pixel {pixel}");
            assert_eq!(light.share[pixel], share[shade], "pixel {pixel}, {per_step} per step");
        }
    }
}

#[test]
fn the_dark_is_slower_than_the_light() {
    let (share, finer) = (shares(300.0, 1), shares(300.0, 4));
    assert!(share[0] < 0.8 && share[255] > 0.999);
    let four_times = 1.0 - (1.0 - finer[0]).powi(4);
    assert!((four_times - share[0]).abs() < 1e-5);
}
