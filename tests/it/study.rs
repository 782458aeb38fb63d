//! `spikeloop study`: its points, its state file, its picture.

use serde_json::Value;
use spikeloop::report::interval::wilson_95;

use crate::bad_input::refused;
use crate::cli::{Folder, assert_well_formed};

/// Short points of the control that comes built in, two of which do not fly.
const SMALL: &str = "study laser-only --axis bits --axis dead-cores --trials 2 --ticks-max 4";

fn points(study: &Value) -> &Vec<Value> {
    study["points"].as_array().expect("points")
}

#[test]
fn a_study_has_a_row_for_every_value_and_a_plot_for_every_axis() {
    let folder = Folder::new();
    let ran = folder.good(&format!("{SMALL} --json out.json --plot out.svg"));
    for part in [
        "laser-only (digest ",
        ") on map1, dynamic, 1.0 m/s, 20 Hz, 2 trials (pairs from seed 1), event camera off",
        "bits 7: does not fly",
        "bits 7 does not fly: core 0 (fuse.laser",
        "weight bits = 7, must be one of [1, 2, 3, 4, 5, 6, 8]; choose a width that the chip has",
        "| float network |",
    ] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    let rows =
        |name: &str| ran.out.lines().filter(|l| l.starts_with(&format!("| {name} "))).count();
    assert_eq!((rows("bits"), rows("dead-cores")), (7, 5), "{}", ran.out);
    let study = folder.json("out.json");
    assert_eq!(study["settings"]["trials"], 2);
    // Eight bits and no dead core are one point.
    assert_eq!(points(&study).len(), 11);
    let flown: Vec<&Value> = points(&study).iter().map(|p| &p["result"]["flown"]).collect();
    // There are no weights of 7 bits, and the control takes fewer than 8 cores.
    assert_eq!(flown.iter().filter(|flown| flown.is_null()).count(), 2);
    assert!(ran.out.contains("dead-cores 8 does not fly: 8 dead cores, but "));
    let words = |index: usize| flown[index]["synapse_words"].as_u64().unwrap();
    assert!(words(0) > words(2), "8 bits take {} words, 6 bits {}", words(0), words(2));
    assert_eq!(flown[0]["outcomes"], "tt", "four ticks get nowhere");
    assert!(flown[0]["summary"]["chip"]["costs"]["sanafe"]["time_ps"].as_u64().unwrap() > 0);
    let picture = String::from_utf8(folder.read("out.svg")).unwrap();
    assert_well_formed(&picture);
    assert_eq!(picture.matches("dead cores, of those in use").count(), 1);
    assert_eq!(picture.matches(">x</text>").count(), 2);
    let (low, high) = wilson_95(0, 2);
    assert!(ran.out.contains(&format!("| {low:.2} to {high:.2} |")), "{}", ran.out);
}

#[test]
fn points_of_another_core_map_are_refused_and_refusals_are_tried_again() {
    let folder = Folder::new();
    let line = format!("{SMALL} --state s.json");
    folder.good(&line);
    let state = folder.json("s.json");
    let of = |index: usize| state["points"][index]["result"].clone();
    assert!(of(0)["flown"].is_object() && of(1)["refused"].is_string());
    // As if it had not compiled then.
    let mut other = state.clone();
    other["points"][0]["result"] = of(1);
    folder.write("s.json", other.to_string());
    let again = folder.good(&format!("{line} --json a.json"));
    assert!(again.out.contains("10 of 11 points are in the state file already"), "{}", again.out);
    assert_eq!(folder.json("a.json")["points"], state["points"]);
    // Another core map, and one where there is none now.
    other = state.clone();
    other["points"][0]["result"]["flown"]["digest"] = "abc".into();
    folder.write("s.json", other.to_string());
    let digest = of(0)["flown"]["digest"].as_str().unwrap().to_owned();
    let text = format!("s.json: bits 8: core map abc there, {digest} here: it has changed; give");
    refused(&folder, &line, &[&text]);
    other = state.clone();
    other["points"][1]["result"] = of(0);
    folder.write("s.json", other.to_string());
    refused(
        &folder,
        &line,
        &[&format!("s.json: bits 7: core map {digest} there, core 0 (fuse.laser")],
    );
}

#[test]
fn studies_side_by_side_keep_all_points_in_one_state_file() {
    let folder = Folder::new();
    let axes = ["bits", "lost-spikes", "dead-synapses", "neurons-per-core"];
    let study = |axis: &str| {
        let line = format!(
            "study reflex --axis {axis} --map courtyard --trials 1 --ticks-max 3 --state s.json"
        );
        line.split(' ').map(str::to_owned).collect::<Vec<String>>()
    };
    let start = |axis: &&str| folder.command().args(study(axis)).output();
    let outputs: Vec<_> = std::thread::scope(|scope| {
        let running: Vec<_> = axes.iter().map(|axis| scope.spawn(move || start(axis))).collect();
        running.into_iter().map(|one| one.join().unwrap().unwrap()).collect()
    });
    assert!(outputs.iter().all(|output| output.status.success()));
    for axis in axes {
        let again = folder.good(&study(axis).join(" "));
        let words: Vec<&str> =
            again.out.lines().find(|l| l.contains("state file")).unwrap().split(' ').collect();
        assert_eq!(words[0], words[2], "{axis}: {}", again.out);
    }
}

#[test]
fn a_study_goes_on_and_ends_as_one_that_was_not_interrupted_on_any_threads() {
    let folder = Folder::new();
    folder.good(&format!("{SMALL} --threads 1 --json whole.json"));
    folder.good(&format!("{SMALL} --threads 2 --state s.json"));
    // As if it had been killed after the float network and three points.
    let mut state = folder.json("s.json");
    assert_eq!(points(&state).len(), 11);
    state["points"].as_array_mut().unwrap().truncate(3);
    folder.write("s.json", state.to_string());
    let ran = folder.good(&format!("{SMALL} --threads 2 --state s.json --json a.json"));
    assert!(ran.out.contains("3 of 11 points are in the state file already"), "{}", ran.out);
    assert_eq!(ran.out.matches(" of 2 (").count(), 7, "{}", ran.out);
    assert!(folder.read("a.json") == folder.read("whole.json"));
    // One axis more flies what is new alone, and a study is a state as well.
    let line = SMALL.replace("--axis bits", "--axis lost-spikes");
    let ran = folder.good(&format!("{line} --state whole.json"));
    assert!(ran.out.contains("5 of 10 points are in the state file already"), "{}", ran.out);
}

#[test]
fn every_kind_of_damage_changes_what_the_chip_does() {
    let folder = Folder::new();
    let axes = "--axis lost-spikes --axis dead-synapses --axis dead-cores";
    folder.good(&format!("study laser-only {axes} --trials 2 --ticks-max 8 --json out.json"));
    let study = folder.json("out.json");
    let counters = |point: &Value| point["result"]["flown"]["summary"]["chip"]["counters"].clone();
    let find = |name: &str, value: u32| {
        let point = points(&study).iter().find(|p| p["variant"][name] == value);
        counters(point.unwrap_or_else(|| panic!("no point with {name} {value}")))
    };
    let whole = counters(&points(&study)[0]);
    assert_eq!(whole["messages_lost"], 0);
    let lossy = find("messages_lost_per_million", 100_000);
    let of = |counters: &Value, name: &str| counters[name].as_u64().unwrap() as f64;
    let sent = of(&lossy, "messages_lost") + of(&lossy, "axon_deliveries");
    let share = of(&lossy, "messages_lost") / sent;
    assert!((0.08..0.12).contains(&share), "{share} of {sent} messages lost, not a tenth");
    let dead = find("dead_synapses_per_million", 200_000);
    assert_eq!(dead["messages_lost"], 0);
    assert_ne!(dead["updates_spiking"], whole["updates_spiking"]);
    let still = find("dead_cores", 4);
    let updates = |c: &Value| {
        ["updates_inactive", "updates_active", "updates_spiking"]
            .map(|n| of(c, n))
            .iter()
            .sum::<f64>()
    };
    assert!(updates(&still) < updates(&whole));
}

#[test]
fn a_state_of_other_settings_or_damaged_is_refused_and_stays() {
    let folder = Folder::new();
    folder.good(&format!("{SMALL} --state s.json"));
    let good = String::from_utf8(folder.read("s.json")).unwrap();
    let line = format!("{SMALL} --state s.json --json out.json --plot out.svg");
    for (from, to, part) in [
        (
            "--trials 2",
            "--trials 3",
            "s.json: trials is 2 there and 3 here; give the same settings",
        ),
        ("--ticks-max 4", "--ticks-max 5", "s.json: ticks_max is 4 there and 5 here"),
        ("laser-only", "reflex", "s.json: network is \"laser-only\" there and \"reflex\" here"),
        ("--state", "--seed 2 --state", "s.json: seed is 1 there and 2 here"),
        ("--state", "--map map2 --state", "s.json: map is \"map1\" there and \"map2\" here"),
        ("--state", "--condition static-0.5 --state", "s.json: condition is \"dynamic-1.0\" there"),
    ] {
        refused(&folder, &line.replacen(from, to, 1), &[part]);
    }
    for (text, part) in [
        (String::new(), "s.json: not a table of `spikeloop study` ("),
        ("{\"format\": 1}".to_owned(), "missing field"),
        (good.replacen("\"format\":1", "\"format\":9", 1), "s.json: format 9 found, 1 expected"),
        (good.replacen("\"tt\"", "\"ss\"", 1), "s.json: float: outcomes \"ss\" do not go with 2"),
        (
            good.replacen("\"network_digest\":\"", "\"network_digest\":\"0", 1),
            "s.json: network_dig",
        ),
    ] {
        assert_ne!(text, good, "{part}");
        folder.write("s.json", &text);
        refused(&folder, &line, &[part]);
        assert_eq!(folder.read("s.json"), text.as_bytes());
    }
}

#[test]
fn studies_without_sense_are_refused_before_they_begin() {
    let folder = Folder::new();
    let cases = [
        ("study nobody", "nobody: neither a file nor a built-in network"),
        ("study chip:laser-only", "chip:laser-only: study compiles it itself; give laser-only"),
        ("study san", "san: names no weights file; give one with --weights FILE"),
        ("study laser-only --weights w.safetensors", "w.safetensors"),
        ("study laser-only --axis colour", "possible values: bits, bits-mixed, bits-toward-zero"),
        ("study laser-only --axis bits --axis bits", "--axis bits: given twice; leave one out"),
        ("study laser-only --map garden", "built-in arenas are courtyard"),
        ("study laser-only --condition calm", "possible values: dynamic-1.0, static-1.0"),
        ("study laser-only --trials 0", "'--trials <N>': 0 is not in 1..=10000"),
        ("study laser-only --ticks-max 0", "tick limit is 0, must be 1..=1000000"),
        ("study laser-only --threads 0", "0 is not in 1..=256"),
        ("study laser-only --state out.json", "is an input or another output as well"),
        ("study laser-only --plot no/out.svg", "cannot write: "),
        ("study compare/bdett --axis bits --trials 1", "dynamic thresholds (BDETT)"),
        ("study compare/avae --trials 1", "65536 artificial neurons"),
    ];
    for (line, part) in cases {
        let ran = refused(&folder, &format!("{line} --json out.json"), &[part]);
        assert_eq!(ran.out, "", "spikeloop {line} began");
    }
}

#[test]
fn networks_with_a_description_can_be_studied() {
    let folder = Folder::new();
    let line = "study reflex --map courtyard --condition static-0.5 --axis current --axis voltage";
    let ran = folder.good(&format!("{line} --trials 1 --ticks-max 3"));
    assert!(ran.out.contains("reflex (digest "), "{}", ran.out);
    assert_eq!(ran.out.matches("\n| voltage ").count(), 7, "{}", ran.out);
}

#[test]
fn more_cores_change_time_and_messages_and_nothing_that_the_robot_does() {
    for axis in ["neurons-per-core", "cores"] {
        study_cores(axis);
    }
}

fn study_cores(axis: &str) {
    let folder = Folder::new();
    let line = format!("study laser-only --axis {axis} --trials 2 --ticks-max 40 --json out.json");
    let ran = folder.good(&format!("{line} --plot out.svg"));
    assert_eq!(ran.out.matches(&format!("\n| {axis} ")).count(), 7, "{}", ran.out);
    let study = folder.json("out.json");
    let chip = |index: usize| &points(&study)[index]["result"]["flown"]["summary"]["chip"];
    let (whole, spread) = (chip(0), chip(6));
    let number = |of: &Value, path: &[&str]| {
        path.iter().fold(of, |of, name| &of[*name]).as_u64().expect("a number") as f64
    };
    let updates = ["counters", "updates_spiking"];
    assert_eq!(number(whole, &updates), number(spread, &updates));
    for table in ["davies2018", "sanafe"] {
        let time = ["costs", table, "time_ps"];
        let faster = number(whole, &time) / number(spread, &time);
        assert!(faster > 4.0, "{table}: {faster} times as fast");
        let energy = ["costs", table, "dynamic_fj"];
        assert!(number(whole, &energy) < number(spread, &energy), "messages cost nothing");
    }
    let outcomes = |index: usize| points(&study)[index]["result"]["flown"]["outcomes"].clone();
    assert!((1..7).all(|index| outcomes(index) == outcomes(0)));
    let picture = String::from_utf8(folder.read("out.svg")).unwrap();
    assert_well_formed(&picture);
    assert!(picture.contains("chip time (top: "));
}
