//! One self-contained HTML page from a report: nothing is fetched, and without a script the still
//! pictures and tables are all there.

mod chip;
mod costs;
mod flights;
mod html;
mod provenance;
mod replays;
mod reproductions;
mod studies;

use html::{Section, paragraph};

use crate::report::document::Report;
use crate::report::plot::escape;

const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("replay.js");

/// Nothing may be fetched, even if a name or file tried.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// The page.
pub fn page(report: &Report) -> String {
    let sections: Vec<Section> = [
        replays::section(report),
        reproductions::section(report),
        flights::success_section(report),
        flights::trajectory_section(report),
        costs::table5_section(report),
        costs::energy_section(report),
        studies::section(report),
        chip::utilization_section(report),
        chip::rate_section(report),
        chip::threshold_section(report),
        chip::agreement_section(report),
        provenance::section(report),
    ]
    .into_iter()
    .filter(|section| !section.body.is_empty())
    .collect();
    let links: Vec<String> =
        sections.iter().map(|s| format!(r##"<a href="#{}">{}</a>"##, s.id, s.title)).collect();
    let mut page = format!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><meta http-equiv="Content-Security-Policy" content="{POLICY}"><title>spikeloop report</title>
<style>{STYLE}</style></head>
<body><header><h1>spikeloop report</h1>{}<nav>{}</nav></header><main>
"#,
        flights::summary(report),
        links.join(" ")
    );
    for Section { id, title, body } in &sections {
        page.push_str(&format!("<section id=\"{id}\"><h2>{title}</h2>\n{body}</section>\n"));
    }
    let made = format!("put together by revision {}", report.revision);
    page.push_str(&format!("</main><footer>{}</footer>\n", paragraph(&escape(&made))));
    if report.replays().next().is_some() {
        page.push_str(&format!("<script>\n{SCRIPT}</script>\n"));
    }
    page.push_str("</body></html>\n");
    page
}
