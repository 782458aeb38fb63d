//! SAN's published weights against its published and independently computed numbers.

use hw_model::{ChipSpec, CoreMap, DenseEngine, EventEngine};
use serde_json::Value;
use spikeloop::coding::InputSpikes;
use spikeloop::compile::graph::Source;
use spikeloop::compile::quantize::quantize;
use spikeloop::compile::{Policy, Split, policy::POLICIES};
use spikeloop::host::{ChipPolicy, Deployment};
use spikeloop::net::{Network, builtin};
use spikeloop::reference::{FixedNetwork, FloatNetwork};
use spikeloop::rng::{Streams, stream};

use crate::fixtures::{json, shared};

fn san() -> Option<Network> {
    let weights = shared("san/san_sddpg_bw5.safetensors")?;
    Some(builtin::read("san", Some(&weights)).expect("the published weights are good"))
}

struct Case {
    id: u64,
    input: InputSpikes,
    counts: Vec<u32>,
    layer_counts: Vec<Vec<u32>>,
}

fn numbers(value: &Value) -> Vec<u32> {
    value.as_array().expect("array").iter().map(|v| v.as_u64().expect("number") as u32).collect()
}

fn golden_cases() -> Vec<Case> {
    let Some(file) = shared("san/san_io_golden.json") else { return Vec::new() };
    let case = |case: &Value| {
        let lines: Vec<Vec<u32>> =
            case["input_spikes"].as_array().unwrap().iter().map(numbers).collect();
        let layers = ["fc1", "fc2", "fc3", "fc4"];
        Case {
            id: case["id"].as_u64().unwrap(),
            input: (0..5).map(|t| lines.iter().map(|line| line[t] == 1).collect()).collect(),
            counts: case["output_spikes"]
                .as_array()
                .unwrap()
                .iter()
                .map(|o| numbers(o).iter().sum())
                .collect(),
            layer_counts: layers
                .iter()
                .map(|l| numbers(&case["spike_counts_per_step"][l]))
                .collect(),
        }
    };
    json(&file)["cases"].as_array().unwrap().iter().map(case).collect()
}

#[test]
fn float_reference_reproduces_all_golden_cases() {
    let Some(network) = san() else { return };
    let mut float = FloatNetwork::new(&network);
    let cases = golden_cases();
    assert_eq!(cases.len(), 50);
    for case in cases {
        let decision = float.decide(&case.input);
        assert_eq!(decision.layer_counts, case.layer_counts, "case {}", case.id);
        assert_eq!(decision.output_counts, case.counts, "case {}", case.id);
    }
}

#[test]
fn quantization_reproduces_the_published_integers() {
    let Some(network) = san() else { return };
    let policy = Policy::named("san").unwrap();
    let quantized = quantize(&network, &policy, &ChipSpec::loihi1()).unwrap();
    let scales: Vec<String> = quantized.layers.iter().map(|l| format!("{:.3}", l.scale)).collect();
    assert_eq!(scales, ["466.178", "603.076", "765.683", "1558.646"]);
    let thresholds: Vec<u32> = quantized.layers.iter().map(|l| l.threshold_mantissa).collect();
    assert_eq!(thresholds, [233, 301, 382, 779]);
    let published = [(3280, 2806, 58), (33348, 30394, 1794), (32209, 31884, 1443), (266, 245, 1)];
    for (index, (excitatory, inhibitory, zero)) in published.into_iter().enumerate() {
        let weights = &quantized.layers[index].weights;
        let count = |sign: i16| weights.iter().filter(|w| w.signum() == sign).count();
        assert_eq!(
            (count(1), count(-1), count(0)),
            (excitatory, inhibitory, zero),
            "fc{}",
            index + 1
        );
        let target = quantized
            .graph
            .populations
            .iter()
            .position(|p| p.name == network.layers[index].name)
            .unwrap();
        let before = quantized.graph.populations.iter().position(|p| match index {
            0 => p.name == "relay",
            _ => p.name == network.layers[index - 1].name,
        });
        let signs = quantized.graph.synapse_signs(Source::Population(before.unwrap()), target);
        assert_eq!(signs, (excitatory, inhibitory));
    }
    let ranges: Vec<_> = quantized
        .layers
        .iter()
        .map(|l| (*l.weights.iter().min().unwrap(), *l.weights.iter().max().unwrap()))
        .collect();
    assert_eq!(ranges, [(-194, 202), (-92, 191), (-115, 169), (-189, 255)]);
    let biases: Vec<_> = quantized
        .layers
        .iter()
        .map(|l| (*l.bias.iter().min().unwrap(), *l.bias.iter().max().unwrap()))
        .collect();
    assert_eq!(biases, [(-119, 255), (-41, 254), (-64, 255), (51, 166)]);
}

#[test]
fn san_takes_nine_cores() {
    let Some(network) = san() else { return };
    let policy = Policy::named("san").unwrap();
    let deployment =
        Deployment::compile(&network, &policy, &ChipSpec::loihi1(), Split::Fewest).unwrap();
    assert!(deployment.map.cores().len() <= 9, "{}", deployment.map.cores().len());
}

#[test]
fn chip_equals_the_fixed_point_reference_in_every_case_and_policy() {
    let Some(network) = san() else { return };
    let chip = ChipSpec::loihi1();
    for policy in POLICIES {
        let quantized = quantize(&network, &policy, &chip).unwrap();
        let fixed = FixedNetwork::new(&network, &quantized, &chip);
        for relay in [true, false] {
            let network = Network { relay, ..network.clone() };
            let deployment = Deployment::compile(&network, &policy, &chip, Split::Fewest).unwrap();
            let map = || std::sync::Arc::<CoreMap>::clone(&deployment.map);
            let mut event =
                ChipPolicy::new(&deployment, Box::new(EventEngine::new(map()))).unwrap();
            let mut dense =
                ChipPolicy::new(&deployment, Box::new(DenseEngine::new(map()))).unwrap();
            for (index, case) in golden_cases().iter().enumerate() {
                let expected = fixed.decide(&case.input).output_counts;
                assert_eq!(event.decide(&case.input), expected, "{} case {}", policy.name, case.id);
                if index < 3 {
                    assert_eq!(
                        dense.decide(&case.input),
                        expected,
                        "{} case {}",
                        policy.name,
                        case.id
                    );
                }
            }
        }
    }
}

#[test]
fn chip_agrees_with_float_as_often_as_published_arithmetic_allows() {
    let Some(network) = san() else { return };
    let chip = ChipSpec::loihi1();
    for policy in POLICIES {
        let deployment = Deployment::compile(&network, &policy, &chip, Split::Fewest).unwrap();
        let engine = Box::new(EventEngine::new(deployment.map.clone()));
        let mut policy_on_chip = ChipPolicy::new(&deployment, engine).unwrap();
        let (mut equal, mut difference) = (0, 0);
        for case in golden_cases() {
            let counts = policy_on_chip.decide(&case.input);
            equal += u32::from(counts == case.counts);
            difference += counts.iter().zip(&case.counts).map(|(a, b)| a.abs_diff(*b)).sum::<u32>();
        }
        let usage = policy_on_chip.chip_use();
        println!(
            "{}: {equal} of 50 equal, mean difference {:.3}; synops {} windowed {}",
            policy.name,
            f64::from(difference) / 100.0,
            usage.counts.synaptic_ops() / 50,
            usage.windowed.synaptic_ops() / 50
        );
        if policy.name == "san" {
            assert!(equal >= 38, "{equal} of 50");
            assert!(difference <= 13, "mean difference {}", f64::from(difference) / 100.0);
        }
    }
}

/// The golden cases' states with fresh random draws: enough decisions to tell policies apart.
#[test]
fn rounding_to_nearest_agrees_with_float_more_often_than_the_published_scaling() {
    const DRAWS: u64 = 20;
    let (Some(network), Some(file)) = (san(), shared("san/san_io_golden.json")) else { return };
    let golden = json(&file);
    let mut inputs: Vec<InputSpikes> = Vec::new();
    for (index, case) in golden["cases"].as_array().unwrap().iter().enumerate() {
        let p: Vec<f64> =
            case["prob24"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        let mut draw = Streams::new(1, index as u64).at(stream::ENCODER_SPIKES, 0);
        let mut step = || p.iter().map(|p| draw.bernoulli(*p)).collect::<Vec<bool>>();
        inputs.extend((0..DRAWS).map(|_| (0..network.steps).map(|_| step()).collect()));
    }
    let mut float = FloatNetwork::new(&network);
    let expected: Vec<_> = inputs.iter().map(|input| float.decide(input).output_counts).collect();
    let mut agreement = std::collections::BTreeMap::new();
    for policy in POLICIES {
        let quantized = quantize(&network, &policy, &ChipSpec::loihi1()).unwrap();
        let fixed = FixedNetwork::new(&network, &quantized, &ChipSpec::loihi1());
        let counts = inputs.iter().map(|input| fixed.decide(input).output_counts);
        let (mut equal, mut difference) = (0, 0);
        for (got, expected) in counts.zip(&expected) {
            equal += u32::from(got == *expected);
            difference += got.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).sum::<u32>();
        }
        let mean = f64::from(difference) / (2 * inputs.len()) as f64;
        println!("{}: {equal} of {} equal, mean difference {mean:.4}", policy.name, inputs.len());
        agreement.insert(policy.name, (equal, difference));
    }
    assert!(agreement["nearest"].0 > agreement["san"].0, "{agreement:?}");
    assert!(agreement["nearest"].1 < agreement["san"].1, "{agreement:?}");
}
