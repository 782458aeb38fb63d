//! `spikeloop camera`.

mod watcher;

use std::path::Path;
use std::time::Instant;

use serde_json::json;
use spikeloop::closed_loop::{StraightToGoal, Trial, TrialConfig};
use spikeloop::net::{Controller, builtin};
use spikeloop::policy::Policy;
use spikeloop::reference::{EemSanPolicy, FloatPolicy};
use spikeloop::report::tables::plain;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::dvs::picture::{Panel, png_of_panels};
use spikeloop::world::dvs::{Activity, CameraConfig, EventCamera, EventStream, Summary};
use spikeloop::world::geometry::Pose;
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::cli::args::CameraArgs;
use crate::cli::drivers::{STRAIGHT, check_weights};
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};
use watcher::{LayerActivity, Watcher, activity_table};

/// Event frames of a control tick at 20 Hz.
const FRAMES_PER_TICK: usize = 5;

/// Most trials flown to fill the time.
const TRIALS_MAX: usize = 1000;

/// What recordings of real sensors show, scaled to 128 x 128 pixels: a quiet background, a
/// standing camera that people pass, and a DAVIS240 that moves itself.
const MEASURED: [(&str, [&str; 5]); 3] = [
    ("at rest, nothing moves", ["160-330", "0.01-0.02", "0.01-0.02", "-", "-"]),
    ("at rest, movers pass", ["3k-25k", "0.2-1.5", "0.07-0.7", "0.5-2", "0.6-1.4"]),
    ("driving", ["30k-45k", "1.8-2.7", "1.8-2.6", "-", "0.6-1.4"]),
];

pub(super) fn run(args: &CameraArgs) -> Result<Verdict, Failure> {
    let world = World::new(Arena::open(&args.arena)?);
    let config = camera_config(args);
    config.check()?;
    let (mut policy, sees) = policy(args)?;
    let watcher = args.encoder.as_deref().map(Watcher::read).transpose()?;
    let pairs =
        generate_pairs(&world, TRIALS_MAX, PairRules::default(), Streams::new(args.seed, 0))?;
    let inputs = [Path::new(&args.driver), Path::new(&args.arena)].into_iter();
    let inputs = inputs.chain(args.weights.as_deref()).chain(args.encoder.as_deref());
    check_outputs(args.events.iter().chain(&args.json), inputs)?;
    say(header(Some(args.seed), &[]))?;
    if let Some(folder) = &args.frames {
        output::picture_folder(folder, "png", args.events.iter().chain(&args.json))?;
    }
    let empty = World::new(world.arena().clone().without_movers());
    let rest = stand(&empty, &pairs[0].start, args, &config)?;
    let passing = match viewpoint(&world) {
        Some(pose) => Some(stand(&world, &pose, args, &config)?),
        None => None,
    };
    let mut drive = Drive::new(args, watcher, sees);
    drive.fill(&world, &pairs, &config, policy.as_mut())?;
    let conditions = [Some(rest), passing, Some(drive.activity)];
    let summaries: Vec<Option<Summary>> =
        conditions.iter().map(|activity| activity.as_ref()?.summary()).collect();
    say(format_args!(
        "arena {}, {} drives at up to {} m/s",
        world.arena().name(),
        args.driver,
        args.v_max
    ))?;
    say(summary_table(&summaries))?;
    let ms_per_frame = 1e3 * drive.camera_s / drive.n_frames.max(1) as f64;
    let pictures = drive.n_pictures as f64 / drive.n_frames.max(1) as f64;
    say(format_args!(
        "{} trials; {ms_per_frame:.3} ms per frame on one core, {pictures:.2} pictures drawn for each",
        drive.n_trials
    ))?;
    let spikes = drive.watcher.as_ref().map(Watcher::activity);
    if let Some(spikes) = &spikes {
        say(activity_table(spikes))?;
    }
    if let Some(path) = &args.events {
        drive.stream.write(path)?;
        say(format_args!("wrote {} ({} events)", path.display(), drive.stream.events().len()))?;
    }
    if let Some(folder) = &args.frames {
        say(format_args!("wrote {} pictures to {}", drive.n_written, folder.display()))?;
        let others = others(folder, drive.n_written);
        if others > 0 {
            say(format_args!("{others} more there are of an earlier, longer run"))?;
        }
    }
    if let Some(path) = &args.json {
        output::write(
            path,
            &serde_json::to_vec_pretty(&as_json(args, &summaries, spikes.as_deref()))?,
        )?;
    }
    Ok(Verdict::Good)
}

fn camera_config(args: &CameraArgs) -> CameraConfig {
    CameraConfig {
        field_of_view_deg: args.field_of_view,
        contrast: args.contrast,
        mover_contrast: args.mover_contrast,
        ..CameraConfig::default()
    }
}

/// What drives, and whether it takes event frames.
fn policy(args: &CameraArgs) -> Result<(Box<dyn Policy>, bool), Failure> {
    if args.driver == STRAIGHT {
        check_weights(&[STRAIGHT], args.weights.as_deref())?;
        return Ok((Box::new(StraightToGoal), false));
    }
    if let Some(name) = args.driver.strip_prefix("chip:") {
        return Err(format!("{}: the float network drives here; give {name}", args.driver).into());
    }
    Ok(match builtin::open(&args.driver, args.weights.as_deref())? {
        Controller::Described(network) => (Box::new(FloatPolicy::new(&network)), false),
        Controller::EemSan(network) if network.told => {
            return Err(format!(
                "{}: the simulator tells it where movers are, and nothing here does; give another \
                 driver",
                args.driver
            )
            .into());
        }
        Controller::EemSan(network) => {
            let policy = EemSanPolicy::new(&network);
            let sees = policy.takes_frames();
            (Box::new(policy), sees)
        }
    })
}

/// Watches from one place for the time asked for.
fn stand(
    world: &World,
    pose: &Pose,
    args: &CameraArgs,
    config: &CameraConfig,
) -> Result<Activity, Failure> {
    let mut camera = EventCamera::new(world, config, Streams::new(args.seed, 0), pose)?;
    let mut activity = Activity::default();
    for _ in 0..args.seconds * 100 {
        let frame = camera.advance(pose);
        activity.add(&frame, &camera.events());
    }
    Ok(activity)
}

/// A free place beside the middle of a track, 1.5 to 3 m from it and in sight of it, looking at it;
/// `None` without one.
fn viewpoint(world: &World) -> Option<Pose> {
    world.arena().movers().iter().find_map(|mover| {
        let along = (mover.to() - mover.from()).normalize();
        let middle = nalgebra::center(&mover.from(), &mover.to());
        (0..14).find_map(|i| {
            let distance_m = 1.5 + 0.25 * f64::from(i / 2);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let away = nalgebra::Vector2::new(-along.y, along.x) * side;
            let place = middle + away * distance_m;
            let yaw_rad = libm::atan2(-away.y, -away.x);
            let range_m = world.scene().ray_range_m(place, yaw_rad, distance_m);
            let free = world.nearest(place, 0).is_none_or(|nearest| nearest.distance_m > 0.3);
            (free && range_m.is_none()).then(|| Pose::new(place.x, place.y, yaw_rad))
        })
    })
}

/// Trials flown one after the other until the time is full, and what their cameras saw.
struct Drive<'a> {
    args: &'a CameraArgs,
    activity: Activity,
    stream: EventStream,
    panels: Vec<Panel>,
    watcher: Option<Watcher>,
    /// Whether the driver takes event frames as well.
    sees: bool,
    failure: Option<Failure>,
    camera_s: f64,
    n_frames: u64,
    n_pictures: u64,
    n_trials: usize,
    n_written: usize,
}

impl<'a> Drive<'a> {
    fn new(args: &'a CameraArgs, watcher: Option<Watcher>, sees: bool) -> Self {
        Self {
            args,
            activity: Activity::default(),
            stream: EventStream::default(),
            panels: Vec::new(),
            watcher,
            sees,
            failure: None,
            camera_s: 0.0,
            n_frames: 0,
            n_pictures: 0,
            n_trials: 0,
            n_written: 0,
        }
    }

    fn fill(
        &mut self,
        world: &World,
        pairs: &[Pair],
        config: &CameraConfig,
        policy: &mut dyn Policy,
    ) -> Result<(), Failure> {
        let camera = self.sees.then(|| config.clone());
        let settings = TrialConfig { camera, ..TrialConfig::eem_san(self.args.v_max) };
        let bar = progress(self.args.seconds * 100, &self.args.driver);
        for (trial_idx, pair) in pairs.iter().enumerate() {
            let streams = Streams::new(self.args.seed, trial_idx as u64);
            let mut trial = Trial::new(world, pair.start, pair.goal, &settings, streams)?;
            let mut camera = EventCamera::new(world, config, streams, &pair.start)?;
            policy.start_trial(streams);
            self.watcher.iter_mut().for_each(Watcher::reset);
            self.n_trials += 1;
            while trial.end().is_none() && self.n_frames < self.args.seconds * 100 {
                trial.tick_with(policy, |_, pose| self.look(&mut camera, pose));
                bar.set_position(self.n_frames);
            }
            self.panels.clear();
            self.n_pictures += camera.n_pictures() - 1;
            if let Some(failure) = self.failure.take() {
                return Err(failure);
            }
            if self.n_frames >= self.args.seconds * 100 {
                break;
            }
        }
        bar.finish_and_clear();
        Ok(())
    }

    fn look(&mut self, camera: &mut EventCamera<'_>, pose: &Pose) {
        let started = Instant::now();
        let frame = camera.advance(pose);
        self.camera_s += started.elapsed().as_secs_f64();
        self.n_frames += 1;
        let events = camera.events();
        self.activity.add(&frame, &events);
        if self.args.events.is_some() {
            self.stream.push_step(&events);
        }
        if let Some(watcher) = &mut self.watcher {
            watcher.look(&frame);
        }
        let Some(folder) = &self.args.frames else { return };
        self.panels.push(Panel::of_frame(&frame));
        if self.panels.len() == FRAMES_PER_TICK {
            let view = Panel::of_shades(camera.picture()).with_events(&events);
            self.panels.insert(0, view);
            self.panels.extend(self.watcher.as_ref().map(Watcher::reconstruction));
            let written = write_picture(folder, self.n_written, &self.panels);
            self.panels.clear();
            self.n_written += 1;
            self.failure = self.failure.take().or(written.err());
        }
    }
}

fn write_picture(folder: &Path, number: usize, panels: &[Panel]) -> Result<(), Failure> {
    let path = folder.join(picture_name(number));
    Ok(spikeloop::files::write_atomically(&path, &png_of_panels(panels)?)?)
}

fn picture_name(number: usize) -> String {
    format!("tick_{number:05}.png")
}

/// Pictures in `folder` from number `first` on.
fn others(folder: &Path, first: usize) -> usize {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    let is_other = |name: &str| {
        let number = name.strip_prefix("tick_").and_then(|name| name.strip_suffix(".png"));
        let number = number.and_then(|number| number.parse().ok());
        number.is_some_and(|number| number >= first && picture_name(number) == name)
    };
    let names = entries.flatten().map(|entry| entry.file_name());
    names.filter(|name| name.to_str().is_some_and(is_other)).count()
}

fn summary_table(summaries: &[Option<Summary>]) -> String {
    let mut table =
        plain(&["condition", "events/s", "Hz/px", "active % per 10 ms, median", "p95", "ON/OFF"]);
    for ((condition, measured), summary) in MEASURED.iter().zip(summaries) {
        let row = match summary {
            Some(s) => [
                format!("{:.0}", s.events_per_s),
                format!("{:.3}", s.hz_per_px),
                format!("{:.2}", s.active_percent_median),
                format!("{:.2}", s.active_percent_p95),
                s.on_per_off.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}")),
            ],
            None => ["-"; 5].map(str::to_owned),
        };
        table.add_row([(*condition).to_owned()].into_iter().chain(row));
        let measured = measured.iter().map(|range| (*range).to_owned());
        table.add_row(["  real sensors".to_owned()].into_iter().chain(measured));
    }
    table.to_string()
}

fn as_json(
    args: &CameraArgs,
    summaries: &[Option<Summary>],
    encoder: Option<&[LayerActivity]>,
) -> serde_json::Value {
    let conditions = ["rest", "movers_pass", "driving"];
    let summaries: std::collections::BTreeMap<_, _> =
        conditions.into_iter().zip(summaries).collect();
    json!({
        "revision": REVISION,
        "seed": args.seed,
        "arena": args.arena,
        "driver": args.driver,
        "v_max_m_per_s": args.v_max,
        "field_of_view_deg": args.field_of_view,
        "contrast_ln": args.contrast,
        "mover_contrast_ln": args.mover_contrast,
        "conditions": summaries,
        "encoder": encoder,
    })
}
