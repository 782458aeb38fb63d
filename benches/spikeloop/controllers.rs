//! What a user waits for: compiling and opening a core map, one decision, one closed-loop trial,
//! EEM-SAN's two phases of a control tick, and a flight with its event camera.
//!
//! The small network has the shape and roughly the spike rates of SAN (24-256-256-256-2, T = 5),
//! with random weights from a fixed stream; EEM-SAN is the one that ships.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BatchSize, Criterion, Throughput};
use hw_model::engine::Engine;
use hw_model::{ChipSpec, CoreMap, DenseEngine, EventEngine, container};
use spikeloop::closed_loop::TrialConfig;
use spikeloop::coding::{InputSpikes, population_spikes};
use spikeloop::compile::{Policy, Split};
use spikeloop::evaluate::{Driver, EngineKind, fly};
use spikeloop::host::{ChipPolicy, Deployment, EemSanChipPolicy, Schedule};
use spikeloop::net::{Controller, EemSan, Layer, Network, builtin};
use spikeloop::policy::{EventFrame, Policy as _};
use spikeloop::reference::eem_san::FloatDecision;
use spikeloop::reference::{FloatEncoder, FloatNetwork};
use spikeloop::rng::{Streams, stream};
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::dvs::CameraConfig;
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::networks::shipped_eem_san;

pub(crate) fn all(criterion: &mut Criterion) {
    compile(criterion);
    decision(criterion);
    trial(criterion);
    eem_san(criterion);
    flight(criterion);
}

/// Shape of SAN with random weights.
fn san_shaped() -> Network {
    let mut draw = Streams::new(1, 0).at(stream::STIMULUS, 0);
    let sizes = [24, 256, 256, 256, 2];
    let layers = sizes.windows(2).enumerate().map(|(index, size)| {
        let (inputs, neurons) = (size[0], size[1]);
        let spread = 1.2 / (inputs as f64).sqrt();
        Layer {
            name: format!("fc{}", index + 1),
            inputs,
            neurons,
            weights: (0..inputs * neurons)
                .map(|_| draw.uniform_in(-spread, spread) as f32)
                .collect(),
            bias: (0..neurons).map(|_| draw.uniform_in(0.0, 0.3) as f32).collect(),
            keep_current: 0.5,
            keep_voltage: 0.75,
            threshold: 0.5,
        }
    });
    let reflex = builtin::read("reflex", None).expect("built in");
    Network {
        name: "san-shaped".to_owned(),
        steps: 5,
        relay: true,
        layers: layers.collect(),
        ..reflex
    }
}

fn input(network: &Network, decision: u64) -> InputSpikes {
    let mut draw = Streams::new(2, 0).at(stream::STIMULUS, decision);
    let mut step = || (0..network.inputs()).map(|_| draw.bernoulli(0.24)).collect();
    (0..network.steps).map(|_| step()).collect()
}

fn deployed(network: &Network) -> Deployment {
    let policy = Policy::named("san").expect("there is one");
    Deployment::compile(network, &policy, &ChipSpec::loihi1(), Split::Fewest).expect("it fits")
}

fn compile(criterion: &mut Criterion) {
    let network = san_shaped();
    let mut group = criterion.benchmark_group("compile");
    group.bench_function("san_shaped", |b| b.iter(|| black_box(deployed(&network))));
    let bytes = deployed(&network).to_bytes();
    group.bench_function("san_shaped/open", |b| {
        b.iter(|| black_box(Deployment::from_bytes("bench", &bytes).expect("good")));
    });
    group.sample_size(10);
    let network = shipped_eem_san();
    let deployment = eem_san_deployed(&network);
    group.bench_function("eem_san", |b| b.iter(|| black_box(eem_san_deployed(&network))));
    let bytes = deployment.to_bytes();
    group.bench_function("eem_san/open", |b| {
        b.iter(|| black_box(Deployment::from_bytes("bench", &bytes).expect("good")));
    });
    // What opening is made of, beside decoding: the file's digest and the checks; then what it takes
    // to run.
    group.bench_function("eem_san/digest", |b| {
        b.iter(|| black_box(container::sha256_hex(black_box(&bytes))));
    });
    group.bench_function("eem_san/check", |b| {
        b.iter_batched(
            || deployment.map.parts().clone(),
            |parts| CoreMap::new(parts).expect("good"),
            BatchSize::LargeInput,
        );
    });
    group.bench_function("eem_san/engine", |b| {
        b.iter(|| black_box(EventEngine::new(Arc::clone(&deployment.map))));
    });
    group.finish();
}

fn decision(criterion: &mut Criterion) {
    let network = san_shaped();
    let deployment = deployed(&network);
    let inputs: Vec<InputSpikes> = (0..16).map(|decision| input(&network, decision)).collect();
    let mut group = criterion.benchmark_group("decision/san_shaped");
    group.throughput(Throughput::Elements(inputs.len() as u64));
    let mut float = FloatNetwork::new(&network);
    group.bench_function("float", |b| {
        b.iter(|| inputs.iter().for_each(|input| drop(black_box(float.decide(input)))));
    });
    let map = || Arc::clone(&deployment.map);
    let engines: [(&str, Box<dyn Engine>); 2] = [
        ("event", Box::new(EventEngine::new(map()))),
        ("dense", Box::new(DenseEngine::new(map()))),
    ];
    for (name, engine) in engines {
        let mut policy = ChipPolicy::new(&deployment, engine).expect("it has a program");
        group.bench_function(name, |b| {
            b.iter(|| inputs.iter().for_each(|input| drop(black_box(policy.decide(input)))));
        });
    }
    group.finish();
}

fn trial(criterion: &mut Criterion) {
    let world = World::new(Arena::open("courtyard").expect("built in"));
    let pairs: Vec<Pair> =
        generate_pairs(&world, 1, PairRules::default(), Streams::new(1, 0)).expect("it has room");
    let network = builtin::read("reflex", None).expect("built in");
    let policy = Policy::named("nearest").expect("there is one");
    let deployment =
        Deployment::compile(&network, &policy, &ChipSpec::loihi1(), Split::Fewest).expect("fits");
    let chip = Driver::chip(deployment, EngineKind::Event).expect("it has a program");
    let mut group = criterion.benchmark_group("trial/courtyard");
    group.sample_size(20);
    let drivers = [
        ("straight", Driver::straight()),
        ("reflex_float", Driver::float(&network)),
        ("reflex_chip", chip),
    ];
    for (name, driver) in drivers {
        group.bench_function(name, |b| {
            b.iter(|| {
                fly(&world, &pairs, &TrialConfig::san(), &driver, 1, 1, &|| ())
                    .expect("good settings")
            });
        });
    }
    group.finish();
}

/// A compiled EEM-SAN in the schedule `held`.
fn eem_san_deployed(network: &EemSan) -> Deployment {
    let policy = Policy::named("nearest").expect("there is one");
    let (chip, held) = (ChipSpec::loihi1(), Schedule::Held);
    Deployment::compile_eem_san(network, &policy, &chip, Split::Fewest, held).expect("it fits")
}

/// The same ready to drive, on one and on two threads.
fn eem_san_on_chip(network: &EemSan) -> [(usize, EemSanChipPolicy); 2] {
    let deployment = eem_san_deployed(network);
    [1, 2].map(|threads| {
        let engine = EventEngine::with_threads(Arc::clone(&deployment.map), threads);
        let mut policy = EemSanChipPolicy::new(&deployment, Box::new(engine)).expect("an EEM-SAN");
        policy.start_trial(Streams::new(1, 0));
        (threads, policy)
    })
}

/// The encoder's phase (a convolutional network of 102,464 neurons, five frames) and a decision.
fn eem_san(criterion: &mut Criterion) {
    let network = shipped_eem_san();
    let mut draw = Streams::new(4, 0).at(stream::STIMULUS, 0);
    let frames: Vec<EventFrame> = (0..5).map(|_| EventFrame::random(&mut draw, 300)).collect();
    let codes: Vec<InputSpikes> = network
        .branches()
        .map(|branch| population_spikes(&vec![0.2; branch.code.lines()], 5, &mut draw))
        .collect();
    let mut on_chip = eem_san_on_chip(&network);
    let mut group = criterion.benchmark_group("encoder/eem_san");
    group.sample_size(10);
    let mut encoder = FloatEncoder::new(network.encoder.as_ref().expect("it has one"));
    group.bench_function("float", |b| {
        b.iter(|| frames.iter().for_each(|frame| encoder.step(black_box(frame))));
    });
    for (threads, policy) in &mut on_chip {
        group.bench_function(format!("event/threads_{threads}"), |b| {
            b.iter(|| black_box(policy.encode(&frames)));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("decision/eem_san");
    let mut float = FloatDecision::new(&network);
    group.bench_function("float", |b| b.iter(|| black_box(float.decide(&codes))));
    for (threads, policy) in &mut on_chip {
        group.bench_function(format!("event/threads_{threads}"), |b| {
            b.iter(|| black_box(policy.decide(&codes)));
        });
    }
    group.finish();
}

/// The first 60 control ticks of a flight past movers, one thread: what takes how long is seen from
/// the differences.
fn flight(criterion: &mut Criterion) {
    let world = World::new(Arena::open("map1").expect("built in"));
    let pairs: Vec<Pair> =
        generate_pairs(&world, 1, PairRules::default(), Streams::new(1, 0)).expect("it has room");
    let blind = TrialConfig { ticks_max: 60, ..TrialConfig::eem_san(1.0) };
    let seeing = TrialConfig { camera: Some(CameraConfig::default()), ..blind.clone() };
    let eem_san = Driver::controller(&Controller::EemSan(shipped_eem_san()));
    let mut group = criterion.benchmark_group("flight/map1");
    group.sample_size(10);
    let flights = [
        ("straight", &blind, &Driver::straight()),
        ("straight_camera", &seeing, &Driver::straight()),
        ("eem_san_float", &seeing, &eem_san),
    ];
    for (name, config, driver) in flights {
        let ticks = || {
            let flown = fly(&world, &pairs, config, driver, 1, 1, &|| ()).expect("good settings");
            flown.iter().map(|flown| flown.outcome.ticks).sum::<u64>()
        };
        group.throughput(Throughput::Elements(ticks()));
        group.bench_function(name, |b| b.iter(|| black_box(ticks())));
    }
    group.finish();
}
