//! The paper's evaluation again: success rates of every row beside the printed ones, with their
//! spread over trainings, and what a decision costs on the chip.

pub mod printed;

use comfy_table::Table;
use serde::{Deserialize, Serialize};

use crate::cost::{ArithmeticTable, Ops};
use crate::evaluate::{CONDITIONS, DEGRADATIONS};
use crate::report::bars::{Bar, bars};
use crate::report::success::{Cell, SuccessSettings, SuccessTable};
use crate::report::tables::{micro, plain, synaptic_ops};
use printed::{PrintedRow, PrintedTable, SUCCESS};

/// Version of the JSON form.
pub const REPRODUCTION_FORMAT: u32 = 1;

/// Before the name of a network that is compiled and flown on the chip.
pub const ON_CHIP: &str = "chip:";

/// What `reproduce` found, whole or in part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reproduction {
    /// [`REPRODUCTION_FORMAT`].
    pub format: u32,
    /// Revision of the program.
    pub revision: String,
    /// Settings of all trials.
    pub settings: SuccessSettings,
    /// Seeds of the evaluation.
    pub seeds: Vec<u64>,
    /// Tables of success rates.
    pub reproduced: Vec<Reproduced>,
    /// Costs on the chip.
    pub costs: Vec<CostRow>,
}

/// A table of success rates beside the printed one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reproduced {
    /// Name.
    pub name: String,
    /// Title.
    pub title: String,
    /// Rows.
    pub rows: Vec<RateRow>,
    /// Differences between rows.
    pub steps: Vec<Step>,
}

/// Success of one method under one condition on one map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateRow {
    /// The method.
    pub label: String,
    /// Name of the condition.
    pub condition: String,
    /// What is degraded, if anything is.
    pub degraded: Option<String>,
    /// Name of the map.
    pub map: String,
    /// Whether the network flew compiled.
    pub on_chip: bool,
    /// Printed rate.
    pub printed: Option<f64>,
    /// What flew, one for each seed of the training.
    pub trained: Vec<Trained>,
    /// Networks that have been trained, and have not flown here.
    #[serde(default)]
    pub not_flown: Vec<String>,
    /// Networks that have been trained, and that the compiler refuses.
    #[serde(default)]
    pub refused: Vec<String>,
    /// Networks that have not been trained.
    pub missing: Vec<String>,
}

/// One trained network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trained {
    /// Its name.
    pub network: String,
    /// Goals reached with each seed of the evaluation.
    pub success: Vec<usize>,
    /// Trials of each.
    pub trials: usize,
}

/// The difference between two rows of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The row that it starts from.
    pub from: String,
    /// The row that it ends at.
    pub to: String,
    /// Name of the condition.
    pub condition: String,
    /// Name of the map.
    pub map: String,
    /// Printed difference.
    pub printed: Option<f64>,
    /// Ours; `None` when a row has not been flown.
    pub here: Option<f64>,
    /// Standard error of ours.
    pub standard_error: Option<f64>,
}

/// What a decision of one network costs on the chip.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CostRow {
    /// The network.
    pub network: String,
    /// Why it does not go onto the chip.
    pub refused: Option<String>,
    /// Cores in use.
    pub cores: u64,
    /// Decisions that the costs are a mean of.
    pub decisions: u64,
    /// Synaptic operations of all decisions.
    pub synaptic_ops: u64,
    /// Name of a cost table; dynamic energy (fJ) and chip time (ps) of all decisions.
    pub costs: Vec<(String, u64, u64)>,
    /// Goals reached, and trials.
    pub success: [usize; 2],
    /// What the network does in floats, if that was counted.
    #[serde(default)]
    pub counted: Option<CountedOps>,
}

/// Sums and products of a network as it is, in the accounting `exact` ([`crate::cost`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CountedOps {
    /// Control ticks.
    pub ticks: u64,
    /// Operations of all of them.
    pub ops: Ops,
}

impl Trained {
    fn rate(&self) -> f64 {
        let trials = self.trials * self.success.len();
        self.success.iter().sum::<usize>() as f64 / trials.max(1) as f64
    }
}

impl RateRow {
    /// Mean over all trainings and seeds; `None` when nothing was flown.
    pub fn mean(&self) -> Option<f64> {
        let rates = self.trained.iter().map(Trained::rate);
        (!self.trained.is_empty()).then(|| rates.sum::<f64>() / self.trained.len() as f64)
    }

    /// Standard deviation over trainings; `None` for fewer than two.
    pub fn spread(&self) -> Option<f64> {
        let (mean, n) = (self.mean()?, self.trained.len());
        let square = |trained: &Trained| (trained.rate() - mean).powi(2);
        let sum = self.trained.iter().map(square).sum::<f64>();
        (n >= 2).then(|| (sum / (n - 1) as f64).sqrt())
    }

    /// Standard error of the mean: from the spread over trainings, but at least what the number of
    /// trials gives, for a few trainings are close together by chance now and then. A single
    /// training has the latter alone, which leaves out what another training would change.
    pub fn standard_error(&self) -> Option<f64> {
        let mean = self.mean()?;
        let trials: usize = self.trained.iter().map(|t| t.trials * t.success.len()).sum();
        let of_trials = (mean * (1.0 - mean) / trials.max(1) as f64).sqrt();
        let of_trainings = self.spread().map(|spread| spread / (self.trained.len() as f64).sqrt());
        Some(of_trainings.map_or(of_trials, |error| error.max(of_trials)))
    }
}

impl Reproduction {
    /// What is wrong with one that was read.
    ///
    /// Errors: another format; a network without trials.
    pub fn check(&self) -> Result<(), String> {
        if self.format != REPRODUCTION_FORMAT {
            return Err(format!("format {}, {REPRODUCTION_FORMAT} expected", self.format));
        }
        let rows = self.reproduced.iter().flat_map(|part| &part.rows);
        let mut trained = rows.flat_map(|row| &row.trained);
        let damaged = |t: &&Trained| t.success.iter().any(|n| *n > t.trials);
        match trained.find(damaged) {
            Some(t) => Err(format!("{}: more goals than the {} trials", t.network, t.trials)),
            None => Ok(()),
        }
    }
}

impl CostRow {
    /// Adds what the compiled network did in whole cells of one condition and map.
    pub fn add(&mut self, table: &SuccessTable, condition: &str, map: &str) {
        let name = format!("{ON_CHIP}{}", self.network);
        let same = |cell: &&Cell| {
            cell.network == name
                && cell.condition == condition
                && cell.map == map
                && cell.degraded.is_none()
        };
        for summary in table.cells.iter().filter(same).map(|cell| &cell.summary) {
            self.success[0] += summary.success;
            self.success[1] += summary.trials;
            self.decisions = self.decisions.saturating_add(summary.decisions);
            let Some(chip) = &summary.chip else { continue };
            self.synaptic_ops = self.synaptic_ops.saturating_add(synaptic_ops(&chip.counters));
            for (name, cost) in &chip.costs {
                let place = self.costs.iter().position(|(known, _, _)| known == name);
                let place = place.unwrap_or_else(|| {
                    self.costs.push((name.clone(), 0, 0));
                    self.costs.len() - 1
                });
                let (_, energy_fj, time_ps) = &mut self.costs[place];
                *energy_fj = energy_fj.saturating_add(cost.dynamic_fj);
                *time_ps = time_ps.saturating_add(cost.time_ps);
            }
        }
    }
}

/// The cells of `table` that a printed table asks for. `is_trained` tells which networks there are.
pub fn reproduced(
    printed: &PrintedTable,
    table: &SuccessTable,
    is_trained: &dyn Fn(&str) -> bool,
) -> Reproduced {
    let mut rows = Vec::new();
    let mut steps = Vec::new();
    for condition in printed.conditions {
        for (at, map) in printed.maps.iter().enumerate() {
            let place = CONDITIONS.iter().position(|known| known.name == *condition);
            let row = |row: &PrintedRow| {
                let figure = place.and_then(|place| row.printed[place][at]);
                let under = Flown { condition, degraded: None, map, on_chip: false };
                rate_row(row, figure, &under, table, is_trained)
            };
            let some: Vec<RateRow> = printed.rows.iter().map(row).collect();
            steps.extend(printed.steps.iter().map(|(from, to)| step(&some[*from], &some[*to])));
            rows.extend(some);
        }
    }
    let (name, title) = (printed.name.to_owned(), printed.title.to_owned());
    Reproduced { name, title, rows, steps }
}

/// Every trained method in every degraded condition, in floats and compiled, on map 1 past movers.
/// `is_refused` tells which networks the compiler does not take.
pub fn degraded(
    table: &SuccessTable,
    is_trained: &dyn Fn(&str) -> bool,
    is_refused: &dyn Fn(&str) -> bool,
) -> Reproduced {
    let mut rows = Vec::new();
    let kinds = [None].into_iter().chain(DEGRADATIONS.iter().map(|kind| Some(kind.name)));
    for degraded in kinds {
        for on_chip in [false, true] {
            let under = Flown { condition: CONDITIONS[0].name, degraded, map: "map1", on_chip };
            let there =
                SUCCESS.rows.iter().filter(|row| row.networks.iter().any(|n| is_trained(n)));
            rows.extend(there.map(|row| {
                let mut row = rate_row(row, None, &under, table, is_trained);
                let no = |name: &mut String| name.strip_prefix(ON_CHIP).is_some_and(is_refused);
                row.refused = row.not_flown.extract_if(.., no).collect();
                row
            }));
        }
    }
    let title = "Degraded conditions, past movers on map 1".to_owned();
    Reproduced { name: "degraded".to_owned(), title, rows, steps: Vec::new() }
}

/// What cells were flown under.
struct Flown<'a> {
    condition: &'a str,
    degraded: Option<&'a str>,
    map: &'a str,
    on_chip: bool,
}

fn rate_row(
    row: &PrintedRow,
    printed: Option<f64>,
    under: &Flown,
    table: &SuccessTable,
    is_trained: &dyn Fn(&str) -> bool,
) -> RateRow {
    let (mut trained, mut not_flown) = (Vec::new(), Vec::new());
    for network in row.networks {
        let name = if under.on_chip { format!("{ON_CHIP}{network}") } else { network.to_string() };
        let same = |cell: &&Cell| {
            cell.network == name
                && cell.map == under.map
                && cell.condition == under.condition
                && cell.degraded.as_deref() == under.degraded
        };
        let cells: Vec<&Cell> = table.cells.iter().filter(same).collect();
        if !cells.is_empty() {
            let success = cells.iter().map(|cell| cell.summary.success).collect();
            trained.push(Trained { network: name, success, trials: table.settings.trials });
        } else if is_trained(network) {
            not_flown.push(name);
        }
    }
    let missing = row.networks.iter().filter(|name| !is_trained(name));
    RateRow {
        label: row.label.to_owned(),
        condition: under.condition.to_owned(),
        degraded: under.degraded.map(str::to_owned),
        map: under.map.to_owned(),
        on_chip: under.on_chip,
        printed,
        trained,
        not_flown,
        refused: Vec::new(),
        missing: missing.map(|name| (*name).to_owned()).collect(),
    }
}

fn step(from: &RateRow, to: &RateRow) -> Step {
    let both = |of: fn(&RateRow) -> Option<f64>| of(from).zip(of(to));
    Step {
        from: from.label.clone(),
        to: to.label.clone(),
        condition: to.condition.clone(),
        map: to.map.clone(),
        printed: both(|row| row.printed).map(|(from, to)| to - from),
        here: both(RateRow::mean).map(|(from, to)| to - from),
        standard_error: both(RateRow::standard_error).map(|(from, to)| from.hypot(to)),
    }
}

/// Rates as text; rows that were not flown say so.
pub fn rate_table(reproduced: &Reproduced) -> Table {
    let mut table = plain(&[
        "condition",
        "map",
        "method",
        "paper",
        "here",
        "s.e.",
        "spread",
        "trainings, each seed",
    ]);
    for row in &reproduced.rows {
        let condition = match &row.degraded {
            None => row.condition.clone(),
            Some(degraded) => format!("{}, {degraded}", row.condition),
        };
        let method = if row.on_chip { format!("{}, chip", row.label) } else { row.label.clone() };
        let each = match (row.trained.is_empty(), row.missing.is_empty()) {
            (true, false) => {
                let there = if row.not_flown.is_empty() { "" } else { "not flown; " };
                format!("{there}not trained: {}", row.missing.join(", "))
            }
            (true, true) if row.not_flown.is_empty() && !row.refused.is_empty() => {
                "refused by the compiler".to_owned()
            }
            (true, true) => "not flown".to_owned(),
            (false, _) => {
                let open = [
                    (&row.not_flown, "not flown"),
                    (&row.refused, "refused"),
                    (&row.missing, "not trained"),
                ];
                let open = open.iter().filter(|(names, _)| !names.is_empty());
                let open = open.map(|(names, what)| format!("{} {what}", names.len()));
                row.trained.iter().map(each_seed).chain(open).collect::<Vec<_>>().join("; ")
            }
        };
        let numbers = [row.printed, row.mean(), row.standard_error(), row.spread()];
        let numbers = numbers.map(|number| number.map_or_else(dash, |n| format!("{n:.3}")));
        table
            .add_row([condition, row.map.clone(), method].into_iter().chain(numbers).chain([each]));
    }
    table
}

fn each_seed(trained: &Trained) -> String {
    let rate = |success: &usize| format!("{:.3}", *success as f64 / trained.trials.max(1) as f64);
    trained.success.iter().map(rate).collect::<Vec<_>>().join(" ")
}

/// Means as bars, a dot for each training, beside what the paper prints; `None` when nothing was
/// flown.
pub fn rate_bars(reproduced: &Reproduced) -> Option<String> {
    let several = |of: fn(&RateRow) -> &String| {
        reproduced.rows.iter().any(|row| of(row) != of(&reproduced.rows[0]))
    };
    let (maps, conditions) = (several(|row| &row.map), several(|row| &row.condition));
    let mut rows = Vec::new();
    for row in &reproduced.rows {
        let parts = [
            Some(row.label.as_str()),
            row.on_chip.then_some("chip"),
            maps.then_some(row.map.as_str()),
            conditions.then_some(row.condition.as_str()),
            row.degraded.as_deref(),
        ];
        let label = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        if let Some(mean) = row.mean() {
            rows.push(Bar {
                label,
                values: vec![mean],
                dots: row.trained.iter().map(Trained::rate).collect(),
                said: format!("{mean:.3}"),
            });
        }
        if let Some(printed) = row.printed {
            let (values, said) = (vec![0.0, printed], format!("{printed:.3}"));
            rows.push(Bar {
                label: format!("{}, paper", row.label),
                values,
                said,
                ..Bar::default()
            });
        }
    }
    let flown = reproduced.rows.iter().any(|row| !row.trained.is_empty());
    let title = "Share of trials that reached the goal (dots: trainings)";
    flown.then(|| bars(title, &["here", "paper"], &rows, Some(1.0)))
}

/// Differences as text.
pub fn step_table(reproduced: &Reproduced) -> Option<Table> {
    let mut table = plain(&["condition", "map", "from", "to", "paper", "here", "s.e."]);
    for step in &reproduced.steps {
        let signed = |number: Option<f64>| number.map_or_else(dash, |n| format!("{n:+.3}"));
        let error = step.standard_error.map_or_else(dash, |n| format!("{n:.3}"));
        let names = [&step.condition, &step.map, &step.from, &step.to].map(String::clone);
        let numbers = [signed(step.printed), signed(step.here), error];
        table.add_row(names.into_iter().chain(numbers));
    }
    (!reproduced.steps.is_empty()).then_some(table)
}

/// Operations as text; energy is of the arithmetic alone, were it done by digital units.
pub fn counted_table(rows: &[CostRow]) -> Table {
    let tables = ArithmeticTable::all();
    let priced = tables.iter().map(|table| format!("{} (uJ)", table.name));
    let header: Vec<String> =
        ["network", "sums", "products"].map(str::to_owned).into_iter().chain(priced).collect();
    let mut table = plain(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for (row, counted) in rows.iter().filter_map(|row| Some((row, row.counted?))) {
        let ticks = counted.ticks.max(1) as f64;
        let number = |n: u64| format!("{:.0}", n as f64 / ticks);
        let ops = counted.ops;
        let cells = [row.network.clone(), number(ops.additions), number(ops.multiplications)];
        let energy = tables.iter().map(|table| table.energy_pj(&ops) / 1e6 / ticks);
        table.add_row(cells.into_iter().chain(energy.map(|uj| format!("{uj:.3}"))));
    }
    table
}

/// Costs as text.
pub fn cost_rows_table(rows: &[CostRow]) -> Table {
    let mut names: Vec<&str> = Vec::new();
    for (name, _, _) in rows.iter().flat_map(|row| &row.costs) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let priced = names.iter().flat_map(|name| [format!("{name} (uJ)"), format!("{name} (us)")]);
    let header: Vec<String> = ["network", "goals", "cores", "syn. ops"]
        .map(str::to_owned)
        .into_iter()
        .chain(priced)
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table = plain(&header);
    for row in rows {
        let decisions = row.decisions.max(1) as f64;
        let mut cells = vec![row.network.clone()];
        if row.refused.is_some() {
            cells.extend(["not on this chip".to_owned(), dash(), dash()]);
        } else if row.decisions == 0 {
            cells.extend(["not flown".to_owned(), row.cores.to_string(), dash()]);
        } else {
            cells.push(format!("{}/{}", row.success[0], row.success[1]));
            cells.push(row.cores.to_string());
            cells.push(format!("{:.0}", row.synaptic_ops as f64 / decisions));
        }
        for name in &names {
            let cost = row.costs.iter().find(|(known, _, _)| known == name);
            cells.push(cost.map_or_else(dash, |(_, energy_fj, _)| micro(*energy_fj, decisions)));
            let us = |ps: u64| format!("{:.1}", ps as f64 / 1e6 / decisions);
            cells.push(cost.map_or_else(dash, |(_, _, time_ps)| us(*time_ps)));
        }
        table.add_row(cells);
    }
    table
}

fn dash() -> String {
    "-".to_owned()
}

#[cfg(test)]
#[path = "reproduction_tests.rs"]
mod tests;
