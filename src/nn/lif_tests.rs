use super::*;
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::spike::{Rectangular, Smooth};
use crate::nn::threshold::{THRESHOLD_MIN, project, r_gradient, r_of, threshold};

#[test]
fn one_neuron_by_hand() {
    let mut state = LifState::rest(1);
    let trace: LifTrace<Rectangular> =
        LifShape::default().forward(0.5, &[0.375, 0.25, 0.0, 0.0], &mut state);
    // c: .375, .4375, .21875, .109375; the spike of step 2 clears the voltage.
    assert_eq!(trace.voltage, [0.375, 0.71875, 0.21875, 0.2734375]);
    assert_eq!(trace.spikes, [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(state.current, [0.109375]);
}

#[test]
fn voltage_at_the_threshold_does_not_fire() {
    let mut state = LifState::rest(2);
    let trace: LifTrace<Rectangular> =
        LifShape::default().forward(0.5, &[0.5, 0.5f32.next_up()], &mut state);
    assert_eq!(trace.spikes, [0.0, 1.0]);
}

#[test]
fn state_carried_over_a_cut_changes_nothing() {
    let drive = gaussians(3, 10 * 6);
    let shape = LifShape::default();
    let mut state = LifState::rest(6);
    let whole: LifTrace<Rectangular> = shape.forward(0.5, &drive, &mut state);
    let mut cut = LifState::rest(6);
    let first: LifTrace<Rectangular> = shape.forward(0.5, &drive[..24], &mut cut);
    let second: LifTrace<Rectangular> = shape.forward(0.5, &drive[24..], &mut cut);
    assert_eq!(whole.spikes, [first.spikes, second.spikes].concat());
    assert_eq!(whole.voltage, [first.voltage, second.voltage].concat());
    assert_eq!(state, cut);
}

#[test]
fn rectangular_window_is_open_and_half_wide() {
    let slopes = [-0.5, -0.4999, 0.0, 0.4999, 0.5].map(Rectangular::slope);
    assert_eq!(slopes, [0.0, 1.0, 1.0, 1.0, 0.0]);
}

fn smooth(drive: &[f32], r: f32, neurons: usize) -> LifTrace<Smooth> {
    LifShape::default().forward(threshold(r), drive, &mut LifState::rest(neurons))
}

#[test]
fn gradients_of_drive_and_threshold_equal_finite_differences() {
    let (neurons, steps) = (7, 6);
    let drive = gaussians(1, steps * neurons);
    let (on_spikes, on_voltage) = (gaussians(2, drive.len()), gaussians(3, drive.len()));
    let loss = |trace: LifTrace<Smooth>| {
        weighted(&trace.spikes, &on_spikes) + weighted(&trace.voltage, &on_voltage)
    };
    let r = 0.4;
    let trace = smooth(&drive, r, neurons);
    let d = LifShape::default().backward(&trace, Some(&on_spikes), Some(&on_voltage));
    check("drive", &drive, &d.drive, |x| loss(smooth(x, r, neurons)));
    // eq. 9 and 10
    let d_r = r_gradient(r, d.threshold);
    check("r", &[r], &[d_r], |r| loss(smooth(&drive, r[0], neurons)));
}

#[test]
fn reset_path_can_be_switched_off() {
    let drive = [0.45, 0.3];
    let gradient = |gradient_through_reset| {
        let shape = LifShape { gradient_through_reset, ..LifShape::default() };
        let trace: LifTrace<Rectangular> = shape.forward(0.5, &drive, &mut LifState::rest(1));
        shape.backward(&trace, Some(&[0.0, 1.0]), None).drive[0]
    };
    // v1 = .45 (no spike), v2 = .8625. dv2/dx1 = .75 + .5, and -.75 * .45 more through s1.
    assert_eq!(gradient(false), 1.25);
    assert!((gradient(true) - (1.25 - 0.75 * 0.45)).abs() < 1e-6);
}

#[test]
fn projection_keeps_thresholds_at_or_above_the_least() {
    for start in [-3.0, 0.0, 0.019, 0.3] {
        let mut r: f32 = start;
        project(&mut r);
        assert!(threshold(r) >= THRESHOLD_MIN, "tanh({r})");
        assert!(r == start || threshold(r) < THRESHOLD_MIN + 1e-6, "moved from {start} to {r}");
    }
    assert!((threshold(r_of(0.5)) - 0.5).abs() < 1e-6);
}
