use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::spike::{Rectangular, Smooth};

const RULE: Bdett = Bdett::PUBLISHED;

#[test]
fn two_neurons_by_hand() {
    let mut state = BdettState::fresh(&RULE, 2);
    let trace: LifTrace<Rectangular> =
        RULE.forward(&LifShape::default(), 2, &[0.375, -0.75, 0.25, 0.0], &mut state);
    let Firing::Each(theta) = trace.thresholds() else { panic!("one threshold") };
    // Step 1: v = .375, -.75; T = exp(-.125) - 1, exp(.25) - 1; theta = .25 + T / 2.
    let near = |found: f32, expected: f64| {
        assert!((f64::from(found) - expected).abs() < 1e-6, "{found}, {expected}");
    };
    let first = [0.25 + (f64::exp(-0.125) - 1.0) / 2.0, 0.25 + (f64::exp(0.25) - 1.0) / 2.0];
    near(theta[0], first[0]);
    near(theta[1], first[1]);
    assert_eq!(trace.spikes[..2], [1.0, 0.0]);
    // V = mean - .2 range of v, H of theta; E = .01 (v - V) + H + ln(1 + exp((v - V) / 4)).
    let v = [0.375, -0.75];
    let low = |x: [f64; 2]| (x[0] + x[1]) / 2.0 - 0.2 * (x[0] - x[1]).abs();
    let energy = |v_i: f64| {
        let above = v_i - low(v);
        0.01 * above + low(first) + f64::ln(1.0 + f64::exp(above / 4.0))
    };
    // Step 2: c = .4375, -.375; the spike of neuron 1 clears its voltage, which T still sees.
    let v2 = [0.4375, 0.75 * -0.75 - 0.375];
    assert_eq!(trace.voltage[2..], [0.4375, -0.9375]);
    for i in 0..2 {
        near(theta[2 + i], 0.5 * energy(v[i]) + 0.5 * (f64::exp((v[i] - v2[i]) / 3.0) - 1.0));
    }
}

#[test]
fn statistics_are_of_one_layer_of_one_sample() {
    let drive = gaussians(5, 4 * 3 * 6);
    let run = |rows: std::ops::Range<usize>| -> (Vec<f32>, Vec<f32>) {
        let part: Vec<f32> = drive
            .chunks_exact(18)
            .flat_map(|step| &step[rows.start * 6..rows.end * 6])
            .copied()
            .collect();
        let mut state = BdettState::fresh(&RULE, rows.len() * 6);
        let trace: LifTrace<Rectangular> = RULE.forward(&LifShape::default(), 6, &part, &mut state);
        (trace.spikes, state.energy)
    };
    let (spikes, energy) = run(0..3);
    let (alone, alone_energy) = run(1..2);
    assert_eq!(alone_energy, energy[6..12]);
    let of_row: Vec<f32> = spikes.chunks_exact(18).flat_map(|s| &s[6..12]).copied().collect();
    assert_eq!(alone, of_row);
    assert!(alone.contains(&0.0) && alone.contains(&1.0), "{alone:?}");
}

#[test]
fn state_carried_over_a_cut_changes_nothing_and_a_restart_is_fresh() {
    let drive = gaussians(3, 10 * 6);
    let run = |drive: &[f32], state: &mut BdettState| -> LifTrace<Rectangular> {
        RULE.forward(&LifShape::default(), 3, drive, state)
    };
    let mut state = BdettState::fresh(&RULE, 6);
    let whole = run(&drive, &mut state);
    let mut cut = BdettState::fresh(&RULE, 6);
    let (first, second) = (run(&drive[..24], &mut cut), run(&drive[24..], &mut cut));
    assert_eq!(whole.spikes, [first.spikes, second.spikes].concat());
    assert_eq!(state, cut);
    state.restart(&RULE, 0, 3);
    assert_eq!(state.energy[..3], [0.5; 3]);
    assert_eq!(state.energy[3..], cut.energy[3..]);
    state.restart(&RULE, 1, 3);
    assert_eq!(state, BdettState::fresh(&RULE, 6));
}

#[test]
fn thresholds_stay_finite_whatever_the_drive() {
    let mut state = BdettState::fresh(&RULE, 4);
    let drive: Vec<f32> = gaussians(4, 400).iter().map(|x| 1e6 * x).collect();
    let trace: LifTrace<Rectangular> = RULE.forward(&LifShape::default(), 4, &drive, &mut state);
    let Firing::Each(theta) = trace.thresholds() else { panic!("one threshold") };
    assert!(theta.iter().chain(&state.energy).all(|x| x.is_finite()));
}

/// The same neurons with thresholds that are given.
fn given(drive: &[f32], theta: &[f32], neurons: usize) -> Vec<f32> {
    let (mut c, mut v, mut s) = (vec![0.0; neurons], vec![0.0f32; neurons], vec![0.0; neurons]);
    let mut spikes = Vec::new();
    for (drive, theta) in drive.chunks_exact(neurons).zip(theta.chunks_exact(neurons)) {
        for i in 0..neurons {
            c[i] = 0.5 * c[i] + drive[i];
            v[i] = 0.75 * v[i] * (1.0 - s[i]) + c[i];
            s[i] = Smooth::fire(v[i] - theta[i]);
        }
        spikes.extend(&s);
    }
    spikes
}

#[test]
fn gradients_equal_finite_differences_at_given_thresholds() {
    let (neurons, steps) = (8, 6);
    let drive = gaussians(1, steps * neurons);
    let weights = gaussians(2, drive.len());
    let mut state = BdettState::fresh(&RULE, neurons);
    let trace: LifTrace<Smooth> = RULE.forward(&LifShape::default(), 4, &drive, &mut state);
    let Firing::Each(theta) = trace.thresholds() else { panic!("one threshold") };
    let d = LifShape::default().backward(&trace, Some(&weights), None);
    check("drive", &drive, &d.drive, |x| weighted(&given(x, theta, neurons), &weights));
}

#[test]
fn numbers_go_into_a_tensor_and_back() {
    assert_eq!(RULE.to_array(), [0.5, 3.0, 0.5, 0.2, 0.01, 4.0]);
    let odd = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert_eq!(Bdett::from_slice(&odd).to_array(), odd);
}
