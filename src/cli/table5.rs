//! `spikeloop table5`.

use std::path::Path;

use spikeloop::closed_loop::{Trial, TrialConfig};
use spikeloop::coding::decode;
use spikeloop::cost::{Activity, Counts, Modules, Row, Shape, closed_form};
use spikeloop::net::{Controller, EemSan, builtin};
use spikeloop::nn::{Actor, ActorShape, Hsvae, HsvaeShape, StateWriter};
use spikeloop::reference::CountedEemSan;
use spikeloop::report::table5::{
    ArithmeticPrices, Table5Result, neurobench_table, ops_table, rate_table, rates, ratios, rows,
};
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::dvs::CameraConfig;
use spikeloop::world::pairs::{PairRules, generate_pairs};

use crate::cli::args::Table5Args;
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// Name of EEM-SAN's sizes with random weights.
const UNTRAINED: &str = "untrained";

/// Control ticks per second.
const TICKS_PER_S: u64 = 20;

/// Most trials flown to fill the time.
const TRIALS_MAX: usize = 1000;

pub(super) fn run(args: &Table5Args) -> Result<Verdict, Failure> {
    check_outputs(&args.json, [Path::new(&args.network), Path::new(&args.arena)])?;
    let counting = Counting::prepare(args)?;
    say(header(Some(args.seed), &[]))?;
    let result = counting.count()?;
    print(&result)?;
    if let Some(path) = &args.json {
        output::write(path, &serde_json::to_vec_pretty(&result)?)?;
    }
    let agree = result.rows.iter().all(|row| row.equals_closed_form);
    Ok(if agree { Verdict::Good } else { Verdict::Differs })
}

/// Everything that is needed to count, read and checked.
pub(super) struct Counting<'a> {
    args: &'a Table5Args,
    shape: Shape,
    counted: CountedEemSan,
    config: TrialConfig,
    world: World,
}

impl<'a> Counting<'a> {
    pub(super) fn prepare(args: &'a Table5Args) -> Result<Self, Failure> {
        let network = network(args)?;
        let missing = || {
            format!(
                "{}: not an EEM-SAN with HSVAE's encoder of event frames, population codes and a \
                 middle fuse module, which Table 5 and its artificial counterparts are about; train \
                 one with `spikeloop train actor --encoder FILE`",
                args.network
            )
        };
        let shape = Shape::of(&network).ok_or_else(missing)?;
        let counted = CountedEemSan::new(&network).ok_or_else(missing)?;
        let camera = Some(CameraConfig::default());
        let config = TrialConfig { camera, ..TrialConfig::eem_san(args.v_max) };
        config.check()?;
        let world = World::new(Arena::open(&args.arena)?);
        Ok(Self { args, shape, counted, config, world })
    }

    /// Drives, counts, and compares with the closed form.
    pub(super) fn count(mut self) -> Result<Table5Result, Failure> {
        let measured = fly(self.args, &self.world, &self.config, &mut self.counted)?;
        let formula = closed_form(&self.shape, &measured.activity, measured.ticks);
        let differs = |row: &Row| row.counts(&measured.counts) != row.counts(&formula);
        let differing: Vec<Row> = Row::ALL.into_iter().filter(differs).collect();
        Ok(as_result(self.args, self.shape, measured, &differing))
    }
}

fn as_result(
    args: &Table5Args,
    shape: Shape,
    measured: Measured,
    differing: &[Row],
) -> Table5Result {
    Table5Result {
        revision: REVISION.to_owned(),
        seed: args.seed,
        network: args.network.clone(),
        random_weights: args.network == UNTRAINED,
        arena: args.arena.clone(),
        v_max_m_per_s: args.v_max,
        ticks: measured.ticks,
        trials: measured.trials,
        rows: rows(&measured.counts, differing),
        ratios: ratios(&measured.counts),
        rates: rates(&shape, &measured.activity, measured.ticks),
        activity: measured.activity,
        shape,
        energy_pj: ArithmeticPrices::float32(),
    }
}

pub(super) fn print(result: &Table5Result) -> Result<(), Failure> {
    say(result.caption())?;
    say(ops_table(result))?;
    say(result.ratio_line())?;
    say(neurobench_table(result))?;
    say(result.energy_line())?;
    say(rate_table(result))?;
    say("artificial modules take the spiking network's weights: their NeuroBench figures are of \
         untrained networks")?;
    say(result.agreement_line())
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
