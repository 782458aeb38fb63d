use hw_model::weight::{SignMode, SynapseFormat};
use proptest::prelude::*;

use super::*;
use crate::compile::policy::{POLICIES, Rounding};
use crate::net::builtin;

fn layer(weights: Vec<f32>, bias: Vec<f32>, threshold: f64) -> Layer {
    let neurons = bias.len();
    Layer {
        name: "l".to_owned(),
        inputs: weights.len() / neurons,
        neurons,
        weights,
        bias,
        keep_current: 0.5,
        keep_voltage: 0.75,
        threshold,
    }
}

fn quantized(layer: &Layer, policy: &str) -> Result<QuantizedLayer, CompileError> {
    quantize_layer(layer, &Policy::named(policy).unwrap(), &ChipSpec::loihi1())
}

#[test]
fn san_scales_by_weights_and_biases_and_truncates() {
    let q = quantized(&layer(vec![0.25, -0.1, 0.001], vec![0.5], 0.3), "san").unwrap();
    assert_eq!((q.scale, q.threshold_mantissa), (510.0, 153));
    assert_eq!((q.weights, q.bias, q.bias_exponent), (vec![127, -51, 0], vec![255], 0));
}

#[test]
fn nearest_uses_the_whole_range_for_weights_and_an_exponent_for_the_bias() {
    let q = quantized(&layer(vec![0.25, -0.1], vec![0.5], 0.5), "nearest").unwrap();
    // 255 / 0.25 = 1020; 0.5 * 1020 = 510 is whole already.
    assert_eq!((q.scale, q.threshold_mantissa), (1020.0, 510));
    assert_eq!((q.weights, q.bias, q.bias_exponent), (vec![255, -102], vec![255], 1));
}

#[test]
fn tiny_weights_are_as_good_as_others() {
    let weights = vec![0.25, -0.1, 0.003];
    let usual = quantized(&layer(weights.clone(), vec![0.125], 0.5), "nearest").unwrap();
    for power in [-120, -126, -130] {
        let unit = 2f64.powi(power);
        let tiny = |values: &[f32]| values.iter().map(|v| (f64::from(*v) * unit) as f32).collect();
        let q = quantized(&layer(tiny(&weights), tiny(&[0.125]), 0.5 * unit), "nearest").unwrap();
        assert_eq!((q.weights, q.bias), (usual.weights.clone(), usual.bias.clone()), "2^{power}");
        assert_eq!(q.threshold_mantissa, usual.threshold_mantissa, "2^{power}");
    }
}

#[test]
fn mixed_signs_give_even_mantissas() {
    let q = quantized(&layer(vec![0.25, -0.1, 0.003], vec![0.0], 0.5), "mixed").unwrap();
    assert!(q.weights.iter().chain(&q.bias).all(|m| m % 2 == 0), "{:?}", q.weights);
    assert_eq!(q.weights[0], 254);
}

#[test]
fn diffused_errors_of_a_neuron_sum_to_less_than_a_step() {
    let weights: Vec<f32> = (0..100).map(|i| ((i * 37 % 101) as f32 - 50.0) / 137.0).collect();
    let exact = layer(weights.clone(), vec![0.0], 0.5);
    let q = quantized(&exact, "diffused").unwrap();
    let error: f64 =
        scaled(&weights, q.scale).iter().zip(&q.weights).map(|(w, m)| w - f64::from(*m)).sum();
    assert!(error.abs() <= 0.5 + 1e-6, "{error}");
}

#[test]
fn a_threshold_without_a_mantissa_names_layer_and_value() {
    let error = quantized(&layer(vec![100.0], vec![0.0], 0.01), "san").unwrap_err().to_string();
    assert!(
        error.starts_with(
            "layer l: threshold 0.01 -> mantissa 0, must be 1..=131071; the threshold is too small"
        ),
        "{error}"
    );
    let error = quantized(&layer(vec![1e-4], vec![0.0], 1.0), "san").unwrap_err().to_string();
    assert!(
        error.contains(
            "-> mantissa 2550000, must be 1..=131071; it is too large beside the weights"
        ),
        "{error}"
    );
    let error = quantized(&layer(vec![1.0], vec![0.0], -0.031), "nearest").unwrap_err().to_string();
    assert!(error.starts_with("layer l: threshold -0.031 -> mantissa -8"), "{error}");
}

#[test]
fn a_layer_of_zeros_has_no_scale() {
    let error = quantized(&layer(vec![0.0], vec![0.0], 0.5), "nearest").unwrap_err().to_string();
    assert!(error.starts_with("layer l: all weights and biases are zero"), "{error}");
}

#[test]
fn an_unknown_policy_lists_what_there_is() {
    assert_eq!(
        Policy::named("best").unwrap_err().to_string(),
        "policy best: no such policy (there is: nearest, san, mixed, fine, diffused, toward-zero, san-nearest)"
    );
}

#[test]
fn bias_lines_reach_every_neuron_with_a_bias_and_no_other() {
    let network = builtin::read("reflex", None).unwrap();
    let q = quantize(&network, &Policy::named("nearest").unwrap(), &ChipSpec::loihi1()).unwrap();
    let of_layer = |target: usize| {
        let from_bias = [Source::Port(1)];
        let mut onto = q.graph.projections.iter().filter(|p| p.target == target);
        let bias = onto.find(|p| p.sources == from_bias).expect("every layer has a bias line");
        bias.mantissas.values().iter().map(|m| m.signum()).collect::<Vec<_>>()
    };
    assert_eq!(of_layer(0), [-1, -1, -1, -1, 0, 0]);
    assert_eq!(of_layer(1), [1, 1]);
}

/// Weights of one layer, 12 inputs for each neuron, with one that is largest.
fn rows() -> impl Strategy<Value = Vec<f32>> {
    let weights = prop::collection::vec(-1.0f32..1.0, 24);
    (weights, 0.05f32..20.0).prop_map(|(weights, size)| weights.iter().map(|w| w * size).collect())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn weights_of_every_width_are_on_their_grid_and_near_enough(
        weights in rows(),
        bias in prop::collection::vec(-1.0f32..1.0, 2),
        policy in prop::sample::select(POLICIES.to_vec()),
        bits in 2..=8u8,
    ) {
        let policy = policy.with_weight_bits(bits).unwrap();
        let exact = layer(weights, bias, 0.5);
        let q = match quantize_layer(&exact, &policy, &ChipSpec::loihi1()) {
            Ok(q) => q,
            // A threshold far below or above the weights.
            Err(error) => {
                prop_assert!(error.to_string().contains("the threshold is too "), "{error}");
                return Ok(());
            }
        };
        let (signs, grid) = if policy.split_signs {
            (vec![SignMode::Excitatory, SignMode::Inhibitory], 1 << (8 - bits))
        } else {
            (vec![SignMode::Mixed], 1 << (9 - bits))
        };
        let format = |sign_mode, weight_bits| SynapseFormat { sign_mode, weight_bits, exponent: 0 };
        let held = |mantissa: &i16, bits| {
            signs.iter().any(|signs| format(*signs, bits).holds(i32::from(*mantissa)))
        };
        prop_assert!(q.weights.iter().all(|m| held(m, bits)), "{:?}", q.weights);
        prop_assert!(q.bias.iter().all(|m| held(m, 8)), "{:?}", q.bias);
        // Half a step to nearest, a whole one toward zero; what is diffused adds another half.
        let error_max = match policy.rounding {
            Rounding::Nearest => 0.5,
            Rounding::TowardZero | Rounding::Diffused => 1.0,
        } * f64::from(grid) + 1e-3;
        for (weight, mantissa) in scaled(&exact.weights, q.scale).iter().zip(&q.weights) {
            let error = (weight - f64::from(*mantissa)).abs();
            prop_assert!(error <= error_max, "{weight} -> {mantissa}: {error} > {error_max}");
        }
    }
}

#[test]
fn widths_that_no_format_has_are_refused() {
    let nearest = Policy::named("nearest").unwrap();
    for bits in [0, 1, 9, 255] {
        let error = nearest.with_weight_bits(bits).unwrap_err().to_string();
        assert_eq!(error, format!("weight bits = {bits}, must be 2..=8; choose a width between"));
    }
    let labels = [8, 5].map(|bits| nearest.with_weight_bits(bits).unwrap().label());
    assert_eq!(labels, ["nearest", "nearest-5"]);
}
