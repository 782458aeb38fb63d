//! `spikeloop evaluate`: the table, its state file, its pictures.

use serde_json::Value;
use spikeloop::report::success::SuccessTable;

use crate::bad_input::refused;
use crate::cli::{Folder, assert_well_formed, reflex_map};
use crate::fixtures::{eem_san, shared};

/// Two networks, two seeds, two conditions: eight short cells.
const SMALL: &str = "evaluate see.safetensors straight --map courtyard-moving \
                     --condition dynamic-1.0 --condition static-0.5 --trials 2 --ticks-max 5";

fn folder_with_network() -> Folder {
    let folder = Folder::new();
    folder.write("see.safetensors", eem_san(true, &|_, _, _| ()));
    folder
}

#[test]
fn the_table_stands_beside_the_papers() {
    let folder = Folder::new();
    let ran = folder.good("evaluate straight --trials 1 --ticks-max 2 --seeds 2");
    for part in [
        "20 Hz, no action noise, actuators ideal, 1 trials per map (pairs from seed 1), seeds 1..=2",
        "straight, map2, static, 0.5 m/s, seed 2: 0 of 1",
        "| condition        | network        |  map1 | map1, collision | map1, each seed |  map2 |",
        "| dynamic, 1.0 m/s | straight       | 0.000 |           0.000 |     0.000 0.000 | 0.000 |",
        "| dynamic, 1.0 m/s | EEM-SAN, paper | 0.765 |               - |               - | 0.743 |",
        "| static, 1.0 m/s  | SAN, paper     | 0.645 |               - |               - | 0.560 |",
        "| static, 0.5 m/s  | EEM-SAN, paper | 1.000 |               - |               - | 0.985 |",
        "Rows of the paper are its table of success rates (tab:2). Its maps are not published",
        "map1, map2\nare of this project's own design: compare the order of rows, not the numbers.",
    ] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
}

#[test]
fn the_table_says_how_many_trials_ended_in_a_collision() {
    let folder = Folder::new();
    let line =
        "evaluate straight --map map1 --condition dynamic-1.0 --trials 40 --seeds 2 --json t.json";
    let ran = folder.good(line);
    let cells = folder.json("t.json")["cells"].clone();
    let cells = cells.as_array().expect("a list").iter();
    let collisions = cells.map(|cell| cell["summary"]["collision"].as_u64().expect("a count"));
    let collided = collisions.sum::<u64>() as f64 / 80.0;
    assert!(collided > 0.5, "{collided} for one that looks at nothing");
    let row = ran.out.lines().find(|line| line.contains("| straight ")).expect("a row");
    let shown = row.split('|').nth(4).expect("a fourth column").trim();
    assert_eq!(shown, format!("{collided:.3}"), "{row}");
}

#[test]
fn contacts_are_told_by_side_and_by_view() {
    let folder = Folder::new();
    let line =
        "evaluate straight --map map1 --condition dynamic-1.0 --trials 40 --seeds 2 --state s.json";
    let ran = folder.good(line);
    let cells = folder.json("s.json")["cells"].clone();
    let sum = |name: &str| {
        let counts = cells.as_array().unwrap().iter();
        counts.map(|cell| cell["summary"]["contacts"][name].as_u64().unwrap()).sum::<u64>()
    };
    let [standing, ahead, beside, behind, camera, laser, neither] =
        ["standing", "ahead", "beside", "behind", "camera", "laser", "neither"].map(sum);
    let movers = ahead + beside + behind;
    assert!(standing > 0 && movers > 0 && movers == camera + laser + neither, "{cells}");
    let below = ran.out.split_once("trials that ended in contact").expect("a table").1;
    let row = below.lines().find(|line| line.contains("| straight ")).expect("a row");
    let shown: Vec<&str> = row.split('|').map(str::trim).collect();
    let counts = [standing, ahead, beside, behind, camera, laser, neither];
    assert_eq!(shown[3..10], counts.map(|n| n.to_string()), "{row}");
    folder.good("report s.json -o page.html");
    let page = String::from_utf8(folder.read("page.html")).unwrap();
    assert!(page.contains("<p>Trials that ended in contact; ahead: within 45 degrees"));
    // A table of before contacts were looked into has none to show.
    let text = String::from_utf8(folder.read("s.json")).unwrap();
    let (before, rest) = text.split_once(",\"contacts\":{").expect("contacts");
    let after = rest.split_once('}').expect("their end").1;
    folder.write("s.json", format!("{before}{after}"));
    assert!(!folder.good(line).out.contains("trials that ended in contact"));
}

#[test]
fn the_planner_takes_another_lens() {
    let folder = Folder::new();
    let common = "--map map1 --condition dynamic-1.0 --trials 12 --seeds 1 --json t.json";
    folder.good(&format!("evaluate planner-camera planner-camera:90 planner-camera:20 {common}"));
    let cells = folder.json("t.json")["cells"].clone();
    assert_eq!(cells[0]["summary"], cells[1]["summary"]);
    assert_ne!(cells[0]["summary"], cells[2]["summary"]);
    for (lens, part) in
        [("9", "field of view 9, whole degrees of 10..=150"), ("151", "151"), ("x", "view x")]
    {
        refused(&folder, &format!("evaluate planner-camera:{lens} {common}"), &[part, lens]);
    }
}

#[test]
fn everything_that_drives_can_be_evaluated() {
    let folder = folder_with_network();
    reflex_map(&folder);
    let common = "--map courtyard --condition static-0.5 --trials 1 --ticks-max 3 --seeds 1";
    let line = format!("evaluate reflex reflex.map planner straight {common} --json t.json");
    let ran = folder.good(&line);
    assert!(ran.out.contains("core map reflex.map "), "{}", ran.out);
    assert!(!ran.out.contains("Rows of the paper"), "{}", ran.out);
    let cells = folder.json("t.json")["cells"].clone();
    assert!(cells[0]["summary"]["chip"].is_null() && cells[2]["network_digest"].is_null());
    let counters = &cells[1]["summary"]["chip"]["counters"];
    assert!(counters["messages"].as_u64().is_some(), "{cells}");
    let Some(weights) = shared("san/san_sddpg_bw5.safetensors") else { return };
    folder.good(&format!("evaluate san --weights {} {common}", weights.display()));
}

#[test]
fn degraded_cells_stand_below_whole_ones_and_are_others() {
    let folder = Folder::new();
    let line = "evaluate laser-only chip:laser-only --map courtyard --condition static-1.0 \
                --trials 2 --ticks-max 500 --seeds 2 --degraded weights-noise --degraded beams-near \
                --state s.json --json t.json";
    let ran = folder.good(line);
    for part in [
        "laser-only, courtyard, static, 1.0 m/s, weights-noise, seed 2: ",
        "| static, 1.0 m/s                | chip:laser-only | ",
        "| static, 1.0 m/s, beams-near    | laser-only      | ",
    ] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    assert!(!ran.out.contains("EEM-SAN, paper"), "{}", ran.out);
    let cells = folder.json("t.json")["cells"].clone();
    let path = |network: &str, degraded: Option<&str>, seed: u64| {
        let of = |cell: &&Value| {
            cell["network"] == network
                && cell["seed"] == seed
                && cell.get("degraded").and_then(Value::as_str) == degraded
        };
        let cell = cells.as_array().unwrap().iter().find(of).expect("a cell");
        cell["summary"].to_string()
    };
    for network in ["laser-only", "chip:laser-only"] {
        let whole = path(network, None, 1);
        assert_ne!(whole, path(network, Some("beams-near"), 1), "{network}");
        assert_ne!(whole, path(network, Some("weights-noise"), 1), "{network}");
    }
    let again = folder.good(line);
    assert!(again.out.contains("12 of 12 cells are in the state file already"), "{}", again.out);
}

#[test]
fn maps_that_the_paper_has_not_stand_alone() {
    let folder = folder_with_network();
    let ran = folder.good(&format!("{SMALL} --seeds 1 --json t.json"));
    assert!(!ran.out.contains("PopSAN"), "{}", ran.out);
    assert!(ran.out.contains("event camera on for see.safetensors\n"), "{}", ran.out);
    let cells = folder.json("t.json")["cells"].clone();
    let of = |cell: &Value| {
        let text = |key: &str| cell[key].as_str().unwrap().to_owned();
        (text("network"), text("condition"), cell["camera"].as_bool().unwrap())
    };
    let found: Vec<_> = cells.as_array().unwrap().iter().map(of).collect();
    let expected = [
        ("see.safetensors", "dynamic-1.0", true),
        ("see.safetensors", "static-0.5", true),
        ("straight", "dynamic-1.0", false),
        ("straight", "static-0.5", false),
    ];
    assert_eq!(found, expected.map(|(n, c, camera)| (n.to_owned(), c.to_owned(), camera)));
}

#[test]
fn a_run_that_goes_on_ends_as_one_that_was_not_interrupted() {
    let folder = folder_with_network();
    folder.good(&format!("{SMALL} --seeds 2 --json whole.json --plot whole"));
    folder.good(&format!("{SMALL} --seeds 2 --state s.json --plot parts"));
    // As if it had been killed after the third cell.
    let mut state = folder.json("s.json");
    assert_eq!(state["cells"].as_array().unwrap().len(), 8);
    state["cells"].as_array_mut().unwrap().truncate(3);
    folder.write("s.json", state.to_string());
    let ran = folder.good(&format!("{SMALL} --seeds 2 --state s.json --plot parts --json a.json"));
    assert!(ran.out.contains("3 of 8 cells are in the state file already"), "{}", ran.out);
    assert_eq!(ran.out.matches(" of 2 (").count(), 5, "{}", ran.out);
    assert!(folder.read("a.json") == folder.read("whole.json"));
    assert_eq!(folder.json("s.json")["cells"], folder.json("whole.json")["cells"]);
    // Pictures of the first seed, the same either way.
    let names = ["dynamic-1.0", "static-0.5"].map(|c| format!("straight_courtyard-moving_{c}.svg"));
    for name in names {
        let picture = |folder_name: &str| {
            std::fs::read_to_string(folder.path(folder_name).join(&name)).expect("a picture")
        };
        assert_eq!(picture("whole"), picture("parts"));
        assert_well_formed(&picture("parts"));
    }
    assert_eq!(std::fs::read_dir(folder.path("parts")).unwrap().count(), 4);
}

#[test]
fn more_seeds_and_a_lost_picture_are_flown_and_nothing_else() {
    let folder = folder_with_network();
    folder.good(&format!("{SMALL} --seeds 1 --state s.json --plot p"));
    std::fs::remove_file(folder.path("p/straight_courtyard-moving_static-0.5.svg")).unwrap();
    let ran = folder.good(&format!("{SMALL} --seeds 2 --state s.json --plot p --json two.json"));
    assert!(ran.out.contains("3 of 8 cells are in the state file already"), "{}", ran.out);
    folder.good(&format!("{SMALL} --seeds 2 --threads 1 --json whole.json"));
    assert!(folder.read("two.json") == folder.read("whole.json"));
    // A table is a state as well.
    let ran = folder.good(&format!("{SMALL} --seeds 2 --state whole.json"));
    assert!(ran.out.contains("8 of 8 cells"), "{}", ran.out);
    // Pictures of another first seed are drawn anew.
    let ran = folder.good(&format!("{SMALL} --seed 2 --seeds 1 --state whole.json --plot p"));
    assert!(!ran.out.contains("in the state file already"), "{}", ran.out);
    folder.good(&format!("{SMALL} --seed 2 --seeds 1 --plot q"));
    let name = "straight_courtyard-moving_static-0.5.svg";
    assert!(folder.read(&format!("p/{name}")) == folder.read(&format!("q/{name}")));
    let ran = folder.good(&format!("{SMALL} --seed 2 --seeds 1 --state whole.json --plot p"));
    assert!(ran.out.contains("4 of 4 cells are in the state file already"), "{}", ran.out);
}

#[test]
fn what_two_runs_write_to_one_state_is_kept() {
    let folder = folder_with_network();
    let state = |seed: u64| {
        folder.good(&format!("{SMALL} --seed {seed} --seeds 1 --state s{seed}.json"));
        let text = String::from_utf8(folder.read(&format!("s{seed}.json"))).unwrap();
        SuccessTable::from_json("s.json", &text).unwrap()
    };
    let (mut one, two) = (state(1), state(2));
    let cells = [one.cells.clone(), two.cells.clone()].concat();
    one.add_missing(two.clone());
    assert_eq!(one.cells, cells);
    one.add_missing(two);
    assert_eq!(one.cells, cells);
}

#[test]
fn a_state_of_other_weights_maps_or_settings_is_refused_and_stays() {
    let folder = folder_with_network();
    folder.good(&format!("{SMALL} --seeds 1 --state s.json"));
    let state = folder.read("s.json");
    let line = format!("{SMALL} --seeds 1 --state s.json --json out.json");
    let cases = [
        (
            "--trials 2",
            "--trials 3",
            "s.json: trials is 2 there and 3 here; give the same settings",
        ),
        ("--ticks-max 5", "--ticks-max 6", "s.json: ticks_max is 5 there and 6 here"),
        ("--seeds 1", "--actuators lag", "s.json: actuators is \"ideal\" there and \"lag\" here"),
    ];
    for (from, to, part) in cases {
        refused(&folder, &line.replace(from, to), &[part]);
    }
    let changed = eem_san(true, &|name, _, values| {
        if name == "actor.decision.1.bias" {
            values[0] += 0.25;
        }
    });
    folder.write("see.safetensors", changed);
    let part = "s.json: network see.safetensors has digest ";
    refused(&folder, &line, &[part, "here: it has changed; give another file"]);
    assert!(folder.read("s.json") == state);
    folder.good(&line.replace("see.safetensors ", ""));

    let arena = |x: u32| {
        format!(
            r#"{{"name": "a", "arena": {{"xmin": 0, "xmax": 20, "ymin": 0, "ymax": 20}},
            "walls": [{{"name": "w", "shape": "cylinder", "x": {x}, "y": 10, "radius": 3, "height": 1}}]}}"#
        )
    };
    folder.write("a.json", arena(10));
    let line = "evaluate straight --map a.json --trials 1 --ticks-max 2 --state m.json";
    folder.good(line);
    folder.write("a.json", arena(11));
    refused(&folder, line, &["m.json: map a.json has digest "]);
}

#[test]
fn state_files_of_another_form_are_refused_and_stay() {
    let folder = folder_with_network();
    folder.good(&format!("{SMALL} --seeds 1 --state s.json"));
    let good = String::from_utf8(folder.read("s.json")).unwrap();
    let cases = [
        (String::new(), "s.json: not a table of `spikeloop evaluate` ("),
        ("{}".to_owned(), "missing field `format`"),
        ("{\"format\": 1}".to_owned(), "missing field `settings`"),
        (good.replacen("\"format\":1", "\"format\":2", 1), "s.json: format 2 found, 1 expected"),
        (
            good.replacen("\"time_out\":2", "\"time_out\":3", 1),
            "s.json: cell 0: 3 outcomes, 2 expected (settings.trials); the file is damaged",
        ),
        (
            good.replacen("\"neither\":", "\"neither\":1", 1),
            "s.json: cell 0: contacts do not add up, 0 expected (collision)",
        ),
        (good[..good.len() / 2].to_owned(), "s.json: not a table"),
    ];
    for (text, part) in cases {
        assert_ne!(text, good, "{part}");
        folder.write("s.json", &text);
        refused(&folder, &format!("{SMALL} --seeds 1 --state s.json --json out.json"), &[part]);
        assert_eq!(folder.read("s.json"), text.as_bytes());
    }
}

#[test]
fn evaluations_without_sense_are_refused_before_they_begin() {
    let folder = folder_with_network();
    folder.write("file", b"");
    let cases = [
        ("evaluate straight straight", "network straight: given twice; leave one out"),
        ("evaluate straight --map map1 --map map1", "--map map1: given twice"),
        ("evaluate straight --condition calm", "possible values: dynamic-1.0, static-1.0"),
        (
            "evaluate straight --condition static-0.5 --condition static-0.5",
            "--condition static-0.5: given twice",
        ),
        (
            "evaluate reflex straight --degraded weights-pruned",
            "straight: only the weights of a network can be degraded; leave it out",
        ),
        ("evaluate straight --degraded laser", "possible values: beams-near, beams-far"),
        (
            "evaluate straight --degraded beams-far --degraded beams-far",
            "--degraded beams-far: given twice",
        ),
        ("evaluate chip:nobody", "nobody: neither a file nor a built-in network"),
        ("evaluate straight --map garden", "built-in arenas are courtyard"),
        ("evaluate nobody", "nobody: neither a file nor a built-in network"),
        ("evaluate no.safetensors", "no.safetensors: cannot read: "),
        ("evaluate san", "san: names no weights file; give one with --weights FILE"),
        ("evaluate straight --weights w", "w: weights are for networks with a description"),
        ("evaluate straight --trials 0", "'--trials <N>': 0 is not in 1..=10000"),
        ("evaluate straight --seeds 0", "0 is not in 1..=1000"),
        ("evaluate straight --seed 18446744073709551615 --seeds 2", "take a smaller seed"),
        ("evaluate straight --ticks-max 0", "tick limit is 0, must be 1..=1000000"),
        ("evaluate straight --actuators jelly", "actuators \"jelly\": not understood"),
        ("evaluate straight --threads 0", "0 is not in 1..=256"),
        ("evaluate straight --state no/s.json", "cannot write: "),
        ("evaluate straight --state out.json", "is an input or another output as well"),
        ("evaluate see.safetensors --state see.safetensors", "is an input or another output"),
        ("evaluate straight --plot file", "file: cannot make the folder: "),
    ];
    for (line, part) in cases {
        let ran = refused(&folder, &format!("{line} --json out.json"), &[part]);
        assert_eq!(ran.out, "", "spikeloop {line} began");
    }
}

#[cfg(unix)]
#[test]
fn a_killed_evaluation_leaves_whole_files() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    let folder = folder_with_network();
    let line = format!("{SMALL} --seeds 1000 --state s.json --json t.json --plot p");
    let mut command = folder.command();
    let mut child = command.args(line.split_whitespace()).stdout(Stdio::piped()).spawn().unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    // Two cells are in the file when the third is told.
    let told = out.lines().map(|line| line.unwrap()).filter(|line| line.contains(" of 2 ("));
    assert_eq!(told.take(3).count(), 3);
    child.kill().unwrap();
    child.wait().unwrap();
    let cells = folder.json("s.json")["cells"].as_array().unwrap().len();
    assert!(cells >= 2, "{cells} cells");
    // Only a temporary file that the writer had no time to rename may be left.
    let left: Vec<String> =
        folder.names().into_iter().filter(|name| !name.ends_with(".tmp")).collect();
    assert_eq!(left, ["p", "s.json", "see.safetensors"]);
    let ran = folder.good(&line.replace("--seeds 1000", "--seeds 1"));
    assert!(ran.out.contains(" cells are in the state file already"), "{}", ran.out);
}
