use super::*;
use crate::net::{Layer, Network, RateEncoder};
use crate::nn::adam::{Adam, AdamSettings};
use crate::nn::gradient_check::{check, gaussians, weighted};
use crate::nn::spike::{Rectangular, Smooth};
use crate::reference::FloatNetwork;
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

#[test]
fn gradients_equal_finite_differences() {
    let streams = Streams::new(7, 0);
    for dvs in [0, 2] {
        let actor = Actor::new(&small(dvs));
        let mut values = actor.initial(&streams).values;
        // Larger weights, so that gradients of the first layers stand out.
        let noise = gaussians(11, values.len());
        for entry in actor.layout().entries().iter().filter(|e| e.name.ends_with("weight")) {
            for at in entry.slot.range() {
                values[at] += 0.3 * noise[at];
            }
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
            let loss = |part: &[f32]| {
                let mut moved = values.clone();
                entry.slot.of_mut(&mut moved).copy_from_slice(part);
                weighted(&run(&moved, &observations).action, &weights)
            };
            check(&entry.name, entry.slot.of(&values), entry.slot.of(&gradient), loss);
        }
        let loss = |o: &[f32]| weighted(&run(&values, o).action, &weights);
        check("observations", &observations, &d, loss);
    }
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
    let mut layers = vec![layer(&actor.branches[0].layer, "fuse.laser")];
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
            let traces = [&trace.branches[0].lif].into_iter().chain(&trace.layers);
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

#[test]
fn thresholds_stay_when_they_do_not_learn() {
    let actor = Actor::new(&ActorShape { learn_thresholds: false, ..small(2) });
    let (streams, observations) = (Streams::new(3, 0), gaussians(1, 4 * 5));
    let values = actor.initial(&streams).values;
    let trace: ActorTrace<Rectangular> = actor.forward(&values, &observations, &draws(&streams));
    let mut gradient = actor.layout().zeros();
    actor.backward(&values, &mut gradient, &trace, &gaussians(2, 8));
    for entry in actor.layout().entries().iter().filter(|entry| entry.name.ends_with(".r")) {
        assert_eq!(entry.slot.of(&gradient), [0.0], "{}", entry.name);
    }
}

#[test]
fn actor_learns_given_actions() {
    let shape = ActorShape { hidden: vec![32, 32], ..small(2) };
    let (actor, streams) = (Actor::new(&shape), Streams::new(3, 0));
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
    assert!(last < 0.25 * first, "loss went from {first} to {last}");
}
