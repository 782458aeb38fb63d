//! `spikeloop reproduce`.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::slice;

use spikeloop::evaluate::{CONDITIONS, DEGRADATIONS, Driver, EngineKind};
use spikeloop::files;
use spikeloop::net::builtin;
use spikeloop::report::Report;
use spikeloop::report::document::Content;
use spikeloop::report::reproduction::printed::{PrintedRow, SUCCESS, TABLES};
use spikeloop::report::reproduction::{
    CostRow, ON_CHIP, REPRODUCTION_FORMAT, Reproduction, cost_rows_table, counted_table, degraded,
    rate_bars, rate_table, reproduced, step_table,
};
use spikeloop::report::success::SuccessTable;
use spikeloop::report::thresholds::{ThresholdsResult, thresholds_table};

use crate::cli::args::{EvaluateArgs, FlightsArgs, ReproduceArgs, Table5Args};
use crate::cli::drive::all_threads;
use crate::cli::drivers::{drivers, last_seed};
use crate::cli::evaluate::Evaluation;
use crate::cli::output::{self, REVISION, header, say};
use crate::cli::table5::{self, Counting};
use crate::cli::thresholds::thresholds_of;
use crate::cli::{Failure, Verdict, report};

/// Parts beside the tables of success rates: flown degraded, cost on the chip, operations, learned
/// thresholds.
pub(super) const OTHER_PARTS: [&str; 4] = ["degraded", "cost", "table5", "learned"];

/// What stands in the paper's figures and is the same for all parts.
const MAP: &str = "map1";
const TICKS_MAX: u64 = 1000;
/// How long operations are counted.
const TABLE5_SECONDS: u64 = 10;

/// Below the tables.
const NOTE: &str = "\
paper: as printed, in maps that are not published. spread: standard deviation over trainings.
s.e.: standard error of the mean over trainings, at least that of the number of trials. Networks
called compare/... had the same steps of the recipe `compare` in the same rooms; \"longer\" is what
ships as eem-san and laser-only. laser-only is EEM-SAN without its DVS branch. Costs are of the first
training.";

pub(super) fn run(args: &ReproduceArgs) -> Result<Verdict, Failure> {
    last_seed(args.flights.seed, "--seeds", args.flights.seeds)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|e| format!("{}: cannot make the folder: {e}", args.output.display()))?;
    files::check_writable(&args.file("state.json"))?;
    say(header(Some(args.flights.seed), &[]))?;
    let (costs, refused) = fly(args)?;
    let state = args.state()?;
    let reproduction = reproduction(args, &state, costs, &refused);
    let mut all = Report::new(REVISION);
    print(&reproduction, &refused)?;
    all.push("reproduction.json", Content::Reproduction(Box::new(reproduction.clone())));
    others(args, &mut all)?;
    all.push("state.json", Content::Success(state));
    output::write(&args.file("reproduction.json"), &serde_json::to_vec(&reproduction)?)?;
    for part in &reproduction.reproduced {
        if let Some(picture) = rate_bars(part) {
            output::write(&args.file(&format!("{}.svg", part.name)), picture.as_bytes())?;
        }
    }
    report::write(&all, Some(&args.file("reproduction.html")), None)?;
    Ok(Verdict::Good)
}

impl ReproduceArgs {
    fn wants(&self, part: &str) -> bool {
        self.parts.is_empty() || self.parts.iter().any(|wanted| wanted == part)
    }

    fn seeds(&self) -> RangeInclusive<u64> {
        let FlightsArgs { seed, seeds, .. } = self.flights;
        seed..=seed.saturating_add(seeds.saturating_sub(1))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.output.join(name)
    }

    /// Settings for some cells of the success table; all share one state file.
    fn evaluation(
        &self,
        networks: Vec<String>,
        maps: &[&str],
        conditions: &[&str],
    ) -> EvaluateArgs {
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        EvaluateArgs {
            networks,
            weights: None,
            maps: owned(maps),
            conditions: owned(conditions),
            degraded: Vec::new(),
            flights: self.flights,
            actuators: self.actuators,
            ticks_max: TICKS_MAX,
            state: Some(self.file("state.json")),
            json: None,
            plot: None,
        }
    }

    /// What has been flown with these seeds.
    fn state(&self) -> Result<SuccessTable, Failure> {
        let path = self.file("state.json");
        let empty = Evaluation::settings_of(&self.evaluation(Vec::new(), &[MAP], &[]))?;
        if !path.exists() {
            return Ok(SuccessTable::new(empty));
        }
        let file = path.display().to_string();
        let mut table = SuccessTable::from_json(&file, &files::read_text(&path)?)?;
        table.check_settings(&file, &empty)?;
        table.cells.retain(|cell| self.seeds().contains(&cell.seed));
        Ok(table)
    }
}

/// Flies every cell that is wanted and not in the state file, unless nothing shall be flown, and
/// gives what networks take of the chip, and those that it does not take.
fn fly(args: &ReproduceArgs) -> Result<(Vec<CostRow>, Vec<Refused>), Failure> {
    for table in TABLES.iter().filter(|table| args.wants(table.name)) {
        fly_some(args, &args.evaluation(trained(table.rows), table.maps, table.conditions))?;
    }
    let dynamic = [CONDITIONS[0].name];
    let degraded = DEGRADATIONS.map(|kind| kind.name.to_owned()).to_vec();
    if args.wants("degraded") {
        let mut evaluation = args.evaluation(trained(SUCCESS.rows), &[MAP], &dynamic);
        evaluation.degraded.clone_from(&degraded);
        fly_some(args, &evaluation)?;
    }
    let (mut costs, mut refused) = (Vec::new(), Vec::new());
    if args.wants("cost") {
        let chips;
        (costs, chips) = compiled(first_trained(&all_rows()));
        refused.extend(costs.iter().filter_map(Refused::of));
        let names: Vec<&str> = costs.iter().map(|cost| &cost.network[..]).collect();
        let flight = (MAP, TABLE5_SECONDS, args.flights.seed);
        let threads = args.flights.threads.unwrap_or_else(all_threads);
        let counted = table5::operations(&names, flight, threads)?;
        for (cost, counted) in costs.iter_mut().zip(counted) {
            cost.counted = Some(counted);
        }
        fly_chips(args, chips, &mut args.evaluation(Vec::new(), &[MAP], &dynamic))?;
    }
    if args.wants("degraded") {
        let (rows, chips) = compiled(trained(SUCCESS.rows));
        for new in rows.iter().filter_map(Refused::of) {
            if !refused.iter().any(|known| known.network == new.network) {
                refused.push(new);
            }
        }
        let mut evaluation = args.evaluation(Vec::new(), &[MAP], &dynamic);
        evaluation.degraded = degraded;
        fly_chips(args, chips, &mut evaluation)?;
    }
    Ok((costs, refused))
}

/// A network that does not compile.
struct Refused {
    network: String,
    why: String,
}

impl Refused {
    fn of(row: &CostRow) -> Option<Self> {
        Some(Self { network: row.network.clone(), why: row.refused.clone()? })
    }
}

fn fly_some(args: &ReproduceArgs, evaluation: &EvaluateArgs) -> Result<(), Failure> {
    if evaluation.networks.is_empty() {
        return Ok(());
    }
    fly_prepared(args, Evaluation::prepare(evaluation)?)
}

/// The same for networks that are compiled already.
fn fly_chips(
    args: &ReproduceArgs,
    chips: Vec<Driver>,
    evaluation: &mut EvaluateArgs,
) -> Result<(), Failure> {
    if chips.is_empty() {
        return Ok(());
    }
    evaluation.networks = chips.iter().map(|chip| chip.label.clone()).collect();
    fly_prepared(args, Evaluation::prepare_with(evaluation, || Ok(chips))?)
}

/// What is in the state file has to be of these networks, whether any flies or not.
fn fly_prepared(args: &ReproduceArgs, evaluation: Evaluation) -> Result<(), Failure> {
    if !args.as_flown {
        evaluation.fly_all()?;
    }
    Ok(())
}

/// The rows of all tables.
fn all_rows() -> Vec<PrintedRow> {
    TABLES.iter().flat_map(|table| table.rows).copied().collect()
}

/// Networks of these rows that there are, each once: the first training of every row, then the
/// second of every row, so that what is done in part is done evenly.
fn trained(rows: &[PrintedRow]) -> Vec<String> {
    let most = rows.iter().map(|row| row.networks.len()).max().unwrap_or(0);
    let every = (0..most).flat_map(|training| rows.iter().map(move |row| (row, training)));
    each(every.filter_map(|(row, training)| row.networks.get(training)))
}

/// The first training of every row.
fn first_trained(rows: &[PrintedRow]) -> Vec<String> {
    each(rows.iter().filter_map(|row| row.networks.first()))
}

/// Those networks that there are, each once.
fn each<'a>(networks: impl Iterator<Item = &'a &'static str>) -> Vec<String> {
    let mut known: Vec<String> = Vec::new();
    for network in networks.filter(|network| builtin::is_name(network)) {
        if known.iter().all(|name| name != network) {
            known.push((*network).to_owned());
        }
    }
    known
}

/// What the chip needs for each network, or why it cannot take it, nothing flown yet; and a driver for
/// each that it can take.
fn compiled(networks: Vec<String>) -> (Vec<CostRow>, Vec<Driver>) {
    let (mut costs, mut chips) = (Vec::new(), Vec::new());
    for network in networks {
        let name = format!("{ON_CHIP}{network}");
        let mut cost = CostRow { network, ..CostRow::default() };
        match drivers(slice::from_ref(&name), None, EngineKind::Event) {
            Ok(compiled) => {
                for mut chip in compiled {
                    let deployment = chip.deployment().expect("a compiled network");
                    cost.cores = deployment.map.core_usage().used;
                    chip.label.clone_from(&name);
                    chips.push(chip);
                }
            }
            Err(why) => cost.refused = Some(why.to_string()),
        }
        costs.push(cost);
    }
    (costs, chips)
}

fn reproduction(
    args: &ReproduceArgs,
    state: &SuccessTable,
    mut costs: Vec<CostRow>,
    refused: &[Refused],
) -> Reproduction {
    let is_trained = |name: &str| builtin::is_name(name);
    let is_refused = |name: &str| refused.iter().any(|refused| refused.network == name);
    let tables = TABLES.iter().filter(|table| args.wants(table.name));
    let mut all: Vec<_> = tables.map(|table| reproduced(table, state, &is_trained)).collect();
    if args.wants("degraded") {
        all.push(degraded(state, &is_trained, &is_refused));
    }
    costs.iter_mut().for_each(|cost| cost.add(state, CONDITIONS[0].name, MAP));
    Reproduction {
        format: REPRODUCTION_FORMAT,
        revision: REVISION.to_owned(),
        settings: state.settings.clone(),
        seeds: args.seeds().collect(),
        reproduced: all,
        costs,
    }
}

fn print(reproduction: &Reproduction, refused: &[Refused]) -> Result<(), Failure> {
    say(format_args!("actuators {}", reproduction.settings.actuators))?;
    for part in &reproduction.reproduced {
        say(format_args!("\n{}", part.title))?;
        say(rate_table(part))?;
        if let Some(steps) = step_table(part) {
            say(steps)?;
        }
    }
    say(NOTE)?;
    if !reproduction.costs.is_empty() {
        say(format_args!("\nper decision on the chip, past movers on {MAP}, all seeds"))?;
        say(cost_rows_table(&reproduction.costs))?;
        say(format_args!(
            "\nper decision of the float network as it is, {TABLE5_SECONDS} s of flight; exponentials are \
             neither sums nor products"
        ))?;
        say(counted_table(&reproduction.costs))?;
    }
    if !refused.is_empty() {
        say("\nnot on the chip:")?;
    }
    for Refused { why, .. } in refused {
        say(why)?;
    }
    Ok(())
}

/// Operations of EEM-SAN and its artificial counterparts, and learned thresholds.
fn others(args: &ReproduceArgs, all: &mut Report) -> Result<(), Failure> {
    if args.wants("table5") {
        let counting = Table5Args {
            network: "eem-san".to_owned(),
            arena: MAP.to_owned(),
            seconds: TABLE5_SECONDS,
            seed: args.flights.seed,
            v_max: 1.0,
            json: None,
        };
        let counted = Counting::prepare(&counting)?.count()?;
        say("\nOperations (table 5)")?;
        table5::print(&counted)?;
        all.push("table5", Content::Table5(Box::new(counted)));
    }
    if args.wants("learned") {
        let mut thresholds = Vec::new();
        for name in trained(&all_rows()) {
            thresholds.push(thresholds_of(&name, &builtin::open(&name, None::<&Path>)?));
        }
        say("\nThresholds (figure 4)")?;
        say(thresholds_table(&thresholds))?;
        let result = ThresholdsResult { revision: REVISION.to_owned(), thresholds };
        all.push("thresholds", Content::Thresholds(result));
    }
    Ok(())
}
