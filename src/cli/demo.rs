//! `spikeloop demo`: compile, drive float and chip side by side, report.

use std::path::Path;
use std::sync::Arc;

use hw_model::{ChipSpec, EventEngine};
use spikeloop::closed_loop::TrialConfig;
use spikeloop::compile::{Policy, Split};
use spikeloop::evaluate::{Comparison, Driver, EngineKind};
use spikeloop::host::{Deployment, Schedule};
use spikeloop::net::{Controller, builtin};
use spikeloop::report::Report;
use spikeloop::report::agreement::{AgreementResult, agreement_table};
use spikeloop::report::chip_plan::ChipPlan;
use spikeloop::report::document::Content;
use spikeloop::report::thresholds::ThresholdsResult;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::{Arena, EVALUATION_SEED};
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::cli::args::{DemoArgs, DemoNetwork, Table5Args};
use crate::cli::drive::{Flight, all_threads, first_success, pairs_of_file, print_result};
use crate::cli::drivers::{chip_driver, maps};
use crate::cli::output::{REVISION, header, say};
use crate::cli::report::write;
use crate::cli::table5::Counting;
use crate::cli::thresholds::thresholds_of;
use crate::cli::{Failure, Verdict, agree, inspect, output};

/// Trials of EEM-SAN, whose camera and encoder take time; the other networks fly more.
const EEM_SAN_TRIALS: usize = 20;
const TRIALS: usize = 200;
/// How long chip and float network are compared, and operations counted; the verbs take longer.
const AGREE_TICKS: u64 = 100;
const TABLE5_SECONDS: u64 = 2;

pub(super) fn run(args: &DemoArgs) -> Result<Verdict, Failure> {
    let scene = match (&args.san, args.network) {
        (Some(folder), _) => san(folder, args.trials.unwrap_or(TRIALS))?,
        (None, DemoNetwork::EemSan) => eem_san(args)?,
        (None, DemoNetwork::Reflex) => reflex(args)?,
    };
    std::fs::create_dir_all(&args.output)
        .map_err(|e| format!("{}: cannot make the folder: {e}", args.output.display()))?;
    let Scene { deployment, floats, flight } = scene;
    let (about, bytes) = (inspect::table(&deployment), deployment.to_bytes());
    let plan = ChipPlan::new(&deployment);
    let name = deployment.network.clone();
    let chip = chip_driver(deployment, &name, EngineKind::Event)?;
    let mut drivers = vec![Driver::straight()];
    drivers.extend(floats.iter().map(Driver::controller));
    drivers.push(chip);
    say(header(Some(args.seed), &maps(&drivers)))?;
    say(about)?;
    let file = |ending: &str| args.output.join(format!("{name}.{ending}"));
    output::write(&file("map"), &bytes)?;
    let result = flight.fly_all(&drivers, args.seed, 1)?;
    print_result(&result)?;
    output::write(&file("json"), &serde_json::to_vec(&result)?)?;
    let chip = drivers.last().expect("the chip drives last");
    let trial = first_success(&result, chip);
    let replay = flight.record(chip, args.seed, &[trial])?;
    output::write(&file("replay.json"), &serde_json::to_vec(&replay)?)?;
    let mut report = Report::new(REVISION);
    report.push(&format!("{name}.replay.json"), Content::Replay(Box::new(replay)));
    report.push(&format!("{name}.json"), Content::Drive(result));
    report.push(&format!("{name}.map"), Content::Chip(plan));
    for network in floats.iter().filter(|network| network.name() == name) {
        compare(network, chip, &flight, args.seed, &mut report)?;
    }
    let thresholds = floats.iter().map(|network| thresholds_of(network.name(), network)).collect();
    let thresholds = ThresholdsResult { revision: REVISION.to_owned(), thresholds };
    report.push(&name, Content::Thresholds(thresholds));
    write(&report, Some(&file("html")), Some(&file("report.json")))?;
    Ok(Verdict::Good)
}

/// Chip beside float network, and beside artificial ones, for an EEM-SAN with an encoder.
fn compare(
    network: &Controller,
    chip: &Driver,
    flight: &Flight,
    seed: u64,
    report: &mut Report,
) -> Result<(), Failure> {
    let (Controller::EemSan(network), Some(deployment)) = (network, chip.deployment()) else {
        return Ok(());
    };
    let engine = Box::new(EventEngine::new(Arc::clone(&deployment.map)));
    let mut comparison = Comparison::new(network, deployment, engine)?;
    let (world, config) = (&flight.world, chip.config(&flight.config)?);
    let trials = agree::fly(&network.name, seed, AGREE_TICKS, world, &config, &mut comparison)?;
    let names = [REVISION, &network.name, &deployment.policy, world.arena().name()];
    let map = &deployment.map;
    let speed = config.wheel_speed_m_per_s_max;
    let agreement = AgreementResult::new(names, map, speed, seed, trials, &comparison);
    say(agreement_table(&agreement.agreement))?;
    report.push("agree", Content::Agreement(agreement));
    let counting = Table5Args {
        network: network.name.clone(),
        arena: world.arena().name().to_owned(),
        seconds: TABLE5_SECONDS,
        seed,
        v_max: flight.config.wheel_speed_m_per_s_max,
        json: None,
    };
    let table5 = Counting::prepare(&counting)?.count()?;
    report.push("table5", Content::Table5(Box::new(table5)));
    Ok(())
}

/// What a demonstration flies: a compiled network, float networks beside it, and where.
struct Scene {
    deployment: Deployment,
    floats: Vec<Controller>,
    flight: Flight,
}

/// EEM-SAN and its laser-only control on the first evaluation map.
fn eem_san(args: &DemoArgs) -> Result<Scene, Failure> {
    let world = World::new(Arena::open("map1")?);
    let n = args.trials.unwrap_or(EEM_SAN_TRIALS);
    let streams = Streams::new(EVALUATION_SEED, 0);
    let pairs = generate_pairs(&world, n, PairRules::default(), streams)?;
    let network = builtin::open("eem-san", None)?;
    let deployment = compiled(&network, "nearest")?;
    let floats = vec![builtin::open("laser-only", None)?, network];
    let flight = Flight { world, pairs, config: TrialConfig::eem_san(1.0), threads: all_threads() };
    Ok(Scene { deployment, floats, flight })
}

fn compiled(network: &Controller, policy: &str) -> Result<Deployment, Failure> {
    let (policy, chip) = (Policy::named(policy)?, ChipSpec::loihi1());
    Ok(Deployment::of_controller(network, &policy, &chip, Split::Fewest, Schedule::Held)?)
}

fn san_flight(world: World, pairs: Vec<Pair>) -> Flight {
    Flight { world, pairs, config: TrialConfig::san(), threads: all_threads() }
}

/// The hand-wired network in the project's own arena.
fn reflex(args: &DemoArgs) -> Result<Scene, Failure> {
    let world = World::new(Arena::open("courtyard")?);
    let n = args.trials.unwrap_or(TRIALS);
    let pairs = generate_pairs(&world, n, PairRules::default(), Streams::new(args.seed, 0))?;
    let network = builtin::open("reflex", None)?;
    let deployment = compiled(&network, "nearest")?;
    Ok(Scene { deployment, floats: vec![network], flight: san_flight(world, pairs) })
}

/// SAN's published weights in its own evaluation world, with its own scaling.
fn san(folder: &Path, trials: usize) -> Result<Scene, Failure> {
    let file = |name: &str| folder.join(name);
    let network = builtin::open("san", Some(&file("san_sddpg_bw5.safetensors")))?;
    let world = World::new(Arena::open(&file("san_evaluation_world.json").display().to_string())?);
    let radius = TrialConfig::san().robot_radius_m;
    let pairs = pairs_of_file(&file("san_eval_positions.json"), &world, radius, Some(trials))?;
    let deployment = compiled(&network, "san")?;
    Ok(Scene { deployment, floats: vec![network], flight: san_flight(world, pairs) })
}
