//! `spikeloop drive`.

use std::path::Path;
use std::time::Instant;

use spikeloop::closed_loop::TrialConfig;
use spikeloop::evaluate::{Driver, EngineKind, check_recordable, fly, record};
use spikeloop::report::contacts::{CONTACT_NOTE, driver_contacts};
use spikeloop::report::energy::{ENERGY_NOTE, driver_energy, speed_line};
use spikeloop::report::plot::trajectories;
use spikeloop::report::replay::Replay;
use spikeloop::report::results::{
    ArenaPicture, DriveResult, DriverResult, RESULT_FORMAT, Settings, pairs_mm,
};
use spikeloop::report::tables::{
    camera_note, cost_table, host_line, outcome_table, overflow_line, waiting_lines,
};
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::pairs::{Pair, PairRules, check_pairs, generate_pairs, read_pairs};

use crate::cli::args::{DriveArgs, EngineArg};
use crate::cli::drivers::{drivers, last_seed, maps};
use crate::cli::evaluate::each_once;
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

const TRIALS_DEFAULT: usize = 200;

pub(super) fn run(args: &DriveArgs) -> Result<Verdict, Failure> {
    let inputs = args.drivers.iter().map(Path::new).chain([Path::new(&args.arena)]);
    let inputs = inputs.chain(args.weights.as_deref()).chain(args.pairs.as_deref());
    check_outputs(args.json.iter().chain(&args.plot).chain(&args.replay), inputs)?;
    each_once("driver", &args.drivers)?;
    let engine = match args.engine {
        EngineArg::Event => EngineKind::Event,
        EngineArg::Dense => EngineKind::Dense,
    };
    let drivers = drivers(&args.drivers, args.weights.as_deref(), engine)?;
    let flight = Flight::prepare(args)?;
    last_seed(args.seed, "--repeats", args.repeats)?;
    flight.check_replay(args, &drivers)?;
    say(header(Some(args.seed), &maps(&drivers)))?;
    let result = flight.fly_all(&drivers, args.seed, args.repeats)?;
    print_result(&result)?;
    if let Some(path) = &args.json {
        output::write(path, &serde_json::to_vec(&result)?)?;
    }
    if let Some(path) = &args.plot {
        output::write(path, trajectories(&result).as_bytes())?;
    }
    if let (Some(path), Some(driver)) = (&args.replay, drivers.last()) {
        let chosen = match args.replay_trials.is_empty() {
            true => vec![first_success(&result, driver)],
            false => args.replay_trials.clone(),
        };
        let replay = flight.record(driver, args.seed, &chosen)?;
        output::write(path, &serde_json::to_vec(&replay)?)?;
    }
    Ok(Verdict::Good)
}

/// The first trial of `driver` that reached the goal, or else trial 0.
pub(super) fn first_success(result: &DriveResult, driver: &Driver) -> usize {
    let mut flown = result.drivers.iter().filter(|result| result.label == driver.label);
    let trials = flown.next().map_or(&[][..], |result| &result.trials);
    trials.iter().find(|trial| trial.outcome == "success").map_or(0, |trial| trial.trial)
}

/// World, trials and settings, ready to fly.
pub(super) struct Flight {
    pub(super) world: World,
    pub(super) pairs: Vec<Pair>,
    pub(super) config: TrialConfig,
    pub(super) threads: usize,
}

impl Flight {
    fn prepare(args: &DriveArgs) -> Result<Self, Failure> {
        let world = World::new(Arena::open(&args.arena)?);
        let config = TrialConfig {
            control_hz: args.control_hz,
            wheel_speed_m_per_s_max: args.v_max,
            actuators: args.actuators,
            ticks_max: args.ticks_max,
            action_noise: !args.no_action_noise,
            ..TrialConfig::san()
        };
        config.check()?;
        let pairs = match &args.pairs {
            Some(file) => pairs_of_file(file, &world, config.robot_radius_m, args.trials)?,
            None => {
                let n = args.trials.unwrap_or(TRIALS_DEFAULT);
                generate_pairs(&world, n, PairRules::default(), Streams::new(args.seed, 0))?
            }
        };
        // Pairs keep clear of movers in either condition, so that both fly the same ones.
        let world = match args.without_movers {
            true => World::new(world.arena().clone().without_movers()),
            false => world,
        };
        let threads = args.threads.unwrap_or_else(all_threads);
        Ok(Self { world, pairs, config, threads })
    }

    /// All trials of every driver and seed.
    pub(super) fn fly_all(
        &self,
        drivers: &[Driver],
        seed: u64,
        repeats: u64,
    ) -> Result<DriveResult, Failure> {
        let mut settings = self.config.clone();
        for driver in drivers {
            let flown = driver.config(&self.config)?;
            settings = if driver.needs_camera() { flown } else { settings };
        }
        let mut results = Vec::new();
        for driver in drivers {
            for seed in (0..repeats).map(|repeat| seed + repeat) {
                results.push(self.fly_one(driver, seed)?);
            }
        }
        Ok(DriveResult {
            format: RESULT_FORMAT,
            revision: REVISION.to_owned(),
            seed,
            settings: Settings::new(&settings),
            arena: ArenaPicture::new(&self.world),
            pairs_mm: pairs_mm(&self.pairs),
            drivers: results,
        })
    }

    /// Errs when a trial to be written down is none, or the driver is one that cannot be.
    fn check_replay(&self, args: &DriveArgs, drivers: &[Driver]) -> Result<(), Failure> {
        let n = self.pairs.len();
        if let Some(trial) = args.replay_trials.iter().find(|trial| **trial >= n) {
            return Err(format!(
                "--replay-trial {trial}: there are {n} trials, 0..={}; give one of them",
                n - 1
            )
            .into());
        }
        match drivers.last() {
            Some(driver) if args.replay.is_some() => Ok(check_recordable(driver)?),
            _ => Ok(()),
        }
    }

    /// Trials of one driver, tick by tick.
    pub(super) fn record(
        &self,
        driver: &Driver,
        seed: u64,
        trials: &[usize],
    ) -> Result<Replay, Failure> {
        let bar = progress(trials.len() as u64, &format!("{}, recorded", driver.label));
        let mut recordings = Vec::new();
        for trial in trials {
            let (world, pairs) = (&self.world, &self.pairs);
            recordings.push(record(world, pairs, *trial, &self.config, driver, seed)?);
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(Replay::new(REVISION, driver, seed, &self.world, &self.pairs, &recordings))
    }

    fn fly_one(&self, driver: &Driver, seed: u64) -> Result<DriverResult, Failure> {
        let bar = progress(self.pairs.len() as u64, &driver.label);
        let started = Instant::now();
        let flown =
            fly(&self.world, &self.pairs, &self.config, driver, seed, self.threads, &|| {
                bar.inc(1)
            })?;
        let wall_s = started.elapsed().as_secs_f64();
        bar.finish_and_clear();
        Ok(DriverResult::new(driver, seed, &flown, wall_s))
    }
}

/// The first `trials` pairs of a file, all of them by default.
pub(super) fn pairs_of_file(
    file: &Path,
    world: &World,
    robot_radius_m: f64,
    trials: Option<usize>,
) -> Result<Vec<Pair>, Failure> {
    let mut pairs = read_pairs(file)?;
    if let Some(trials) = trials.filter(|trials| *trials > pairs.len()) {
        let there = pairs.len();
        return Err(format!(
            "{}: {there} pairs, --trials {trials}; ask for {there} or fewer",
            file.display()
        )
        .into());
    }
    pairs.truncate(trials.unwrap_or(pairs.len()));
    check_pairs(&pairs, world, robot_radius_m, &file.display().to_string())?;
    Ok(pairs)
}

pub(super) fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The tables of a result.
pub(super) fn print_result(result: &DriveResult) -> Result<(), Failure> {
    let s = &result.settings;
    say(format_args!(
        "arena {}, {} Hz, v_max {} m/s, actuators {}{}",
        result.arena.name,
        s.control_hz,
        s.v_max_m_per_s,
        s.actuators,
        camera_note(result)
    ))?;
    say(outcome_table(&result.drivers))?;
    if let Some(contacts) = driver_contacts(&result.drivers) {
        say("trials that ended in contact:")?;
        say(contacts)?;
        say(CONTACT_NOTE)?;
    }
    let Some(costs) = cost_table(&result.drivers) else { return Ok(()) };
    say("per decision on the emulated chip (static energy is not part of the dynamic):")?;
    say(costs)?;
    if let Some(energy) = driver_energy(&result.drivers) {
        say("per decision, beside the artificial counterpart (ANN):")?;
        say(energy)?;
        say(ENERGY_NOTE)?;
    }
    for driver in &result.drivers {
        let decisions = driver.summary.decisions;
        let line = driver.summary.chip.as_ref().and_then(|chip| host_line(chip, decisions));
        if let Some(line) = line {
            let (label, seed) = (&driver.label, driver.seed);
            say(format_args!("{label}, seed {seed}: host, per decision: {line}"))?;
        }
        for line in waiting_lines(driver) {
            say(format_args!("{}, seed {}: {line}", driver.label, driver.seed))?;
        }
        if let Some(line) = speed_line(driver) {
            say(format_args!("{}, seed {}: {line}", driver.label, driver.seed))?;
        }
        if let Some(line) = driver.summary.chip.as_ref().and_then(overflow_line) {
            say(format_args!(
                "{}, seed {}: registers overflowed: {line}",
                driver.label, driver.seed
            ))?;
        }
    }
    Ok(())
}
