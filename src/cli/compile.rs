//! `spikeloop compile`.

use std::path::Path;

use hw_model::core_map::Usage;
use spikeloop::compile::{CompileError, Policy, Split, open_chip};
use spikeloop::host::{Deployment, Schedule};
use spikeloop::net::{Controller, builtin, integer};

use crate::cli::args::{CompileArgs, ScheduleArg};
use crate::cli::output::{check_outputs, header, say};
use crate::cli::{Failure, Verdict, inspect, output};

/// Policy when none is named.
pub(super) const POLICY_DEFAULT: &str = "nearest";

pub(super) fn run(args: &CompileArgs) -> Result<Verdict, Failure> {
    let inputs = [Path::new(&args.network), Path::new(&args.chip)];
    check_outputs([&args.output], inputs.into_iter().chain(args.weights.as_deref()))?;
    let deployment = compiled(args)?;
    say(header(None, &[(deployment.network.clone(), deployment.map.digest())]))?;
    for (layer, scale) in &deployment.scales {
        say(format_args!("layer {layer}: {scale:.3} mantissas per unit"))?;
    }
    say(inspect::table(&deployment))?;
    let Usage { used: taken, limit: there } = deployment.map.core_usage();
    let split = Split::asked(args.cores, args.neurons_per_core);
    if split == Split::Fewest && 2 * taken <= there {
        say(format_args!(
            "as few cores as can be; --cores N, up to {there}, shares the layers out over more and may \
             make steps shorter"
        ))?;
    }
    if let Some(asked) = args.cores.filter(|asked| *asked as u64 > taken) {
        say(format_args!(
            "{taken} of the {asked} cores asked for are taken: no split over more was found that makes steps shorter, by \
             what the layers do on random input"
        ))?;
    }
    output::write(&args.output, &deployment.to_bytes())?;
    Ok(Verdict::Good)
}

fn compiled(args: &CompileArgs) -> Result<Deployment, Failure> {
    let chip = open_chip(&args.chip)?;
    let split = Split::asked(args.cores, args.neurons_per_core);
    let (path, weights) = (Path::new(&args.network), args.weights.as_deref());
    let refused = |error| refused(&args.network, &error);
    if path.extension().is_none_or(|extension| extension != "json") {
        let policy = Policy::named(args.policy.as_deref().unwrap_or(POLICY_DEFAULT))?;
        let policy = policy.narrowed(args.weight_bits)?;
        let network = builtin::open(&args.network, weights)?;
        let schedule = match (&network, args.schedule) {
            (Controller::Described(_), Some(_)) => return Err(no_schedule(args)),
            (_, Some(ScheduleArg::Streaming)) => Schedule::Streaming,
            (_, Some(ScheduleArg::Held) | None) => Schedule::Held,
        };
        let deployment = Deployment::of_controller(&network, &policy, &chip, split, schedule);
        return deployment.map_err(refused);
    }
    if args.schedule.is_some() {
        return Err(no_schedule(args));
    }
    if let Some(policy) = &args.policy {
        return Err(format!(
            "{}: --policy {policy} cannot apply, the weights are integers already; leave it out",
            args.network
        )
        .into());
    }
    if let Some(bits) = args.weight_bits {
        return Err(format!(
            "{}: --weight-bits {bits} cannot apply, the weights are integers already; leave it out",
            args.network
        )
        .into());
    }
    Deployment::of_integers(integer::read(path, weights)?, &chip, split).map_err(refused)
}

/// Why the network that was called `name` does not compile; its name goes first.
pub(super) fn refused(name: &str, error: &CompileError) -> Failure {
    let text = error.to_string();
    if text.starts_with(name) { text.into() } else { format!("{name}: {text}").into() }
}

fn no_schedule(args: &CompileArgs) -> Failure {
    let name = &args.network;
    format!("{name}: --schedule is for an EEM-SAN, and this is none; leave it out").into()
}
