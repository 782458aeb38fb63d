//! Faulty chips: the same faults in every engine, and none where none are asked for.

use std::sync::Arc;

use hw_model::engine::{SpikeRecord, Stimulus};
use hw_model::faults::with_dead_synapses;
use hw_model::id::{CompartmentIdx, CoreId};
use hw_model::{ChipSpec, CoreMap, CoreMapParts, Engine, Faults, OpCounts};
use proptest::prelude::*;

use crate::differential::{STEPS, THREADS, dense, event, ordered_run, run_whole};
use crate::random_map::{config, recipe, spikes, stimulus};

/// Rate of lost messages, dead cores as bits, seed.
fn faults() -> impl Strategy<Value = (u32, u8, u64)> {
    let rate = prop::sample::select(vec![0, 1_000, 100_000, 500_000, 1_000_000]);
    (rate, prop_oneof![Just(0u8), any::<u8>()], any::<u64>())
}

fn faulty(mut engine: Box<dyn Engine>, (rate, dead, seed): (u32, u8, u64)) -> Box<dyn Engine> {
    let cores = 0..engine.map().cores().len() as u16;
    let dead = cores.filter(|core| dead >> core & 1 == 1).map(CoreId);
    engine.set_faults(Faults::new(seed, rate, dead).unwrap());
    engine
}

proptest! {
    #![proptest_config(config(60))]

    #[test]
    fn every_engine_and_thread_count_has_the_same_faults(
        recipe in recipe(),
        raw in spikes(STEPS),
        faults in faults(),
        orders in prop::collection::vec((0..STEPS, any::<u16>(), 0..4u8), 0..10),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let expected = ordered_run(faulty(dense(&map), faults).as_mut(), &stimulus, &orders);
        for threads in THREADS {
            let mut engine = faulty(event(&map, threads), faults);
            let lines = ordered_run(engine.as_mut(), &stimulus, &orders);
            prop_assert_eq!(&lines, &expected, "{} threads", threads);
        }
    }

    #[test]
    fn a_chip_with_no_faults_set_is_a_chip_without_faults(
        recipe in recipe(),
        raw in spikes(STEPS),
        seed in any::<u64>(),
    ) {
        let map = Arc::new(recipe.build());
        let stimulus = stimulus(&map, STEPS, &raw);
        let expected = run_whole(event(&map, 1), &stimulus);
        for engine in [dense(&map), event(&map, 1), event(&map, 3)] {
            prop_assert_eq!(run_whole(faulty(engine, (0, 0, seed)), &stimulus), expected.clone());
        }
        let whole = Arc::new(with_dead_synapses(&map, seed, 0).unwrap());
        prop_assert_eq!(run_whole(event(&whole, 1), &stimulus), expected);
    }

    #[test]
    fn engines_agree_on_a_map_with_dead_synapses(
        recipe in recipe(),
        raw in spikes(STEPS),
        seed in any::<u64>(),
    ) {
        let map = Arc::new(with_dead_synapses(&recipe.build(), seed, 300_000).unwrap());
        let stimulus = stimulus(&map, STEPS, &raw);
        let expected = run_whole(dense(&map), &stimulus);
        prop_assert_eq!(run_whole(event(&map, 2), &stimulus), expected);
    }
}

/// 50 lines, each onto an axon of its own with a weight onto the one compartment, which never
/// spikes and forgets nothing.
fn counter_of_lines() -> Arc<CoreMap> {
    let mut text = "\
chip loihi1
core 000 label sink
core 000 group cx=0000..0001 decay_u=4096 decay_v=0 vth=100000 bias=0<<0 refractory=1
core 000 format 0 mode=excitatory bits=8 exp=0
core 000 list 0 entry format=0 dense first=0: 1
"
    .to_owned();
    text.extend((0..50).map(|axon| format!("core 000 axon_in {axon} list=0 base=0\n")));
    text.push_str("port in lines=50\n");
    text.extend((0..50).map(|l| format!("port in line {l} -> core 000 axon {l}\n")));
    let parts = CoreMapParts::from_text("sink", &text, ChipSpec::loihi1()).unwrap();
    Arc::new(CoreMap::new(parts).unwrap())
}

#[test]
fn a_lost_message_is_counted_and_does_nothing_else() {
    let map = counter_of_lines();
    let steps = 200;
    let all = (0..steps).flat_map(|step| (0..50).map(move |line| (step, 0, line)));
    let stimulus = Stimulus::new(&map, steps as usize + 1, all).unwrap();
    for (rate, low, high) in [(10_000, 60, 140), (200_000, 1850, 2150)] {
        let mut engine = faulty(event(&map, 1), (rate, 0, 11));
        engine.run(&stimulus, &mut SpikeRecord::none());
        let counts = engine.total_counts();
        let (lost, arrived) = (counts.messages_lost, counts.axon_deliveries);
        assert!((low..=high).contains(&lost), "{lost} of 10000 at {rate} per million");
        assert_eq!((counts.host_injections, lost + arrived), (10_000, 10_000));
        assert_eq!(counts.synaptic_ops(), arrived);
        let voltage = engine.state(CoreId(0), CompartmentIdx(0)).voltage;
        assert_eq!(i64::from(voltage), 64 * arrived as i64);
    }
}

#[test]
fn a_dead_core_does_nothing_and_nothing_arrives_at_it() {
    let map = counter_of_lines();
    let stimulus = Stimulus::new(&map, 3, [(0, 0, 4), (1, 0, 5)]).unwrap();
    for engine in [dense(&map), event(&map, 1)] {
        let mut engine = faulty(engine, (500_000, 1, 0));
        engine.run(&stimulus, &mut SpikeRecord::none());
        assert_eq!(engine.core_counts(), [OpCounts::default()]);
        assert_eq!(engine.state(CoreId(0), CompartmentIdx(0)).voltage, 0);
        assert_eq!(engine.total_counts().host_injections, 2);
    }
}

#[test]
fn other_seeds_lose_other_messages() {
    let map = counter_of_lines();
    let all = (0..20).flat_map(|step| (0..50).map(move |line| (step, 0, line)));
    let stimulus = Stimulus::new(&map, 21, all).unwrap();
    let run = |seed| run_whole(faulty(event(&map, 1), (300_000, 0, seed)), &stimulus);
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}
