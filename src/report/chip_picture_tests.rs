use hw_model::{ChipSpec, CoreMap, CoreMapParts};

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

fn plan() -> ChipPlan {
    ChipPlan::of_map("n&m", "integer", &map())
}

#[test]
fn every_core_is_drawn_in_both_views_with_the_colour_of_its_layer() {
    let svg = chip_picture(&plan(), None);
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
    let plan = plan();
    let layout = Layout::new(&plan.mesh);
    let mut places: Vec<_> = (0..128).map(|core| layout.place(core)).collect();
    let fits = |(x, y): &(u32, u32)| x + CORE_PX <= layout.width && y + CORE_PX <= layout.height;
    assert!(places.iter().all(fits));
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 128);
}

#[test]
fn plans_that_cannot_be_drawn_are_refused() {
    type Damage = fn(&mut ChipPlan);
    let damages: [(Damage, &str); 4] = [
        (|plan| plan.mesh.cores_per_tile = 0, "3 cores in use of 128, on a mesh of 0"),
        (|plan| plan.cores.limit = 2, "3 cores in use of 2, on a mesh of 128"),
        (|plan| plan.layer_of_core = vec![None], "layers of 1 cores, 3 expected"),
        (|plan| plan.layer_of_core[0] = Some(2), "numbered below 2"),
    ];
    plan().check().unwrap();
    for (damage, part) in damages {
        let mut plan = plan();
        damage(&mut plan);
        assert!(plan.check().unwrap_err().contains(part), "{:?}", plan.check());
    }
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
    let svg = chip_picture(&plan(), Some(&activity));
    assert_eq!(svg.matches("<title>").count(), 3 * 128);
    assert!(svg.contains("synaptic operations per chip step, white 0 to dark 10<"), "{svg}");
    assert!(svg.contains("; per chip step 10.0 synaptic operations, 1.0 spikes, 0.0 messages<"));
    // Core 0 is the busiest, core 1 half as busy.
    assert_eq!(svg.matches(&shade(1.0)).count(), 1);
    assert_eq!(svg.matches(&shade(0.5)).count(), 1);
}
