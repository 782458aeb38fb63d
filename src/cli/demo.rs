//! `spikeloop demo`: compile, drive float and chip side by side, report.

use std::path::Path;

use hw_model::ChipSpec;
use spikeloop::closed_loop::TrialConfig;
use spikeloop::compile::Policy;
use spikeloop::evaluate::{Driver, EngineKind};
use spikeloop::host::{Deployment, Schedule};
use spikeloop::net::{Controller, Network, builtin};
use spikeloop::report::page::page;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::{Arena, EVALUATION_SEED};
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::cli::args::{DemoArgs, DemoNetwork};
use crate::cli::drive::{Flight, all_threads, pairs_of_file, print_result};
use crate::cli::drivers::{chip_driver, maps};
use crate::cli::output::{header, say};
use crate::cli::{Failure, Verdict, inspect, output};

/// Trials of EEM-SAN, whose camera and encoder take time; the other networks fly more.
const EEM_SAN_TRIALS: usize = 20;
const TRIALS: usize = 200;

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
    let title = format!("{name} on {}", result.arena.name);
    output::write(&file("html"), page(&[(title, result)]).as_bytes())?;
    Ok(Verdict::Good)
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
    let policy = Policy::named("nearest")?;
    let deployment = match &network {
        Controller::EemSan(network) => {
            let chip = ChipSpec::loihi1();
            Deployment::compile_eem_san(network, &policy, &chip, None, Schedule::Held)?
        }
        Controller::Described(network) => compiled(network, "nearest")?,
    };
    let floats = vec![builtin::open("laser-only", None)?, network];
    let flight = Flight { world, pairs, config: TrialConfig::eem_san(1.0), threads: all_threads() };
    Ok(Scene { deployment, floats, flight })
}

fn compiled(network: &Network, policy: &str) -> Result<Deployment, Failure> {
    Ok(Deployment::compile(network, &Policy::named(policy)?, &ChipSpec::loihi1(), None)?)
}

fn san_flight(world: World, pairs: Vec<Pair>) -> Flight {
    Flight { world, pairs, config: TrialConfig::san(), threads: all_threads() }
}

/// The hand-wired network in the project's own arena.
fn reflex(args: &DemoArgs) -> Result<Scene, Failure> {
    let world = World::new(Arena::open("courtyard")?);
    let n = args.trials.unwrap_or(TRIALS);
    let pairs = generate_pairs(&world, n, PairRules::default(), Streams::new(args.seed, 0))?;
    let network = builtin::read("reflex", None)?;
    let deployment = compiled(&network, "nearest")?;
    let floats = vec![Controller::Described(network)];
    Ok(Scene { deployment, floats, flight: san_flight(world, pairs) })
}

/// SAN's published weights in its own evaluation world, with its own scaling.
fn san(folder: &Path, trials: usize) -> Result<Scene, Failure> {
    let file = |name: &str| folder.join(name);
    let network = builtin::read("san", Some(&file("san_sddpg_bw5.safetensors")))?;
    let world = World::new(Arena::open(&file("san_evaluation_world.json").display().to_string())?);
    let radius = TrialConfig::san().robot_radius_m;
    let pairs = pairs_of_file(&file("san_eval_positions.json"), &world, radius, Some(trials))?;
    let deployment = compiled(&network, "san")?;
    let floats = vec![Controller::Described(network)];
    Ok(Scene { deployment, floats, flight: san_flight(world, pairs) })
}
