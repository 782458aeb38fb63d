use super::printed::{ABLATION, SUCCESS, TABLES};
use super::{
    CostRow, CountedOps, RateRow, Trained, cost_rows_table, counted_table, degraded, rate_table,
    reproduced, step_table,
};
use crate::closed_loop::TrialConfig;
use crate::cost::Ops;
use crate::report::results::{ChipResult, Cost, Summary};
use crate::report::success::{Cell, SuccessSettings, SuccessTable};
use crate::world::dvs::CameraConfig;

fn empty(trials: usize) -> SuccessTable {
    let config = TrialConfig::eem_san(1.0);
    SuccessTable::new(SuccessSettings::new(trials, 1, &config, &CameraConfig::default()))
}

fn cell(network: &str, map: &str, seed: u64, success: usize) -> Cell {
    let summary = Summary {
        trials: 100,
        success,
        collision: 100 - success,
        time_out: 0,
        path_m_mean: None,
        time_s_mean: None,
        decisions: 1000,
        chip: None,
        artificial: None,
        contacts: None,
    };
    Cell {
        network: network.to_owned(),
        network_digest: None,
        core_map_digest: None,
        map: map.to_owned(),
        arena_digest: String::new(),
        condition: "dynamic-1.0".to_owned(),
        degraded: None,
        seed,
        revision: String::new(),
        camera: false,
        summary,
    }
}

fn trained(rates: &[&[usize]]) -> RateRow {
    let one = |success: &&[usize]| Trained {
        network: String::new(),
        success: success.to_vec(),
        trials: 100,
    };
    RateRow {
        label: String::new(),
        condition: String::new(),
        degraded: None,
        map: String::new(),
        on_chip: false,
        printed: None,
        trained: rates.iter().map(one).collect(),
        not_flown: Vec::new(),
        refused: Vec::new(),
        missing: Vec::new(),
    }
}

#[test]
fn spread_is_of_trainings_and_the_error_at_least_that_of_the_trials() {
    let one = trained(&[&[50, 70]]);
    assert_eq!((one.mean(), one.spread()), (Some(0.6), None));
    assert!((one.standard_error().unwrap() - (0.6f64 * 0.4 / 200.0).sqrt()).abs() < 1e-12);
    let three = trained(&[&[40, 60], &[60, 60], &[70, 70]]);
    assert!((three.mean().unwrap() - 0.6).abs() < 1e-12);
    assert!((three.spread().unwrap() - 0.1).abs() < 1e-12);
    assert!((three.standard_error().unwrap() - 0.1 / 3f64.sqrt()).abs() < 1e-12);
    let alike = trained(&[&[60, 60], &[60, 60], &[60, 60]]);
    assert_eq!(alike.spread(), Some(0.0));
    assert!((alike.standard_error().unwrap() - (0.6f64 * 0.4 / 600.0).sqrt()).abs() < 1e-12);
    let none = trained(&[]);
    assert_eq!((none.mean(), none.spread(), none.standard_error()), (None, None, None));
}

#[test]
fn printed_rates_and_steps_are_the_papers() {
    let part = reproduced(&SUCCESS, &empty(100), &|_| true);
    let printed = |label: &str, condition: &str, map: &str| {
        let same = |r: &&RateRow| r.label == label && r.condition == condition && r.map == map;
        part.rows.iter().find(same).unwrap().printed
    };
    assert_eq!(printed("SAN", "static-1.0", "map1"), Some(0.645));
    assert_eq!(printed("BDETT", "static-0.5", "map2"), Some(0.923));
    assert_eq!(printed("EEM-SAN", "dynamic-1.0", "map2"), Some(0.743));
    let ablation = reproduced(&ABLATION, &empty(100), &|_| true);
    let steps: Vec<f64> = ablation.steps.iter().map(|step| step.printed.unwrap()).collect();
    for (step, expected) in steps.iter().zip([0.107, 0.023, 0.037]) {
        assert!((step - expected).abs() < 1e-9, "{steps:?}");
    }
    for table in TABLES {
        for (from, to) in table.steps {
            assert!(from.max(to) < &table.rows.len(), "{}", table.name);
        }
    }
}

#[test]
fn rows_that_were_not_flown_say_why() {
    let mut table = empty(100);
    table.cells = vec![
        cell("compare/popsan", "map1", 1, 50),
        cell("compare/popsan", "map1", 2, 54),
        cell("compare/popsan-2", "map1", 1, 62),
        cell("compare/eem-san", "map1", 1, 80),
        cell("compare/eem-san", "map2", 1, 10),
    ];
    let part = reproduced(&ABLATION, &table, &|name| !name.contains("e2e"));
    let text = rate_table(&part).to_string();
    for line in [
        "0.598 | 0.570 | 0.050 |  0.071 |                        0.500 0.540; 0.620; 1 not flown |",
        "not trained: compare/e2e, compare/e2e-2, compare/e2e-3 |",
        "not flown |",
        "0.765 | 0.800 | 0.040 |      - |",
    ] {
        assert!(text.contains(line), "no {line:?} in\n{text}");
    }
    let steps = step_table(&part).unwrap().to_string();
    assert!(steps.contains("+0.107 |    - |    - |"), "{steps}");
}

#[test]
fn degraded_rows_are_of_their_own_cells() {
    let mut table = empty(100);
    let near = |network: &str, success| Cell {
        degraded: Some("beams-near".to_owned()),
        ..cell(network, "map1", 1, success)
    };
    table.cells =
        vec![cell("eem-san", "map1", 1, 70), near("eem-san", 40), near("chip:eem-san", 30)];
    let part = degraded(&table, &|_| true, &|name| name == "compare/bdett");
    let mean = |degraded: Option<&str>, on_chip: bool| {
        let same = |row: &&RateRow| {
            row.label == "EEM-SAN, longer"
                && row.degraded.as_deref() == degraded
                && row.on_chip == on_chip
        };
        part.rows.iter().find(same).unwrap().mean()
    };
    assert_eq!(mean(None, false), Some(0.7));
    assert_eq!(mean(None, true), None);
    assert_eq!(mean(Some("beams-near"), false), Some(0.4));
    assert_eq!(mean(Some("beams-near"), true), Some(0.3));
    assert_eq!(mean(Some("laser-noise"), true), None);
    let text = rate_table(&part).to_string();
    let line =
        |text: &str, of: &str| text.lines().find(|line| line.contains(of)).unwrap().to_owned();
    assert!(line(&text, "SAN, chip").ends_with("not flown |"), "{text}");
    assert!(line(&text, "BDETT, chip").ends_with("not flown |"), "{text}");
    let part = degraded(&table, &|_| true, &|name| name.starts_with("compare/bdett"));
    let text = rate_table(&part).to_string();
    assert!(line(&text, "BDETT, chip").ends_with("refused by the compiler |"), "{text}");
    assert!(line(&text, " BDETT |").ends_with("not flown |"), "{text}");
}

#[test]
fn costs_are_sums_of_whole_cells() {
    let mut table = empty(100);
    let cost = |dynamic_fj, time_ps| Cost {
        synapses_fj: 0,
        compartments_fj: 0,
        network_fj: 0,
        dynamic_fj,
        dynamic_windowed_fj: 0,
        dynamic_encoder_fj: 0,
        time_ps,
        barrier_ps: 0,
        static_fj: 0,
    };
    for seed in [1, 2] {
        let mut flown = cell("chip:n", "map1", seed, 30);
        flown.summary.chip = Some(ChipResult {
            counters: [
                ("synaptic_ops_dense", 4000),
                ("synaptic_ops_kernel", 1000),
                ("messages", 7),
            ]
            .map(|(name, count)| (name.to_owned(), count))
            .into(),
            windowed_counters: Default::default(),
            host_counters: Default::default(),
            costs: [("davies2018".to_owned(), cost(4_000_000_000_000, 7_000_000_000))].into(),
        });
        table.cells.push(flown);
    }
    let mut row = CostRow { network: "n".to_owned(), cores: 3, ..CostRow::default() };
    row.add(&table, "dynamic-1.0", "map1");
    let refused = Some("too large".to_owned());
    let other = CostRow { network: "m".to_owned(), refused, ..CostRow::default() };
    let open = CostRow { network: "o".to_owned(), cores: 5, ..CostRow::default() };
    let text = cost_rows_table(&[row, other, open]).to_string();
    for line in ["| n       |           60/200 |     3 |        5 |            4.00 |", "7.0 |"] {
        assert!(text.contains(line), "no {line:?} in\n{text}");
    }
    assert!(text.contains("| m       | not on this chip |     - |"), "{text}");
    assert!(text.contains("| o       |        not flown |     5 |        - |"), "{text}");
}

#[test]
fn operations_are_means_over_control_ticks() {
    let ops = Ops { additions: 3_000_000, multiplications: 1_000_000 };
    let counted = Some(CountedOps { ticks: 10, ops });
    let row = CostRow { network: "n".to_owned(), counted, ..CostRow::default() };
    let other = CostRow { network: "m".to_owned(), ..CostRow::default() };
    let text = counted_table(&[row, other]).to_string();
    // 0.9 pJ a sum and 3.7 pJ a product of 32-bit floats: 2.7 + 3.7 uJ for ten ticks.
    assert!(text.contains("| n       | 300000 |   100000 |             0.640 |"), "{text}");
    assert!(!text.contains("| m"), "{text}");
}
