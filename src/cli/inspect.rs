//! `spikeloop inspect`.

use serde_json::json;
use spikeloop::host::Deployment;
use spikeloop::report::tables::plain;

use crate::cli::args::InspectArgs;
use crate::cli::output::{REVISION, header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &InspectArgs) -> Result<Verdict, Failure> {
    let deployment = Deployment::read(&args.map)?;
    let digest = deployment.map.digest();
    if args.json {
        say(serde_json::to_string_pretty(&as_json(&deployment, &digest))?)?;
        return Ok(Verdict::Good);
    }
    let header = header(None, &[(deployment.network.clone(), digest)]);
    if args.dump {
        // A comment of the text form, so that the dump still reads back.
        say(format_args!("; {header}\n{}", deployment.map.to_text().trim_end()))?;
        return Ok(Verdict::Good);
    }
    say(header)?;
    say(format_args!("policy {} | chip {}", deployment.policy, deployment.map.chip().name))?;
    say(table(&deployment))?;
    Ok(Verdict::Good)
}

/// Use of every resource, used / limit, core by core.
pub(super) fn table(deployment: &Deployment) -> String {
    let map = &deployment.map;
    let usage = map.core_usage();
    let mut table = plain(&[
        "core",
        "holds",
        "compartments",
        "in axons",
        "out axons",
        "synapse words",
        "formats",
        "synapses",
    ]);
    for core in map.utilization() {
        let of = |usage: hw_model::core_map::Usage| format!("{}/{}", usage.used, usage.limit);
        table.add_row([
            core.core.to_string(),
            core.label.clone(),
            of(core.compartments),
            of(core.input_axons),
            of(core.output_axons),
            of(core.synapse_words),
            of(core.synapse_formats),
            core.synapses.to_string(),
        ]);
    }
    let steps = deployment.program.as_ref().map_or_else(String::new, |program| {
        format!(", {} chip steps per decision (T = {})", program.chip_steps, program.steps)
    });
    format!("cores {}/{}{steps}\n{table}", usage.used, usage.limit)
}

fn as_json(deployment: &Deployment, digest: &str) -> serde_json::Value {
    let map = &deployment.map;
    json!({
        "revision": REVISION,
        "network": deployment.network,
        "policy": deployment.policy,
        "chip": map.chip().name,
        "map_digest": digest,
        "cores": map.core_usage(),
        "utilization": map.utilization(),
        "populations": map.populations().iter()
            .map(|p| json!({ "name": p.name, "neurons": p.len(), "cores": p.slices.len() }))
            .collect::<Vec<_>>(),
        "ports": map.ports().iter()
            .map(|p| json!({ "name": p.name, "lines": p.lines, "messages": p.targets.len() }))
            .collect::<Vec<_>>(),
        "program": deployment.program,
        "scales": deployment.scales,
    })
}
