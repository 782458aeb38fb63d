//! Table 5 as data and as tables: what a decision costs beside artificial counterparts.

use comfy_table::Table;
use serde::{Deserialize, Serialize};

use crate::cost::{
    Activity, ArithmeticTable, Counts, Modules, Ops, PRINTED, RATIOS, Row, Shape,
    implied_decision_rate, implied_encoder_rate,
};
use crate::report::tables::plain;

/// What `table5 --json` writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table5Result {
    /// Revision of the program.
    pub revision: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// The network as it was typed.
    pub network: String,
    /// Whether its weights are random: its spike rates are those of no network that drives.
    pub random_weights: bool,
    /// The arena as it was typed.
    pub arena: String,
    /// Fastest wheel speed.
    pub v_max_m_per_s: f64,
    /// Control ticks counted.
    pub ticks: u64,
    /// Trials flown to fill them.
    pub trials: usize,
    /// Rows (i) to (iv).
    pub rows: Vec<Table5Row>,
    /// Row (iv) over row (i).
    pub ratios: Ratios,
    /// Spike rates of the layers.
    pub rates: Vec<Rate>,
    /// What the closed form was given.
    pub activity: Modules<Activity>,
    /// Sizes of the network.
    pub shape: Shape,
    /// Prices of arithmetic.
    pub energy_pj: ArithmeticPrices,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table5Row {
    /// Its number in the paper.
    pub row: String,
    /// What encodes and what decides.
    pub modules: String,
    /// Counts over all ticks.
    pub totals: Counts,
    /// What the paper prints, per tick.
    pub paper_prints: PaperPrints,
    /// Whether counted execution and closed form agree.
    pub equals_closed_form: bool,
}

/// The paper's figures of a row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PaperPrints {
    /// Additions.
    pub additions: f64,
    /// Multiplications.
    pub multiplications: f64,
}

/// Row (iv) over row (i) in the paper's accounting, here and in the paper's text.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Ratios {
    pub additions: f64,
    pub multiplications: f64,
    pub paper_additions: f64,
    pub paper_multiplications: f64,
}

/// A layer's spikes, and what the paper's additions imply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Name.
    pub layer: String,
    /// Neurons.
    pub neurons: u64,
    /// Spikes over all ticks.
    pub spikes: u64,
    /// Spikes per neuron and step.
    pub rate_per_step: f64,
    /// The rate that the paper's additions imply.
    pub implied_by_paper: Option<f64>,
}

/// Energy of arithmetic alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArithmeticPrices {
    /// Name of the table of prices.
    #[serde(default)]
    pub name: String,
    /// Of an addition (pJ).
    pub addition: f64,
    /// Of a multiplication (pJ).
    pub multiplication: f64,
    /// Where the prices come from.
    pub source: String,
}

impl ArithmeticPrices {
    /// Of 32-bit floats.
    pub fn float32() -> Self {
        let ArithmeticTable { name, source, multiplication_pj, addition_pj } =
            ArithmeticTable::float32();
        Self { name, source, addition: addition_pj, multiplication: multiplication_pj }
    }
}

/// All rows beside the paper's; those in `differing` are not what the closed form says.
pub fn rows(counts: &Modules<Counts>, differing: &[Row]) -> Vec<Table5Row> {
    let row = |(row, printed): (Row, crate::cost::Printed)| Table5Row {
        row: row.number().to_owned(),
        modules: row.modules().to_owned(),
        totals: row.counts(counts),
        paper_prints: PaperPrints {
            additions: printed.additions,
            multiplications: printed.multiplications,
        },
        equals_closed_form: !differing.contains(&row),
    };
    Row::ALL.into_iter().zip(PRINTED).map(row).collect()
}

/// Row (iv) over row (i).
pub fn ratios(counts: &Modules<Counts>) -> Ratios {
    let [one, four] =
        [Row::SpikingSpiking, Row::ArtificialArtificial].map(|row| row.counts(counts).paper);
    Ratios {
        additions: ratio(four.additions, one.additions),
        multiplications: ratio(four.multiplications, one.multiplications),
        paper_additions: RATIOS.0,
        paper_multiplications: RATIOS.1,
    }
}

/// Spike rates of inputs and layers over `ticks` control ticks.
pub fn rates(shape: &Shape, activity: &Modules<Activity>, ticks: u64) -> Vec<Rate> {
    let (encoder, decision) = (&activity.spiking_encoder, &activity.spiking_decision);
    let (frames, steps) = (ticks * shape.frames, ticks * shape.steps);
    let pixels = shape.encoder.first().map_or(0, |layer| layer.side * layer.side);
    let rate = |layer: String, neurons: u64, spikes: u64, steps: u64, implied: Option<f64>| Rate {
        layer,
        neurons,
        spikes,
        rate_per_step: ratio(spikes, neurons * steps),
        implied_by_paper: implied,
    };
    let arrivals = |activity: &Activity, layer: usize| {
        activity.layers.get(layer).map_or(0, |traffic| traffic.arrivals)
    };
    let mut all = vec![rate("event frame".into(), pixels, arrivals(encoder, 0), frames, None)];
    for (k, (layer, fired)) in shape.encoder.iter().zip(&encoder.fired).enumerate() {
        let implied = (k + 1 < shape.encoder.len()).then(|| implied_encoder_rate(shape));
        all.push(rate(format!("encoder.{}", k + 1), layer.neurons(), *fired, frames, implied));
    }
    let implied = Some(implied_decision_rate(shape));
    for (k, name) in ["population.laser", "population.dvs"].into_iter().enumerate() {
        let spikes = arrivals(decision, k);
        all.push(rate(name.into(), shape.branches[k].inputs, spikes, steps, implied));
    }
    let n = shape.dense_layers().count();
    for (k, (layer, fired)) in shape.dense_layers().zip(&decision.fired).enumerate() {
        let name = match k {
            0 => "fuse.laser".to_owned(),
            1 => "fuse.dvs".to_owned(),
            _ => format!("decision.{}", k - 1),
        };
        let implied = implied.filter(|_| k + 1 < n);
        all.push(rate(name, layer.outputs, *fired, steps, implied));
    }
    all
}

/// Operations per tick in the accountings `paper`, `exact` and `chip`.
pub fn ops_table(result: &Table5Result) -> Table {
    let mut table = plain(&[
        "row",
        "holds",
        "accounting",
        "additions",
        "multiplications",
        "paper: additions",
        "multiplications",
        "x (i): additions",
        "multiplications",
        "energy (uJ)",
    ]);
    let first = result.rows.first().map(|row| named(&row.totals)).unwrap_or_default();
    for row in &result.rows {
        for ((name, ops), (_, first)) in named(&row.totals).into_iter().zip(first) {
            let paper = |value: f64| match name {
                "paper" => format!("{:.2}e7", value / 1e7),
                _ => "-".to_owned(),
            };
            table.add_row([
                row.row.clone(),
                row.modules.clone(),
                name.to_owned(),
                grouped(ops.additions, result.ticks),
                grouped(ops.multiplications, result.ticks),
                paper(row.paper_prints.additions),
                paper(row.paper_prints.multiplications),
                format!("{:.2}", ratio(ops.additions, first.additions)),
                format!("{:.2}", ratio(ops.multiplications, first.multiplications)),
                format!("{:.1}", result.uj(ops.additions, ops.multiplications)),
            ]);
        }
    }
    table
}

/// Operations per tick as NeuroBench counts them.
pub fn neurobench_table(result: &Table5Result) -> Table {
    let mut table = plain(&[
        "row",
        "holds",
        "neurobench: dense",
        "effective MACs",
        "effective ACs",
        "membrane updates",
        "of",
        "energy (uJ)",
    ]);
    for row in &result.rows {
        let n = row.totals.neurobench;
        let each = |count: u64| grouped(count, result.ticks);
        let sums = n.effective_acs.saturating_add(n.effective_macs);
        table.add_row([
            row.row.clone(),
            row.modules.clone(),
            each(n.dense),
            each(n.effective_macs),
            each(n.effective_acs),
            each(n.membrane_updates),
            each(n.membrane_updates_dense),
            format!("{:.1}", result.uj(sums, n.effective_macs)),
        ]);
    }
    table
}

/// Spikes of every layer.
pub fn rate_table(result: &Table5Result) -> Table {
    let mut table =
        plain(&["layer", "neurons", "spikes per tick", "rate per step", "implied by the paper"]);
    for rate in &result.rates {
        table.add_row([
            rate.layer.clone(),
            rate.neurons.to_string(),
            format!("{:.1}", ratio(rate.spikes, result.ticks)),
            format!("{:.4}", rate.rate_per_step),
            rate.implied_by_paper.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}")),
        ]);
    }
    table
}

impl Table5Result {
    /// What was counted, and where.
    pub fn caption(&self) -> String {
        let random = match self.random_weights {
            true => "; the weights are random: spike rates are those of no network that drives",
            false => "",
        };
        format!(
            "{} in arena {} at up to {} m/s: {} control ticks of {} trials; all figures are means \
             per tick{random}",
            self.network, self.arena, self.v_max_m_per_s, self.ticks, self.trials
        )
    }

    /// The paper's two ratios beside its own.
    pub fn ratio_line(&self) -> String {
        let r = &self.ratios;
        format!(
            "(iv) over (i) in the paper's accounting: {:.2} additions (paper {}), {:.2} \
             multiplications (paper {}, from its rounded figures)",
            r.additions, r.paper_additions, r.multiplications, r.paper_multiplications
        )
    }

    /// What the energies are.
    pub fn energy_line(&self) -> String {
        let p = &self.energy_pj;
        format!(
            "energy by {}: {} pJ per addition or AC and {} pJ per multiplication, so {:.1} pJ per \
             MAC ({}); without memory, and not what the chip takes",
            p.name,
            p.addition,
            p.multiplication,
            p.addition + p.multiplication,
            p.source
        )
    }

    /// Whether counted execution and closed form agree.
    pub fn agreement_line(&self) -> String {
        let differing: Vec<&str> =
            self.rows.iter().filter(|r| !r.equals_closed_form).map(|r| r.row.as_str()).collect();
        if differing.is_empty() {
            return "counted execution and closed form agree exactly in all rows and accountings"
                .to_owned();
        }
        format!(
            "counted execution and closed form differ in {}; weights that are 0 make NeuroBench's \
             effective operations fewer, anything else is an error of this program",
            differing.join(", ")
        )
    }

    /// Energy of arithmetic per tick.
    fn uj(&self, additions: u64, multiplications: u64) -> f64 {
        let p = &self.energy_pj;
        let pj = p.addition * additions as f64 + p.multiplication * multiplications as f64;
        pj * 1e-6 / self.ticks.max(1) as f64
    }
}

fn named(counts: &Counts) -> [(&'static str, Ops); 3] {
    [("paper", counts.paper), ("exact", counts.exact), ("chip", counts.chip)]
}

fn ratio(a: u64, b: u64) -> f64 {
    a as f64 / b.max(1) as f64
}

/// A mean, rounded, its digits in groups of three.
fn grouped(total: u64, ticks: u64) -> String {
    let digits = (total.saturating_add(ticks / 2) / ticks.max(1)).to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
