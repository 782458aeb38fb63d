//! `spikeloop demo`: compile, drive float and chip side by side, report.

use std::path::Path;

use hw_model::ChipSpec;
use spikeloop::closed_loop::TrialConfig;
use spikeloop::compile::Policy;
use spikeloop::evaluate::{Driver, EngineKind};
use spikeloop::host::Deployment;
use spikeloop::net::{Network, builtin};
use spikeloop::report::page::page;
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::pairs::{Pair, PairRules, generate_pairs};

use crate::cli::args::DemoArgs;
use crate::cli::drive::{Flight, all_threads, pairs_of_file, print_result};
use crate::cli::drivers::{chip_driver, maps};
use crate::cli::output::{header, say};
use crate::cli::{Failure, Verdict, inspect, output};

pub(super) fn run(args: &DemoArgs) -> Result<Verdict, Failure> {
    let (network, world, pairs, policy) = match &args.san {
        Some(folder) => san(folder, args.trials)?,
        None => reflex(args)?,
    };
    std::fs::create_dir_all(&args.output)
        .map_err(|e| format!("{}: cannot make the folder: {e}", args.output.display()))?;
    let deployment =
        Deployment::compile(&network, &Policy::named(policy)?, &ChipSpec::loihi1(), None)?;
    let (about, bytes) = (inspect::table(&deployment), deployment.to_bytes());
    let chip = chip_driver(deployment, &network.name, EngineKind::Event)?;
    let drivers = [Driver::straight(), Driver::float(&network), chip];
    say(header(Some(args.seed), &maps(&drivers)))?;
    say(about)?;
    let file = |ending: &str| args.output.join(format!("{}.{ending}", network.name));
    output::write(&file("map"), &bytes)?;
    let flight = Flight { world, pairs, config: TrialConfig::san(), threads: all_threads() };
    let result = flight.fly_all(&drivers, args.seed, 1)?;
    print_result(&result)?;
    output::write(&file("json"), &serde_json::to_vec(&result)?)?;
    let title = format!("{} on {}", network.name, result.arena.name);
    output::write(&file("html"), page(&[(title, result)]).as_bytes())?;
    Ok(Verdict::Good)
}

/// What a demonstration flies, and the quantization policy.
type Scene = (Network, World, Vec<Pair>, &'static str);

/// The hand-wired network in the project's own arena.
fn reflex(args: &DemoArgs) -> Result<Scene, Failure> {
    let world = World::new(Arena::open("courtyard")?);
    let pairs =
        generate_pairs(&world, args.trials, PairRules::default(), Streams::new(args.seed, 0))?;
    Ok((builtin::read("reflex", None)?, world, pairs, "nearest"))
}

/// SAN's published weights in its own evaluation world, with its own scaling.
fn san(folder: &Path, trials: usize) -> Result<Scene, Failure> {
    let file = |name: &str| folder.join(name);
    let network = builtin::read("san", Some(&file("san_sddpg_bw5.safetensors")))?;
    let world = World::new(Arena::open(&file("san_evaluation_world.json").display().to_string())?);
    let radius = TrialConfig::san().robot_radius_m;
    let pairs = pairs_of_file(&file("san_eval_positions.json"), &world, radius, Some(trials))?;
    Ok((network, world, pairs, "san"))
}
