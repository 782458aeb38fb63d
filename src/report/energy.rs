//! What decisions cost on the chip, beside the arithmetic of the artificial counterpart.

use comfy_table::Table;

use crate::cost::{ArithmeticTable, Ops};
use crate::report::results::{Cost, DriverResult, Summary};
use crate::report::success::{SuccessTable, grouped};
use crate::report::tables::{micro, plain};

/// Below a table of energies.
pub const ENERGY_NOTE: &str = "\
ANN: the same layers without spikes, row (iv) of Table 5 in the accounting `exact`, every frame and
step computed. Its energy is that of its products and sums alone, without memory; the chip's is
dynamic, without static power, host and input.";

/// A row: what it is about, and the summaries that it is the mean of.
type Row<'a> = (Vec<String>, Vec<&'a Summary>);

/// Energy and time per decision of the compiled EEM-SANs among `drivers`; `None` when there is none.
pub fn driver_energy(drivers: &[DriverResult]) -> Option<Table> {
    let drivers = drivers.iter().filter(|driver| driver.summary.artificial.is_some());
    let row = |d: &'_ DriverResult| vec![d.label.clone(), d.seed.to_string()];
    let rows = drivers.map(|driver| (row(driver), vec![&driver.summary]));
    energy_table(&["driver", "seed"], rows.collect())
}

/// The same for each condition, network and map, mean of all seeds.
pub fn success_energy(table: &SuccessTable) -> Option<Table> {
    energy_table(&["condition", "network", "map"], grouped(table))
}

fn energy_table(header: &[&str], rows: Vec<Row>) -> Option<Table> {
    let rows: Vec<Row> =
        rows.into_iter().filter(|(_, s)| s.iter().any(|s| s.chip.is_some())).collect();
    let mut names: Vec<&String> = Vec::new();
    for name in
        rows.iter().flat_map(|(_, s)| s.iter()).flat_map(|s| &s.chip).flat_map(|c| c.costs.keys())
    {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let arithmetic = ArithmeticTable::all();
    let mut titles: Vec<String> = header.iter().map(|title| (*title).to_owned()).collect();
    titles.extend(names.iter().flat_map(|name| [format!("{name} (uJ)"), format!("{name} (us)")]));
    titles.push("ANN products".to_owned());
    titles.extend(arithmetic.iter().map(|table| format!("{} (uJ)", table.name)));
    let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
    let mut table = plain(&titles);
    for (label, summaries) in &rows {
        let decisions = summaries.iter().fold(0u64, |sum, s| sum.saturating_add(s.decisions));
        let decisions = decisions.max(1) as f64;
        let mut row = label.clone();
        for name in &names {
            row.extend(priced(summaries, name, decisions));
        }
        row.extend(artificial(summaries.iter().find_map(|s| s.artificial), &arithmetic));
        table.add_row(row);
    }
    (!rows.is_empty()).then_some(table)
}

/// Energy and time per decision by the cost table of this name; dashes when their chip has none of
/// that name.
fn priced(summaries: &[&Summary], name: &str, decisions: f64) -> [String; 2] {
    let costs = || summaries.iter().flat_map(|s| &s.chip).flat_map(|chip| chip.costs.get(name));
    if costs().next().is_none() {
        return ["-".to_owned(), "-".to_owned()];
    }
    let sum = |of: fn(&Cost) -> u64| costs().fold(0u64, |sum, cost| sum.saturating_add(of(cost)));
    let time_ps = sum(|cost| cost.time_ps) as f64;
    [micro(sum(|cost| cost.dynamic_fj), decisions), format!("{:.1}", time_ps / decisions / 1e6)]
}

/// Products and energy by each table; dashes without a counterpart.
fn artificial(ops: Option<Ops>, tables: &[ArithmeticTable]) -> Vec<String> {
    let Some(ops) = ops else { return vec!["-".to_owned(); 1 + tables.len()] };
    let energy = tables.iter().map(|table| format!("{:.2}", table.energy_pj(&ops) / 1e6));
    [ops.multiplications.to_string()].into_iter().chain(energy).collect()
}

/// How fast the emulated chip was: its own time and decisions per second of wall-clock time.
/// `None` for a driver without a chip. Differs from run to run.
pub fn speed_line(driver: &DriverResult) -> Option<String> {
    let chip = driver.summary.chip.as_ref()?;
    let per_s = driver.decisions_per_s;
    let wall_s = driver.summary.decisions as f64 / per_s.max(1e-9);
    let shares =
        time_shares(chip.costs.iter().map(|(name, cost)| (&name[..], cost.time_ps)), wall_s);
    Some(format!(
        "{per_s:.1} decisions/s of wall-clock time, world and all threads included; {shares}"
    ))
}

/// Chip time by each cost table for one second of wall-clock time.
pub fn time_shares<'a>(times_ps: impl Iterator<Item = (&'a str, u64)>, wall_s: f64) -> String {
    let share = |(name, time_ps): (&str, u64)| {
        format!("{:.5} ({name})", time_ps as f64 / 1e12 / wall_s.max(1e-9))
    };
    let shares: Vec<String> = times_ps.map(share).collect();
    format!("chip time / wall-clock time {}", shares.join(", "))
}

#[cfg(test)]
#[path = "energy_tests.rs"]
mod tests;
