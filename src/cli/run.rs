//! `spikeloop run`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use hw_model::container::sha256_hex;
use hw_model::engine::{PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::{CoreMap, DenseEngine, Engine, EventEngine};
use serde_json::json;
use spikeloop::host::Deployment;
use spikeloop::npz::{self, Npz};
use spikeloop::report::tables::plain;

use crate::cli::args::{EngineArg, RunArgs};
use crate::cli::output::{self, REVISION, print_header, progress};
use crate::cli::{Failure, Verdict};

/// Steps between two looks at the progress bar.
const STEPS_PER_TICK: usize = 256;

pub(super) fn run(args: &RunArgs) -> Result<Verdict, Failure> {
    let deployment = Deployment::read(&args.map)?;
    let digest = deployment.map.digest();
    print_header(None, &[(deployment.network.clone(), digest.clone())]);
    let map = Arc::clone(&deployment.map);
    let spikes = read_spikes(&map, args)?;
    let steps = args.steps.unwrap_or_else(|| default_steps(&map, &spikes));
    let mut engine: Box<dyn Engine> = match args.engine {
        EngineArg::Event => Box::new(EventEngine::with_threads(Arc::clone(&map), args.threads)),
        EngineArg::Dense => Box::new(DenseEngine::new(Arc::clone(&map))),
    };
    let started = Instant::now();
    let record = run_steps(engine.as_mut(), steps, &spikes)?;
    let wall_s = started.elapsed().as_secs_f64();
    let populations = named_spikes(&map, &record);
    print_result(engine.as_ref(), &populations, steps, wall_s);
    if let Some(path) = &args.output {
        output::write(path, &npz_bytes(&populations)?)?;
    }
    if let Some(path) = &args.json {
        let json = as_json(engine.as_ref(), &deployment, &digest, &populations, steps);
        output::write(path, &serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(Verdict::Good)
}

/// Arrays `PORT_t` and `PORT_i` of every port as (step, port, line).
fn read_spikes(map: &CoreMap, args: &RunArgs) -> Result<Vec<(u64, u32, u32)>, Failure> {
    let mut npz = Npz::open(&args.spikes)?;
    let mut spikes = Vec::new();
    for (port, about) in map.ports().iter().enumerate() {
        let name = &about.name;
        let steps = npz.ints(&format!("{name}_t"))?.values;
        let lines = npz.ints(&format!("{name}_i"))?.values;
        if steps.len() != lines.len() {
            let (file, t, i) = (args.spikes.display(), steps.len(), lines.len());
            return Err(format!(
                "{file}: {name}_t has {t} elements, {name}_i has {i}; they must be pairs"
            )
            .into());
        }
        for (index, (step, line)) in steps.into_iter().zip(lines).enumerate() {
            let (Ok(step), Ok(line)) = (u64::try_from(step), u32::try_from(line)) else {
                let file = args.spikes.display();
                return Err(format!("{file}: element {index} of {name}_t, {name}_i is ({step}, {line}), must be 0 or more").into());
            };
            spikes.push((step, port as u32, line));
        }
    }
    Ok(spikes)
}

fn default_steps(map: &CoreMap, spikes: &[(u64, u32, u32)]) -> usize {
    let last = spikes.iter().map(|(step, ..)| *step).max().unwrap_or(0);
    last as usize + 1 + map.populations().len()
}

fn run_steps(
    engine: &mut dyn Engine,
    steps: usize,
    spikes: &[(u64, u32, u32)],
) -> Result<SpikeRecord, Failure> {
    let mut record = SpikeRecord::all(engine.map());
    let bar = progress(steps as u64, "chip steps");
    let mut sorted = spikes.to_vec();
    sorted.sort_unstable();
    for start in (0..steps).step_by(STEPS_PER_TICK) {
        let n = STEPS_PER_TICK.min(steps - start);
        let from = sorted.partition_point(|s| s.0 < start as u64);
        let to = sorted.partition_point(|s| s.0 < (start + n) as u64);
        let part = sorted[from..to].iter().map(|(t, port, line)| (t - start as u64, *port, *line));
        let stimulus = Stimulus::new(engine.map(), n, part)?;
        engine.run(&stimulus, &mut record);
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
) {
    let mut table = plain(&["population", "spikes", "SHA-256 of (t, i)"]);
    for (name, spikes) in populations {
        table.add_row([name.clone(), spikes.len().to_string(), spikes_digest(spikes)]);
    }
    println!("{table}");
    let counts = engine.total_counts();
    for (name, count) in counts.named().into_iter().filter(|(_, count)| *count > 0) {
        println!("{name:24} {count:>14}");
    }
    let mut costs =
        plain(&["cost table", "dynamic energy (uJ)", "chip time (us)", "static energy (uJ)"]);
    let chip = engine.map().chip();
    for (table, time_ps) in chip.cost_tables.iter().zip(engine.chip_time_ps()) {
        costs.add_row([
            table.name.clone(),
            format!("{:.2}", table.energy(&counts).total_fj() as f64 / 1e9),
            format!("{:.1}", *time_ps as f64 / 1e6),
            format!("{:.2}", chip.static_power.chip_mw * *time_ps as f64 / 1e9),
        ]);
    }
    println!("{costs}");
    let per_s = counts.synaptic_ops() as f64 / wall_s.max(1e-9);
    println!(
        "{steps} steps in {wall_s:.3} s of wall-clock time: {per_s:.3e} synaptic operations/s"
    );
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
    let by_core: Vec<BTreeMap<_, _>> =
        engine.core_counts().iter().map(|counts| counts.named().into_iter().collect()).collect();
    let costs: BTreeMap<_, _> = engine
        .map()
        .chip()
        .cost_tables
        .iter()
        .zip(engine.chip_time_ps())
        .map(|(table, time_ps)| {
            let dynamic_fj = table.energy(&counts).total_fj();
            (table.name.clone(), json!({ "dynamic_fj": dynamic_fj, "time_ps": time_ps }))
        })
        .collect();
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
