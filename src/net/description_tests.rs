use std::collections::BTreeMap;

use safetensors::Dtype;
use safetensors::tensor::TensorView;

use super::*;

const TEXT: &str = r#"
format = 1
name = "tiny"
weights = "tiny.safetensors"
steps = 5
keep_current = 0.5
keep_voltage = 0.75
threshold = 0.5
[encoder]
kind = "rate"
goal_distance_scale_m = 0.3
linear_scale_m_per_s = 0.5
angular_scale_rad_per_s = 2.0
laser_scale_m = 0.35
[decoder]
kind = "rate"
[[layers]]
name = "a"
neurons = 3
weight = "a.weight"
bias = "a.bias"
[[layers]]
name = "b"
neurons = 2
weight = "b.weight"
"#;

fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Weights for [`TEXT`], with element `at` of a.weight replaced.
fn weights(at: usize, value: f32) -> Vec<u8> {
    let mut a = vec![0.25f32; 3 * 24];
    a[at] = value;
    let tensors = [
        ("a.weight", vec![3, 24], bytes_of(&a)),
        ("a.bias", vec![3], bytes_of(&[0.1; 3])),
        ("b.weight", vec![2, 3], bytes_of(&[-0.5; 6])),
    ];
    let views: BTreeMap<&str, TensorView<'_>> = tensors
        .iter()
        .map(|(name, shape, data)| {
            (*name, TensorView::new(Dtype::F32, shape.clone(), data).unwrap())
        })
        .collect();
    safetensors::serialize(views, None).unwrap()
}

fn error_of(from: &str, to: &str) -> String {
    assert!(TEXT.contains(from), "{from} is not in the text");
    let text = TEXT.replacen(from, to, 1);
    from_memory("n.toml", &text, "w.st", &weights(0, 0.25)).unwrap_err().to_string()
}

#[test]
fn a_good_description_is_read() {
    let network = from_memory("n.toml", TEXT, "w.st", &weights(1, -1.0)).unwrap();
    assert_eq!((network.inputs(), network.outputs(), network.steps), (24, 2, 5));
    assert_eq!(network.layers[0].weights[1], -1.0);
    assert_eq!(network.layers[1].bias, [0.0, 0.0]);
    assert_eq!(network.parameters(), 72 + 3 + 6 + 2);
}

#[test]
fn weights_that_are_not_finite_are_refused() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let error =
            from_memory("n.toml", TEXT, "w.st", &weights(7, value)).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "w.st: layer a: tensor a.weight: element 7 is {value}, must be finite; train or export again"
            )
        );
    }
}

#[test]
fn negative_and_zero_thresholds_are_refused() {
    for threshold in ["-0.031", "0.0", "nan"] {
        let error = error_of("threshold = 0.5", &format!("threshold = {threshold}"));
        let value: f64 = threshold.parse().unwrap();
        assert_eq!(
            error,
            format!(
                "n.toml: layer a: threshold = {value}, must be positive and finite (a chip threshold is unsigned); train it to stay above 0"
            )
        );
    }
}

#[test]
fn tensors_of_another_shape_or_name_are_refused() {
    assert_eq!(
        error_of("neurons = 3", "neurons = 4"),
        "w.st: layer a: tensor a.weight: F32 [3, 24] found, F32 or F16 [4, 24] expected"
    );
    assert_eq!(
        error_of("\"b.weight\"", "\"c.weight\""),
        "w.st: layer b: tensor c.weight: nothing (there is: a.bias, a.weight, b.weight) found, F32 or F16 [2, 3] expected"
    );
}

#[test]
fn numbers_out_of_range_are_refused() {
    assert_eq!(error_of("format = 1", "format = 2"), "n.toml: header: format = 2, must be 1");
    assert_eq!(error_of("steps = 5", "steps = 0"), "n.toml: header: steps = 0, must be 1..=4096");
    assert_eq!(
        error_of("keep_current = 0.5", "keep_current = 1.5"),
        "n.toml: layer a: keep_current = 1.5, must be in 0..=1"
    );
    assert_eq!(
        error_of("laser_scale_m = 0.35", "laser_scale_m = 0.0"),
        "n.toml: encoder: laser_scale_m = 0, must be positive and finite"
    );
    assert_eq!(
        error_of("neurons = 2", "neurons = 3"),
        "n.toml: last layer: neurons = 3, must be 2 for the rate decoder"
    );
}

#[test]
fn unknown_keys_name_their_line() {
    let error = error_of("steps = 5", "steps = 5\nspeed = 3");
    assert!(error.starts_with("n.toml: ") && error.contains("line 6"), "{error}");
    assert!(error.contains("unknown field `speed`"), "{error}");
}

#[test]
fn layers_of_one_name_are_refused() {
    let error = error_of("name = \"b\"", "name = \"a\"");
    assert_eq!(error, "n.toml: two layers are called a; give each a name of its own");
}

#[test]
fn damaged_weights_are_refused() {
    let good = weights(0, 0.25);
    for bytes in [&good[..4], &good[..good.len() - 1], &b"nothing like it"[..]] {
        let error = from_memory("n.toml", TEXT, "w.st", bytes).unwrap_err().to_string();
        assert!(error.starts_with("w.st: not a readable safetensors file ("), "{error}");
    }
}
