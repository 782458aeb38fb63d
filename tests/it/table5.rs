//! `spikeloop table5`: the paper's table of operations.

use serde_json::Value;

use crate::bad_input::refused;
use crate::cli::Folder;
use crate::fixtures::{Change, eem_san};

const AS_IS: Change = &|_, _, _| ();

fn totals<'a>(result: &'a Value, row: usize, accounting: &str) -> &'a Value {
    &result["rows"][row]["totals"][accounting]
}

#[test]
fn table5_of_the_papers_sizes_has_the_papers_figures() {
    let folder = Folder::new();
    let ran = folder.good("table5 untrained --seconds 1 --json t.json");
    for text in [
        "the weights are random",
        "61,586,610 |      61,069,600 |           6.16e7 |          6.11e7",
        "57,794,560",
        "8,517,920",
        "5,242,880",
        "(paper 4.63), 11.65 multiplications (paper 11.66",
        "4.6 pJ per MAC (Horowitz, ISSCC 2014: 45 nm, 0.9 V, ",
        "0.138",
        "agree exactly in all rows and accountings",
    ] {
        assert!(ran.out.contains(text), "{text} is not in\n{}", ran.out);
    }
    let result = folder.json("t.json");
    assert_eq!(
        (&result["ticks"], &result["random_weights"]),
        (&Value::from(20), &Value::from(true))
    );
    let multiplications: Vec<u64> = (0..4)
        .map(|row| totals(&result, row, "paper")["multiplications"].as_u64().unwrap() / 20)
        .collect();
    assert_eq!(multiplications, [5_242_880, 57_794_560, 8_517_920, 61_069_600]);
    assert_eq!(totals(&result, 3, "paper")["additions"], 20 * 61_586_610u64);
    for row in 0..4 {
        assert_eq!(result["rows"][row]["equals_closed_form"], true, "row {row}");
    }
    let rate = &result["rates"][1];
    assert_eq!(rate["layer"], "encoder.1");
    assert!((rate["implied_by_paper"].as_f64().unwrap() - 0.1376).abs() < 1e-4, "{rate}");
}

#[test]
fn table5_of_a_file_is_the_same_for_the_same_seed_and_flies_on_after_a_trial() {
    let folder = Folder::new();
    folder.write("small.safetensors", eem_san(true, AS_IS));
    let line = "table5 small.safetensors --arena courtyard-moving --seconds 2 --seed 4";
    let (once, again) = (folder.good(line), folder.good(line));
    assert_eq!(once.out, again.out);
    assert!(once.out.contains("40 control ticks of"), "{}", once.out);
    assert!(!once.out.contains("the weights are random"), "{}", once.out);
}

#[test]
fn weights_of_0_make_effective_operations_differ_and_that_is_said() {
    let folder = Folder::new();
    let no_weights: Change = &|name, _, values| {
        if name == "actor.fuse.laser.weight" {
            values.fill(0.0);
        }
    };
    folder.write("zero.safetensors", eem_san(true, no_weights));
    let ran = folder.run("table5 zero.safetensors --seconds 1 --json z.json");
    assert_eq!(ran.code, Some(1), "{}{}", ran.out, ran.err);
    let wanted = "differ in (i), (ii), (iii), (iv); weights that are 0";
    assert!(ran.out.contains(wanted), "{}", ran.out);
    assert_eq!(folder.json("z.json")["rows"][3]["equals_closed_form"], false);
}

#[test]
fn networks_without_an_encoder_have_no_table5() {
    let folder = Folder::new();
    folder.write("blind.safetensors", eem_san(false, AS_IS));
    folder.write("arena.json", "{");
    for (line, text) in [
        ("table5 blind.safetensors", "blind.safetensors: not an EEM-SAN with HSVAE's encoder"),
        ("table5 reflex", "reflex: a network with a rate code, not an EEM-SAN; give"),
        ("table5 nothing.safetensors", "nothing.safetensors: "),
        ("table5 untrained --arena arena.json", "arena.json"),
        ("table5 untrained --v-max 20", "wheel speed (m/s) is 20, must be 0.05..=10"),
        ("table5 untrained --seconds 0", "0 is not in 1..=2000"),
    ] {
        refused(&folder, line, &[text]);
    }
}
