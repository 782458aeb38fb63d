//! Speed of training: one DDPG update and one HSVAE update with the sizes of EEM-SAN.
//!
//! Both divide a batch into two shards and run them on one or two threads; results are the same.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spikeloop::nn::hsvae::{HsvaeSettings, HsvaeTrainer, Sequences};
use spikeloop::nn::shards::Shards;
use spikeloop::nn::{
    ActorShape, CriticShape, Ddpg, DdpgSettings, HsvaeShape, Rectangular, Transitions,
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

criterion_group!(benches, ddpg, hsvae);
criterion_main!(benches);
