//! Counts from sizes and spikes, without running anything.
//!
//! The effective operations of NeuroBench hold for weights none of which is 0.

use crate::cost::{Activity, ConvShape, Counts, DenseShape, Modules, Ops, Row, Shape, Traffic};

/// Counts of all modules over `ticks` control ticks with this activity.
///
/// Panics when an activity has other layers than the shape.
pub fn closed_form(shape: &Shape, activity: &Modules<Activity>, ticks: u64) -> Modules<Counts> {
    Modules {
        spiking_encoder: spiking_encoder(shape, &activity.spiking_encoder, ticks),
        artificial_encoder: artificial_encoder(shape, &activity.artificial_encoder, ticks),
        spiking_decision: spiking_decision(shape, &activity.spiking_decision, ticks),
        artificial_decision: artificial_decision(shape, &activity.artificial_decision, ticks),
    }
}

/// Operations of the artificial counterpart, row (iv), per control tick in the accounting `exact`:
/// they are the same whatever is seen.
pub fn artificial_ops(shape: &Shape) -> Ops {
    let (n_encoder, n_decision) = (shape.encoder.len(), shape.dense_layers().count());
    let (encoder, decision) = (Activity::new(n_encoder + 1, 0), Activity::new(n_decision, 0));
    let nothing = Modules {
        spiking_encoder: encoder.clone(),
        artificial_encoder: encoder,
        spiking_decision: decision.clone(),
        artificial_decision: decision,
    };
    Row::ArtificialArtificial.counts(&closed_form(shape, &nothing, 1)).exact
}

fn spiking_encoder(shape: &Shape, activity: &Activity, ticks: u64) -> Counts {
    let frames = ticks * shape.frames;
    let (read, seen) = readout_and_layers(shape, activity);
    let mut counts = Counts::default();
    for (index, (layer, traffic)) in shape.encoder.iter().zip(seen).enumerate() {
        if index == 0 {
            let dense = artificial_conv(layer, frames);
            (counts.paper, counts.exact) = (dense.paper, dense.exact);
        } else {
            let sums = traffic.arrivals * layer.fan_out() + frames * layer.neurons();
            counts.paper += Ops::sums(sums);
            counts.exact += Ops::sums(traffic.reached * layer.outputs);
        }
        counts.chip += Ops::sums(traffic.reached * layer.outputs);
        synaptic(&mut counts, traffic, frames * layer.products(), layer.outputs);
    }
    counts.exact += Ops::products(ticks * shape.readout.products());
    synaptic(&mut counts, read, ticks * shape.readout.products(), shape.readout.outputs);
    neurons(&mut counts, activity, shape.encoder_neurons(), shape.frames, ticks);
    counts
}

fn artificial_encoder(shape: &Shape, activity: &Activity, ticks: u64) -> Counts {
    let frames = ticks * shape.frames;
    let (read, seen) = readout_and_layers(shape, activity);
    let mut counts = Counts::default();
    for (layer, traffic) in shape.encoder.iter().zip(seen) {
        counts += artificial_conv(layer, frames);
        synaptic(&mut counts, traffic, frames * layer.products(), layer.outputs);
    }
    let mean = artificial_dense(&shape.readout, frames);
    counts += mean;
    synaptic(&mut counts, read, frames * shape.readout.products(), shape.readout.outputs);
    let deviation = mean.paper;
    counts.paper += deviation;
    counts
}

fn spiking_decision(shape: &Shape, activity: &Activity, ticks: u64) -> Counts {
    let steps = ticks * shape.steps;
    let mut counts = Counts::default();
    for (layer, traffic) in shape.dense_layers().zip(checked(shape, activity)) {
        let sums = Ops::sums(traffic.arrivals * layer.outputs);
        counts.paper += sums;
        counts.paper += Ops::sums(steps * layer.outputs);
        counts.exact += sums;
        counts.chip += sums;
        synaptic(&mut counts, traffic, steps * layer.products(), layer.outputs);
    }
    neurons(&mut counts, activity, shape.decision_neurons(), shape.steps, ticks);
    counts
}

fn artificial_decision(shape: &Shape, activity: &Activity, ticks: u64) -> Counts {
    let steps = ticks * shape.steps;
    let mut counts = Counts::default();
    for (layer, traffic) in shape.dense_layers().zip(checked(shape, activity)) {
        counts += artificial_dense(layer, steps);
        synaptic(&mut counts, traffic, steps * layer.products(), layer.outputs);
    }
    let fused = Ops::sums(steps * shape.branches[0].outputs);
    counts.exact += fused;
    counts.chip += fused;
    counts
}

fn artificial_conv(layer: &ConvShape, frames: u64) -> Counts {
    let mut paper = Ops::products(frames * layer.products_with_border());
    paper += Ops::sums(frames * layer.neurons());
    let exact = Ops::products(frames * layer.products());
    Counts { paper, exact, chip: exact, ..Counts::default() }
}

/// FSVAE's counter takes the inputs for the outputs.
fn artificial_dense(layer: &DenseShape, calls: u64) -> Counts {
    let mut paper = Ops::products(calls * layer.inputs * layer.inputs);
    paper += Ops::sums(calls * layer.outputs);
    let exact = Ops::products(calls * layer.products());
    Counts { paper, exact, chip: exact, ..Counts::default() }
}

/// NeuroBench's synaptic operations of a layer with `outputs` channels.
fn synaptic(counts: &mut Counts, traffic: &Traffic, dense: u64, outputs: u64) {
    counts.neurobench.dense += dense;
    counts.neurobench.effective_macs += traffic.reached_by_reals * outputs;
    counts.neurobench.effective_acs += traffic.reached_by_bits() * outputs;
}

/// Decays and sums of neurons: `c = d_c c + x`, `v = d_v v + c`; the chip adds the bias as well.
fn neurons(counts: &mut Counts, activity: &Activity, neurons: u64, steps: u64, ticks: u64) {
    let updates = ticks * steps * neurons;
    counts.exact += Ops::products(2 * updates);
    counts.chip += Ops { additions: 3 * updates, multiplications: 2 * updates };
    counts.neurobench.membrane_updates += ticks * neurons + activity.membranes_changed;
    counts.neurobench.membrane_updates_dense += updates;
}

fn readout_and_layers<'a>(shape: &Shape, activity: &'a Activity) -> (&'a Traffic, &'a [Traffic]) {
    let n = shape.encoder.len();
    assert_eq!(activity.layers.len(), n + 1, "layers of an encoder's activity, with readout");
    (&activity.layers[n], &activity.layers[..n])
}

fn checked<'a>(shape: &Shape, activity: &'a Activity) -> &'a [Traffic] {
    let n = shape.dense_layers().count();
    assert_eq!(activity.layers.len(), n, "layers of a decision module's activity");
    &activity.layers
}
