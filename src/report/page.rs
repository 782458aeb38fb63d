//! One self-contained HTML page from several results.

use std::fmt::Write;

use crate::report::plot::{escape, trajectories};
use crate::report::results::DriveResult;
use crate::report::tables::{camera_note, cost_table, outcome_table};

/// A page with the tables and trajectories of `results`, which are (file, content).
pub fn page(results: &[(String, DriveResult)]) -> String {
    let mut html = String::from(HEAD);
    for (file, result) in results {
        let s = &result.settings;
        let _ = write!(
            html,
            "<h2>{}</h2><p>Arena {}, {} Hz, v_max {} m/s, actuators {}, seed {}, revision {}{}.</p>",
            escape(file),
            escape(&result.arena.name),
            s.control_hz,
            s.v_max_m_per_s,
            escape(&s.actuators),
            result.seed,
            escape(&result.revision),
            escape(&camera_note(result))
        );
        let _ = write!(html, "<pre>{}</pre>", escape(&outcome_table(&result.drivers)));
        if let Some(costs) = cost_table(&result.drivers) {
            let _ = write!(
                html,
                "<p>Per decision on the emulated chip:</p><pre>{}</pre>",
                escape(&costs)
            );
        }
        for driver in &result.drivers {
            if let Some(digest) = &driver.map_digest {
                let _ =
                    write!(html, "<p>{}: core map {}</p>", escape(&driver.label), escape(digest));
            }
        }
        html.push_str(&trajectories(result));
    }
    html.push_str("</body></html>\n");
    html
}

const HEAD: &str = r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>spikeloop report</title>
<style>body{font-family:sans-serif;max-width:100em;margin:2em auto;padding:0 1em}pre{overflow-x:auto;line-height:1.25}svg{max-width:100%;height:auto}</style>
</head><body><h1>spikeloop report</h1>
<p>Energy is counts times the named cost table. Static power is listed apart and is not part of the
dynamic energy. "In windows" counts only what each core did during its own layer's decision window.</p>
"#;
