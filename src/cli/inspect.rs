//! `spikeloop inspect`.

use std::path::Path;
use std::sync::Arc;

use hw_model::core_map::{Core, HostPort};
use hw_model::id::CoreId;
use hw_model::{CoreMap, EventEngine, MemoryUse};
use serde_json::json;
use spikeloop::files;
use spikeloop::host::eem_san_program::Window;
use spikeloop::host::{Deployment, EemSanProgram, Schedule};
use spikeloop::report::activity::CoreActivity;
use spikeloop::report::chip_picture::chip_picture;
use spikeloop::report::chip_plan::ChipPlan;
use spikeloop::report::tables::plain;

use crate::cli::args::InspectArgs;
use crate::cli::output::{REVISION, check_outputs, header, say, write};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &InspectArgs) -> Result<Verdict, Failure> {
    check_outputs(
        &args.picture,
        [Some(&*args.map), args.activity.as_deref()].into_iter().flatten(),
    )?;
    let deployment = Deployment::read(&args.map)?;
    let activity = args.activity.as_deref().map(|path| activity(path, &deployment.map));
    let activity = activity.transpose()?;
    let digest = deployment.map.digest();
    if args.json {
        say(serde_json::to_string_pretty(&as_json(&deployment)?)?)?;
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
    say(layers(&deployment.map, activity.as_ref()))?;
    say(memory(&deployment))?;
    if let Some(path) = &args.picture {
        let picture = chip_picture(&ChipPlan::new(&deployment), activity.as_ref());
        write(path, picture.as_bytes())?;
    }
    Ok(Verdict::Good)
}

fn activity(path: &Path, map: &CoreMap) -> Result<CoreActivity, Failure> {
    Ok(CoreActivity::from_json(&path.display().to_string(), &files::read_text(path)?, map)?)
}

/// Which cores each layer lies on, what its synapses take there, and what its cores did.
fn layers(map: &CoreMap, activity: Option<&CoreActivity>) -> String {
    let of_cores = map.utilization();
    let mut titles: Vec<String> =
        ["layer", "neurons", "on cores", "stored synapses", "synapse words", "in axons"]
            .map(str::to_owned)
            .to_vec();
    let cost_tables = || map.chip().cost_tables.iter().map(|table| &table.name[..]);
    if let Some(activity) = activity {
        titles.push(format!("syn. ops per {}", activity.unit()));
        titles.extend(cost_tables().map(|name| format!("slowest (us, {name})")));
    }
    let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
    let mut table = plain(&titles);
    for population in map.populations() {
        let cores = population.cores();
        let sum = |of: fn(&hw_model::core_map::CoreUse) -> u64| -> String {
            cores.iter().map(|core| of(&of_cores[core.index()])).sum::<u64>().to_string()
        };
        let mut row = vec![
            population.name.clone(),
            population.len().to_string(),
            ranges(&cores),
            sum(|core| core.synapses),
            sum(|core| core.synapse_words.used),
            sum(|core| core.input_axons.used),
        ];
        if let Some(activity) = activity {
            let did = |of: &dyn Fn(usize) -> f64| -> f64 {
                cores.iter().map(|core| of(core.index())).sum()
            };
            row.push(format!("{:.1}", did(&|core| activity.synaptic_ops(core))));
            let slowest = |name| format!("{:.2}", did(&|core| activity.slowest_us(core, name)));
            row.extend(cost_tables().map(slowest));
        }
        table.add_row(row);
    }
    let note = "slowest: chip time of the steps that waited for a core of the layer, the barrier not in it; \
                a core that holds several layers counts for each";
    match activity {
        Some(activity) => format!("{table}\n{note}, per {}", activity.unit()),
        None => table.to_string(),
    }
}

/// What the event engine takes of this machine's memory.
fn memory(deployment: &Deployment) -> String {
    let memory = memory_use(deployment);
    let (synapses, compartments) = sizes(&deployment.map);
    let per = |bytes: usize, n: u64| bytes as f64 / n.max(1) as f64;
    format!(
        "event engine on this machine: {} bytes for all engines of the map, {:.2} per synapse of \
         {synapses}; {} bytes for each, {:.1} per compartment of {compartments}",
        memory.shared,
        per(memory.shared, synapses),
        memory.state,
        per(memory.state, compartments)
    )
}

/// Number of synapses and of compartments, see [`Core::synapses`].
fn sizes(map: &CoreMap) -> (u64, u64) {
    let compartments = map.cores().iter().map(|core| core.compartments() as u64).sum();
    (map.cores().iter().map(Core::synapses).sum(), compartments)
}

fn memory_use(deployment: &Deployment) -> MemoryUse {
    EventEngine::new(Arc::clone(&deployment.map)).memory()
}

/// Sorted core numbers as ranges: `3`, `0-63`, `2, 5-6`.
fn ranges(cores: &[CoreId]) -> String {
    let next = |a: &CoreId, b: &CoreId| a.index() + 1 == b.index();
    let range = |range: &[CoreId]| match range {
        [one] => one.to_string(),
        _ => format!("{}-{}", range[0], range[range.len() - 1]),
    };
    cores.chunk_by(next).map(range).collect::<Vec<_>>().join(", ")
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
        table.add_row([
            core.core.to_string(),
            core.label.clone(),
            core.compartments.to_string(),
            core.input_axons.to_string(),
            core.output_axons.to_string(),
            core.synapse_words.to_string(),
            core.synapse_formats.to_string(),
            core.synapses.to_string(),
        ]);
    }
    let steps = deployment.program.as_ref().map_or_else(String::new, |program| {
        format!(", {} chip steps per decision (T = {})", program.chip_steps, program.steps)
    });
    let steps = deployment.eem_san.as_ref().map_or(steps, |program| {
        if program.schedule == Schedule::Streaming {
            return format!(", streaming, {} chip steps per control tick", program.steps);
        }
        let cleared = match program.schedule {
            Schedule::HeldCleared => ", then cleared",
            Schedule::Held | Schedule::Streaming => "",
        };
        let encoder = program.encoder.as_ref().map_or_else(String::new, |phase| {
            format!(", {} chip steps per {} event frames{cleared}", phase.chip_steps, phase.frames)
        });
        let (chip_steps, steps) = (program.decision_steps, program.steps);
        format!("{encoder}, {chip_steps} chip steps per decision (T = {steps})")
    });
    format!("cores {usage}{steps}\nports: {}\n{table}", ports(deployment))
}

/// Where spikes come in, and when those of biases must.
fn ports(deployment: &Deployment) -> String {
    let program = deployment.program.as_ref();
    let eem_san = deployment.eem_san.as_ref();
    let port = |(index, port): (usize, &HostPort)| {
        let biases = program.filter(|program| program.bias_port as usize == index);
        let when = biases.map_or_else(String::new, |program| {
            let starts: Vec<String> = program.bias_starts.iter().map(u32::to_string).collect();
            let (starts, steps) = (starts.join(", "), program.steps);
            format!(": line by line on for {steps} steps of a decision, from step {starts} on")
        });
        let biases = eem_san.filter(|program| program.bias_port as usize == index);
        let when = biases.map_or(when, eem_san_biases);
        format!("{} ({} lines{when})", port.name, port.lines)
    };
    let ports: Vec<String> = deployment.map.ports().iter().enumerate().map(port).collect();
    if ports.is_empty() { "none".to_owned() } else { ports.join(", ") }
}

/// When the biases of an EEM-SAN must spike.
fn eem_san_biases(program: &EemSanProgram) -> String {
    // A spike that is injected in a step arrives in the next one.
    let line =
        |window: &Window, start: u64| format!("{} from step {}", window.population, start - 1);
    let lines = |windows: &[Window]| {
        let line = |window| line(window, u64::from(window.start));
        windows.iter().map(line).collect::<Vec<_>>().join(", ")
    };
    if program.schedule == Schedule::Streaming {
        let encoder = program.encoder.as_ref().map_or(&[][..], |phase| &phase.layers);
        let decision =
            program.decision.iter().map(|window| line(window, program.streamed_start(window)));
        let decision = decision.collect::<Vec<_>>().join(", ");
        return format!(": each on to the end of an episode: {}, {decision}", lines(encoder));
    }
    let encoder = program.encoder.as_ref().map_or_else(String::new, |phase| {
        format!(": each on for {} steps of the encoder's: {}", phase.frames, lines(&phase.layers))
    });
    let also = if encoder.is_empty() { ": each" } else { "; or" };
    format!(
        "{encoder}{also} on for {} steps of a decision: {}",
        program.steps,
        lines(&program.decision)
    )
}

/// The plan, and what a picture does not need.
fn as_json(deployment: &Deployment) -> Result<serde_json::Value, Failure> {
    let port =
        |p: &HostPort| json!({ "name": p.name, "lines": p.lines, "messages": p.targets.len() });
    let mut json = serde_json::to_value(ChipPlan::new(deployment))?;
    json["revision"] = json!(REVISION);
    json["ports"] = deployment.map.ports().iter().map(port).collect();
    json["program"] = json!(deployment.program);
    json["eem_san"] = json!(deployment.eem_san);
    json["scales"] = json!(deployment.scales);
    let (memory, (synapses, compartments)) = (memory_use(deployment), sizes(&deployment.map));
    json["event_engine"] = json!({
        "shared_bytes": memory.shared,
        "state_bytes": memory.state,
        "synapses": synapses,
        "compartments": compartments,
    });
    Ok(json)
}
