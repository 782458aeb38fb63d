//! `spikeloop run`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use hw_model::container::sha256_hex;
use hw_model::core_map::HostPort;
use hw_model::cost::CostTable;
use hw_model::engine::{PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::{CoreMap, DenseEngine, Engine, EventEngine};
use serde_json::json;
use spikeloop::host::Deployment;
use spikeloop::npz::{self, Npz};
use spikeloop::report::energy::time_shares;
use spikeloop::report::results::counters_by_core;
use spikeloop::report::tables::{micro, plain};

use crate::cli::args::{EngineArg, RunArgs, STEPS_MAX};
use crate::cli::output::{self, REVISION, check_outputs, header, progress, say};
use crate::cli::{Failure, Verdict};

/// Steps between two looks at the progress bar.
const STEPS_PER_TICK: usize = 256;
/// Most spikes that are kept, 16 bytes each.
const RECORDED_MAX: usize = 1 << 26;

/// (step, port, line).
type InputSpike = (u64, u32, u32);

pub(super) fn run(args: &RunArgs) -> Result<Verdict, Failure> {
    check_outputs(args.output.iter().chain(&args.json), [&*args.map, &*args.spikes])?;
    let deployment = Deployment::read(&args.map)?;
    let digest = deployment.map.digest();
    let map = Arc::clone(&deployment.map);
    let (mut spikes, others) = read_spikes(&map, args)?;
    let given = spikes.len();
    spikes.dedup();
    let steps = steps(&map, args, &spikes)?;
    say(header(None, &[(deployment.network.clone(), digest.clone())]))?;
    let late = spikes.len() - spikes.partition_point(|spike| spike.0 < steps as u64);
    say(format_args!("{} input spikes, {late} of them after the last step", spikes.len()))?;
    if !others.is_empty() {
        say(format_args!("not injected, as no port has that name: {}", others.join(", ")))?;
    }
    let repeated = given - spikes.len();
    if repeated > 0 {
        say(format_args!("{repeated} more are there already: a line spikes once in a step"))?;
    }
    let mut engine: Box<dyn Engine> = match args.engine {
        EngineArg::Event => {
            Box::new(EventEngine::with_threads_at_most(Arc::clone(&map), args.threads))
        }
        EngineArg::Dense => Box::new(DenseEngine::new(Arc::clone(&map))),
    };
    let started = Instant::now();
    let record = run_steps(engine.as_mut(), steps, &spikes)?;
    let wall_s = started.elapsed().as_secs_f64();
    let populations = named_spikes(&map, &record);
    print_result(engine.as_ref(), &populations, steps, wall_s)?;
    if let Some(path) = &args.output {
        output::write(path, &npz_bytes(&populations)?)?;
    }
    if let Some(path) = &args.json {
        let mut json = as_json(engine.as_ref(), &deployment, &digest, &populations, steps);
        json["input"] = json!({ "spikes": spikes.len(), "late": late, "repeated": repeated });
        output::write(path, &serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(Verdict::Good)
}

/// Arrays `PORT_t` and `PORT_i` of every port, by step, and names of what else has steps there.
fn read_spikes(map: &CoreMap, args: &RunArgs) -> Result<(Vec<InputSpike>, Vec<String>), Failure> {
    let mut npz = Npz::open(&args.spikes)?;
    let mut spikes = Vec::new();
    for (port, about) in map.ports().iter().enumerate() {
        let steps = npz.flat_ints(&format!("{}_t", about.name))?;
        let lines = npz.flat_ints(&format!("{}_i", about.name))?;
        let pairs = port_spikes(port as u32, about, &steps, &lines);
        spikes.extend(pairs.map_err(|problem| format!("{}: {problem}", args.spikes.display()))?);
    }
    let is_port = |name: &&str| map.ports().iter().any(|port| port.name == **name);
    let names = npz.names();
    let spiking = names.iter().filter_map(|array| array.strip_suffix("_t"));
    let others = spiking.filter(|name| !is_port(name)).map(str::to_owned).collect();
    spikes.sort_unstable();
    Ok((spikes, others))
}

/// The spikes of one port, or what is wrong with them.
fn port_spikes(
    port: u32,
    about: &HostPort,
    steps: &[i64],
    lines: &[i64],
) -> Result<Vec<InputSpike>, String> {
    let name = &about.name;
    if steps.len() != lines.len() {
        return Err(format!(
            "{name}_t has {} elements, {name}_i has {}; they must be pairs",
            steps.len(),
            lines.len()
        ));
    }
    let spike = |(index, (step, line)): (usize, (&i64, &i64))| {
        let there = u32::try_from(*line).ok().filter(|line| *line < about.lines);
        match (u64::try_from(*step), there) {
            (Ok(step), Some(line)) => Ok((step, port, line)),
            (Err(_), _) => Err(format!("element {index} of {name}_t is {step}, must be 0 or more")),
            (_, None) => Err(format!(
                "element {index} of {name}_i is {line}, must be 0..={} (lines of port {name}); another network's file?",
                i64::from(about.lines) - 1
            )),
        }
    };
    steps.iter().zip(lines).enumerate().map(spike).collect()
}

/// The steps asked for, or until the last input has gone through every population.
fn steps(map: &CoreMap, args: &RunArgs, spikes: &[InputSpike]) -> Result<usize, Failure> {
    if let Some(steps) = args.steps {
        return Ok(steps);
    }
    let last = spikes.last().map_or(0, |spike| spike.0);
    let steps = last.saturating_add(1 + map.populations().len() as u64);
    usize::try_from(steps).ok().filter(|steps| *steps <= STEPS_MAX).ok_or_else(|| {
        format!(
            "{}: the last input spike is at step {last}, limit {STEPS_MAX} steps; give --steps N to run the first N",
            args.spikes.display()
        )
        .into()
    })
}

/// `spikes` must be sorted.
fn run_steps(
    engine: &mut dyn Engine,
    steps: usize,
    spikes: &[InputSpike],
) -> Result<SpikeRecord, Failure> {
    let mut record = SpikeRecord::all(engine.map());
    let bar = progress(steps as u64, "chip steps");
    for start in (0..steps).step_by(STEPS_PER_TICK) {
        let n = STEPS_PER_TICK.min(steps - start);
        let from = spikes.partition_point(|s| s.0 < start as u64);
        let to = spikes.partition_point(|s| s.0 < (start + n) as u64);
        let part = spikes[from..to].iter().map(|(t, port, line)| (t - start as u64, *port, *line));
        engine.run(&Stimulus::new(engine.map(), n, part)?, &mut record);
        if record.spikes.len() > RECORDED_MAX {
            return Err(format!(
                "{} spikes after {} of {steps} steps, limit {RECORDED_MAX}; run fewer --steps",
                record.spikes.len(),
                start + n
            )
            .into());
        }
        bar.inc(n as u64);
    }
    bar.finish_and_clear();
    Ok(record)
}

fn named_spikes(map: &CoreMap, record: &SpikeRecord) -> Vec<(String, PopulationSpikes)> {
    let names = map.populations().iter().map(|population| population.name.clone());
    names.zip(record.by_population(map)).collect()
}

/// SHA-256 of all steps, then all neurons, as little-endian int32.
fn spikes_digest(spikes: &PopulationSpikes) -> String {
    let steps = spikes.iter().flat_map(|(step, _)| (*step as i32).to_le_bytes());
    let neurons = spikes.iter().flat_map(|(_, neuron)| (*neuron as i32).to_le_bytes());
    sha256_hex(&steps.chain(neurons).collect::<Vec<u8>>())
}

fn npz_bytes(populations: &[(String, PopulationSpikes)]) -> Result<Vec<u8>, Failure> {
    let arrays: Vec<(String, Vec<i32>)> = populations
        .iter()
        .flat_map(|(name, spikes)| {
            let steps = spikes.iter().map(|(step, _)| *step as i32).collect();
            let neurons = spikes.iter().map(|(_, neuron)| *neuron as i32).collect();
            [(format!("{name}_t"), steps), (format!("{name}_i"), neurons)]
        })
        .collect();
    Ok(npz::to_bytes(&arrays)?)
}

fn print_result(
    engine: &dyn Engine,
    populations: &[(String, PopulationSpikes)],
    steps: usize,
    wall_s: f64,
) -> Result<(), Failure> {
    let mut table = plain(&["population", "spikes", "SHA-256 of (t, i)"]);
    for (name, spikes) in populations {
        table.add_row([name.clone(), spikes.len().to_string(), spikes_digest(spikes)]);
    }
    say(table)?;
    let counts = engine.total_counts();
    for (name, count) in counts.named().into_iter().filter(|(_, count)| *count > 0) {
        say(format_args!("{name:24} {count:>14}"))?;
    }
    let mut costs =
        plain(&["cost table", "dynamic energy (uJ)", "chip time (us)", "static energy (uJ)"]);
    let chip = engine.map().chip();
    for (table, time_ps) in chip.cost_tables.iter().zip(engine.chip_time_ps()) {
        costs.add_row([
            table.name.clone(),
            micro(table.energy(&counts).total_fj(), 1.0),
            format!("{:.1}", *time_ps as f64 / 1e6),
            micro(chip.static_power.energy_fj(*time_ps), 1.0),
        ]);
    }
    say(costs)?;
    let per_s = counts.synaptic_ops() as f64 / wall_s.max(1e-9);
    let names = chip.cost_tables.iter().map(|table| &table.name[..]);
    let shares = time_shares(names.zip(engine.chip_time_ps().iter().copied()), wall_s);
    say(format_args!(
        "{steps} steps in {wall_s:.3} s of wall-clock time: {per_s:.3e} synaptic operations/s; {shares}"
    ))
}

fn as_json(
    engine: &dyn Engine,
    deployment: &Deployment,
    digest: &str,
    populations: &[(String, PopulationSpikes)],
    steps: usize,
) -> serde_json::Value {
    let counts = engine.total_counts();
    let counters: BTreeMap<_, _> = counts.named().into_iter().collect();
    let chip = engine.map().chip();
    let by_core = counters_by_core(engine.map(), &engine.core_counts(), engine.slowest_ps());
    let cost = |(table, time_ps): (&CostTable, &u64)| {
        let dynamic_fj = table.energy(&counts).total_fj();
        let static_fj = chip.static_power.energy_fj(*time_ps);
        let cost = json!({ "dynamic_fj": dynamic_fj, "static_fj": static_fj, "time_ps": time_ps });
        (table.name.clone(), cost)
    };
    let costs: BTreeMap<_, _> =
        chip.cost_tables.iter().zip(engine.chip_time_ps()).map(cost).collect();
    let populations: BTreeMap<_, _> = populations
        .iter()
        .map(|(name, spikes)| {
            (name.clone(), json!({ "spikes": spikes.len(), "sha256": spikes_digest(spikes) }))
        })
        .collect();
    json!({
        "revision": REVISION,
        "network": deployment.network,
        "map_digest": digest,
        "steps": steps,
        "populations": populations,
        "counters": counters,
        "counters_by_core": by_core,
        "costs": costs,
    })
}
