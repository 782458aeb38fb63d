use super::WeightFault;
use crate::net::builtin;
use crate::net::controller::Controller;

fn weights(network: &Controller) -> Vec<f32> {
    network.clone().weights_mut().into_iter().flat_map(|layer| layer.clone()).collect()
}

#[test]
fn all_spiking_weights_and_nothing_else() {
    let whole = builtin::open("eem-san", None).unwrap();
    let before = weights(&whole);
    let encoder = 16 * 16 + 16 * 32 * 16 + 32 * 16 * 16 + 16 * 16;
    assert_eq!(before.len(), encoder + 220 * 20 + 640 * 20 + 20 * 256 + 2 * 256 * 256 + 256 * 2);
    for fault in [WeightFault::EightBit, WeightFault::Noise, WeightFault::Pruned] {
        let mut broken = fault.apply(&whole, 1);
        assert_ne!(weights(&broken), before);
        let saved = before.clone();
        let mut at = 0;
        for layer in broken.weights_mut() {
            let weights = layer.len();
            layer.copy_from_slice(&saved[at..at + weights]);
            at += weights;
        }
        assert_eq!(broken, whole, "{fault:?} changed more than weights");
    }
}

#[test]
fn eight_bits_are_at_most_255_values_a_step_apart() {
    let whole = builtin::open("laser-only", None).unwrap();
    let (before, after) = (weights(&whole), weights(&WeightFault::EightBit.apply(&whole, 1)));
    let step = before.iter().fold(0.0, |most: f32, weight| most.max(weight.abs())) / 127.0;
    let mut values = after.clone();
    values.sort_by(f32::total_cmp);
    values.dedup();
    assert!(values.len() <= 255, "{} values", values.len());
    for (before, after) in before.iter().zip(&after) {
        assert!((before - after).abs() <= 0.501 * step, "{before} became {after}");
    }
}

#[test]
fn noise_and_loss_are_as_large_as_said_and_follow_the_seed() {
    let whole = builtin::open("laser-only", None).unwrap();
    let before = weights(&whole);
    let noisy = weights(&WeightFault::Noise.apply(&whole, 1));
    let square = noisy.iter().zip(&before).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let deviation = (square / before.len() as f64).sqrt();
    assert!((deviation - 0.05).abs() < 0.0005, "deviation {deviation}");
    let lost = weights(&WeightFault::Pruned.apply(&whole, 1));
    let share = lost.iter().filter(|weight| **weight == 0.0).count() as f64 / lost.len() as f64;
    assert!((share - 0.3).abs() < 0.01, "{share} lost");
    assert_eq!(noisy, weights(&WeightFault::Noise.apply(&whole, 1)));
    assert_ne!(noisy, weights(&WeightFault::Noise.apply(&whole, 2)));
}
