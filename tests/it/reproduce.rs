//! `spikeloop reproduce`: its tables, going on, bad input.

use crate::bad_input::refused;
use crate::cli::Folder;

/// One trial of what ships.
const SMALL: &str =
    "reproduce --only ablation --only thresholds --only learned --trials 1 --seeds 1";

#[test]
fn tables_say_what_was_flown() {
    let folder = Folder::new();
    let ran = folder.good(SMALL);
    for part in [
        "Ablation (table 3)",
        "(b) E2E, addition | 0.705 |",
        "Learnable against fixed thresholds",
        "Thresholds (figure 4)",
        "wrote out/reproduce/reproduction.html",
    ] {
        assert!(ran.out.contains(part), "no {part:?} in {}", ran.out);
    }
    assert!(!ran.out.contains("not trained: "), "{}", ran.out);
    assert!(!ran.out.contains("Degraded conditions"), "{}", ran.out);
    let again = folder.good(SMALL);
    let tables = |out: &str| out.split("\nAblation").nth(1).unwrap().to_owned();
    assert_eq!(tables(&again.out), tables(&ran.out));
    assert!(again.out.contains("cells are in the state file already"), "{}", again.out);
    let page = String::from_utf8(folder.read("out/reproduce/reproduction.html")).unwrap();
    assert!(page.contains("<h2>The paper's tables</h2>"));
    let picture = String::from_utf8(folder.read("out/reproduce/ablation.svg")).unwrap();
    assert!(picture.starts_with("<svg ") && picture.contains("(a) PopSAN"), "{picture}");
    assert!(!folder.path("out/reproduce/success.svg").exists());
    folder.good("report out/reproduce/reproduction.json -o page.html");
    let page = String::from_utf8(folder.read("page.html")).unwrap();
    assert!(page.contains("Ablation (table 3)"));
}

#[test]
fn every_row_has_its_costs() {
    let folder = Folder::new();
    let ran = folder.good("reproduce --only cost --as-flown --trials 1 --seeds 1");
    let (chip, floats) = ran.out.split_once("per decision of the float network as it is").unwrap();
    assert!(chip.contains("per decision on the chip, past movers on map1, all seeds"), "{chip}");
    let row = |text: &str, name: &str| {
        let row = text.lines().find(|line| line.contains(&format!(" {name} "))).map(str::to_owned);
        row.unwrap_or_else(|| panic!("no {name} in {text}"))
    };
    for refused in ["compare/bdett", "compare/avae"] {
        assert!(row(chip, refused).contains("not on this chip"), "{chip}");
    }
    assert!(row(chip, "compare/fsvae").contains(" 122 |"), "{chip}");
    // Of every step: two products a neuron, BDETT's five more and four a layer.
    assert!(row(floats, "compare/san").contains(" 7700 |"), "{floats}");
    assert!(row(floats, "compare/bdett").contains(" 27030 |"), "{floats}");
}

#[test]
fn without_flights_there_is_what_was_flown() {
    let folder = Folder::new();
    let nothing = folder.good("reproduce --only ablation --as-flown --trials 1 --seeds 1");
    assert!(nothing.out.contains(" not flown |"), "{}", nothing.out);
    assert!(!nothing.out.contains(" of 1 ("), "{}", nothing.out);
    folder.good("evaluate compare/popsan --condition dynamic-1.0 --map map1 --trials 1 --seeds 1 --state out/reproduce/state.json");
    let some = folder.good("reproduce --only ablation --as-flown --trials 1 --seeds 1");
    assert!(!some.out.contains(" of 1 ("), "{}", some.out);
    let row = |method: &str| some.out.lines().find(|line| line.contains(method)).unwrap();
    assert!(row("(a) PopSAN").contains("; 2 not flown |"), "{}", some.out);
    assert!(row("(c) HSVAE, addition").contains("not flown"), "{}", some.out);
}

#[test]
fn robots_whose_wheels_lag_have_tables_of_their_own() {
    let folder = Folder::new();
    let line = "reproduce --only success --as-flown --trials 1 --seeds 1";
    let flown = "evaluate compare/popsan --trials 1 --seeds 1 --state";
    folder.good(&format!("{line} --actuators lag -o lag"));
    folder.good(&format!("{flown} lag/state.json --actuators lag"));
    let ran = folder.good(&format!("{line} --actuators lag -o lag"));
    assert!(ran.out.contains("\nactuators lag\n"), "{}", ran.out);
    assert!(ran.out.contains("; 2 not flown |"), "{}", ran.out);
    let page = String::from_utf8(folder.read("lag/reproduction.html")).unwrap();
    assert!(page.contains("each training, actuators lag."));
    let part = "lag/state.json: actuators is \"lag\" there and \"ideal\" here";
    refused(&folder, &format!("{line} -o lag"), &[part]);
}

#[test]
fn what_makes_no_sense_is_refused_before_anything_flies() {
    let folder = Folder::new();
    folder.write("file", b"");
    let cases = [
        ("reproduce --only table9", "possible values: success, ablation"),
        ("reproduce --output file", "file: cannot make the folder: "),
        ("reproduce --trials 0", "0 is not in 1..=10000"),
        ("reproduce --seed 18446744073709551615", "take a smaller seed"),
    ];
    for (line, part) in cases {
        refused(&folder, line, &[part]);
    }
    folder.good("reproduce --only learned --trials 1 --seeds 1 -o r");
    folder.write("r/state.json", b"{}");
    refused(&folder, "reproduce --only learned -o r", &["r/state.json: not a table of "]);
    assert_eq!(folder.read("r/state.json"), b"{}");
}
