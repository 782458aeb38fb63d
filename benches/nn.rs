//! Speed of training: one DDPG update and one HSVAE update with the sizes of EEM-SAN, and a tick of the
//! encoder that learns end to end.
//!
//! The first two divide a batch into two shards and run them on one or two threads; results are the
//! same.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spikeloop::nn::hsvae::{HsvaeSettings, HsvaeTrainer, Sequences};
use spikeloop::nn::shards::Shards;
use spikeloop::nn::spiking_encoder::Tape;
use spikeloop::nn::{
    ActorShape, CriticShape, Ddpg, DdpgSettings, Hsvae, HsvaeShape, Rectangular, SpikingEncoder,
    SpikingEncoderShape, Transitions,
};
use spikeloop::rng::{Streams, stream};

const BATCH: usize = 256;
const SEQUENCES: usize = 16;

fn uniforms(counter: u64, count: usize) -> Vec<f32> {
    let mut draw = Streams::new(1, 0).at(stream::STIMULUS, counter);
    (0..count).map(|_| draw.uniform() as f32).collect()
}

fn ddpg(c: &mut Criterion) {
    let actor = ActorShape::eem_san();
    let width = actor.observations();
    let (observations, next) = (uniforms(0, BATCH * width), uniforms(1, BATCH * width));
    let (actions, rewards) = (uniforms(2, BATCH * 2), uniforms(3, BATCH));
    let batch = Transitions {
        observations: &observations,
        actions: &actions,
        rewards: &rewards,
        next_observations: &next,
        terminal: &[0.0; BATCH],
        judged: None,
        history: None,
    };
    let streams = Streams::new(1, 0);
    let mut group = c.benchmark_group("nn/ddpg_update/batch_256");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    for threads in [1, 2] {
        let shards = Shards { count: 2, threads };
        let settings = DdpgSettings { shards, ..DdpgSettings::default() };
        let mut learner = Ddpg::new(&settings, &actor, &CriticShape::eem_san(width), 1);
        group.bench_function(format!("threads_{threads}"), |b| {
            b.iter(|| black_box(learner.update(&batch, &streams)));
        });
    }
    group.finish();
}

/// Frames with about 3 % of the pixels on.
fn frames(count: usize) -> Vec<f32> {
    uniforms(4, count).into_iter().map(|u| f32::from(u < 0.03)).collect()
}

fn hsvae(c: &mut Criterion) {
    let shape = HsvaeShape::eem_san();
    let frames = frames(shape.frames * SEQUENCES * shape.pixels());
    let targets = &frames[(shape.frames - 1) * SEQUENCES * shape.pixels()..];
    let batch = Sequences { samples: SEQUENCES, frames: &frames, targets };
    let streams = Streams::new(1, 0);
    let mut group = c.benchmark_group("nn/hsvae");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    for threads in [1, 2] {
        let shards = Shards { count: 2, threads };
        let settings = HsvaeSettings { shards, ..HsvaeSettings::default() };
        let trainer = HsvaeTrainer::new(&settings, &shape, &streams);
        group.bench_function(format!("gradient/sequences_16/threads_{threads}"), |b| {
            b.iter(|| {
                let mut state = trainer.layers().rest(SEQUENCES);
                black_box(trainer.gradient(&batch, &mut state, &streams))
            });
        });
    }
    let trainer = HsvaeTrainer::new(&HsvaeSettings::default(), &shape, &streams);
    let one: Vec<f32> = frames
        .chunks(SEQUENCES * shape.pixels())
        .flat_map(|f| &f[..shape.pixels()])
        .copied()
        .collect();
    let mut state = trainer.layers().rest(1);
    group.bench_function("encode/tick", |b| {
        let values = &trainer.parameters.values;
        b.iter(|| black_box(trainer.layers().encode::<Rectangular>(values, &one, &mut state)));
    });
    group.finish();
}

/// One control tick of one world, by events: forward, and there and back.
fn spiking_encoder(c: &mut Criterion) {
    let dense = HsvaeShape { encoder_lean: 1.0, ..HsvaeShape::eem_san() };
    let initial = Hsvae::new(&dense).initial(&Streams::new(1, 0));
    let encoder = SpikingEncoder::new(&SpikingEncoderShape {
        side: dense.side,
        channels: dense.channels.clone(),
        latent: dense.latent(),
        lif: dense.lif,
        threshold: dense.threshold,
    });
    let mut values = encoder.layout().zeros();
    for entry in encoder.layout().entries() {
        entry.slot.of_mut(&mut values).copy_from_slice(initial.tensor(&entry.name).unwrap());
    }
    let weights = encoder.lay_out(&values);
    let all = frames(dense.frames * dense.pixels());
    let active = |frame: &[f32]| (0..frame.len()).filter(|at| frame[*at] > 0.0).collect();
    let tick: Vec<Vec<usize>> = all.chunks(dense.pixels()).map(active).collect();
    let mut tape = encoder.tape(true);
    let see = |tape: &mut Tape| {
        for frame in &tick {
            encoder.step::<Rectangular>(&weights, tape, frame.iter().copied());
        }
    };
    let mut group = c.benchmark_group("nn/spiking_encoder");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    group.bench_function("forward/tick", |b| {
        b.iter(|| {
            tape.forget();
            see(&mut tape);
            black_box(encoder.state(&weights, &tape))
        });
    });
    let d_state = vec![1.0; dense.latent()];
    let mut gradient = encoder.layout().zeros();
    group.bench_function("gradient/tick", |b| {
        b.iter(|| {
            tape.forget();
            see(&mut tape);
            let d = [(tape.newest(), &d_state[..])];
            encoder.backward::<Rectangular>(&weights, &tape, &d, 0.1, &mut gradient)
        });
    });
    group.finish();
}

criterion_group!(benches, ddpg, hsvae, spiking_encoder);
criterion_main!(benches);
