//! How trials ended, and where they went.

use std::fmt::Write;

use comfy_table::Table;

use crate::report::contacts::{CONTACT_NOTE, driver_contacts};
use crate::report::document::{Content, Report};
use crate::report::page::html::{Section, heading, paragraph, picture, table};
use crate::report::plot::{escape, trajectories};
use crate::report::results::{DriveResult, DriverResult};
use crate::report::success::{success_bars, success_table};
use crate::report::tables::{camera_note, micro, outcome_table};

/// What a reader wants to know first, driver by driver.
pub(super) fn summary(report: &Report) -> String {
    let mut cards = String::new();
    for item in &report.items {
        match &item.content {
            Content::Drive(result) => {
                result.drivers.iter().for_each(|d| cards += &driver_card(d, &result.name_of(d)));
            }
            Content::Chip(plan) => {
                let (used, limit) = (plan.cores.used, plan.cores.limit);
                cards += &card(&format!("{used} of {limit}"), &format!("cores of {}", plan.chip));
            }
            Content::Agreement(result) => {
                let a = &result.agreement;
                let share = 100.0 * a.equal_actions as f64 / a.ticks.max(1) as f64;
                cards += &card(&format!("{share:.0} %"), "of actions equal, chip and float");
            }
            _ => {}
        }
    }
    if cards.is_empty() { cards } else { format!("<ul class=\"cards\">{cards}</ul>\n") }
}

fn driver_card(driver: &DriverResult, name: &str) -> String {
    let s = &driver.summary;
    let mut cards =
        card(&format!("{} of {}", s.success, s.trials), &format!("goals reached, {name}"));
    if let Some((name, cost)) = s.chip.as_ref().and_then(|chip| chip.costs.iter().next()) {
        let energy = format!("{} uJ", micro(cost.dynamic_fj, s.decisions.max(1) as f64));
        cards += &card(&energy, &format!("dynamic energy per decision, {name}"));
    }
    cards
}

fn card(figure: &str, about: &str) -> String {
    format!("<li><b>{}</b> {}</li>", escape(figure), escape(about))
}

/// Tables of `evaluate` and of `drive`.
pub(super) fn success_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        match &item.content {
            Content::Success(success) => {
                let s = &success.settings;
                let about = format!(
                    "{} trials per cell, {} Hz, actuators {}. Rows of the paper are its table of \
                     success rates (tab:2); its maps are not published, so compare the order of \
                     rows, not the numbers.",
                    s.trials, s.control_hz, s.actuators
                );
                body += &heading(&item.file);
                body += &paragraph(&escape(&about));
                body += &picture(&success_bars(success));
                body += &table(&success_table(success));
                body += &contacts(success.contact_table());
            }
            Content::Drive(result) => {
                body += &heading(&item.file);
                body += &paragraph(&escape(&caption(result)));
                body += &table(&outcome_table(&result.drivers));
                body += &contacts(driver_contacts(&result.drivers));
            }
            _ => {}
        }
    }
    Section { id: "success", title: "Success", body }
}

/// How trials came to end in contact, where some did with movers.
fn contacts(counts: Option<Table>) -> String {
    counts.map_or_else(String::new, |counts| {
        let about = format!("Trials that ended in contact; {CONTACT_NOTE}");
        table(&counts) + &paragraph(&escape(&about))
    })
}

fn caption(result: &DriveResult) -> String {
    let s = &result.settings;
    format!(
        "Arena {}, {} Hz, v_max {} m/s, actuators {}, {}{}.",
        result.arena.name,
        s.control_hz,
        s.v_max_m_per_s,
        s.actuators,
        result.seeds(),
        camera_note(result)
    )
}

/// Every arena with the ways through it.
pub(super) fn trajectory_section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        if let Content::Drive(result) = &item.content {
            let _ = write!(
                body,
                "{}{}",
                heading(&format!("{}: arena {}", item.file, result.arena.name)),
                picture(&trajectories(result))
            );
        }
    }
    Section { id: "trajectories", title: "Trajectories", body }
}
