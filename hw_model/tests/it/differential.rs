//! All engines give the same spikes, states, counts and times on random maps.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use hw_model::compartment::CompartmentState;
use hw_model::core_map::{Core, HostPort};
use hw_model::cost::CostTable;
use hw_model::engine::{PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::id::{CompartmentIdx, CoreId};
use hw_model::trace::{Detail, observe, total_lines};
use hw_model::{
    ChipSpec, CoreMap, CoreMapParts, DenseEngine, Engine, EventEngine, Faults, OpCounts,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use crate::random_map::{config, recipe, sorted, spikes, stimulus};

pub(crate) const STEPS: usize = 24;
pub(crate) const THREADS: [usize; 4] = [1, 2, 3, 5];

pub(crate) fn dense(map: &Arc<CoreMap>) -> Box<dyn Engine> {
    Box::new(DenseEngine::new(Arc::clone(map)))
}

pub(crate) fn event(map: &Arc<CoreMap>, threads: usize) -> Box<dyn Engine> {
    Box::new(EventEngine::with_threads(Arc::clone(map), threads))
}

/// Everything that can be seen of an engine after a run, as text.
pub(crate) fn seen(engine: &dyn Engine, record: &SpikeRecord) -> Vec<String> {
    let mut lines: Vec<String> = record.spikes.iter().map(|s| format!("{s:?}")).collect();
    for (core, of_core) in engine.map().cores().iter().enumerate() {
        lines.extend((0..of_core.compartments()).map(|cx| {
            format!("{:?}", engine.state(CoreId(core as u16), CompartmentIdx(cx as u16)))
        }));
    }
    lines.extend(engine.core_counts().iter().map(|counts| format!("{counts:?}")));
    lines.extend(total_lines(engine));
    lines.push(format!("slowest {:?}", engine.slowest_ps()));
    assert_eq!(waited(engine), engine.chip_time_ps());
    lines.push(format!("now {}", engine.now()));
    lines
}

/// Time of slowest cores, all cores together, and of barriers.
fn waited(engine: &dyn Engine) -> Vec<u64> {
    let (tables, tiles) = (&engine.map().chip().cost_tables, engine.map().tiles_in_use());
    let of_table = |(index, table): (usize, &CostTable)| {
        let cores = engine.slowest_ps().chunks_exact(tables.len()).map(|of_core| of_core[index]);
        cores.sum::<u64>() + engine.total_counts().barriers * table.barrier_ps(tiles)
    };
    tables.iter().enumerate().map(of_table).collect()
}

pub(crate) fn run_whole(mut engine: Box<dyn Engine>, stimulus: &Stimulus) -> Vec<String> {
    let mut record = SpikeRecord::all(engine.map());
    engine.run(stimulus, &mut record);
    seen(engine.as_ref(), &record)
}

proptest! {
    #![proptest_config(config(100))]

    #[test]
    fn every_engine_and_thread_count_agrees_in_every_step(
        recipe in recipe(),
        raw in spikes(STEPS),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let expected = observe(dense(&map).as_mut(), &stimulus, Detail::Compartment);
        let expected_end = run_whole(dense(&map), &stimulus);
        for threads in THREADS {
            let lines = observe(event(&map, threads).as_mut(), &stimulus, Detail::Compartment);
            prop_assert_eq!(&lines, &expected, "{} threads", threads);
            let end = run_whole(event(&map, threads), &stimulus);
            prop_assert_eq!(&end, &expected_end, "{} threads", threads);
        }
    }

    #[test]
    fn a_run_in_pieces_equals_the_run_in_one(
        recipe in recipe(),
        raw in spikes(STEPS),
        cuts in prop::collection::vec(0..=STEPS, 0..5),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let cuts = sorted([cuts, vec![0, STEPS]].concat());
        let expected = run_whole(dense(&map), &stimulus);
        for mut engine in [dense(&map), event(&map, 1), event(&map, 3)] {
            let mut record = SpikeRecord::all(&map);
            for piece in cuts.windows(2) {
                engine.run(&stimulus.part(piece[0]..piece[1]), &mut record);
            }
            prop_assert_eq!(seen(engine.as_ref(), &record), expected.clone());
        }
    }

    #[test]
    fn a_reset_engine_runs_like_a_fresh_one(
        recipe in recipe(),
        first in spikes(STEPS),
        second in spikes(STEPS),
        odd in 0..2usize,
    ) {
        let map = Arc::new(recipe.build());
        let warm_up = stimulus(&map, STEPS + odd, &first);
        let stimulus = stimulus(&map, STEPS, &second);
        let (expected, expected_counts) = shifted_run(dense(&map).as_mut(), &stimulus);
        for mut engine in [dense(&map), event(&map, 1), event(&map, 3)] {
            engine.run(&warm_up, &mut SpikeRecord::none());
            engine.reset();
            let (lines, counts) = shifted_run(engine.as_mut(), &stimulus);
            prop_assert_eq!(&lines, &expected);
            prop_assert_eq!(counts, expected_counts);
        }
    }

    #[test]
    fn a_fresh_copy_of_a_used_engine_runs_like_a_new_one(
        recipe in recipe(),
        raw in spikes(STEPS),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let mut used = EventEngine::with_threads(Arc::clone(&map), 2);
        let fresh = used.fresh();
        used.run(&stimulus, &mut SpikeRecord::none());
        let expected = run_whole(dense(&map), &stimulus);
        prop_assert_eq!(run_whole(Box::new(fresh), &stimulus), expected.clone());
        prop_assert_eq!(run_whole(Box::new(used.fresh()), &stimulus), expected);
    }

    #[test]
    fn engines_agree_while_cores_are_held_released_and_cleared(
        recipe in recipe(),
        raw in spikes(STEPS),
        orders in prop::collection::vec((0..STEPS, any::<u16>(), 0..4u8), 1..10),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let expected = ordered_run(dense(&map).as_mut(), &stimulus, &orders);
        for threads in THREADS {
            let lines = ordered_run(event(&map, threads).as_mut(), &stimulus, &orders);
            prop_assert_eq!(&lines, &expected, "{} threads", threads);
        }
    }

    #[test]
    fn core_numbers_do_not_change_what_populations_do(
        (recipe, order) in recipe().prop_flat_map(|recipe| {
            let ids: Vec<usize> = (0..recipe.parts().cores.len()).collect();
            (Just(recipe), Just(ids).prop_shuffle())
        }),
        raw in spikes(STEPS),
    ) {
        let parts = recipe.parts();
        let here = population_run(parts.clone(), &raw);
        let there = population_run(moved(&parts, &order), &raw);
        prop_assert_eq!(here, there);
    }
}

/// A run with steps numbered from its start, and what was counted during it.
fn shifted_run(engine: &mut dyn Engine, stimulus: &Stimulus) -> (Vec<String>, OpCounts) {
    let (start, before) = (engine.now(), engine.total_counts());
    let mut record = SpikeRecord::all(engine.map());
    let mut lines = Vec::new();
    for step in 0..stimulus.steps() {
        engine.run(&stimulus.part(step..step + 1), &mut record);
        let cores = engine.map().cores().iter().enumerate();
        for (core, len) in cores.map(|(core, c)| (core as u16, c.compartments() as u16)) {
            let state = |cx| engine.state(CoreId(core), CompartmentIdx(cx));
            lines.push(format!("{step} {:?}", (0..len).map(state).collect::<Vec<_>>()));
        }
    }
    let spikes = record.spikes.iter();
    lines.extend(spikes.map(|s| format!("{} {} {}", s.step - start, s.core, s.compartment)));
    (lines, engine.total_counts() - before)
}

/// A run in which the management processor does something before some steps: (step, cores as
/// bits, clear, hold, release or clear the state alone).
pub(crate) fn ordered_run(
    engine: &mut dyn Engine,
    stimulus: &Stimulus,
    orders: &[(usize, u16, u8)],
) -> Vec<String> {
    let mut record = SpikeRecord::all(engine.map());
    let mut lines = Vec::new();
    for step in 0..stimulus.steps() {
        for (_, cores, order) in orders.iter().filter(|order| order.0 == step) {
            let named = |core: &CoreId| cores >> (core.0 % 16) & 1 == 1;
            let cores: Vec<CoreId> =
                (0..engine.map().cores().len() as u16).map(CoreId).filter(named).collect();
            match order {
                0 => engine.reset_cores(&cores, true),
                3 => engine.reset_cores(&cores, false),
                1 => engine.set_held(&cores, true),
                _ => engine.set_held(&cores, false),
            }
        }
        engine.run(&stimulus.part(step..step + 1), &mut record);
        lines.extend(seen(engine, &record));
    }
    lines
}

/// Spikes by population and the counts that do not depend on where cores lie.
fn population_run(
    parts: CoreMapParts,
    raw: &[(u64, u32, u32)],
) -> (Vec<PopulationSpikes>, Vec<(&'static str, u64)>) {
    let map = Arc::new(CoreMap::new(parts).unwrap());
    let mut engine = EventEngine::with_threads(Arc::clone(&map), 2);
    let mut record = SpikeRecord::all(&map);
    engine.run(&stimulus(&map, STEPS, raw), &mut record);
    let mut counts = engine.total_counts().named();
    counts.retain(|(name, _)| !name.starts_with("hops") && *name != "messages_within_tile");
    (record.by_population(&map), counts)
}

/// The same map with core `order[i]` of the old one as core `i`.
fn moved(parts: &CoreMapParts, order: &[usize]) -> CoreMapParts {
    let to = |id: CoreId| {
        CoreId(order.iter().position(|old| *old == id.index()).expect("a permutation") as u16)
    };
    let mut moved = parts.clone();
    moved.cores = order.iter().map(|old| parts.cores[*old].clone()).collect();
    for Core { axons_out, .. } in &mut moved.cores {
        axons_out.iter_mut().for_each(|axon| axon.core = to(axon.core));
        axons_out.sort_unstable();
    }
    for slice in moved.populations.iter_mut().flat_map(|p| &mut p.slices) {
        slice.core = to(slice.core);
    }
    for port in &mut moved.ports {
        port.targets.iter_mut().for_each(|target| target.core = to(target.core));
        port.targets.sort_unstable();
    }
    moved
}

#[test]
fn a_step_waits_for_its_slowest_core_and_for_the_first_of_equals() {
    // Core 2 has twice the compartments of core 0; core 1 is as slow as core 0.
    let text = "\
chip loihi1
core 000 label a
core 000 group cx=0000..0002 decay_u=0 decay_v=0 vth=1000 bias=0<<0 refractory=1
core 001 label b
core 001 group cx=0000..0002 decay_u=0 decay_v=0 vth=1000 bias=0<<0 refractory=1
core 002 label c
core 002 group cx=0000..0004 decay_u=0 decay_v=0 vth=1000 bias=0<<0 refractory=1
population p core=000 cx=0000..0002
population q core=001 cx=0000..0002
population r core=002 cx=0000..0004
";
    let parts = CoreMapParts::from_text("p", text, ChipSpec::loihi1()).unwrap();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    let tables = &map.chip().cost_tables;
    let idle = |n: u64, table: &CostTable| {
        let counts = OpCounts { updates_inactive: n, ..OpCounts::default() };
        table.core_time_ps(&counts)
    };
    let of_core = |n: u64, steps: u64| tables.iter().map(move |table| steps * idle(n, table));
    for mut engine in [dense(&map), event(&map, 1), event(&map, 2), event(&map, 3)] {
        engine.run(&Stimulus::silent(5), &mut SpikeRecord::none());
        let last: Vec<u64> = of_core(0, 5).chain(of_core(0, 5)).chain(of_core(4, 5)).collect();
        assert_eq!(engine.slowest_ps(), last);
        engine.set_held(&[CoreId(2)], true);
        engine.run(&Stimulus::silent(3), &mut SpikeRecord::none());
        let both: Vec<u64> = of_core(2, 3).chain(of_core(0, 3)).chain(of_core(4, 5)).collect();
        assert_eq!(engine.slowest_ps(), both);
        assert!(both.iter().filter(|ps| **ps > 0).count() == 2 * tables.len(), "prices are 0");
    }
}

#[test]
fn neuron_numbers_run_through_the_slices_of_a_population_in_order() {
    // Two compartments on each of two cores, all driven by their bias, one more each step.
    let text = "\
chip loihi1
core 000 label a
core 000 group cx=0000..0001 decay_u=0 decay_v=0 vth=1 bias=65<<0 refractory=63
core 000 group cx=0001..0002 decay_u=0 decay_v=0 vth=1 bias=33<<0 refractory=63
core 001 label b
core 001 group cx=0000..0002 decay_u=0 decay_v=0 vth=1 bias=22<<0 refractory=63
population p core=001 cx=0001..0002
population p core=000 cx=0000..0002
population q core=001 cx=0000..0001
";
    let parts = CoreMapParts::from_text("p", text, ChipSpec::loihi1()).unwrap();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    let spikes = |mut record: SpikeRecord| {
        event(&map, 2).run(&Stimulus::silent(4), &mut record);
        record.by_population(&map)
    };
    let p = vec![(0, 1), (1, 2), (2, 0)];
    assert_eq!(spikes(SpikeRecord::all(&map)), [p.clone(), vec![(2, 0)]]);
    assert_eq!(spikes(SpikeRecord::of_population(&map, 0))[0], p);
    assert_eq!(spikes(SpikeRecord::of_population(&map, 1)), [vec![(2, 0)], vec![(2, 0)]]);
    assert_eq!(spikes(SpikeRecord::none()), [vec![], vec![]]);
}

#[test]
fn the_largest_fan_in_does_not_overflow_any_accumulator() {
    // 256 lines on 256 axons each, all with the largest weight there is: 2^16 additions.
    let mut text = "\
chip loihi1
core 000 label sink
core 000 group cx=0000..0001 decay_u=4096 decay_v=4096 vth=1 bias=0<<0 refractory=1
core 000 format 0 mode=mixed bits=8 exp=7
core 000 list 0 entry format=0 dense first=0: -256
"
    .to_owned();
    text.extend((0..256).map(|axon| format!("core 000 axon_in {axon} list=0 base=0\n")));
    text.push_str("port in lines=256\n");
    let targets = (0..256).flat_map(|line| (0..256).map(move |axon| (line, axon)));
    text.extend(targets.map(|(l, a)| format!("port in line {l} -> core 000 axon {a}\n")));
    let parts = CoreMapParts::from_text("sink", &text, ChipSpec::loihi1()).unwrap();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    let stimulus = Stimulus::new(&map, 2, (0..256).map(|line| (0, 0, line))).unwrap();
    // -2^16 * (2^15 - 1) * 2^6 = -2^37 + 2^22: a multiple of 2^22, so nothing is left of it.
    let expected = run_whole(dense(&map), &stimulus);
    assert_eq!(expected[0], format!("{:?}", CompartmentState::default()));
    assert!(expected.contains(&"total accumulator_overflows 1".to_owned()), "{expected:?}");
    assert_eq!(run_whole(event(&map, 1), &stimulus), expected);
}

#[test]
fn groups_that_differ_in_their_bias_alone_agree_with_the_dense_engine() {
    // 70 compartments that are updated together, every third with another bias, one of them 0.
    let mut text = "chip loihi1\ncore 000 label a\n".to_owned();
    for cx in 0..70 {
        let (end, bias) = (cx + 1, [40, 0, -90][cx % 3]);
        text += &format!(
            "core 000 group cx={cx}..{end} decay_u=100 decay_v=200 vth=3 bias={bias}<<2 refractory=1\n"
        );
    }
    text += "core 000 format 0 mode=mixed bits=8 exp=0
core 000 list 0 entry format=0 dense first=0: 20 30 -40 50
core 000 list 0 entry format=0 dense first=40: 20 30 -40 50
core 000 axon_in 0 list=0 base=0
core 000 axon_in 1 list=0 base=26
port in lines=2
port in line 0 -> core 000 axon 0
port in line 1 -> core 000 axon 1
";
    let parts = CoreMapParts::from_text("p", &text, ChipSpec::loihi1()).unwrap();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    let spikes = (0..20).flat_map(|t| [(t, 0, 0), (2 * t, 0, 1)]);
    let stimulus = Stimulus::new(&map, 30, spikes).unwrap();
    let expected = run_whole(dense(&map), &stimulus);
    assert!(expected.iter().any(|line| line.contains("synaptic_ops_kernel: 280")), "{expected:?}");
    assert_eq!(run_whole(event(&map, 1), &stimulus), expected);
}

/// Core 0 spikes on every second step by itself and sends to core 1, which takes whatever comes.
const SENDER_AND_SINK: &str = "\
chip loihi1
core 000 label sender
core 000 group cx=0000..0001 decay_u=0 decay_v=0 vth=1 bias=40<<0 refractory=1
core 000 axon_out cx=0000 -> core 001 axon 0000
core 001 label sink
core 001 group cx=0000..0001 decay_u=4096 decay_v=0 vth=100 bias=0<<0 refractory=1
core 001 format 0 mode=mixed bits=8 exp=0
core 001 list 0 entry format=0 dense first=0: 2
core 001 axon_in 0000 list=0 base=0
";

fn sender_and_sink() -> Vec<Box<dyn Engine>> {
    let parts = CoreMapParts::from_text("p", SENDER_AND_SINK, ChipSpec::loihi1()).unwrap();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    vec![dense(&map), event(&map, 1), event(&map, 2)]
}

fn voltages(engine: &dyn Engine) -> [i32; 2] {
    [0, 1].map(|core| engine.state(CoreId(core), CompartmentIdx(0)).voltage)
}

#[test]
fn a_held_core_keeps_its_state_and_loses_what_arrives() {
    let none = &mut SpikeRecord::none();
    for mut engine in sender_and_sink() {
        // 40, 80 > 64: a spike in step 1, which arrives in step 2.
        engine.run(&Stimulus::silent(3), none);
        assert_eq!(voltages(engine.as_ref()), [40, 128]);
        engine.set_held(&[CoreId(1)], true);
        let before = engine.core_counts();
        // Another in step 3, lost in step 4.
        engine.run(&Stimulus::silent(3), none);
        assert_eq!(voltages(engine.as_ref()), [0, 128]);
        let done = engine.core_counts()[1] - before[1];
        assert_eq!(done, OpCounts { deliveries_while_held: 1, ..OpCounts::default() });
        engine.set_held(&[CoreId(1)], false);
        engine.set_held(&[CoreId(0)], true);
        // The spike of step 5 is under way and arrives; the sender makes no more.
        engine.run(&Stimulus::silent(4), none);
        assert_eq!(voltages(engine.as_ref()), [0, 256]);
        assert_eq!(engine.total_counts().management_writes, 3);
        engine.reset();
        engine.run(&Stimulus::silent(4), none);
        assert_eq!(voltages(engine.as_ref()), [0, 0], "the sender is still held");
    }
}

#[test]
fn clearing_one_core_takes_its_state_and_what_is_under_way_to_it() {
    let none = &mut SpikeRecord::none();
    for mut engine in sender_and_sink() {
        engine.run(&Stimulus::silent(4), none);
        assert_eq!(voltages(engine.as_ref()), [0, 128]);
        engine.reset_cores(&[CoreId(1)], true);
        engine.run(&Stimulus::silent(1), none);
        assert_eq!(voltages(engine.as_ref()), [40, 0]);
        engine.run(&Stimulus::silent(2), none);
        assert_eq!(voltages(engine.as_ref()), [40, 128]);
        assert_eq!(engine.total_counts().host_resets, 1);
        engine.reset_cores(&[CoreId(0)], false);
        assert_eq!(voltages(engine.as_ref()), [0, 128]);
        engine.run(&Stimulus::silent(2), none);
        engine.reset_cores(&[CoreId(1)], false);
        assert_eq!(voltages(engine.as_ref()), [0, 0]);
        engine.run(&Stimulus::silent(1), none);
        assert_eq!(voltages(engine.as_ref()), [40, 128], "the spike under way arrived");
    }
}

#[test]
fn a_panic_in_one_thread_ends_the_run() {
    let mut parts = sender_and_sink().remove(0).map().parts().clone();
    parts.ports = vec![HostPort { name: "in".to_owned(), lines: 1, targets: Vec::new() }];
    let with_port = CoreMap::new(parts.clone()).unwrap();
    let stimulus = Stimulus::new(&with_port, 9, [(4, 0, 0)]).unwrap();
    // The thread of the first core looks for a port that this map does not have.
    parts.ports.clear();
    let map = Arc::new(CoreMap::new(parts).unwrap());
    for threads in [1, 2] {
        let mut engine = EventEngine::with_threads(Arc::clone(&map), threads);
        assert_eq!(engine.threads(), threads);
        let run = AssertUnwindSafe(|| engine.run(&stimulus, &mut SpikeRecord::none()));
        assert!(catch_unwind(run).is_err(), "{threads} threads");
    }
}

#[test]
fn random_maps_use_every_counter() {
    let mut runner = TestRunner::deterministic();
    let mut sum = OpCounts::default();
    for _ in 0..60 {
        let (recipe, raw) = (recipe(), spikes(STEPS)).new_tree(&mut runner).unwrap().current();
        let map = Arc::new(recipe.build());
        let mut engine = EventEngine::new(Arc::clone(&map));
        engine.set_faults(Faults::new(1, 100_000, []).unwrap());
        engine.run(&stimulus(&map, STEPS, &raw), &mut SpikeRecord::none());
        engine.set_held(&[CoreId(0)], true);
        engine.run(&stimulus(&map, STEPS, &raw), &mut SpikeRecord::none());
        engine.reset();
        engine.count_host_reads(1);
        sum += &engine.total_counts();
    }
    for (name, count) in sum.named() {
        assert!(count > 5, "{name} is only {count}");
    }
}
