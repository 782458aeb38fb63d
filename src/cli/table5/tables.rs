//! Table 5 as text and as JSON.

use serde_json::{Value, json};
use spikeloop::cost::{
    Activity, ArithmeticTable, Counts, Modules, Ops, PRINTED, RATIOS, Row, Shape,
    implied_decision_rate, implied_encoder_rate,
};
use spikeloop::report::tables::plain;

use super::{Measured, UNTRAINED};
use crate::cli::Failure;
use crate::cli::args::Table5Args;
use crate::cli::output::{REVISION, say};

pub(super) fn print(
    args: &Table5Args,
    shape: &Shape,
    measured: &Measured,
    differing: &[Row],
) -> Result<(), Failure> {
    say(format_args!(
        "{} in arena {} at up to {} m/s: {} control ticks of {} trials; all figures are means per \
         tick",
        args.network, args.arena, args.v_max, measured.ticks, measured.trials
    ))?;
    if args.network == UNTRAINED {
        say("the weights are random: spike rates are those of no network that drives")?;
    }
    say(ops_table(measured))?;
    let [additions, multiplications] = ratios(&measured.counts);
    say(format_args!(
        "(iv) over (i) in the paper's accounting: {additions:.2} additions (paper {}), \
         {multiplications:.2} multiplications (paper {}, from its rounded figures)",
        RATIOS.0, RATIOS.1
    ))?;
    say(neurobench_table(measured))?;
    let prices = ArithmeticTable::float32();
    say(format_args!(
        "energy by {}: {} pJ per addition or AC and {} pJ per multiplication, so {:.1} pJ per MAC \
         ({}); without memory, and not what the chip takes",
        prices.name,
        prices.addition_pj,
        prices.multiplication_pj,
        prices.mac_pj(),
        prices.source
    ))?;
    say(rate_table(shape, measured))?;
    say("artificial modules take the spiking network's weights: their NeuroBench figures are of \
         untrained networks")?;
    say(agreement(differing))
}

fn agreement(differing: &[Row]) -> String {
    if differing.is_empty() {
        return "counted execution and closed form agree exactly in all rows and accountings"
            .to_owned();
    }
    let rows: Vec<&str> = differing.iter().map(|row| row.number()).collect();
    format!(
        "counted execution and closed form differ in {}; weights that are 0 make NeuroBench's \
         effective operations fewer, anything else is an error of this program",
        rows.join(", ")
    )
}

fn named(counts: &Counts) -> [(&'static str, Ops); 3] {
    [("paper", counts.paper), ("exact", counts.exact), ("chip", counts.chip)]
}

fn ops_table(measured: &Measured) -> String {
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
    let first = named(&Row::SpikingSpiking.counts(&measured.counts));
    for (row, printed) in Row::ALL.into_iter().zip(PRINTED) {
        let counts = row.counts(&measured.counts);
        for ((name, ops), (_, first)) in named(&counts).into_iter().zip(first) {
            let paper = |value: f64| match name {
                "paper" => format!("{:.2}e7", value / 1e7),
                _ => "-".to_owned(),
            };
            table.add_row([
                row.number().to_owned(),
                row.modules().to_owned(),
                name.to_owned(),
                grouped(ops.additions, measured.ticks),
                grouped(ops.multiplications, measured.ticks),
                paper(printed.additions),
                paper(printed.multiplications),
                format!("{:.2}", ratio(ops.additions, first.additions)),
                format!("{:.2}", ratio(ops.multiplications, first.multiplications)),
                format!("{:.1}", uj(ops.additions, ops.multiplications, measured.ticks)),
            ]);
        }
    }
    table.to_string()
}

fn neurobench_table(measured: &Measured) -> String {
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
    for row in Row::ALL {
        let n = row.counts(&measured.counts).neurobench;
        let each = |count: u64| grouped(count, measured.ticks);
        let energy = uj(n.effective_acs + n.effective_macs, n.effective_macs, measured.ticks);
        table.add_row([
            row.number().to_owned(),
            row.modules().to_owned(),
            each(n.dense),
            each(n.effective_macs),
            each(n.effective_acs),
            each(n.membrane_updates),
            each(n.membrane_updates_dense),
            format!("{energy:.1}"),
        ]);
    }
    table.to_string()
}

/// A layer's spikes, and what the paper's additions imply.
struct Rate {
    layer: String,
    neurons: u64,
    spikes: u64,
    steps: u64,
    implied: Option<f64>,
}

impl Rate {
    fn per_step(&self) -> f64 {
        ratio(self.spikes, self.neurons * self.steps)
    }
}

fn rates(shape: &Shape, measured: &Measured) -> Vec<Rate> {
    let (encoder, decision) =
        (&measured.activity.spiking_encoder, &measured.activity.spiking_decision);
    let frames = measured.ticks * shape.frames;
    let steps = measured.ticks * shape.steps;
    let pixels = shape.encoder.first().map_or(0, |layer| layer.side * layer.side);
    let rate = |layer: String, neurons: u64, spikes: u64, steps: u64, implied: Option<f64>| Rate {
        layer,
        neurons,
        spikes,
        steps,
        implied,
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

fn rate_table(shape: &Shape, measured: &Measured) -> String {
    let mut table =
        plain(&["layer", "neurons", "spikes per tick", "rate per step", "implied by the paper"]);
    for rate in rates(shape, measured) {
        table.add_row([
            rate.layer.clone(),
            rate.neurons.to_string(),
            format!("{:.1}", ratio(rate.spikes, measured.ticks)),
            format!("{:.4}", rate.per_step()),
            rate.implied.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}")),
        ]);
    }
    table.to_string()
}

pub(super) fn as_json(
    args: &Table5Args,
    shape: &Shape,
    measured: &Measured,
    differing: &[Row],
) -> Value {
    let rows = Row::ALL.into_iter().zip(PRINTED).map(|(row, printed)| {
        json!({
            "row": row.number(),
            "modules": row.modules(),
            "totals": row.counts(&measured.counts),
            "paper_prints": {
                "additions": printed.additions,
                "multiplications": printed.multiplications,
            },
            "equals_closed_form": !differing.contains(&row),
        })
    });
    let rates = rates(shape, measured).into_iter().map(|rate| {
        json!({
            "layer": rate.layer,
            "neurons": rate.neurons,
            "spikes": rate.spikes,
            "rate_per_step": rate.per_step(),
            "implied_by_paper": rate.implied,
        })
    });
    let [additions, multiplications] = ratios(&measured.counts);
    let prices = ArithmeticTable::float32();
    json!({
        "revision": REVISION,
        "seed": args.seed,
        "network": args.network,
        "random_weights": args.network == UNTRAINED,
        "arena": args.arena,
        "v_max_m_per_s": args.v_max,
        "ticks": measured.ticks,
        "trials": measured.trials,
        "rows": rows.collect::<Vec<_>>(),
        "ratios": {
            "additions": additions,
            "multiplications": multiplications,
            "paper_additions": RATIOS.0,
            "paper_multiplications": RATIOS.1,
        },
        "rates": rates.collect::<Vec<_>>(),
        "activity": measured.activity,
        "shape": shape,
        "energy_pj": {
            "addition": prices.addition_pj,
            "multiplication": prices.multiplication_pj,
            "source": prices.source,
        },
    })
}

/// Row (iv) over row (i) in the paper's accounting.
fn ratios(counts: &Modules<Counts>) -> [f64; 2] {
    let [one, four] =
        [Row::SpikingSpiking, Row::ArtificialArtificial].map(|row| row.counts(counts).paper);
    [ratio(four.additions, one.additions), ratio(four.multiplications, one.multiplications)]
}

fn ratio(a: u64, b: u64) -> f64 {
    a as f64 / b.max(1) as f64
}

fn uj(additions: u64, multiplications: u64, ticks: u64) -> f64 {
    let pj = ArithmeticTable::float32().energy_pj(&Ops { additions, multiplications });
    pj * 1e-6 / ticks.max(1) as f64
}

/// A mean, rounded, its digits in groups of three.
fn grouped(total: u64, ticks: u64) -> String {
    let digits = ((total + ticks / 2) / ticks.max(1)).to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
