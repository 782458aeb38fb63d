//! The paper's tables beside ours.

use crate::report::document::{Content, Report};
use crate::report::page::html::{Section, heading, paragraph, picture, table};
use crate::report::plot::escape;
use crate::report::reproduction::{
    cost_rows_table, counted_table, rate_bars, rate_table, step_table,
};

pub(super) fn section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        let Content::Reproduction(result) = &item.content else { continue };
        let about = format!(
            "{} trials for each of {} seeds and each training, actuators {}. Printed figures are of \
             maps that are not published. s.e.: standard error; spread: standard deviation over \
             trainings.",
            result.settings.trials,
            result.seeds.len(),
            result.settings.actuators
        );
        body += &paragraph(&escape(&about));
        for part in &result.reproduced {
            body += &heading(&part.title);
            body += &rate_bars(part).map_or_else(String::new, |svg| picture(&svg));
            body += &table(&rate_table(part));
            body += &step_table(part).map_or_else(String::new, |steps| table(&steps));
        }
        if !result.costs.is_empty() {
            body += &heading("Cost of a decision on the chip");
            body += &table(&cost_rows_table(&result.costs));
            for cost in &result.costs {
                if let Some(why) = &cost.refused {
                    body += &paragraph(&escape(why));
                }
            }
            body += &heading("Operations of a decision in floats");
            body += &table(&counted_table(&result.costs));
        }
    }
    Section { id: "reproduction", title: "The paper's tables", body }
}
