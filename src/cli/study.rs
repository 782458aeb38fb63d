//! `spikeloop study`.

use std::path::Path;
use std::time::Instant;

use indicatif::ProgressBar;
use spikeloop::closed_loop::TrialConfig;
use spikeloop::evaluate::{Condition, Driver, fly};
use spikeloop::files;
use spikeloop::host::Deployment;
use spikeloop::net::{Controller, builtin};
use spikeloop::report::results::DriverResult;
use spikeloop::report::study::{
    AxisRows, OnChip, Point, PointResult, StudySettings, StudyTable, Tried, study_text,
};
use spikeloop::report::study_picture::study_picture;
use spikeloop::report::success::SuccessSettings;
use spikeloop::report::tables::overflow_line;
use spikeloop::study::{AXES, Axis, Variant, VariantError};
use spikeloop::world::arena::EVALUATION_SEED;
use spikeloop::world::dvs::CameraConfig;

use crate::cli::args::StudyArgs;
use crate::cli::drive::all_threads;
use crate::cli::evaluate::{Map, each_once};
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// Below the table.
const NOTE: &str = "\
95 %: Wilson's interval. Against float: trials that only this chip, or only the float network, got
to the goal; p: how likely a split as uneven is by chance (sign test). Costs are per decision. With
faults every trial flies on a chip of its own, broken anew. Biases always have 8 bits.";

pub(super) fn run(args: &StudyArgs) -> Result<Verdict, Failure> {
    let study = Study::prepare(args)?;
    let compiled = study.first_that_compiles()?;
    let known = study.read_state()?;
    say(header(Some(args.seed), &[]))?;
    study.say_settings()?;
    let table = study.fly_all(known, compiled)?;
    say(study_text(&table))?;
    say(NOTE)?;
    if let Some(path) = &args.json {
        output::write(path, &serde_json::to_vec_pretty(&table)?)?;
    }
    if let Some(path) = &args.plot {
        output::write(path, study_picture(&table).as_bytes())?;
    }
    Ok(Verdict::Good)
}

/// What to fly.
struct Study<'a> {
    args: &'a StudyArgs,
    network: Controller,
    float: Driver,
    map: Map,
    condition: &'static Condition,
    config: TrialConfig,
    settings: StudySettings,
    axes: Vec<AxisRows>,
    threads: usize,
}

/// The map that was compiled last: variants that differ in their damage share it.
type Compiled = Option<(Variant, Result<Deployment, VariantError>)>;

impl<'a> Study<'a> {
    fn prepare(args: &'a StudyArgs) -> Result<Self, Failure> {
        let inputs = [Path::new(&args.network), Path::new(&args.map)];
        let inputs = inputs.into_iter().chain(args.weights.as_deref());
        check_outputs(args.state.iter().chain(&args.json).chain(&args.plot), inputs)?;
        each_once("--axis", &args.axes)?;
        if let Some(name) = args.network.strip_prefix("chip:") {
            return Err(format!("{}: study compiles it itself; give {name}", args.network).into());
        }
        let network = builtin::open(&args.network, args.weights.as_deref())?;
        let condition = Condition::named(&args.condition).expect("clap knows the names");
        let base = TrialConfig { ticks_max: args.ticks_max, ..TrialConfig::eem_san(1.0) };
        let config = condition.config(&base);
        config.check()?;
        let map = Map::open(&args.map, args.trials)?;
        let float = Driver::controller(&network);
        let camera = CameraConfig::default();
        let settings = StudySettings {
            network: args.network.clone(),
            network_digest: float.digest.clone().unwrap_or_default(),
            map: args.map.clone(),
            arena_digest: map.digest.clone(),
            condition: condition.name.to_owned(),
            seed: args.seed,
            flight: SuccessSettings::new(args.trials, EVALUATION_SEED, &config, &camera),
        };
        let axes = axes(&args.axes).into_iter().map(|axis| AxisRows {
            name: axis.name.to_owned(),
            about: axis.about.to_owned(),
            rows: axis.variants().collect(),
        });
        let (axes, threads) = (axes.collect(), args.threads.unwrap_or_else(all_threads));
        Ok(Self { args, network, float, map, condition, config, settings, axes, threads })
    }

    /// What the state file has, if there is one and it goes with what is to be flown.
    fn read_state(&self) -> Result<StudyTable, Failure> {
        let Some(path) = self.args.state.as_ref().filter(|path| path.exists()) else {
            return Ok(StudyTable::new(self.settings.clone()));
        };
        let file = path.display().to_string();
        Ok(StudyTable::from_json(&file, &files::read_text(path)?, &self.settings)?)
    }

    fn say_settings(&self) -> Result<(), Failure> {
        let (s, camera) = (&self.settings, self.float.needs_camera());
        say(format_args!(
            "{} (digest {}) on {}, {}, {} Hz, {} trials (pairs from seed {}), event camera {}",
            s.network,
            s.network_digest,
            s.map,
            self.condition,
            s.flight.control_hz,
            s.flight.trials,
            s.flight.pairs_seed,
            if camera { "on" } else { "off" }
        ))
    }

    /// All variants of all axes, each once.
    fn variants(&self) -> Vec<&Variant> {
        let mut variants: Vec<&Variant> = Vec::new();
        for (_, variant) in self.axes.iter().flat_map(|axis| &axis.rows) {
            if !variants.contains(&variant) {
                variants.push(variant);
            }
        }
        variants
    }

    /// The first variant's chip that the network goes onto.
    ///
    /// Errors: there is none, and so nothing to study, with the reason of the first.
    fn first_that_compiles(&self) -> Result<Compiled, Failure> {
        let mut first = None;
        for variant in self.variants() {
            let whole = variant.undamaged();
            match whole.compile(&self.network) {
                Ok(deployment) => return Ok(Some((whole, Ok(deployment)))),
                Err(why) => first = first.or(Some(why)),
            }
        }
        first.map_or(Ok(None), |why| Err(why.into()))
    }

    /// Flies what `state` does not have, and gives the whole study.
    fn fly_all(
        &self,
        mut state: StudyTable,
        mut compiled: Compiled,
    ) -> Result<StudyTable, Failure> {
        let variants = self.variants();
        self.check_known(&mut state, &mut compiled)?;
        let open: Vec<&Variant> =
            variants.iter().copied().filter(|variant| state.find(variant).is_none()).collect();
        if open.len() < variants.len() {
            let (done, all) = (variants.len() - open.len(), variants.len());
            say(format_args!("{done} of {all} points are in the state file already"))?;
        }
        let flights = open.len() + usize::from(state.float.is_none());
        let bar = progress((flights * self.args.trials) as u64, "");
        if state.float.is_none() {
            state.float = Some(self.fly(&self.float, "float network", &bar)?);
            self.save(&mut state)?;
        }
        for variant in open {
            let result = self.fly_variant(variant, &mut compiled, &bar)?;
            state.points.retain(|point| point.variant != *variant);
            state.points.push(Point { variant: variant.clone(), result });
            self.save(&mut state)?;
        }
        bar.finish_and_clear();
        let points = variants.iter().filter_map(|variant| state.find(variant).cloned()).collect();
        Ok(StudyTable { points, axes: self.axes.clone(), ..state })
    }

    /// Compiles what the state file has flown: it goes with nothing else. What did not compile then and
    /// does now is left out of `state`.
    ///
    /// Errors: a point of another core map than the one of now.
    fn check_known(&self, state: &mut StudyTable, compiled: &mut Compiled) -> Result<(), Failure> {
        for variant in self.variants() {
            let Some(point) = state.find(variant) else { continue };
            let now = self.driver(variant, compiled).map(|driver| driver.digest);
            let now = match (&point.result, now) {
                (PointResult::Refused(_), Err(_)) => continue,
                (PointResult::Refused(_), Ok(_)) => {
                    state.points.retain(|point| point.variant != *variant);
                    continue;
                }
                (PointResult::Flown(flown), Ok(now)) if now.as_ref() == Some(&flown.digest) => {
                    continue;
                }
                (PointResult::Flown(_), Ok(now)) => now.unwrap_or_default(),
                (PointResult::Flown(_), Err(why)) => why,
            };
            let (file, found) =
                (self.args.state.as_ref(), point.flown().map(|flown| &flown.digest));
            return Err(format!(
                "{}: {}: core map {} there, {now} here: it has changed; give another file",
                file.map_or_else(String::new, |file| file.display().to_string()),
                self.label(variant),
                found.map_or("none", String::as_str)
            )
            .into());
        }
        Ok(())
    }

    /// Writes the state file, with what another run may have put there in the meantime.
    fn save(&self, state: &mut StudyTable) -> Result<(), Failure> {
        if let Some(path) = &self.args.state {
            files::in_turn(path, || -> Result<(), Failure> {
                state.add_missing(self.read_state()?);
                Ok(files::write_atomically(path, &serde_json::to_vec(state)?)?)
            })?;
        }
        Ok(())
    }

    fn fly_variant(
        &self,
        variant: &Variant,
        compiled: &mut Compiled,
        bar: &ProgressBar,
    ) -> Result<PointResult, Failure> {
        let name = self.label(variant);
        let driver = self.driver(variant, compiled);
        let driver = match driver {
            Ok(driver) => driver,
            Err(why) => {
                bar.inc(self.args.trials as u64);
                bar.suspend(|| say(format_args!("{name}: does not fly")))?;
                return Ok(PointResult::Refused(why));
            }
        };
        let tried = self.fly(&driver, &name, bar)?;
        let map = &driver.deployment().expect("a chip").map;
        Ok(PointResult::Flown(Box::new(OnChip {
            digest: driver.digest.clone().unwrap_or_default(),
            core_map_digest: map.digest(),
            cores: map.core_usage().used,
            synapse_words: map.utilization().iter().map(|core| core.synapse_words.used).sum(),
            tried,
        })))
    }

    /// The variant as a driver, or why there is none.
    fn driver(&self, variant: &Variant, compiled: &mut Compiled) -> Result<Driver, String> {
        let whole = variant.undamaged();
        if compiled.as_ref().is_none_or(|(of, _)| *of != whole) {
            let deployment = whole.compile(&self.network);
            *compiled = Some((whole, deployment));
        }
        match compiled.as_ref().map(|(_, deployment)| deployment) {
            Some(Ok(deployment)) => variant.driver(deployment.clone()).map_err(|e| e.to_string()),
            Some(Err(why)) => Err(why.to_string()),
            None => unreachable!("it was compiled above"),
        }
    }

    fn fly(&self, driver: &Driver, name: &str, bar: &ProgressBar) -> Result<Tried, Failure> {
        bar.set_message(name.to_owned());
        let (world, pairs) = (self.map.world(self.condition), &self.map.pairs);
        let started = Instant::now();
        let (seed, finished) = (self.args.seed, || bar.inc(1));
        let flown = fly(world, pairs, &self.config, driver, seed, self.threads, &finished)?;
        let wall_s = started.elapsed().as_secs_f64();
        let summary = DriverResult::new(driver, seed, &flown, wall_s).summary;
        let (success, trials) = (summary.success, summary.trials);
        let overflow = summary.chip.as_ref().and_then(overflow_line);
        let overflow =
            overflow.map_or_else(String::new, |it| format!(", registers overflowed: {it}"));
        bar.suspend(|| {
            say(format_args!("{name}: {success} of {trials} ({wall_s:.1} s){overflow}"))
        })?;
        Ok(Tried::new(REVISION, &flown, summary))
    }

    /// First axis and value that make a variant.
    fn label(&self, variant: &Variant) -> String {
        let rows = self.axes.iter().flat_map(|axis| axis.rows.iter().map(move |row| (axis, row)));
        let of =
            |(axis, (value, _)): (&AxisRows, &(String, Variant))| format!("{} {value}", axis.name);
        rows.into_iter().find(|(_, row)| row.1 == *variant).map_or_else(String::new, of)
    }
}

/// The axes of these names, in the order of [`AXES`]; all when none is named.
fn axes(names: &[String]) -> Vec<&'static Axis> {
    let wanted = |axis: &&Axis| names.is_empty() || names.iter().any(|name| name == axis.name);
    AXES.iter().filter(wanted).collect()
}
