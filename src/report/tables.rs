//! Tables for reading.

use comfy_table::{CellAlignment, Table, presets};

use crate::report::results::{ChipResult, DriveResult, DriverResult};

/// How it went: one row per driver and seed. Paths and times are means of the trials that reached
/// the goal.
pub fn outcome_table(drivers: &[DriverResult]) -> Table {
    let mut table = plain(&[
        "driver",
        "seed",
        "success",
        "collision",
        "time-out",
        "path to goal (m)",
        "time to goal (s)",
        "decisions",
        "decisions/s",
    ]);
    for driver in drivers {
        let s = &driver.summary;
        let of_successes = |mean: Option<f64>, digits| {
            mean.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.digits$}"))
        };
        table.add_row([
            driver.label.clone(),
            driver.seed.to_string(),
            format!("{}/{}", s.success, s.trials),
            s.collision.to_string(),
            s.time_out.to_string(),
            of_successes(s.path_m_mean, 2),
            of_successes(s.time_s_mean, 1),
            s.decisions.to_string(),
            format!("{:.0}", driver.decisions_per_s),
        ]);
    }
    table
}

/// `, event camera on for NAME, NAME`; empty when no driver flew with one.
pub fn camera_note(result: &DriveResult) -> String {
    let mut labels: Vec<&str> =
        result.drivers.iter().filter(|d| d.camera).map(|d| d.label.as_str()).collect();
    labels.dedup();
    if labels.is_empty() {
        return String::new();
    }
    format!(", event camera on for {}", labels.join(", "))
}

/// What a decision costs on the chip: one row per driver, seed and cost table. Empty when no chip
/// drove.
pub fn cost_table(drivers: &[DriverResult]) -> Option<Table> {
    let mut table = plain(&[
        "driver",
        "seed",
        "cost table",
        "syn. ops",
        "in windows",
        "updates",
        "spikes",
        "messages",
        "dynamic (uJ)",
        "in windows (uJ)",
        "chip time (us)",
        "static, whole chip (uJ)",
    ]);
    let mut any = false;
    for driver in drivers {
        let Some(chip) = &driver.summary.chip else { continue };
        any = true;
        let n = driver.summary.decisions.max(1) as f64;
        for (name, cost) in &chip.costs {
            table.add_row([
                driver.label.clone(),
                driver.seed.to_string(),
                name.clone(),
                per(synaptic_ops(&chip.counters), n),
                per(synaptic_ops(&chip.windowed_counters), n),
                per(updates(chip), n),
                per(counter(chip, "updates_spiking"), n),
                per(counter(chip, "messages"), n),
                micro(cost.dynamic_fj, n),
                micro(cost.dynamic_windowed_fj, n),
                format!("{:.1}", cost.time_ps as f64 / n / 1e6),
                micro(cost.static_fj, n),
            ]);
        }
    }
    any.then_some(table)
}

/// Registers that overflowed, when any did.
pub fn overflow_line(chip: &ChipResult) -> Option<String> {
    let names =
        ["accumulator_overflows", "current_overflows", "bias_sum_overflows", "voltage_clips"];
    let found: Vec<String> = names
        .iter()
        .filter(|name| counter(chip, name) > 0)
        .map(|name| format!("{name} {}", counter(chip, name)))
        .collect();
    (!found.is_empty()).then(|| found.join(", "))
}

/// Synaptic operations of all forms.
pub fn synaptic_ops(counters: &std::collections::BTreeMap<String, u64>) -> u64 {
    let of_synapses = counters.iter().filter(|(name, _)| name.starts_with("synaptic_ops"));
    of_synapses.fold(0, |sum, (_, n)| sum.saturating_add(*n))
}

/// What host and management processor do for a decision, and the encoder's share of the energy;
/// `None` for a driver that did nothing but inject and read.
pub fn host_line(chip: &ChipResult, decisions: u64) -> Option<String> {
    let of_chip = ["host_injections", "host_reads", "host_resets", "management_writes"];
    let of_chip = of_chip.iter().map(|name| (*name, counter(chip, name)));
    let host = chip.host_counters.iter().map(|(name, n)| (name.as_str(), *n));
    let n = decisions.max(1) as f64;
    let said = |(name, count): (&str, u64)| format!("{name} {:.1}", count as f64 / n);
    let mut parts: Vec<String> =
        host.chain(of_chip).filter(|(_, count)| *count > 0).map(said).collect();
    let share = |(table, cost): (&String, &crate::report::results::Cost)| {
        let share = 100.0 * cost.dynamic_encoder_fj as f64 / cost.dynamic_fj.max(1) as f64;
        (cost.dynamic_encoder_fj > 0).then(|| format!("encoder {share:.1} % of energy ({table})"))
    };
    parts.extend(chip.costs.iter().filter_map(share));
    (!chip.host_counters.is_empty()).then(|| parts.join(", "))
}

/// What the steps of a decision waited for by each cost table: layers with the slowest core, the
/// longest first, then barriers. Nothing when no chip drove.
pub fn waiting_lines(driver: &DriverResult) -> Vec<String> {
    let Some(chip) = &driver.summary.chip else { return Vec::new() };
    let decisions = driver.summary.decisions.max(1) as f64;
    let line = |(table, of_layers): (&String, &std::collections::BTreeMap<String, u64>)| {
        let cost = chip.costs.get(table)?;
        let mut parts: Vec<(&str, u64)> =
            of_layers.iter().map(|(layer, ps)| (layer.as_str(), *ps)).collect();
        parts.sort_by_key(|(_, ps)| core::cmp::Reverse(*ps));
        parts.push(("barriers", cost.barrier_ps));
        let said = |(name, ps): (&str, u64)| {
            let share = 100.0 * ps as f64 / cost.time_ps.max(1) as f64;
            format!("{name} {:.1} us ({share:.0} %)", ps as f64 / decisions / 1e6)
        };
        let parts: Vec<String> = parts.into_iter().map(said).collect();
        Some(format!("steps of a decision wait for {} ({table})", parts.join(", ")))
    };
    driver.slowest_layers_ps.iter().filter_map(line).collect()
}

fn updates(chip: &ChipResult) -> u64 {
    let names = ["updates_inactive", "updates_active", "updates_spiking"];
    names.iter().fold(0, |sum, name| sum.saturating_add(counter(chip, name)))
}

fn counter(chip: &ChipResult, name: &str) -> u64 {
    chip.counters.get(name).copied().unwrap_or(0)
}

fn per(count: u64, decisions: f64) -> String {
    format!("{:.0}", count as f64 / decisions)
}

/// Femtojoules per decision as microjoules, with three digits that say something.
pub fn micro(fj: u64, decisions: f64) -> String {
    let uj = fj as f64 / decisions / 1e9;
    let decimals = if uj >= 1.0 { 2 } else { 5 };
    format!("{uj:.decimals$}")
}

/// Columns of text beside the first one.
const TEXT_COLUMNS: [&str; 3] = ["holds", "cost table", "network"];

/// A table without frills, numbers to the right.
pub fn plain(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_header(header.to_vec());
    for (column, title) in table.column_iter_mut().zip(header).skip(1) {
        if !TEXT_COLUMNS.contains(title) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}
