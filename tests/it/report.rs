//! The report: recorded trials, the page with every section, its script.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use spikeloop::report::replay::Replay;

use crate::bad_input::refused;
use crate::cli::Folder;
use crate::fixtures::eem_san;

/// A small untrained EEM-SAN, compiled, flown for some ticks on the chip, and recorded.
fn small_eem_san(folder: &Folder) {
    folder.write("s.safetensors", eem_san(true, &|_, _, _| ()));
    folder.good("compile s.safetensors -o s.map");
    folder.good(
        "drive s.safetensors s.map --arena map1 --control-hz 20 --trials 2 --ticks-max 12 \
         --json d.json --replay r.json --replay-trial 0 --replay-trial 1",
    );
}

fn replay(folder: &Folder, name: &str) -> Replay {
    let text = String::from_utf8(folder.read(name)).unwrap();
    Replay::from_json(name, &text).unwrap()
}

fn page(folder: &Folder, name: &str) -> String {
    String::from_utf8(folder.read(name)).unwrap()
}

#[test]
fn recording_a_small_eem_san_keeps_the_flight_and_holds_frames_spikes_and_state() {
    let folder = Folder::new();
    small_eem_san(&folder);
    let (result, replay) = (folder.json("d.json"), replay(&folder, "r.json"));
    assert_eq!(replay.episodes.len(), 2);
    for (episode, trial) in
        replay.episodes.iter().zip(result["drivers"][1]["trials"].as_array().unwrap())
    {
        assert_eq!(serde_json::to_value(&episode.poses_mm).unwrap(), trial["trajectory_mm"]);
        let last = episode.ticks.last().unwrap();
        assert_eq!(trial["chip"]["costs"]["sanafe"]["dynamic_fj"], last.dynamic_fj[1]);
        assert_eq!((last.frames.len(), last.dvs_state.len()), (5, 4));
        // The camera was on: there are events once the robot moves.
        let pixels = |frame: &Vec<u32>| frame.len();
        assert!(episode.ticks.iter().flat_map(|t| &t.frames).map(pixels).sum::<usize>() > 0);
    }
    let again = "drive s.map --arena map1 --control-hz 20 --trials 2 --ticks-max 12 --threads 1 \
                 --replay again.json --replay-trial 0 --replay-trial 1";
    folder.good(again);
    assert!(folder.read("again.json") == folder.read("r.json"));
}

#[test]
fn the_page_has_a_section_for_every_kind_of_result() {
    let folder = Folder::new();
    small_eem_san(&folder);
    folder.good("agree s.map s.safetensors --ticks 4 --json a.json");
    folder.good("table5 s.safetensors --seconds 1 --json t.json");
    folder.good("thresholds s.safetensors --json h.json");
    folder.good(
        "evaluate straight --map map1 --condition static-1.0 --trials 2 --seeds 2 --json e.json",
    );
    folder
        .good("study laser-only --axis bits --map map1 --trials 1 --ticks-max 4 --json study.json");
    let about = folder.good("inspect s.map --json").out;
    folder.write("c.json", &about);
    let files = "r.json d.json e.json t.json a.json c.json h.json study.json";
    folder
        .good(&format!("report {files} -o page.html --json all.json --picture still.svg --tick 3"));
    let html = page(&folder, "page.html");
    for id in [
        "replay",
        "success",
        "trajectories",
        "table5",
        "energy",
        "study",
        "chip",
        "rates",
        "thresholds",
        "agreement",
        "provenance",
    ] {
        assert!(html.contains(&format!("<section id=\"{id}\">")), "{id}");
        assert!(html.contains(&format!("<a href=\"#{id}\">")), "link to {id}");
    }
    let plan: Value = serde_json::from_str(&about).unwrap();
    let digest = plan["map_digest"].as_str().unwrap();
    for part in [
        digest,
        "Without a price",
        "in barriers",
        "by the layer with the slowest core",
        "other layers",
        ": steps of a decision wait for ",
        "EEM-SAN, paper",
        "s chip (nearest)",
    ] {
        assert!(html.contains(part), "{part}");
    }
    // Nothing is fetched: links lead into the page, pictures are in it.
    for part in ["href=\"http", "src=\"", "@import", "url("] {
        assert!(!html.contains(part), "{part}");
    }
    crate::cli::assert_well_formed(&String::from_utf8(folder.read("still.svg")).unwrap());
    let all = folder.json("all.json");
    assert_eq!(all["items"].as_array().unwrap().len(), 8);
    folder.good("report all.json -o again.html --json same.json");
    assert!(folder.read("same.json") == folder.read("all.json"));
    assert_eq!(page(&folder, "again.html"), html);
}

#[test]
fn the_page_tells_repeated_flights_apart_by_their_seeds() {
    let folder = Folder::new();
    folder.good("compile reflex -o r.map");
    let fly = "drive r.map --trials 1 --ticks-max 5 --seed 4";
    folder.good(&format!("{fly} --repeats 2 --json two.json"));
    folder.good(&format!("{fly} --json one.json"));
    let told = |files: &str| {
        folder.good(&format!("report {files} -o page.html"));
        page(&folder, "page.html")
    };
    let html = told("two.json");
    for part in [
        "actuators ideal, seeds 4 to 5.",
        "goals reached, reflex chip (nearest), seed 5",
        "reflex chip (nearest), seed 5, davies2018",
        "reflex chip (nearest), seed 4: host, per decision: ",
    ] {
        assert!(html.contains(part), "no {part:?}");
    }
    let html = told("one.json");
    assert!(html.contains("actuators ideal, seed 4."));
    assert!(html.contains("goals reached, reflex chip (nearest)<"), "no seed where there is one");
}

#[test]
fn names_with_markup_stay_text_in_the_page() {
    let folder = Folder::new();
    let arena = r#"{"name": "</script><b>&\"'", "arena": {"xmin": 0, "xmax": 20, "ymin": 0, "ymax": 20},
        "walls": [{"name": "<i>&", "shape": "cylinder", "x": 10, "y": 10, "radius": 3, "height": 1}]}"#;
    folder.write("a.json", arena);
    folder.write("p.json", r#"{"starts": [[2, 10, 0]], "goals": [[18, 10]]}"#);
    folder.good("drive straight --arena a.json --pairs p.json --json <d>&.json --replay r.json");
    // Nobody gets past the cylinder: there is no mean path of no successes.
    let drove = String::from_utf8(folder.read("<d>&.json")).unwrap();
    assert!(drove.contains("\"path_m_mean\":null,"), "{drove}");
    folder.good("report <d>&.json r.json -o page.html");
    let html = page(&folder, "page.html");
    for part in ["<b>&", "</script><b>", "<i>&", "<d>&"] {
        assert!(!html.contains(part), "{part}");
    }
    assert!(html.contains("&lt;d&gt;&amp;.json"));
    // Two scripts: the data, whose text ends nowhere early, and the player.
    assert_eq!((html.matches("<script").count(), html.matches("</script>").count()), (2, 2));
    let data = html.split("<script type=\"application/json\">").nth(1).unwrap();
    let data = data.split("</script>").next().unwrap();
    assert_eq!(Replay::from_json("page", data).unwrap(), replay(&folder, "r.json"));
    if let Some(players) = run_script(&folder.path("page.html")) {
        assert_eq!(players.len(), 1);
    }
}

#[test]
fn what_cannot_be_recorded_or_reported_is_refused() {
    let folder = Folder::new();
    refused(
        &folder,
        "drive straight --trials 2 --replay r.json --replay-trial 2",
        &["--replay-trial 2: there are 2 trials, 0..=1; give one of them"],
    );
    refused(
        &folder,
        "drive planner --trials 1 --replay r.json",
        &["cannot be recorded; record another"],
    );
    folder.good("drive straight --trials 1 --ticks-max 5 --json d.json --replay r.json");
    refused(&folder, "report d.json --picture p.svg", &["--picture: no replay among the results"]);
    refused(
        &folder,
        "report r.json --picture p.svg --tick 5",
        &["--tick 5: the trial has 5 ticks"],
    );
    refused(&folder, "report r.json -o r.json", &["is an input"]);
    let text = String::from_utf8(folder.read("d.json")).unwrap();
    let (before, after) = text.split_once("\"bounds_m\":").unwrap();
    let after = after.split_once(']').unwrap().1;
    for bounds in ["[-10,-10,10,-20]", "[0,0,0,0]", "[-10,-10,10,1e308]"] {
        folder.write("b.json", format!("{before}\"bounds_m\":{bounds}{after}"));
        let parts = ["b.json: ", "arena.bounds_m: [", "with min below max, within 1000000 m of 0"];
        refused(&folder, "report b.json -o out.html", &parts);
    }
    let names = folder.names();
    assert!(!names.contains(&"p.svg".to_owned()), "{names:?}");
}

#[test]
fn the_demonstration_leaves_a_page_that_plays() {
    let folder = Folder::new();
    folder.good("demo --network reflex --trials 1 -o out");
    let replay = replay(&folder, "out/reflex.replay.json");
    assert_eq!(replay.driver, "reflex chip (nearest)");
    let html = page(&folder, "out/reflex.html");
    for id in ["replay", "success", "energy", "chip", "thresholds", "provenance"] {
        assert!(html.contains(&format!("<section id=\"{id}\">")), "{id}");
    }
    folder.good("report out/reflex.report.json -o again.html");
    assert_eq!(page(&folder, "again.html"), html);
}

/// What tests/page_check.js says of a page; `None` (said on standard output) without node.
fn run_script(page: &Path) -> Option<Vec<Value>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page_check.js");
    let ran = match Command::new("node").arg(script).arg(page).output() {
        Ok(ran) => ran,
        Err(error) => {
            println!("skipped: needs node ({error})");
            return None;
        }
    };
    let err = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{err}");
    Some(serde_json::from_slice(&ran.stdout).unwrap())
}

#[test]
fn the_script_plays_to_the_end_and_decodes_what_was_recorded() {
    let folder = Folder::new();
    small_eem_san(&folder);
    folder
        .good("drive straight --trials 1 --ticks-max 15 --arena courtyard-moving --replay s.json");
    folder.good("report r.json s.json -o page.html");
    let Some(players) = run_script(&folder.path("page.html")) else { return };
    assert_eq!(players.len(), 2);
    let replay = replay(&folder, "r.json");
    let ticks = players[0]["ticks"].as_array().unwrap();
    assert_eq!(ticks.len(), replay.episodes[0].ticks.len());
    let numbers = |value: &Value| -> Vec<u64> {
        value.as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect()
    };
    let wide = |places: &[u32]| -> Vec<u64> { places.iter().map(|n| u64::from(*n)).collect() };
    for (seen, tick) in ticks.iter().zip(&replay.episodes[0].ticks) {
        for (seen, frame) in seen["frames"].as_array().unwrap().iter().zip(&tick.frames) {
            assert_eq!(numbers(seen), wide(frame));
        }
        assert_eq!(numbers(&seen["spikes"]), wide(&tick.spikes));
        let cores = [&seen["cores"]["operations"], &seen["cores"]["spikes"]].map(numbers).concat();
        assert_eq!(cores, tick.cores);
        for place in seen["places"].as_array().unwrap() {
            let [layer, step, _] = numbers(place)[..] else { panic!("{place}") };
            assert!(step < u64::from(replay.layers[layer as usize].steps), "{place}");
        }
    }
    let text = players[0]["text"].as_str().unwrap();
    for part in ["2 of 12", "0.10 s", "davies2018", "core 0", "event camera"] {
        assert!(text.contains(part), "{part} in {text}");
    }
}

/// Says in a page what goes wrong in it, before anything else runs.
const LISTENER: &str = r#"<script>window.errors = [];
for (const [name, said] of [["error", "message"], ["unhandledrejection", "reason"], ["securitypolicyviolation", "violatedDirective"]])
  window.addEventListener(name, (event) => window.errors.push(String(event[said])));
</script><style>"#;

/// What tests/page_probe.js says of a page in a window of this width, and the name of the browser;
/// `None` (said on standard output) where none is installed.
fn probe(folder: &Folder, page: &str, width: u32) -> Option<(Value, &'static str)> {
    let script = concat!("<script>", include_str!("../page_probe.js"), "</script></body>");
    let html = std::fs::read_to_string(folder.path(page)).unwrap();
    let html = html.replacen("<style>", LISTENER, 1).replacen("</body>", script, 1);
    std::fs::write(folder.path("probe.html"), html).unwrap();
    let profile = format!("--user-data-dir={}", folder.path(&format!("browser{width}")).display());
    let url = format!("file://{}", folder.path("probe.html").display());
    for browser in ["chromium", "chromium-browser", "google-chrome"] {
        let mut command = Command::new(browser);
        command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"]);
        command.args(["--no-first-run", "--disable-background-networking", "--disable-sync"]);
        command.args(["--disable-component-update", "--virtual-time-budget=20000", "--dump-dom"]);
        command.args([&profile, &format!("--window-size={width},900"), &url]);
        let Ok(ran) = command.output() else { continue };
        let dom = String::from_utf8_lossy(&ran.stdout);
        let said =
            dom.split(r#"<pre id="probe">"#).nth(1).and_then(|rest| rest.split("</pre>").next());
        let said = said.unwrap_or_else(|| {
            panic!("{browser}: the player did not start: {}", String::from_utf8_lossy(&ran.stderr))
        });
        let said = said.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
        return Some((serde_json::from_str(&said).unwrap(), browser));
    }
    println!("skipped: needs chromium or google-chrome");
    None
}

/// In a real browser, where one is installed: no error, every canvas is drawn on and changes with
/// the tick, and nothing reaches out of the page, be it wide or narrow.
#[test]
fn a_browser_plays_the_page() {
    let folder = Folder::new();
    small_eem_san(&folder);
    folder.good("drive s.map --arena map1 --control-hz 20 --trials 1 --ticks-max 12 --replay r.json --json d.json");
    folder.good("report r.json d.json -o page.html");
    for width in [1280, 500] {
        let Some((said, browser)) = probe(&folder, "page.html", width) else { return };
        let place = format!("{browser}, {width} pixels");
        assert_eq!(said["errors"], serde_json::json!([]), "{place}");
        assert_eq!(said["still_hidden"], true, "{place}");
        assert_eq!(said["moves"], true, "{place}");
        assert_eq!(said["cut_off"], serde_json::json!([]), "{place}");
        let [page, window] = [0, 1].map(|index| said["page_px"][index].as_u64().unwrap());
        assert!(page <= window, "{place}: the page is {page} wide");
        // The tick in the middle: arena, events, DVS state, chip, spikes, the whole trial.
        let inked = said["inked"][1].as_array().unwrap();
        assert_eq!(inked.len(), 6, "{place}");
        assert!(inked.iter().all(|n| n.as_u64().unwrap() > 0), "{place}: {inked:?}");
        for (tick, part) in ["0 of 12", "6 of 12", "end"].iter().enumerate() {
            let text = said["texts"][tick].as_str().unwrap();
            assert!(text.contains(part), "{place}: {part} in {text}");
        }
    }
}
