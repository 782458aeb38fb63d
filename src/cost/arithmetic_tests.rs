use super::*;

#[test]
fn tables_have_sources_and_the_published_energy_per_mac() {
    let tables = ArithmeticTable::all();
    let macs: Vec<(&str, f64)> = tables.iter().map(|t| (t.name.as_str(), t.mac_pj())).collect();
    assert_eq!(macs[0].0, "float32-45nm");
    assert!((macs[0].1 - 4.6).abs() < 1e-12 && (macs[1].1 - 0.23).abs() < 1e-12, "{macs:?}");
    assert!(tables.iter().all(|table| table.source.contains("Horowitz, ISSCC 2014")));
}

#[test]
fn energy_is_counts_times_prices() {
    let ops = Ops { additions: 10, multiplications: 2 };
    assert!((ArithmeticTable::float32().energy_pj(&ops) - 16.4).abs() < 1e-12);
}
