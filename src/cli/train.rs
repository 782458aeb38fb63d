//! `spikeloop train`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sha2::{Digest, Sha256};
use spikeloop::files::{self, OwnFolder};
use spikeloop::net::{CHECKPOINT, EemSan, EventEncoder, NetError};
use spikeloop::nn::{StateReader, StateWriter};
use spikeloop::report::curves::{Curve, curves};
use spikeloop::train::actor::Stage;
use spikeloop::train::config::Shows;
use spikeloop::train::{ActorConfig, ActorTraining, HsvaeConfig, HsvaeTraining, Selected};
use spikeloop::world::robot::Actuators;

use crate::cli::args::{KindArg, RecipeArg, TrainArgs, TrainVerb};
use crate::cli::drive::all_threads;
use crate::cli::output::{check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

const HSVAE_CONFIG: &str = include_str!("../train/configs/hsvae.toml");
const AVAE_CONFIG: &str = include_str!("../train/configs/avae.toml");
const FSVAE_CONFIG: &str = include_str!("../train/configs/fsvae.toml");
const FIRST_CONFIG: &str = include_str!("../train/configs/first.toml");
const SECOND_CONFIG: &str = include_str!("../train/configs/second.toml");
const THIRD_CONFIG: &str = include_str!("../train/configs/third.toml");
const FOURTH_CONFIG: &str = include_str!("../train/configs/fourth.toml");
const FIFTH_CONFIG: &str = include_str!("../train/configs/fifth.toml");
const STREAMING_CONFIG: &str = include_str!("../train/configs/streaming.toml");
const E2E_CONFIG: &str = include_str!("../train/configs/e2e.toml");
const COMPARE_CONFIG: &str = include_str!("../train/configs/compare.toml");
const COMPARE_E2E_CONFIG: &str = include_str!("../train/configs/compare_e2e.toml");
const PLAIN_CONFIG: &str = include_str!("../train/configs/plain.toml");

/// Weights of the actor that did best in the flights of the selection.
const BEST: &str = "best.safetensors";

/// What a run goes on from.
const CHECKPOINT_FILE: &str = "checkpoint.safetensors";

/// Losses and success, round by round.
const CURVES: &str = "curves.svg";

/// Control ticks of each world in a measurement of the auto-encoder, and of one that shows movers,
/// which are not in every picture.
const MEASURE_TICKS: u64 = 60;
const MEASURE_MOVERS_TICKS: u64 = 300;

pub(super) fn run(args: &TrainArgs) -> Result<Verdict, Failure> {
    match &args.what {
        TrainVerb::Hsvae { kind } => hsvae(args, *kind),
        TrainVerb::Actor { variant, threshold, actuators, encoder, recipe, from } => {
            let files = [encoder.as_deref(), from.as_deref()];
            let changes = (variant.as_deref(), *threshold, *actuators);
            actor(args, *recipe, changes, files)
        }
    }
}

impl TrainArgs {
    /// Rounds that this run may do of a training that has done `done`.
    fn rounds_left(&self, done: u64) -> u64 {
        let left = self.until.map(|until| until.saturating_sub(done));
        left.or(self.rounds).unwrap_or(u64::MAX)
    }
}

/// Files of a training run, all in one folder.
struct Folder {
    path: PathBuf,
    digest: u64,
    own: OwnFolder,
}

impl Folder {
    fn open(path: &Path, inputs: &[&[u8]]) -> Result<Self, Failure> {
        std::fs::create_dir_all(path)
            .map_err(|e| format!("{}: cannot make the folder: {e}", path.display()))?;
        let mut hash = Sha256::new();
        inputs.iter().for_each(|input| hash.update(input));
        let digest = hash.finalize();
        let digest = digest.iter().take(8).fold(0, |all, byte| (all << 8) | u64::from(*byte));
        Ok(Self { path: path.to_path_buf(), digest, own: OwnFolder::take(path)? })
    }

    /// Errs when the run would write over one of the files that it reads; `weights` is the name of
    /// what it makes.
    fn check_inputs(&self, weights: &str, files: [Option<&Path>; 3]) -> Result<(), Failure> {
        let made = [weights, CHECKPOINT_FILE, CURVES, BEST].map(|name| self.file(name));
        check_outputs(&made, files.into_iter().flatten())?;
        self.own.remove_partials(&made);
        Ok(())
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        Ok(files::write_atomically(&self.file(name), bytes)?)
    }

    /// Reads the checkpoint, when there is one of the same configuration.
    fn resume(
        &self,
        read: impl FnOnce(&StateReader) -> Result<(), spikeloop::nn::StateError>,
    ) -> Result<bool, Failure> {
        let path = self.file(CHECKPOINT_FILE);
        if !path.exists() {
            return Ok(false);
        }
        let name = path.display().to_string();
        let bytes = files::read_bytes(&path)?;
        let state = StateReader::new(&name, &bytes)?;
        let found = state.count(CHECKPOINT)?;
        if found != self.digest {
            return Err(format!(
                "{name}: was made with another configuration or encoder ({found:016x} found, \
                 {:016x} expected); give another --out, or remove the file to start afresh",
                self.digest
            )
            .into());
        }
        read(&state)?;
        Ok(true)
    }

    fn checkpoint(&self, write: impl FnOnce(&mut StateWriter)) -> Result<(), Failure> {
        let mut state = StateWriter::default();
        state.count(CHECKPOINT, self.digest);
        write(&mut state);
        if let Some((tensor, element, value)) = state.not_finite() {
            return Err(format!(
                "{}: the training has diverged: tensor {tensor}: element {element} is {value}; the \
                 files of the last good round are left; take smaller learning rates and another --out",
                self.path.display()
            )
            .into());
        }
        self.write(CHECKPOINT_FILE, &state.bytes())
    }
}

/// Text of the configuration and the name that errors mention.
fn config_text(args: &TrainArgs, built_in: &str, name: &str) -> Result<(String, String), Failure> {
    let (file, text) = match &args.config {
        Some(path) => (path.display().to_string(), files::read_text(path)?),
        None => (format!("built-in {name}"), built_in.to_owned()),
    };
    Ok((file, text))
}

fn hsvae(args: &TrainArgs, kind: Option<KindArg>) -> Result<Verdict, Failure> {
    if let (Some(config), Some(_)) = (&args.config, kind) {
        return Err(format!(
            "{}: --kind chooses a built-in configuration, and a file says its kind itself; leave \
             one of them out",
            config.display()
        )
        .into());
    }
    let (built_in, name) = match kind.unwrap_or(KindArg::Hsvae) {
        KindArg::Hsvae => (HSVAE_CONFIG, "hsvae.toml"),
        KindArg::Avae => (AVAE_CONFIG, "avae.toml"),
        KindArg::Fsvae => (FSVAE_CONFIG, "fsvae.toml"),
    };
    let (file, text) = config_text(args, built_in, name)?;
    let mut config = HsvaeConfig::from_toml(&file, &text)?;
    config.seed = args.seed.unwrap_or(config.seed);
    if args.quick {
        config = config.quick();
    }
    let folder = Folder::open(&args.out, &[format!("{config:?}").as_bytes()])?;
    let weights = &format!("{}.safetensors", config.kind.name());
    folder.check_inputs(weights, [args.config.as_deref(), None, None])?;
    let mut training = HsvaeTraining::new(&config, args.threads.unwrap_or_else(all_threads))?;
    say(header(Some(config.seed), &[]))?;
    if folder.resume(|state| training.read(state))? {
        say(format_args!("resumed after round {} of {}", training.round(), training.rounds()))?;
    }
    let updates = config.flight.ticks_per_round / config.stretch_ticks as u64;
    let bar = progress(training.rounds() * updates, "auto-encoder");
    bar.set_position(training.round() * updates);
    let mut left = args.rounds_left(training.round());
    while training.round() < training.rounds() && left > 0 {
        let started = Instant::now();
        let ends = training.run_round(|| bar.inc(1));
        left -= 1;
        let seconds = started.elapsed().as_secs_f64();
        let [reconstruction, divergence, rate, _] =
            training.history().last().copied().unwrap_or_default();
        say(format_args!(
            "round {}: reconstruction {reconstruction:.5}, divergence {divergence:.5}, \
             rate term {rate:.5}, {} flights, {:.1} updates/s",
            training.round(),
            ends.total(),
            updates as f64 / seconds
        ))?;
        if training.round() % args.checkpoint_every == 0 {
            folder.checkpoint(|state| training.write(state))?;
        }
    }
    bar.finish_and_clear();
    folder.checkpoint(|state| training.write(state))?;
    let report = training.measure(match config.shows {
        Shows::Frames => MEASURE_TICKS,
        Shows::Movers => MEASURE_MOVERS_TICKS,
    });
    folder.write(weights, &training.weights())?;
    let column =
        |index: usize| training.history().iter().map(|row| f64::from(row[index])).collect();
    let drawn = [
        Curve { label: "reconstruction error per pixel", values: column(0) },
        Curve { label: "divergence, weighted", values: column(1) },
        Curve { label: "rate term, weighted", values: column(2) },
    ];
    folder.write(CURVES, curves("auto-encoder", "round", &drawn).as_bytes())?;
    say(format_args!(
        "{} updates. Mean squared error per pixel on {} ticks of new flights:",
        training.updates(),
        report.frames
    ))?;
    for (what, errors) in [("targets", report.targets), ("last frames", report.frames_last)] {
        say(format_args!(
            "  {what}: reconstruction {:.6}, mean picture {:.6}, picture before {:.6}",
            errors.reconstruction, errors.mean, errors.previous
        ))?;
    }
    if !report.explained.is_empty() {
        say(format_args!("variance explained of what movers do: {}", shares(&report.explained)))?;
        say(format_args!("of it beyond what nearness implies: {}", shares(&report.beyond)))?;
    }
    let rates: Vec<String> = report.rates.iter().map(|rate| format!("{rate:.3}")).collect();
    let what = match config.kind.spikes() {
        true => "spikes per neuron and frame",
        false => "share of outputs above 0",
    };
    say(format_args!("{what}, layer by layer: {}", rates.join(", ")))?;
    say(format_args!("wrote {}", folder.file(weights).display()))?;
    Ok(Verdict::Good)
}

/// Names with their shares of variance.
fn shares(named: &[(&str, Option<f64>)]) -> String {
    let text = |(name, share): &(&str, Option<f64>)| {
        share.map_or_else(|| format!("{name} -"), |share| format!("{name} {share:.2}"))
    };
    named.iter().map(text).collect::<Vec<_>>().join(", ")
}

fn read_encoder(path: &Path) -> Result<(Vec<u8>, EventEncoder), Failure> {
    let bytes = files::read_bytes(path)?;
    let encoder = EemSan::encoder_from_bytes(&path.display().to_string(), &bytes)?;
    Ok((bytes, encoder))
}

/// Text and name of a built-in configuration.
fn built_in(recipe: RecipeArg) -> (&'static str, &'static str) {
    match recipe {
        RecipeArg::First => (FIRST_CONFIG, "first.toml"),
        RecipeArg::Second => (SECOND_CONFIG, "second.toml"),
        RecipeArg::Third => (THIRD_CONFIG, "third.toml"),
        RecipeArg::Fourth => (FOURTH_CONFIG, "fourth.toml"),
        RecipeArg::Fifth => (FIFTH_CONFIG, "fifth.toml"),
        RecipeArg::Streaming => (STREAMING_CONFIG, "streaming.toml"),
        RecipeArg::E2e => (E2E_CONFIG, "e2e.toml"),
        RecipeArg::Compare => (COMPARE_CONFIG, "compare.toml"),
        RecipeArg::CompareE2e => (COMPARE_E2E_CONFIG, "compare_e2e.toml"),
        RecipeArg::Plain => (PLAIN_CONFIG, "plain.toml"),
    }
}

fn actor(
    args: &TrainArgs,
    recipe: Option<RecipeArg>,
    (variant, threshold, actuators): (Option<&str>, Option<f64>, Option<Actuators>),
    [encoder, from]: [Option<&Path>; 2],
) -> Result<Verdict, Failure> {
    let files = [args.config.as_deref(), encoder, from];
    if let (Some(config), Some(_)) = (&args.config, recipe) {
        return Err(format!(
            "{}: --recipe chooses a built-in configuration; leave one of them out",
            config.display()
        )
        .into());
    }
    let (built_in, name) = built_in(recipe.unwrap_or(RecipeArg::First));
    let (file, text) = config_text(args, built_in, name)?;
    let mut config = ActorConfig::from_toml(&file, &text)?;
    config.seed = args.seed.unwrap_or(config.seed);
    if let Some(variant) = variant {
        config.network.variant = Some(variant.to_owned());
    }
    if let Some(threshold) = threshold {
        config = config.with_threshold(threshold)?;
    }
    if let Some(actuators) = actuators {
        config.flight.actuators = actuators.to_string();
    }
    if args.quick {
        config = config.quick();
    }
    let encoder = encoder.map(read_encoder).transpose()?;
    let (bytes, encoder) = encoder.unzip();
    let about = format!("{config:?}");
    let from = from.map(|path| Ok::<_, Failure>((path, files::read_bytes(path)?))).transpose()?;
    let first = from.as_ref().map_or(&[][..], |(_, bytes)| bytes);
    let inputs = [about.as_bytes(), bytes.as_deref().unwrap_or(&[]), first];
    let threads = args.threads.unwrap_or_else(all_threads);
    let mut training = ActorTraining::new(&config, encoder.as_ref(), threads)?;
    if let Some((path, bytes)) = &from {
        let file = path.display().to_string();
        let weights = StateReader::new(&file, bytes)?;
        if weights.has(CHECKPOINT) {
            return Err(NetError::Checkpoint { file }.into());
        }
        training.begin_with(&weights)?;
    }
    let folder = Folder::open(&args.out, &inputs)?;
    let variant = config.variant(encoder.is_some())?;
    let weights = &format!("{}.safetensors", variant.name.replace('-', "_"));
    folder.check_inputs(weights, files)?;
    say(header(Some(config.seed), &[]))?;
    if folder.resume(|state| training.read(state))? {
        say(format_args!("resumed after round {} of {}", training.round(), training.rounds()))?;
    }
    say(format_args!("network {}: {}", variant.name, variant.form))?;
    let bar = progress(training.rounds() * config.flight.ticks_per_round, "actor");
    bar.set_position(training.round() * config.flight.ticks_per_round);
    let mut left = args.rounds_left(training.round());
    while training.round() < training.rounds() && left > 0 {
        say(actor_round(&mut training, &bar))?;
        left -= 1;
        select(&mut training, &folder)?;
        if training.round() % args.checkpoint_every == 0 {
            folder.checkpoint(|state| training.write(state))?;
            save_actor(&folder, weights, &training)?;
        }
    }
    bar.finish_and_clear();
    folder.checkpoint(|state| training.write(state))?;
    save_actor(&folder, weights, &training)?;
    say(format_args!("wrote {}", folder.file(weights).display()))?;
    Ok(Verdict::Good)
}

/// A round, and a line about it.
fn actor_round(training: &mut ActorTraining, bar: &indicatif::ProgressBar) -> String {
    let (mut last, mut flying_s, mut learning_s) = (Instant::now(), 0.0, 0.0);
    let (ticks, updates) = (training.ticks(), training.updates());
    let report = training.run_round(|stage| {
        let now = Instant::now();
        let spent_s = (now - last).as_secs_f64();
        last = now;
        match stage {
            Stage::Flown => {
                flying_s += spent_s;
                bar.inc(1);
            }
            Stage::Updated => learning_s += spent_s,
        }
    });
    let per_s = |n: u64, seconds: f64| n as f64 / f64::max(seconds, 1e-9);
    let ends = report.ends;
    let seen = report.seen.map_or(String::new(), |loss| format!(", on the newest {loss:.4}"));
    let rate = report.rate.map_or(String::new(), |rate| format!(", encoder's spikes {rate:.3}"));
    format!(
        "round {}: flights {} (goal {}, contact {}, time {}), reward {:.3}, critic {:.3}, actor \
         {:.4}{seen}{rate}; {:.0} ticks/s flown, {:.1} updates/s, {:.0} % of the time flying",
        training.round(),
        ends.total(),
        ends.goal,
        ends.contact,
        ends.time,
        report.reward,
        report.losses.critic,
        report.losses.actor,
        per_s(training.ticks() - ticks, flying_s),
        per_s(training.updates() - updates, learning_s),
        100.0 * flying_s / f64::max(flying_s + learning_s, 1e-9),
    )
}

/// Compares the actors, when it is time, and keeps the best one. After a kill the same comparisons
/// are made again from the last checkpoint on, and the same file is left.
fn select(training: &mut ActorTraining, folder: &Folder) -> Result<(), Failure> {
    let Some(Selected { share, best }) = training.select() else { return Ok(()) };
    if best {
        folder.write(BEST, &training.weights())?;
    }
    let kept = if best { "the best so far, kept as " } else { "not above the best, " };
    say(format_args!(
        "round {}: {share:.4} of the selection's flights at the goal: {kept}{BEST}",
        training.round()
    ))
}

fn save_actor(folder: &Folder, name: &str, training: &ActorTraining) -> Result<(), Failure> {
    folder.write(name, &training.weights())?;
    let column =
        |index: usize| training.history().iter().map(|row| f64::from(row[index])).collect();
    let mut drawn = vec![
        Curve { label: "share of training flights at the goal", values: column(0) },
        Curve { label: "share with contact", values: column(1) },
        Curve { label: "reward per control tick", values: column(2) },
        Curve { label: "loss of the critics", values: column(3) },
        Curve { label: "loss of the actor", values: column(4) },
    ];
    let shares: Vec<f64> = training.shares().into_iter().map(f64::from).collect();
    if !shares.is_empty() {
        drawn.push(Curve { label: "share of the selection's flights at the goal", values: shares });
    }
    folder.write(CURVES, curves("actor", "round", &drawn).as_bytes())
}
