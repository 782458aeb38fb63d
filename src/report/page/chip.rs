//! What a network takes of the chip and does there.

use crate::report::agreement::{AgreementResult, actions_line, agreement_table};
use crate::report::bars::{Bar, bars};
use crate::report::chip_picture::{activity_picture, chip_picture};
use crate::report::chip_plan::{ChipPlan, layer_table};
use crate::report::document::{Content, Report};
use crate::report::page::html::{Section, heading, paragraph, picture, table};
use crate::report::plot::escape;
use crate::report::table5::rate_table;
use crate::report::thresholds::{thresholds_picture, thresholds_table};

pub(super) fn utilization_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        match &item.content {
            Content::Chip(plan) => body += &plan_html(&item.file, plan),
            Content::Replay(replay) => {
                let Some(plan) = &replay.chip else { continue };
                let known = |other: &ChipPlan| other.map_digest == plan.map_digest;
                if !plans(report).any(known) {
                    body += &plan_html(&item.file, plan);
                }
                body += &paragraph(&escape(&format!(
                    "Activity of the cores over the recorded trials of {}:",
                    replay.driver
                )));
                body += &picture(&activity_picture(plan, &replay.operations_of_cores()));
            }
            _ => {}
        }
    }
    Section { id: "chip", title: "Use of the chip", body }
}

fn plans(report: &Report) -> impl Iterator<Item = &ChipPlan> {
    report.items.iter().filter_map(|item| match &item.content {
        Content::Chip(plan) => Some(plan),
        _ => None,
    })
}

fn plan_html(file: &str, plan: &ChipPlan) -> String {
    let about = format!(
        "{} on {}, policy {}: {} of {} cores. Core map {}.",
        plan.network, plan.chip, plan.policy, plan.cores.used, plan.cores.limit, plan.map_digest
    );
    heading(file)
        + &paragraph(&escape(&about))
        + &picture(&chip_picture(plan, None))
        + &table(&layer_table(plan))
}

pub(super) fn rate_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        match &item.content {
            Content::Table5(result) => {
                let row = |rate: &crate::report::table5::Rate| Bar {
                    label: rate.layer.clone(),
                    values: vec![rate.rate_per_step],
                    dots: rate.implied_by_paper.into_iter().collect(),
                    said: format!("{:.4}", rate.rate_per_step),
                };
                let rows: Vec<Bar> = result.rates.iter().map(row).collect();
                let title = "Spikes per neuron and step (dots: implied by the paper's additions)";
                body += &heading(&item.file);
                body += &picture(&bars(title, &["float network"], &rows, None));
                body += &table(&rate_table(result));
            }
            Content::Agreement(result) => {
                body += &heading(&item.file);
                body += &picture(&rates_of_both(result));
            }
            _ => {}
        }
    }
    Section { id: "rates", title: "Spike rates by layer", body }
}

fn rates_of_both(result: &AgreementResult) -> String {
    let row = |layer: &crate::evaluate::LayerAgreement| {
        let sites = (layer.neurons as f64 * layer.steps as f64).max(1.0);
        let (chip, float) = (layer.chip as f64 / sites, layer.float as f64 / sites);
        Bar {
            label: layer.layer.clone(),
            values: vec![chip],
            dots: vec![float],
            said: format!("{chip:.4}, float {float:.4}"),
        }
    };
    let rows: Vec<Bar> = result.agreement.layers.iter().map(row).collect();
    bars("Spikes per neuron and step (dots: float network)", &["chip"], &rows, None)
}

pub(super) fn threshold_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        let Content::Thresholds(result) = &item.content else { continue };
        body += &heading(&item.file);
        body += &picture(&thresholds_picture(&result.thresholds));
        body += &table(&thresholds_table(&result.thresholds));
    }
    Section { id: "thresholds", title: "Learned thresholds", body }
}

/// After a network's name; nothing where the policy is not known.
fn policy(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(" (policy {name})") }
}

pub(super) fn agreement_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        let Content::Agreement(result) = &item.content else { continue };
        let row = |layer: &crate::evaluate::LayerAgreement| Bar {
            label: layer.layer.clone(),
            values: layer.share().map(|share| 100.0 * share).into_iter().collect(),
            dots: layer.share_in_tick().map(|share| 100.0 * share).into_iter().collect(),
            said: layer
                .share()
                .map_or_else(|| "no spikes".to_owned(), |share| format!("{:.1} %", 100.0 * share)),
        };
        let rows: Vec<Bar> = result.agreement.layers.iter().map(row).collect();
        let title = "Spikes of a neuron on both sides, of its spikes on either (dots: same tick)";
        let about = format!(
            "{}{} in {}, seed {}: {}.",
            result.network,
            policy(&result.policy),
            result.arena,
            result.seed,
            actions_line(&result.agreement, result.trials)
        );
        body += &heading(&item.file);
        body += &paragraph(&escape(&about));
        body += &picture(&bars(title, &["same step (%)"], &rows, Some(100.0)));
        body += &table(&agreement_table(&result.agreement));
    }
    Section { id: "agreement", title: "Chip beside float network", body }
}
