use std::collections::BTreeMap;

use super::*;
use crate::report::results::ChipResult;

fn summary(decisions: u64, dynamic_fj: u64) -> Summary {
    let cost = Cost {
        synapses_fj: dynamic_fj,
        compartments_fj: 0,
        network_fj: 0,
        dynamic_fj,
        dynamic_windowed_fj: 0,
        dynamic_encoder_fj: 0,
        time_ps: 3_000_000 * decisions,
        barrier_ps: 0,
        static_fj: 0,
    };
    let chip = ChipResult {
        counters: BTreeMap::new(),
        windowed_counters: BTreeMap::new(),
        host_counters: BTreeMap::new(),
        costs: BTreeMap::from([("t".to_owned(), cost)]),
    };
    Summary {
        trials: 1,
        success: 1,
        collision: 0,
        time_out: 0,
        path_m_mean: Some(1.0),
        time_s_mean: Some(1.0),
        decisions,
        chip: Some(chip),
        artificial: Some(Ops { additions: 3_000_000, multiplications: 2_000_000 }),
        contacts: None,
    }
}

#[test]
fn seeds_are_weighed_by_their_decisions_and_stand_beside_the_counterpart() {
    // 2 uJ in each of 10 decisions and 5 uJ in each of 20: 4 uJ.
    let (one, two) = (summary(10, 20_000_000_000), summary(20, 100_000_000_000));
    let text = energy_table(&["name"], vec![(vec!["a".to_owned()], vec![&one, &two])])
        .unwrap()
        .to_string();
    let row: Vec<&str> = text.lines().last().unwrap().split('|').map(str::trim).collect();
    // 3 x 0.9 + 2 x 3.7 = 10.1 uJ; 3 x 0.03 + 2 x 0.2 = 0.49 uJ.
    assert_eq!(row[1..7], ["a", "4.00", "3.0", "2000000", "10.10", "0.49"], "{text}");
    let head = text.lines().next().unwrap();
    assert!(head.contains("t (uJ)") && head.contains("float32-45nm (uJ)"), "{text}");
}

#[test]
fn a_chip_without_a_cost_table_has_dashes_there() {
    let (one, mut two) = (summary(10, 20_000_000_000), summary(10, 20_000_000_000));
    let costs = &mut two.chip.as_mut().unwrap().costs;
    let cost = costs.remove("t").unwrap();
    costs.insert("u".to_owned(), cost);
    let rows = vec![(vec!["a".to_owned()], vec![&one]), (vec!["b".to_owned()], vec![&two])];
    let text = energy_table(&["name"], rows).unwrap().to_string();
    let row = |line: &str| line.split('|').map(|c| c.trim().to_owned()).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = text.lines().skip(2).map(row).collect();
    assert_eq!(rows[0][1..6], ["a", "2.00", "3.0", "-", "-"], "{text}");
    assert_eq!(rows[1][1..6], ["b", "-", "-", "2.00", "3.0"], "{text}");
}

#[test]
fn without_a_chip_there_is_no_table() {
    let float = Summary { chip: None, artificial: None, ..summary(1, 1) };
    assert!(energy_table(&["name"], vec![(vec!["a".to_owned()], vec![&float])]).is_none());
    let bare = Summary { artificial: None, ..summary(1, 1) };
    let text =
        energy_table(&["name"], vec![(vec!["a".to_owned()], vec![&bare])]).unwrap().to_string();
    let row: Vec<&str> = text.lines().last().unwrap().split('|').map(str::trim).collect();
    assert_eq!(row[4..7], ["-", "-", "-"], "{text}");
}
