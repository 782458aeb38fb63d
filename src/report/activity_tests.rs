use hw_model::{ChipSpec, CoreMapParts};

use super::*;

fn map() -> CoreMap {
    let text = "\
chip loihi1
core 000 label a
core 000 group cx=0000..0002 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
population a core=000 cx=0000..0002
";
    let parts = CoreMapParts::from_text("p", text, ChipSpec::loihi1()).unwrap();
    CoreMap::new(parts).unwrap()
}

fn driver(digest: &str, ops: u64) -> String {
    format!(
        r#"{{"map_digest": "{digest}", "summary": {{"decisions": 5}},
             "counters_by_core": [{{"synaptic_ops_sparse": {ops}}}]}}"#
    )
}

#[test]
fn drivers_and_seeds_of_one_map_are_added_up_and_others_left_out() {
    let map = map();
    let digest = map.digest();
    let (one, two, other) = (driver(&digest, 10), driver(&digest, 30), driver("x", 1000));
    let text = format!(r#"{{"drivers": [{{"label": "float"}}, {one}, {other}, {two}]}}"#);
    let activity = CoreActivity::from_json("f", &text, &map).unwrap();
    assert_eq!((activity.synaptic_ops(0), activity.most()), (4.0, 4.0));
    assert_eq!(activity.unit(), "decision");
}

#[test]
fn what_is_not_of_this_map_is_refused_with_what_it_is_of() {
    let map = map();
    let error = |text: &str| CoreActivity::from_json("f", text, &map).unwrap_err().to_string();
    assert!(error("[").starts_with("f: not a result of `spikeloop run`, `drive` or `agree"));
    let text = format!(r#"{{"drivers": [{}]}}"#, driver("abc", 1));
    let expected = format!("f: no counters of the cores of map {}, but of abc; ", map.digest());
    assert!(error(&text).starts_with(&expected), "{}", error(&text));
    assert!(error("{}").contains(", but of none; "));
    let two = format!(r#"{{"map_digest": "{}", "counters_by_core": [{{}}, {{}}]}}"#, map.digest());
    assert_eq!(error(&two), "f: counters of 2 cores, the map has 1; run or drive it again");
}
