use hw_model::{ChipSpec, CoreMapParts};

use super::*;

/// Two layers on three cores; the first has its neurons scattered.
const TEXT: &str = "\
chip loihi1
core 000 label a<b
core 000 group cx=0000..0006 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
core 001 label b
core 001 group cx=0000..0002 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
core 002 label free
core 002 group cx=0000..0001 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
population a core=000 cx=0000..0005/2
population a core=001 cx=0000..0001
population b core=000 cx=0001..0002
population b core=001 cx=0001..0002
";

fn map() -> CoreMap {
    let parts = CoreMapParts::from_text("p", TEXT, ChipSpec::loihi1()).unwrap();
    CoreMap::new(parts).unwrap()
}

#[test]
fn every_core_is_drawn_in_both_views_with_the_colour_of_its_layer() {
    let svg = chip_picture("n&m", &map(), None);
    assert_eq!(svg.matches("<title>").count(), 2 * 128);
    assert_eq!(svg.matches(": not in use</title>").count(), 2 * 125);
    assert!(svg.contains("n&amp;m on loihi1: 3 of 128 cores"), "{svg}");
    assert!(svg.contains("core 0 a&lt;b: 6/1024 compartments"), "{svg}");
    // Cores 0 and 1 and the legend; a core with as many of either goes to the first.
    assert_eq!(svg.matches(COLOURS[0]).count(), 3);
    assert_eq!(svg.matches(COLOURS[1]).count(), 1);
    assert!(svg.contains("a: 4 neurons on 2 cores"), "{svg}");
}

#[test]
fn no_two_cores_lie_on_each_other() {
    let map = map();
    let plan = Plan::new(&map);
    let mut places: Vec<_> = (0..128).map(|core| plan.place(core)).collect();
    assert!(places.iter().all(|(x, y)| x + CORE_PX <= plan.width && y + CORE_PX <= plan.height));
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 128);
}

#[test]
fn a_third_view_shows_what_each_core_did() {
    let map = map();
    let saved = format!(
        r#"{{"map_digest": "{}", "steps": 4, "counters_by_core":
            [{{"synaptic_ops_dense": 40, "updates_spiking": 4}}, {{"synaptic_ops_kernel": 20}}, {{}}]}}"#,
        map.digest()
    );
    let activity = CoreActivity::from_json("run.json", &saved, &map).unwrap();
    let svg = chip_picture("n", &map, Some(&activity));
    assert_eq!(svg.matches("<title>").count(), 3 * 128);
    assert!(svg.contains("synaptic operations per chip step, white 0 to dark 10<"), "{svg}");
    assert!(svg.contains("; per chip step 10.0 synaptic operations, 1.0 spikes, 0.0 messages<"));
    // Core 0 is the busiest, core 1 half as busy.
    assert_eq!(svg.matches(&shade(1.0)).count(), 1);
    assert_eq!(svg.matches(&shade(0.5)).count(), 1);
}
