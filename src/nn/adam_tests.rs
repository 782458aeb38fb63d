use super::*;
use crate::nn::soft_update::soft_update;

#[test]
fn two_steps_by_hand() {
    let settings = AdamSettings::with_rate(0.1);
    let (mut adam, mut values) = (Adam::new(2), [1.0f32, -2.0]);
    adam.step(&settings, &mut values, &[1.0, 4.0]);
    // The first step has the length of the rate, whatever the gradient.
    assert!((values[0] - 0.9).abs() < 1e-6 && (values[1] + 2.1).abs() < 1e-6, "{values:?}");
    adam.step(&settings, &mut values, &[-0.5, 4.0]);
    // m = .04 / .19, v = .001249 / .001999: .1 * .2105263 / .7904508 = .0266337
    assert!((values[0] - 0.873_366_3).abs() < 1e-6, "{values:?}");
    assert!((values[1] + 2.2).abs() < 1e-6, "{values:?}");
    assert_eq!(adam.steps, 2);
}

#[test]
fn soft_update_moves_by_its_part() {
    let mut target = [1.0, 2.0];
    soft_update(&mut target, &[2.0, 0.0], 0.25);
    assert_eq!(target, [1.25, 1.5]);
}
