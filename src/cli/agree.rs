//! `spikeloop agree`.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use hw_model::{DenseEngine, Engine, EventEngine};
use spikeloop::closed_loop::{Trial, TrialConfig};
use spikeloop::evaluate::{Agreement, Comparison};
use spikeloop::host::Deployment;
use spikeloop::net::{Controller, builtin};
use spikeloop::report::agreement::{AgreementResult, actions_line, agreement_table};
use spikeloop::rng::Streams;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;
use spikeloop::world::dvs::CameraConfig;
use spikeloop::world::pairs::{PairRules, generate_pairs};

use crate::cli::args::{AgreeArgs, EngineArg};
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// Most trials flown to fill the ticks.
const TRIALS_MAX: usize = 1000;

pub(super) fn run(args: &AgreeArgs) -> Result<Verdict, Failure> {
    let inputs = [&*args.map, Path::new(&args.network), Path::new(&args.arena)];
    check_outputs(&args.json, inputs)?;
    let deployment = Deployment::read(&args.map)?;
    let Controller::EemSan(network) = builtin::open(&args.network, None)? else {
        return Err(format!(
            "{}: a network with a rate code, not an EEM-SAN; give an EEM-SAN's weights \
             (.safetensors), eem-san or laser-only",
            args.network
        )
        .into());
    };
    let engine: Box<dyn Engine> = match args.engine {
        EngineArg::Event => Box::new(EventEngine::new(Arc::clone(&deployment.map))),
        EngineArg::Dense => Box::new(DenseEngine::new(Arc::clone(&deployment.map))),
    };
    let mut comparison = Comparison::new(&network, &deployment, engine)
        .map_err(|error| format!("{}: {error}", args.map.display()))?;
    let camera = network.encoder.is_some().then(CameraConfig::default);
    let config = TrialConfig { camera, ..TrialConfig::eem_san(args.v_max) };
    config.check()?;
    let world = World::new(Arena::open(&args.arena)?);
    let map = (deployment.network.clone(), deployment.map.digest());
    say(header(Some(args.seed), std::slice::from_ref(&map)))?;
    say(format_args!("policy {} | chip {}", deployment.policy, deployment.map.chip().name))?;
    let started = Instant::now();
    let ticks = args.ticks as u64;
    let trials = fly(&args.network, args.seed, ticks, &world, &config, &mut comparison)?;
    let wall_s = started.elapsed().as_secs_f64();
    print(comparison.agreement(), trials, wall_s)?;
    let delays = comparison.delays();
    if delays.iter().any(|delay| *delay > 0) {
        let delays: Vec<String> = delays.iter().map(u64::to_string).collect();
        say(format_args!(
            "schedule streaming: the float network reads and acts as late as the chip; layers are \
             compared {} chip steps apart",
            delays.join(", ")
        ))?;
    }
    if network.encoder.is_some() {
        let agreement = comparison.agreement();
        say(format_args!(
            "DVS state: mean difference {:.4} (its deviation in training is 1)",
            agreement.state_difference_sum / agreement.ticks.max(1) as f64
        ))?;
    }
    let used = comparison.chip_use();
    let lost = used.counts.deliveries_while_held;
    let writes = used.counts.management_writes as f64 / used.decisions.max(1) as f64;
    say(format_args!("{writes:.1} register writes per tick to hold cores, {lost} spikes lost"))?;
    if let Some(path) = &args.json {
        let names = [REVISION, &args.network, &deployment.policy, &args.arena];
        let map = &deployment.map;
        let result = AgreementResult::new(names, map, args.v_max, args.seed, trials, &comparison);
        output::write(path, &serde_json::to_vec_pretty(&result)?)?;
    }
    Ok(Verdict::Good)
}

/// The float network drives until the ticks are full; how many trials that took.
pub(super) fn fly(
    network: &str,
    seed: u64,
    ticks: u64,
    world: &World,
    config: &TrialConfig,
    comparison: &mut Comparison,
) -> Result<usize, Failure> {
    let pairs = generate_pairs(world, TRIALS_MAX, PairRules::default(), Streams::new(seed, 0))?;
    let bar = progress(ticks, network);
    let mut trials = 0;
    for (trial_idx, pair) in pairs.iter().enumerate() {
        if comparison.agreement().ticks == ticks {
            break;
        }
        let streams = Streams::new(seed, trial_idx as u64);
        let mut trial = Trial::new(world, pair.start, pair.goal, config, streams)?;
        comparison.start_trial(streams);
        trials += 1;
        while trial.end().is_none() && comparison.agreement().ticks < ticks {
            let action = comparison.tick(&trial.observe(), trial.ticks());
            trial.drive(action);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(trials)
}

fn print(agreement: &Agreement, trials: usize, wall_s: f64) -> Result<(), Failure> {
    say(agreement_table(agreement))?;
    say("same step, same tick: spikes of a neuron in both, of its spikes in either")?;
    say(actions_line(agreement, trials))?;
    let n = agreement.ticks as f64;
    say(format_args!("{:.1} ticks/s of world, float network and chip", n / wall_s.max(1e-9)))
}
