//! The event engine, beside what the machine can do.

use std::cell::LazyCell;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, Throughput};
use hw_model::engine::{Engine, SpikeRecord, Stimulus};
use hw_model::{CoreMap, DenseEngine, EventEngine};

use crate::networks::{self, Case};
use crate::roofline::Roofline;

const THREADS: [usize; 2] = [1, 2];
/// Steps of the dense engine, which visits every synapse in each.
const DENSE_STEPS: usize = 100;

type Build = fn() -> Case;
type NewEngine = fn(Arc<CoreMap>) -> Box<dyn Engine>;

/// Networks, with the synaptic operations of a run: known beforehand, so that a network that the
/// filter leaves out need not be built.
const NETWORKS: [(&str, u64, Build); 4] = [
    ("mlp", 107_714_302, networks::mlp),
    ("conv", 109_256_920, networks::conv),
    ("sparse", 16_017_100, networks::sparse),
    ("eem_san", 158_750_601, networks::eem_san),
];

/// Percent of the inputs that spike in a step, with the synaptic operations of a run.
const RATES: [(u32, u64); 5] =
    [(1, 2_568_192), (5, 12_975_104), (10, 26_045_440), (25, 65_187_840), (50, 130_787_328)];

/// Cores and compartments of each.
const STATES: [(usize, usize); 5] = [(1, 1024), (16, 1024), (64, 256), (128, 128), (128, 1024)];

pub(crate) fn all(criterion: &mut Criterion) {
    for (name, synaptic_ops, case) in NETWORKS {
        network(criterion, &format!("chip/{name}"), &case, synaptic_ops, &THREADS);
    }
    for (percent, synaptic_ops) in RATES {
        let case = || networks::layer(f64::from(percent) / 100.0);
        network(criterion, &format!("rate/{percent}_percent"), &case, synaptic_ops, &[1]);
    }
    for (cores, compartments) in STATES {
        state(criterion, cores, compartments);
    }
    dense(criterion);
}

fn network(
    criterion: &mut Criterion,
    name: &str,
    case: &dyn Fn() -> Case,
    synaptic_ops: u64,
    threads: &[usize],
) {
    let case = LazyCell::new(case);
    let mut roofline = None;
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(synaptic_ops)).sample_size(20);
    for &threads in threads {
        let parameter = format!("threads_{threads}");
        // Criterion calls these closures again for every sample.
        let mut engine = None;
        group.bench_function(BenchmarkId::new("event", &parameter), |b| {
            let with_threads = || EventEngine::with_threads(Arc::clone(&case.map), threads);
            let engine = engine.get_or_insert_with(with_threads);
            b.iter(|| run_anew(engine, &case.stimulus));
        });
        group.bench_function(BenchmarkId::new("roofline", &parameter), |b| {
            let roofline = roofline.get_or_insert_with(|| Roofline::new(&case, synaptic_ops));
            b.iter(|| roofline.run(threads));
        });
    }
    group.finish();
}

/// The reference engine beside the event engine, in the first steps of `mlp`.
fn dense(criterion: &mut Criterion) {
    let case = LazyCell::new(networks::mlp);
    let engines: [(&str, NewEngine); 2] = [
        ("event", |map| Box::new(EventEngine::new(map))),
        ("dense", |map| Box::new(DenseEngine::new(map))),
    ];
    let mut group = criterion.benchmark_group("engines/mlp_100_steps");
    group.sample_size(10);
    for (name, new) in engines {
        let mut engine = None;
        group.bench_function(name, |b| {
            let stimulus = case.stimulus.part(0..DENSE_STEPS);
            let engine = engine.get_or_insert_with(|| new(Arc::clone(&case.map)));
            b.iter(|| run_anew(engine.as_mut(), &stimulus));
        });
    }
    group.finish();
}

/// Updates of compartments that no spike reaches.
fn state(criterion: &mut Criterion, cores: usize, compartments: usize) {
    let mut group = criterion.benchmark_group(format!("state/{cores}x{compartments}"));
    let updates = cores * compartments * networks::STATE_STEPS;
    group.throughput(Throughput::Elements(updates as u64)).sample_size(20);
    let case = networks::state_only(cores, compartments);
    let mut engine = EventEngine::new(Arc::clone(&case.map));
    group.bench_function("event", |b| b.iter(|| run_anew(&mut engine, &case.stimulus)));
    group.finish();
}

/// A run from state zero, so that every run of a bench is the same.
fn run_anew(engine: &mut dyn Engine, stimulus: &Stimulus) {
    engine.reset();
    engine.run(stimulus, &mut SpikeRecord::none());
}
