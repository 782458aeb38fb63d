//! Trials to play.

use crate::report::document::Report;
use crate::report::page::html::{Section, heading, paragraph, picture};
use crate::report::plot::escape;
use crate::report::replay::{Replay, frame_picture};

pub(super) fn section(report: &Report) -> Section {
    let body = report.replays().map(|(item, replay)| one(&report.items[item].file, replay));
    Section { id: "replay", title: "Replay", body: body.collect() }
}

/// The still picture is of the middle of the first trial.
fn one(file: &str, replay: &Replay) -> String {
    let [first, ..] = replay.episodes.as_slice() else { return String::new() };
    let still = frame_picture(replay, 0, first.ticks.len() / 2);
    let about = format!(
        "{} in arena {}, seed {}, {} trial{} recorded tick by tick ({}).",
        replay.driver,
        replay.arena.name,
        replay.seed,
        replay.episodes.len(),
        if replay.episodes.len() == 1 { "" } else { "s" },
        file
    );
    format!(
        "<section class=\"replay\">{}{}<div class=\"still\">{}</div><div class=\"player\"></div>\
         <script type=\"application/json\">{}</script></section>\n",
        heading(&replay.driver),
        paragraph(&escape(&about)),
        picture(&still),
        embedded(replay)
    )
}

/// JSON that no markup in a name can end.
fn embedded(replay: &Replay) -> String {
    let json = serde_json::to_string(replay).expect("a replay has text keys");
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}
