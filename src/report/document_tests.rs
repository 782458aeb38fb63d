use super::*;
use crate::evaluate::Agreement;

fn agreement() -> AgreementResult {
    AgreementResult {
        revision: "r1".to_owned(),
        network: "a<b>&\"n".to_owned(),
        map_digest: "abc".to_owned(),
        policy: "nearest".to_owned(),
        decisions: 3,
        counters_by_core: Vec::new(),
        arena: "map1".to_owned(),
        v_max_m_per_s: Some(1.0),
        seed: 1,
        trials: 2,
        delays_steps: vec![0],
        agreement: Agreement { action_difference_sum: 0.1, ..Agreement::default() },
    }
}

#[test]
fn a_report_reads_itself_back() {
    let mut report = Report::new("r2");
    report.push("a.json", Content::Agreement(agreement()));
    let thresholds = ThresholdsResult { revision: "r1".to_owned(), thresholds: Vec::new() };
    report.push("t.json", Content::Thresholds(thresholds));
    let text = serde_json::to_string(&report).unwrap();
    let mut again = Report::new("r2");
    again.add("report.json", &text).unwrap();
    assert_eq!(again, report);
    assert_eq!(again.maps(), [("a<b>&\"n".to_owned(), "abc".to_owned())]);
}

#[test]
fn files_of_no_known_kind_are_refused() {
    let mut report = Report::new("r");
    let mut refused = |text: &str| report.add("x.json", text).unwrap_err().to_string();
    let unknown = refused("{\"a\": 1, \"b\": 2}");
    assert!(unknown.starts_with("x.json: fields a, b; not a result"), "{unknown}");
    assert!(unknown.contains("drive --replay") && unknown.contains("agree --json"), "{unknown}");
    assert!(refused("[1, 2]").starts_with("x.json: fields none; not a result"));
    assert!(refused("").starts_with("x.json: not JSON (EOF"));
    let form = refused("{\"agreement\": {}}");
    assert!(form.starts_with("x.json: not a result of `spikeloop agree --json`"), "{form}");
    let form = refused("{\"utilization\": []}");
    assert!(form.starts_with("x.json: not a result of `spikeloop inspect --json`"), "{form}");
    assert!(refused("{\"items\": 1, \"format\": 1}").contains("items is no list"));
    assert!(refused("{\"items\": [], \"format\": 9}").contains("format 9 found, 1 expected"));
    let nested = "{\"items\": [{\"file\": \"f\", \"content\": {\"items\": []}}], \"format\": 1}";
    assert!(refused(nested).contains("a report within a report"));
    let study = refused("{\"points\": [], \"axes\": []}");
    assert!(study.starts_with("x.json: not a table of `spikeloop study`"), "{study}");
    assert!(refused("{\"cells\": []}").contains("not a table of `spikeloop evaluate`"));
}
