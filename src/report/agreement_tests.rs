use super::*;
use crate::evaluate::LayerAgreement;

#[test]
fn a_layer_without_spikes_agrees_in_nothing() {
    let layer = |float, chip, both| LayerAgreement {
        layer: "d".to_owned(),
        neurons: 2,
        steps: 10,
        float,
        chip,
        both,
        both_in_tick: both,
    };
    let layers = vec![layer(0, 0, 0), layer(4, 3, 2), layer(0, 1, 0)];
    let table = agreement_table(&Agreement { layers, ..Agreement::default() }).to_string();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| line.starts_with("| d "))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    assert_eq!(rows[0][6..9], ["-", "-", "0.000"]);
    assert_eq!(rows[1][6..9], ["40.000", "40.000", "20.000"]);
    assert_eq!(rows[2][6..9], ["0.000", "0.000", "0.000"]);
}
