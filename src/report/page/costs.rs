//! Operations, energy and time.

use std::collections::BTreeMap;

use crate::report::bars::{Bar, bars};
use crate::report::document::{Content, Report};
use crate::report::energy::{ENERGY_NOTE, driver_energy, success_energy};
use crate::report::page::html::{Section, heading, paragraph, picture, table};
use crate::report::plot::escape;
use crate::report::results::{Cost, CostTableNote, DriveResult, DriverResult};
use crate::report::table5::{neurobench_table, ops_table};
use crate::report::tables::{cost_table, host_line, micro, overflow_line, waiting_lines};

/// What an energy or a time is not.
const NOTE: &str = "Energy is counts times the named cost table, per decision. No table prices the \
barrier's energy; host and management processor are counted below and not priced; modelled time \
leaves out hop latencies and the host. Static power is an upper bound at an unstated operating \
point, a bar of its own and not part of the dynamic energy. \"In windows\" counts only what each \
core did during its own layer's window.";

pub(super) fn table5_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        let Content::Table5(result) = &item.content else { continue };
        body += &heading(&item.file);
        body += &paragraph(&escape(&result.caption()));
        body += &table(&ops_table(result));
        body += &paragraph(&escape(&result.ratio_line()));
        body += &table(&neurobench_table(result));
        body += &paragraph(&escape(&result.energy_line()));
        body += &paragraph(&escape(&result.agreement_line()));
    }
    Section { id: "table5", title: "Operations beside artificial networks (Table 5)", body }
}

pub(super) fn energy_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        if let Content::Success(success) = &item.content
            && let Some(energy) = success_energy(success)
        {
            body += &heading(&item.file);
            body += &table(&energy);
            body += &paragraph(&escape(ENERGY_NOTE));
        }
        let Content::Drive(result) = &item.content else { continue };
        let Some(costs) = cost_table(&result.drivers) else { continue };
        body += &heading(&item.file);
        body += &picture(&bars(
            "Energy per decision",
            &["synapses", "compartments", "network", "static, whole chip"],
            &rows(result, |_, (_, cost), label, n| energy_rows(label, cost, n)),
            None,
        ));
        let layers = slowest_layers(result);
        let names = layers.iter().copied().chain(["other layers", "barriers"]);
        let names: Vec<&str> =
            if layers.is_empty() { vec!["cores", "barriers"] } else { names.collect() };
        let times = |driver: &DriverResult, table: (&str, &Cost), label: &str, n: f64| {
            time_rows(driver, &layers, table, label, n)
        };
        let title = "Modelled chip time per decision, by the layer with the slowest core";
        body += &picture(&bars(title, &names, &rows(result, times), None));
        body += &table(&costs);
        if let Some(energy) = driver_energy(&result.drivers) {
            body += &table(&energy);
            body += &paragraph(&escape(ENERGY_NOTE));
        }
        body += &lines(result);
    }
    if !body.is_empty() {
        body = paragraph(NOTE) + &body;
    }
    Section { id: "energy", title: "Energy and time", body }
}

/// Layers that steps waited for most by any driver and table, at most so many that have a colour.
const LAYERS_MAX: usize = 3;

/// Names of the layers that steps waited for most, the longest first; none in results of before they
/// were counted.
fn slowest_layers(result: &DriveResult) -> Vec<&str> {
    let mut longest: BTreeMap<&str, u64> = BTreeMap::new();
    let of_tables = result.drivers.iter().flat_map(|driver| driver.slowest_layers_ps.values());
    for (layer, ps) in of_tables.flatten() {
        let known = longest.entry(layer).or_default();
        *known = (*known).max(*ps);
    }
    let mut layers: Vec<(&str, u64)> = longest.into_iter().collect();
    layers.sort_by_key(|(_, ps)| core::cmp::Reverse(*ps));
    layers.into_iter().take(LAYERS_MAX).map(|(layer, _)| layer).collect()
}

/// Bars of every driver, seed and cost table; `of` gets driver, table and its cost, label and number of
/// decisions.
fn rows(
    result: &DriveResult,
    of: impl Fn(&DriverResult, (&str, &Cost), &str, f64) -> Vec<Bar>,
) -> Vec<Bar> {
    let mut rows = Vec::new();
    for driver in &result.drivers {
        let Some(chip) = &driver.summary.chip else { continue };
        let n = driver.summary.decisions.max(1) as f64;
        for (name, cost) in &chip.costs {
            let label = format!("{}, {name}", result.name_of(driver));
            rows.extend(of(driver, (name, cost), &label, n));
        }
    }
    rows
}

fn energy_rows(label: &str, cost: &Cost, decisions: f64) -> Vec<Bar> {
    let uj = |fj: u64| fj as f64 / decisions / 1e9;
    let row = |values: [u64; 4], of: &str, label: &str, total: u64| Bar {
        label: label.to_owned(),
        values: values.map(uj).to_vec(),
        said: format!("{} uJ {of}", micro(total, decisions)),
        ..Bar::default()
    };
    let dynamic = [cost.synapses_fj, cost.compartments_fj, cost.network_fj, 0];
    vec![
        row(dynamic, "dynamic", label, cost.dynamic_fj),
        row([0, 0, 0, cost.static_fj], "static", "", cost.static_fj),
    ]
}

/// A bar with the time of each of `layers`, that of all other cores, and that of barriers.
fn time_rows(
    driver: &DriverResult,
    layers: &[&str],
    (table, cost): (&str, &Cost),
    label: &str,
    decisions: f64,
) -> Vec<Bar> {
    let us = |ps: u64| ps as f64 / decisions / 1e6;
    let of_layers = driver.slowest_layers_ps.get(table);
    let of_layer = |layer: &&str| of_layers.and_then(|all| all.get(*layer)).copied().unwrap_or(0);
    let mut parts: Vec<u64> = layers.iter().map(of_layer).collect();
    let shown = parts.iter().fold(cost.barrier_ps, |sum, ps| sum.saturating_add(*ps));
    parts.extend([cost.time_ps.saturating_sub(shown), cost.barrier_ps]);
    vec![Bar {
        label: label.to_owned(),
        values: parts.into_iter().map(us).collect(),
        said: format!("{:.1} us, {:.1} in barriers", us(cost.time_ps), us(cost.barrier_ps)),
        ..Bar::default()
    }]
}

/// Host work, overflows, and what the tables leave out.
fn lines(result: &DriveResult) -> String {
    let mut html = String::new();
    let mut notes: BTreeMap<&str, &CostTableNote> = BTreeMap::new();
    for driver in &result.drivers {
        notes.extend(driver.cost_tables.iter().map(|note| (note.name.as_str(), note)));
        let Some(chip) = &driver.summary.chip else { continue };
        let driver_name = result.name_of(driver);
        if let Some(line) = host_line(chip, driver.summary.decisions) {
            html += &paragraph(&escape(&format!("{driver_name}: host, per decision: {line}.")));
        }
        for line in waiting_lines(driver) {
            html += &paragraph(&escape(&format!("{driver_name}: {line}.")));
        }
        if let Some(line) = overflow_line(chip) {
            html += &paragraph(&escape(&format!("{driver_name}: registers overflowed: {line}")));
        }
    }
    for note in notes.values() {
        let unpriced = match note.unpriced.is_empty() {
            true => "nothing".to_owned(),
            false => note.unpriced.join(", "),
        };
        let source = note.source.trim_end_matches('.');
        let line = format!("{}: {source}. Without a price: {unpriced}.", note.name);
        html += &paragraph(&escape(&line));
    }
    html
}
