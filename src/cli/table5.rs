//! `spikeloop table5`.

use std::path::Path;

use indicatif::ProgressBar;
use spikeloop::closed_loop::{Trial, TrialConfig};
use spikeloop::coding::decode;
use spikeloop::cost::{Activity, Counts, Modules, Row, Shape, closed_form};
use spikeloop::evaluate::in_turn;
use spikeloop::net::{Controller, EemSan, builtin};
use spikeloop::nn::{Actor, ActorShape, Hsvae, HsvaeShape, StateWriter};
use spikeloop::policy::Observation;
use spikeloop::reference::{CountedEemSan, CountedNetwork};
use spikeloop::report::reproduction::CountedOps;
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
    let mut measured = Measured::default();
    let bar = progress(args.seconds * TICKS_PER_S, &args.network);
    let flight = Flight {
        bar: &bar,
        seconds: args.seconds,
        seed: args.seed,
        steps: counted.steps(),
        world,
        config,
    };
    (measured.ticks, measured.trials) = flight.fly(&mut |observation, streams, tick| {
        if tick == 0 {
            counted.reset();
        }
        let done = counted.tick(observation, streams, tick);
        measured.counts += done.counts;
        measured.activity += &done.activity;
        done.output_counts
    })?;
    bar.finish_and_clear();
    Ok(measured)
}

/// Trials one after the other until some time is full.
struct Flight<'a> {
    /// Told of every control tick.
    bar: &'a ProgressBar,
    seconds: u64,
    seed: u64,
    /// `T`, steps per decision.
    steps: u32,
    world: &'a World,
    config: &'a TrialConfig,
}

impl Flight<'_> {
    /// Control ticks and trials flown by what gives output spikes of an observation, with the
    /// streams of its trial, at a control tick of it.
    fn fly(
        &self,
        drive: &mut dyn FnMut(&Observation, Streams, u64) -> Vec<u32>,
    ) -> Result<(u64, usize), Failure> {
        let ticks_max = self.seconds * TICKS_PER_S;
        let streams = Streams::new(self.seed, 0);
        let pairs = generate_pairs(self.world, TRIALS_MAX, PairRules::default(), streams)?;
        let (mut ticks, mut trials) = (0, 0);
        for (trial_idx, pair) in pairs.iter().enumerate() {
            if ticks == ticks_max {
                break;
            }
            let streams = Streams::new(self.seed, trial_idx as u64);
            let mut trial = Trial::new(self.world, pair.start, pair.goal, self.config, streams)?;
            trials += 1;
            while trial.end().is_none() && ticks < ticks_max {
                let output = drive(&trial.observe(), streams, trial.ticks());
                trial.drive(decode(&output, self.steps));
                ticks += 1;
                self.bar.inc(1);
            }
        }
        Ok((ticks, trials))
    }
}

/// What networks of EEM-SAN's parts do in a control tick, as they are, in the exact accounting: sums
/// over `seconds` of flight in `map` at 1 m/s, counted on `threads` threads.
///
/// Errors: a network with a description; an arena that cannot be read.
pub(super) fn operations(
    names: &[&str],
    (map, seconds, seed): (&str, u64, u64),
    threads: usize,
) -> Result<Vec<CountedOps>, Failure> {
    let bar = progress(names.len() as u64 * seconds * TICKS_PER_S, "operations");
    let count = |index: usize| operations_of(names[index], (map, seconds, seed), &bar);
    let counted = in_turn(names.len(), threads, count);
    bar.finish_and_clear();
    counted
}

fn operations_of(
    name: &str,
    (map, seconds, seed): (&str, u64, u64),
    bar: &ProgressBar,
) -> Result<CountedOps, Failure> {
    let Controller::EemSan(network) = builtin::open(name, None)? else {
        return Err(
            format!("{name}: a network with a description; its cost is that of its map").into()
        );
    };
    let mut counted = CountedNetwork::new(&network);
    let camera = network.encoder.is_some().then(CameraConfig::default);
    let config = TrialConfig { camera, ..TrialConfig::eem_san(1.0) };
    let world = World::new(Arena::open(map)?);
    let steps = counted.steps();
    let flight = Flight { bar, seconds, seed, steps, world: &world, config: &config };
    let mut sum = Counts::default();
    let (ticks, _) = flight.fly(&mut |observation, streams, tick| {
        if tick == 0 {
            counted.reset();
        }
        let (output, counts) = counted.tick(observation, streams, tick);
        sum += counts;
        output
    })?;
    Ok(CountedOps { ticks, ops: sum.exact })
}
