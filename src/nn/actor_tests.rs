use super::*;
use crate::net::{EemSan, Layer, Network, RateEncoder};
use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::spike::{Rectangular, Smooth};
use crate::nn::threshold;
use crate::nn::variant::{VARIANTS, Variant};
use crate::nn::{Hsvae, HsvaeShape, StateWriter};
use crate::reference::FloatNetwork;
use crate::reference::eem_san::FloatDecision;
use crate::rng::stream;

fn small(dvs: usize) -> ActorShape {
    ActorShape {
        laser: vec![(-1.0, 1.0); 3],
        dvs: vec![(-2.0, 2.0); dvs],
        population: 4,
        fused: 6,
        hidden: vec![8, 7],
        steps: 4,
        ..ActorShape::eem_san()
    }
}

fn draws(streams: &Streams) -> SpikeDraws<'_> {
    SpikeDraws { streams, name: stream::POPULATION_SPIKES, update: 0, first: 0 }
}

/// All forms, with and without events.
fn forms() -> Vec<ActorShape> {
    let mut all = Vec::new();
    for code in [Code::Population, Code::Rate] {
        for fusion in [Fusion::Middle, Fusion::Naive] {
            for thresholds in [Thresholds::Learned, Thresholds::Fixed, Thresholds::Dynamic] {
                let form = Form { code, fusion, thresholds };
                all.extend([0, 2].map(|dvs| ActorShape { form, ..small(dvs) }));
            }
        }
    }
    all
}

#[test]
fn gradients_equal_finite_differences() {
    forms().iter().for_each(gradients_of);
}

fn gradients_of(shape: &ActorShape) {
    let (streams, dvs) = (Streams::new(7, 0), shape.dvs.len());
    let actor = Actor::new(shape);
    let mut values = actor.initial(&streams).values;
    // Larger weights, so that gradients of the first layers stand out.
    let noise = gaussians(11, values.len());
    for entry in actor.layout().entries().iter().filter(|e| e.name.ends_with("weight")) {
        for at in entry.slot.range() {
            values[at] += 0.3 * noise[at];
        }
    }
    if let Some(rule) = actor.rule {
        // Thresholds that change by step, not with the voltage: no gradient goes through them.
        rule.of_mut(&mut values).copy_from_slice(&[0.5, 1e30, 0.5, 0.2, 0.0, 1e30]);
    }
    let observations = gaussians(12, 3 * (3 + dvs));
    let weights: Vec<f32> = gaussians(13, 3 * 2).iter().map(|w| 20.0 * w).collect();
    let run = |values: &[f32], observations: &[f32]| -> ActorTrace<Smooth> {
        actor.forward(values, observations, &draws(&streams))
    };
    let trace = run(&values, &observations);
    let mut gradient = actor.layout().zeros();
    let d = actor.backward(&values, &mut gradient, &trace, &weights);
    for entry in actor.layout().entries() {
        let name = format!("{}, {}", shape.form, entry.name);
        if entry.name == "bdett" || entry.name.ends_with(".threshold") {
            assert!(entry.slot.of(&gradient).iter().all(|d| *d == 0.0), "{name}");
            continue;
        }
        let loss = |part: &[f32]| {
            let mut moved = values.clone();
            entry.slot.of_mut(&mut moved).copy_from_slice(part);
            weighted(&run(&moved, &observations).action, &weights)
        };
        check(&name, entry.slot.of(&values), entry.slot.of(&gradient), loss);
    }
    let loss = |o: &[f32]| weighted(&run(&values, o).action, &weights);
    check(&format!("{}, observations", shape.form), &observations, &d, loss);
}

#[test]
fn sizes_are_those_of_the_paper() {
    let actor = Actor::new(&ActorShape::eem_san());
    let shape = |name: &str| actor.layout().find(name).unwrap().shape.clone();
    assert_eq!(shape("fuse.laser.weight"), [20, 220]);
    assert_eq!(shape("fuse.dvs.weight"), [20, 640]);
    assert_eq!(shape("decision.1.weight"), [256, 20]);
    assert_eq!(shape("decision.4.weight"), [2, 256]);
    assert_eq!(shape("decision.4.r"), [1]);
    let weights = actor.layout().entries().iter().filter(|e| e.name.ends_with("weight"));
    let multiplications: usize = weights.map(|e| e.shape.iter().product::<usize>()).sum();
    assert_eq!(multiplications, 153_904);
    assert!(Actor::new(&ActorShape::laser_only()).layout().find("fuse.dvs.weight").is_none());
}

#[test]
fn rows_of_the_table_have_the_parts_and_sizes_of_their_form() {
    for (name, first, tensors) in [
        ("san", [256, 24], 12),
        ("popsan", [256, 220], 14),
        ("bdett", [256, 24], 9),
        ("laser-only", [256, 20], 17),
        ("naive", [256, 860], 16),
        ("fixed", [256, 20], 22),
        ("eem-san", [256, 20], 22),
    ] {
        let variant = Variant::named(name).unwrap();
        let dvs = vec![(-3.0, 3.0); if variant.events { 64 } else { 0 }];
        let shape = ActorShape { form: variant.form, dvs, ..ActorShape::eem_san() };
        let layout = Actor::new(&shape).layout().clone();
        assert_eq!(layout.find("decision.1.weight").unwrap().shape, first, "{name}");
        assert_eq!(layout.entries().len(), tensors, "{name}");
    }
    assert!(Variant::named("eem_san").is_none());
}

#[test]
fn history_leaves_the_state_that_flying_on_would_and_a_trial_begins_at_rest() {
    let form = Variant::named("bdett").unwrap().form;
    let shape = ActorShape { form, dvs: Vec::new(), ..small(0) };
    let (actor, streams) = (Actor::new(&shape), Streams::new(7, 0));
    let values: Vec<f32> = actor.initial(&streams).values;
    let seen = gaussians(3, 3 * 2 * 3);
    // Tick by tick, two rows; the trial of row 1 begins with the last of three ticks.
    let mut flown = (actor.rest(&values, 2), draws(&streams).samples(2));
    for tick in 0..3 {
        if tick == 2 {
            flown.0.restart(1);
        }
        let now = &seen[tick * 6..(tick + 1) * 6];
        actor.forward_from::<Rectangular>(&values, now, &mut flown.0, &mut flown.1);
    }
    let by_row =
        |row: usize| (0..3).flat_map(move |tick| tick * 6 + row * 3..tick * 6 + row * 3 + 3);
    let observations: Vec<f32> = by_row(0).chain(by_row(1)).map(|at| seen[at]).collect();
    let history = History { ticks: 3, observations: &observations, known: &[3.0, 1.0] };
    let mut again = draws(&streams).samples(2);
    assert_eq!(actor.after(&values, &history, &mut again), flown.0);
    let rest = actor.rest(&values, 2);
    assert_ne!(flown.0, rest);
    let fresh = History { known: &[0.0, 0.0], ..history };
    assert_eq!(actor.after(&values, &fresh, &mut draws(&streams).samples(2)), rest);
    let of_second = history.rows(&(1..2));
    assert_eq!((of_second.observations, of_second.known), (&observations[9..], &[1.0][..]));
}

fn dyadic(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = (*value * 256.0).round() / 256.0);
}

/// The same layers for the reference.
fn as_network(actor: &Actor, parameters: &Parameters) -> Network {
    let layer = |layer: &SpikingLayer, name: &str| Layer {
        name: name.to_owned(),
        inputs: layer.linear.inputs,
        neurons: layer.linear.outputs,
        weights: parameters.tensor(&format!("{name}.weight")).unwrap().to_vec(),
        bias: parameters.tensor(&format!("{name}.bias")).unwrap().to_vec(),
        keep_current: 0.5,
        keep_voltage: 0.75,
        threshold: f64::from(threshold::threshold(
            parameters.tensor(&format!("{name}.r")).unwrap()[0],
        )),
    };
    let mut layers = vec![layer(actor.branches[0].layer.as_ref().unwrap(), "fuse.laser")];
    for (index, spiking) in actor.layers.iter().enumerate() {
        layers.push(layer(spiking, &format!("decision.{}", index + 1)));
    }
    let encoder = RateEncoder {
        goal_distance_scale_m: 1.0,
        linear_scale_m_per_s: 1.0,
        angular_scale_rad_per_s: 1.0,
        laser_scale_m: 1.0,
    };
    Network { name: "actor".to_owned(), steps: 5, relay: false, layers, encoder }
}

#[test]
fn spikes_equal_those_of_the_reference_bit_for_bit() {
    // Weights are multiples of 1/256, so that sums are exact in every order.
    for seed in 0..5 {
        let shape = ActorShape { hidden: vec![40, 30], ..ActorShape::laser_only() };
        let (actor, streams) = (Actor::new(&shape), Streams::new(seed, 0));
        let mut parameters = actor.initial(&streams);
        for value in &mut parameters.values {
            *value += 0.02;
        }
        dyadic(&mut parameters.values);
        let observations = gaussians(seed, 6 * 22);
        let trace: ActorTrace<Rectangular> =
            actor.forward(&parameters.values, &observations, &draws(&streams));
        let mut reference = FloatNetwork::new(&as_network(&actor, &parameters));
        for row in 0..6 {
            let line = |step: usize| {
                let from = (step * 6 + row) * 220;
                trace.branches[0].input[from..from + 220].iter().map(|s| *s > 0.0).collect()
            };
            let decision = reference.decide(&(0..5).map(line).collect());
            let counts =
                trace.action[row * 2..row * 2 + 2].iter().map(|a| (a * 5.0).round() as u32);
            assert_eq!(decision.output_counts, counts.collect::<Vec<_>>(), "seed {seed} row {row}");
            let traces = trace.branches[0].lif.iter().chain(&trace.layers);
            for (lif, expected) in traces.zip(&decision.layer_counts) {
                let width = lif.neurons() / 6;
                for (step, expected) in expected.iter().enumerate() {
                    let from = step * lif.neurons() + row * width;
                    let found: f32 = lif.spikes[from..from + width].iter().sum();
                    assert_eq!(found as u32, *expected, "seed {seed} row {row} step {step}");
                }
            }
        }
    }
}

/// The network that a weights file of these parameters holds, with a small encoder for events.
fn saved(parameters: &Parameters, events: bool) -> EemSan {
    let mut state = StateWriter::default();
    state.parameters("actor.", parameters);
    if events {
        let shape = HsvaeShape { channels: vec![1; 6], ..HsvaeShape::eem_san() };
        state.parameters("hsvae.", &Hsvae::new(&shape).initial(&Streams::new(1, 0)));
        for name in ["threshold", "latent.mean", "latent.deviation"] {
            let n = if name == "threshold" { 1 } else { shape.latent() };
            state.floats(&format!("hsvae.{name}"), &[n], &vec![0.5; n]);
        }
    }
    EemSan::from_bytes("saved", "saved", &state.bytes()).unwrap()
}

#[test]
fn every_network_of_the_table_equals_the_reference_over_the_ticks_of_a_trial() {
    for variant in VARIANTS {
        let dvs = vec![(-3.0, 3.0); if variant.events { 4 } else { 0 }];
        let shape =
            ActorShape { form: variant.form, dvs, hidden: vec![40, 30], ..ActorShape::eem_san() };
        let (actor, streams) = (Actor::new(&shape), Streams::new(2, 0));
        let mut parameters = actor.initial(&streams);
        let rule = actor.rule.map(Slot::range).unwrap_or_default();
        for (at, value) in parameters.values.iter_mut().enumerate() {
            *value += if rule.contains(&at) { 0.0 } else { 0.03 };
        }
        dyadic(&mut parameters.values[rule.end..]);
        let network = saved(&parameters, variant.events);
        let mut reference = FloatDecision::new(&network);
        reference.restart();
        let (mut state, mut draws) =
            (actor.rest(&parameters.values, 1), draws(&streams).samples(1));
        let mut seen = std::collections::BTreeSet::new();
        for tick in 0..4 {
            let observation = gaussians(tick, shape.observations());
            let trace: ActorTrace<Rectangular> =
                actor.forward_from(&parameters.values, &observation, &mut state, &mut draws);
            let decision = reference.decide(&inputs(&actor, &trace));
            let layers = trace.branches.iter().filter_map(|b| b.lif.as_ref()).chain(&trace.layers);
            for (lif, expected) in layers.zip(&decision.layer_counts) {
                let steps = lif.spikes.chunks_exact(lif.neurons());
                let found: Vec<u32> = steps.map(|s| s.iter().sum::<f32>() as u32).collect();
                assert_eq!(found, *expected, "{} tick {tick}", variant.name);
                seen.extend(found.into_iter().filter(|n| *n > 0 && *n < lif.neurons() as u32));
            }
            let counts: Vec<u32> = trace.action.iter().map(|a| (a * 5.0).round() as u32).collect();
            assert_eq!(decision.output_counts, counts, "{} tick {tick}", variant.name);
        }
        assert!(seen.len() > 3, "{}: layers fire all or nothing", variant.name);
    }
}

/// What the codes of one row gave, by branch and step.
fn inputs(actor: &Actor, trace: &ActorTrace<Rectangular>) -> Vec<Vec<Vec<bool>>> {
    let mut first = 0;
    let mut of_branch = |(branch, own): (&Branch, &BranchTrace<Rectangular>)| {
        let lines = branch.lines();
        let (all, width, from) = match branch.layer {
            Some(_) => (&own.input, lines, 0),
            None => (&trace.fused, actor.layers[0].linear.inputs, first),
        };
        first += lines;
        let steps = all.chunks_exact(width).map(|step| &step[from..from + lines]);
        steps.map(|step| step.iter().map(|s| *s > 0.0).collect()).collect()
    };
    actor.branches.iter().zip(&trace.branches).map(&mut of_branch).collect()
}

#[test]
fn thresholds_stay_when_they_do_not_learn() {
    let form = Form { thresholds: Thresholds::Fixed, ..Form::EEM_SAN };
    let actor = Actor::new(&ActorShape { form, threshold: 0.3, ..small(2) });
    let (streams, observations) = (Streams::new(3, 0), gaussians(1, 4 * 5));
    let values = actor.initial(&streams).values;
    let trace: ActorTrace<Rectangular> = actor.forward(&values, &observations, &draws(&streams));
    let mut gradient = actor.layout().zeros();
    actor.backward(&values, &mut gradient, &trace, &gaussians(2, 8));
    let fixed: Vec<_> =
        actor.layout().entries().iter().filter(|e| e.name.ends_with(".threshold")).collect();
    assert_eq!(fixed.len(), 5);
    for entry in fixed {
        assert_eq!(entry.slot.of(&gradient), [0.0], "{}", entry.name);
        assert_eq!(entry.slot.of(&values), [0.3], "{}", entry.name);
    }
}

#[test]
fn actors_of_every_form_learn_given_actions() {
    for shape in forms().into_iter().filter(|shape| !shape.dvs.is_empty()) {
        learns_given_actions(&ActorShape { hidden: vec![32, 32], ..shape });
    }
}

fn learns_given_actions(shape: &ActorShape) {
    let (actor, streams) = (Actor::new(shape), Streams::new(3, 0));
    let mut parameters = actor.initial(&streams);
    let mut adam = Adam::new(parameters.values.len());
    let observations = gaussians(1, 8 * 5);
    let wanted: Vec<f32> =
        (0..16).map(|i| if (i / 2 + i % 2) % 2 == 0 { 1.0 } else { 0.0 }).collect();
    let mut losses = Vec::new();
    for _ in 0..300 {
        let trace: ActorTrace<Rectangular> =
            actor.forward(&parameters.values, &observations, &draws(&streams));
        let errors: Vec<f32> = trace.action.iter().zip(&wanted).map(|(a, w)| a - w).collect();
        losses.push(errors.iter().map(|e| e * e).sum::<f32>());
        let mut gradient = actor.layout().zeros();
        actor.backward(&parameters.values, &mut gradient, &trace, &errors);
        adam.step(&AdamSettings::with_rate(1e-2), &mut parameters.values, &gradient);
        actor.project(&mut parameters.values);
    }
    let (first, last) = (losses[0], losses[losses.len() - 1]);
    assert!(last < 0.25 * first, "{}: loss went from {first} to {last}", shape.form);
}
