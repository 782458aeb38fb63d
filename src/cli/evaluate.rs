//! `spikeloop evaluate`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use hw_model::container;
use indicatif::ProgressBar;
use spikeloop::closed_loop::TrialConfig;
use spikeloop::evaluate::{CONDITIONS, Condition, Degradation, Driver, EngineKind, fly};
use spikeloop::files;
use spikeloop::net::weight_fault::WeightFault;
use spikeloop::report::contacts::CONTACT_NOTE;
use spikeloop::report::energy::{ENERGY_NOTE, speed_line, success_energy};
use spikeloop::report::plot::trajectories;
use spikeloop::report::results::{
    ArenaPicture, DriveResult, DriverResult, RESULT_FORMAT, Settings, pairs_mm,
};
use spikeloop::report::success::{
    Cell, CellKey, SuccessSettings, SuccessTable, has_paper_rows, success_table,
};
use spikeloop::report::tables::overflow_line;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::{Arena, EVALUATION_SEED};
use spikeloop::world::dvs::CameraConfig;
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::cli::args::EvaluateArgs;
use crate::cli::drive::all_threads;
use crate::cli::drivers::{degraded_driver, drivers, last_seed, maps};
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// The end of a picture.
const SVG_END: &str = "</svg>\n";

/// Below the table.
const NOTE: &str = "\
share of trials that reached the goal and that hit something, mean of all seeds, the rest out of time;
then the goals of each seed. Networks made for another control rate fly at 20 Hz here as well.";

/// Below that, where rows of the paper stand beside ours.
const PAPER_NOTE: &str = "\
Rows of the paper are its table of success rates (tab:2). Its maps are not published and map1, map2
are of this project's own design: compare the order of rows, not the numbers.";

pub(super) fn run(args: &EvaluateArgs) -> Result<Verdict, Failure> {
    let evaluation = Evaluation::prepare(args)?;
    say(header(Some(args.flights.seed), &maps(&evaluation.drivers)))?;
    evaluation.say_settings()?;
    let table = evaluation.fly_all()?;
    say(success_table(&table))?;
    say(NOTE)?;
    if has_paper_rows(&table) {
        say(PAPER_NOTE)?;
    }
    if let Some(contacts) = table.contact_table() {
        say("trials that ended in contact, all maps and seeds:")?;
        say(contacts)?;
        say(CONTACT_NOTE)?;
    }
    if let Some(energy) = success_energy(&table) {
        say("per decision on the emulated chip, mean of all seeds:")?;
        say(energy)?;
        say(ENERGY_NOTE)?;
    }
    for cell in &table.cells {
        if let Some(line) = cell.summary.chip.as_ref().and_then(overflow_line) {
            let (network, map) = (&cell.network, &cell.map);
            let (condition, seed) = (&cell.condition, cell.seed);
            let under = cell.degraded.as_ref().map_or_else(String::new, |it| format!(", {it}"));
            say(format_args!(
                "{network}, {map}, {condition}{under}, seed {seed}: registers overflowed: {line}"
            ))?;
        }
    }
    if let Some(path) = &args.json {
        output::write(path, &serde_json::to_vec_pretty(&table)?)?;
    }
    Ok(Verdict::Good)
}

/// A map in both conditions, and its trials.
pub(super) struct Map {
    name: String,
    pub(super) digest: String,
    moving: World,
    still: World,
    pub(super) pairs: Vec<Pair>,
}

impl Map {
    /// Pairs are drawn with the movers there, so that all conditions fly the same ones.
    pub(super) fn open(name: &str, trials: usize) -> Result<Self, Failure> {
        let moving = World::new(Arena::open(name)?);
        let still = World::new(moving.arena().clone().without_movers());
        let streams = Streams::new(EVALUATION_SEED, 0);
        let pairs = generate_pairs(&moving, trials, PairRules::default(), streams)?;
        let digest = container::digest(&moving.arena().to_json());
        Ok(Self { name: name.to_owned(), digest, moving, still, pairs })
    }

    pub(super) fn world(&self, condition: &Condition) -> &World {
        if condition.movers { &self.moving } else { &self.still }
    }
}

/// What to fly.
pub(super) struct Evaluation<'a> {
    args: &'a EvaluateArgs,
    config: TrialConfig,
    settings: SuccessSettings,
    drivers: Vec<Driver>,
    maps: Vec<Map>,
    conditions: Vec<&'static Condition>,
    /// Nothing first, then what is degraded.
    degradations: Vec<Option<&'static Degradation>>,
    seeds: Vec<u64>,
    threads: usize,
    known: Option<SuccessTable>,
}

/// One cell of the table to fly.
#[derive(Clone, Copy)]
struct Task<'a> {
    driver: &'a Driver,
    map: &'a Map,
    condition: &'static Condition,
    degradation: Option<&'static Degradation>,
    seed: u64,
}

impl<'a> Task<'a> {
    fn key(&self) -> CellKey<'a> {
        CellKey {
            network: &self.driver.label,
            map: &self.map.name,
            condition: self.condition.name,
            degraded: self.degradation.map(|degradation| degradation.name),
            seed: self.seed,
        }
    }

    /// `config` as the trials of this cell fly.
    fn config(&self, config: &TrialConfig) -> TrialConfig {
        let config = self.condition.config(config);
        self.degradation.map_or_else(|| config.clone(), |degradation| degradation.config(&config))
    }
}

impl<'a> Evaluation<'a> {
    pub(super) fn prepare(args: &'a EvaluateArgs) -> Result<Self, Failure> {
        let open = || drivers(&args.networks, args.weights.as_deref(), EngineKind::Event);
        Self::prepare_with(args, open)
    }

    /// The same with drivers that `open` gives, one for each network.
    pub(super) fn prepare_with(
        args: &'a EvaluateArgs,
        open: impl FnOnce() -> Result<Vec<Driver>, Failure>,
    ) -> Result<Self, Failure> {
        let inputs = args.networks.iter().chain(&args.maps).map(Path::new);
        let inputs = inputs.chain(args.weights.as_deref());
        check_outputs(args.json.iter().chain(&args.state), inputs)?;
        each_once("network", &args.networks)?;
        each_once("--map", &args.maps)?;
        each_once("--condition", &args.conditions)?;
        each_once("--degraded", &args.degraded)?;
        let mut drivers = open()?;
        for (driver, name) in drivers.iter_mut().zip(&args.networks) {
            driver.label.clone_from(name);
        }
        let (config, settings) = (config_of(args)?, Self::settings_of(args)?);
        let seed_last = last_seed(args.flights.seed, "--seeds", args.flights.seeds)?;
        let maps = args.maps.iter().map(|name| Map::open(name, args.flights.trials));
        let wanted = |condition: &&Condition| {
            args.conditions.is_empty() || args.conditions.iter().any(|n| n == condition.name)
        };
        let mut evaluation = Self {
            args,
            settings,
            config,
            drivers,
            maps: maps.collect::<Result<_, Failure>>()?,
            conditions: CONDITIONS.iter().filter(wanted).collect(),
            degradations: degradations(&args.degraded),
            seeds: (args.flights.seed..=seed_last).collect(),
            threads: args.flights.threads.unwrap_or_else(all_threads),
            known: None,
        };
        evaluation.check_weights()?;
        evaluation.known = evaluation.read_state()?;
        if let Some(folder) = &args.plot {
            output::picture_folder(folder, "svg", args.json.iter().chain(&args.state))?;
            files::check_writable(&folder.join("picture.svg"))?;
        }
        Ok(evaluation)
    }

    /// Settings that all cells share.
    ///
    /// Errors: a setting out of its limits.
    pub(super) fn settings_of(args: &EvaluateArgs) -> Result<SuccessSettings, Failure> {
        let (config, camera) = (config_of(args)?, CameraConfig::default());
        Ok(SuccessSettings::new(args.flights.trials, EVALUATION_SEED, &config, &camera))
    }

    /// Errs now for a driver whose weights cannot be degraded, not hours later.
    fn check_weights(&self) -> Result<(), Failure> {
        let faults = self.degradations.iter().flatten().filter_map(|it| it.weights());
        for fault in faults {
            for driver in &self.drivers {
                self.degraded(driver, fault, self.args.flights.seed)?;
            }
        }
        Ok(())
    }

    fn degraded(&self, driver: &Driver, fault: WeightFault, seed: u64) -> Result<Driver, Failure> {
        degraded_driver(&driver.label, self.args.weights.as_deref(), fault, seed)
    }

    /// The state file, when there is one, and only if it goes with what is to be flown.
    fn read_state(&self) -> Result<Option<SuccessTable>, Failure> {
        let Some(path) = self.args.state.as_ref().filter(|path| path.exists()) else {
            return Ok(None);
        };
        let file = path.display().to_string();
        let table = SuccessTable::from_json(&file, &files::read_text(path)?)?;
        table.check_settings(&file, &self.settings)?;
        for driver in &self.drivers {
            for map in &self.maps {
                let network = (driver.label.as_str(), driver.digest.as_deref());
                table.check_digests(&file, network, (&map.name, &map.digest))?;
            }
        }
        Ok(Some(table))
    }

    fn say_settings(&self) -> Result<(), Failure> {
        let s = &self.settings;
        say(format_args!(
            "{} Hz, no action noise, actuators {}, {} trials per map (pairs from seed {}), seeds {}..={}",
            s.control_hz,
            s.actuators,
            s.trials,
            s.pairs_seed,
            self.args.flights.seed,
            self.seeds.last().unwrap_or(&self.args.flights.seed)
        ))?;
        let seeing = self.drivers.iter().filter(|driver| driver.needs_camera());
        let seeing: Vec<&str> = seeing.map(|driver| driver.label.as_str()).collect();
        if !seeing.is_empty() {
            say(format_args!("event camera on for {}", seeing.join(", ")))?;
        }
        Ok(())
    }

    /// All cells of the table, in its order.
    fn tasks(&self) -> Vec<Task<'_>> {
        let mut tasks = Vec::new();
        for driver in &self.drivers {
            for condition in self.conditions.iter().copied() {
                for degradation in self.degradations.iter().copied() {
                    for map in &self.maps {
                        let task =
                            |seed: &u64| Task { driver, map, condition, degradation, seed: *seed };
                        tasks.extend(self.seeds.iter().map(task));
                    }
                }
            }
        }
        tasks
    }

    /// Flies what the state file does not have, and gives the whole table.
    pub(super) fn fly_all(&self) -> Result<SuccessTable, Failure> {
        let fresh = || SuccessTable::new(self.settings.clone());
        let mut state = self.known.clone().unwrap_or_else(fresh);
        let tasks = self.tasks();
        let is_open = |task: &&Task| {
            state.find(task.key()).is_none()
                || self.picture(task).is_some_and(|path| !self.is_picture_of(&path, task))
        };
        let open: Vec<Task> = tasks.iter().filter(is_open).copied().collect();
        if open.len() < tasks.len() {
            let done = tasks.len() - open.len();
            say(format_args!("{done} of {} cells are in the state file already", tasks.len()))?;
        }
        let bar = progress((open.len() * self.args.flights.trials) as u64, "");
        for task in open {
            state.put(self.fly_one(&task, &bar)?);
            if let Some(path) = &self.args.state {
                files::in_turn(path, || -> Result<(), Failure> {
                    // Another run may have put something there in the meantime.
                    self.read_state()?.into_iter().for_each(|table| state.add_missing(table));
                    Ok(files::write_atomically(path, &serde_json::to_vec(&state)?)?)
                })?;
            }
        }
        bar.finish_and_clear();
        let mut table = fresh();
        table.cells = tasks.iter().filter_map(|task| state.find(task.key()).cloned()).collect();
        Ok(table)
    }

    fn fly_one(&self, task: &Task, bar: &ProgressBar) -> Result<Cell, Failure> {
        let Task { driver, map, condition, degradation, seed } = *task;
        let under = degradation.map_or_else(String::new, |it| format!(", {}", it.name));
        let name = format!("{}, {}, {condition}{under}, seed {seed}", driver.label, map.name);
        bar.set_message(name.clone());
        let broken = degradation.and_then(Degradation::weights);
        let broken = broken.map(|fault| self.degraded(driver, fault, seed)).transpose()?;
        let flies = broken.as_ref().unwrap_or(driver);
        let (world, config) = (map.world(condition), task.config(&self.config));
        let started = Instant::now();
        let flown = fly(world, &map.pairs, &config, flies, seed, self.threads, &|| bar.inc(1))?;
        let wall_s = started.elapsed().as_secs_f64();
        let result = DriverResult::new(flies, seed, &flown, wall_s);
        let summary = result.summary.clone();
        bar.suspend(|| {
            say(format_args!("{name}: {} of {} ({wall_s:.1} s)", summary.success, summary.trials))?;
            speed_line(&result).map_or(Ok(()), |line| say(format_args!("{name}: {line}")))
        })?;
        if let Some(path) = self.picture(task) {
            let picture = self.drive_result(task, result)?;
            let picture = trajectories(&picture);
            let open = picture.strip_suffix(SVG_END).unwrap_or(&picture);
            files::write_atomically(&path, format!("{open}{}", self.mark(task)).as_bytes())?;
        }
        Ok(Cell {
            network: driver.label.clone(),
            network_digest: driver.digest.clone(),
            core_map_digest: flies.deployment().map(|deployment| deployment.map.digest()),
            map: map.name.clone(),
            arena_digest: map.digest.clone(),
            condition: condition.name.to_owned(),
            degraded: degradation.map(|degradation| degradation.name.to_owned()),
            seed,
            revision: REVISION.to_owned(),
            camera: driver.needs_camera(),
            summary,
        })
    }

    /// What a picture of a cell ends with: told from those of other seeds, settings, networks or maps
    /// of the same names.
    fn mark(&self, task: &Task) -> String {
        let key = task.key();
        let of = (
            serde_json::to_string(&self.settings).expect("settings are plain data"),
            [key.network, key.map, key.condition, key.degraded.unwrap_or_default()],
            [task.driver.digest.as_deref().unwrap_or_default(), &task.map.digest],
            key.seed,
        );
        format!("<desc>cell {}</desc>{SVG_END}", container::digest(&of))
    }

    fn is_picture_of(&self, path: &Path, task: &Task) -> bool {
        files::read_text(path).is_ok_and(|text| text.ends_with(&self.mark(task)))
    }

    /// Picture of the trajectories of a cell: the first seed has one.
    fn picture(&self, task: &Task) -> Option<PathBuf> {
        let folder = self.args.plot.as_ref().filter(|_| task.seed == self.args.flights.seed)?;
        let (network, map) = (file_name(&task.driver.label), file_name(&task.map.name));
        let under = task.degradation.map_or_else(String::new, |it| format!("_{}", it.name));
        Some(folder.join(format!("{network}_{map}_{}{under}.svg", task.condition.name)))
    }

    fn drive_result(&self, task: &Task, driver: DriverResult) -> Result<DriveResult, Failure> {
        let config = task.driver.config(&task.config(&self.config))?;
        Ok(DriveResult {
            format: RESULT_FORMAT,
            revision: REVISION.to_owned(),
            seed: task.seed,
            settings: Settings::new(&config),
            arena: ArenaPicture::new(task.map.world(task.condition)),
            pairs_mm: pairs_mm(&task.map.pairs),
            drivers: vec![driver],
        })
    }
}

/// Settings of the trials but for the speed.
fn config_of(args: &EvaluateArgs) -> Result<TrialConfig, Failure> {
    let (actuators, ticks_max) = (args.actuators, args.ticks_max);
    let config = TrialConfig { actuators, ticks_max, ..TrialConfig::eem_san(1.0) };
    config.check()?;
    Ok(config)
}

/// Nothing, then each that is named.
fn degradations(names: &[String]) -> Vec<Option<&'static Degradation>> {
    let named = names.iter().map(|name| Degradation::named(name).expect("clap knows the names"));
    [None].into_iter().chain(named.map(Some)).collect()
}

/// Errs when a name occurs twice: rows of the table and pictures go by name.
pub(super) fn each_once(what: &str, names: &[String]) -> Result<(), Failure> {
    for (index, name) in names.iter().enumerate() {
        if names[..index].contains(name) {
            return Err(format!("{what} {name}: given twice; leave one out").into());
        }
    }
    Ok(())
}

/// A name as part of a file's name; no two names give the same.
fn file_name(name: &str) -> String {
    let mut text = String::new();
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' => text.push(byte as char),
            _ => text.push_str(&format!("%{byte:02x}")),
        }
    }
    text
}
