//! `spikeloop table5`.

mod tables;

use std::path::Path;

use spikeloop::closed_loop::{Trial, TrialConfig};
use spikeloop::coding::decode;
use spikeloop::cost::{Activity, Counts, Modules, Row, Shape, closed_form};
use spikeloop::net::{Controller, EemSan, builtin};
use spikeloop::nn::{Actor, ActorShape, Hsvae, HsvaeShape, StateWriter};
use spikeloop::reference::CountedEemSan;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::dvs::CameraConfig;
use spikeloop::world::pairs::{PairRules, generate_pairs};

use crate::cli::args::Table5Args;
use crate::cli::output::{self, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// Name of EEM-SAN's sizes with random weights.
const UNTRAINED: &str = "untrained";

/// Control ticks per second.
const TICKS_PER_S: u64 = 20;

/// Most trials flown to fill the time.
const TRIALS_MAX: usize = 1000;

pub(super) fn run(args: &Table5Args) -> Result<Verdict, Failure> {
    check_outputs(&args.json, [Path::new(&args.network), Path::new(&args.arena)])?;
    let network = network(args)?;
    let missing = || {
        format!(
            "{}: laser-only, without an encoder of event frames; Table 5 is about networks with \
             one: train it with `spikeloop train actor --encoder FILE`",
            args.network
        )
    };
    let shape = Shape::of(&network).ok_or_else(missing)?;
    let mut counted = CountedEemSan::new(&network).ok_or_else(missing)?;
    let config =
        TrialConfig { camera: Some(CameraConfig::default()), ..TrialConfig::eem_san(args.v_max) };
    config.check()?;
    let world = World::new(Arena::open(&args.arena)?);
    say(header(Some(args.seed), &[]))?;
    let measured = fly(args, &world, &config, &mut counted)?;
    let formula = closed_form(&shape, &measured.activity, measured.ticks);
    let differing: Vec<Row> = Row::ALL
        .into_iter()
        .filter(|row| row.counts(&measured.counts) != row.counts(&formula))
        .collect();
    tables::print(args, &shape, &measured, &differing)?;
    if let Some(path) = &args.json {
        let json = tables::as_json(args, &shape, &measured, &differing);
        output::write(path, &serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(if differing.is_empty() { Verdict::Good } else { Verdict::Differs })
}

fn network(args: &Table5Args) -> Result<EemSan, Failure> {
    if args.network == UNTRAINED {
        return untrained(args.seed);
    }
    match builtin::open(&args.network, None)? {
        Controller::EemSan(network) => Ok(*network),
        Controller::Described(_) => Err(format!(
            "{}: a network with a rate code, not an EEM-SAN; give an EEM-SAN's weights \
             (.safetensors), eem-san or {UNTRAINED}",
            args.network
        )
        .into()),
    }
}

/// EEM-SAN's sizes with fresh weights.
fn untrained(seed: u64) -> Result<EemSan, Failure> {
    let mut state = StateWriter::default();
    let shape = HsvaeShape::eem_san();
    let hsvae = Hsvae::new(&shape).initial(&Streams::new(seed, 0));
    state.parameters("hsvae.", &hsvae);
    state.floats("hsvae.threshold", &[1], &[shape.threshold]);
    state.floats("hsvae.latent.mean", &[shape.latent()], &vec![0.0; shape.latent()]);
    state.floats("hsvae.latent.deviation", &[shape.latent()], &vec![1.0; shape.latent()]);
    let actor = Actor::new(&ActorShape::eem_san()).initial(&Streams::new(seed, 1));
    state.parameters("actor.", &actor);
    Ok(EemSan::from_bytes(UNTRAINED, UNTRAINED, &state.bytes())?)
}

/// Sums over all control ticks.
#[derive(Default)]
struct Measured {
    ticks: u64,
    trials: usize,
    counts: Modules<Counts>,
    activity: Modules<Activity>,
}

/// The spiking network drives, one trial after the other, until the time is full.
fn fly(
    args: &Table5Args,
    world: &World,
    config: &TrialConfig,
    counted: &mut CountedEemSan,
) -> Result<Measured, Failure> {
    let ticks = args.seconds * TICKS_PER_S;
    let streams = Streams::new(args.seed, 0);
    let pairs = generate_pairs(world, TRIALS_MAX, PairRules::default(), streams)?;
    let bar = progress(ticks, &args.network);
    let mut measured = Measured::default();
    for (trial_idx, pair) in pairs.iter().enumerate() {
        if measured.ticks == ticks {
            break;
        }
        let streams = Streams::new(args.seed, trial_idx as u64);
        let mut trial = Trial::new(world, pair.start, pair.goal, config, streams)?;
        counted.reset();
        measured.trials += 1;
        while trial.end().is_none() && measured.ticks < ticks {
            let done = counted.tick(&trial.observe(), streams, trial.ticks());
            trial.drive(decode(&done.output_counts, counted.steps()));
            measured.ticks += 1;
            measured.counts += done.counts;
            measured.activity += &done.activity;
            bar.set_position(measured.ticks);
        }
    }
    bar.finish_and_clear();
    Ok(measured)
}
