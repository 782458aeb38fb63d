use super::*;
use crate::{ChipSpec, CoreMapParts};

#[test]
fn the_hash_is_that_of_splitmix64() {
    // First three outputs of the published generator with state 0.
    let outputs = [1u64, 2, 3].map(|n| mixed(GAMMA.wrapping_mul(n)));
    assert_eq!(outputs, [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
}

#[test]
fn rates_above_one_are_refused() {
    let error = Faults::new(0, 1_000_001, []).unwrap_err();
    assert_eq!(
        error.to_string(),
        "faults: messages lost = 1000001 per million, must be 0..=1000000; give a share of one"
    );
    let error = with_dead_synapses(&map(4), 0, 2_000_000).unwrap_err().to_string();
    assert!(error.starts_with("faults: dead synapses = 2000000 per million"), "{error}");
}

#[test]
fn lost_messages_come_at_the_rate_asked_for() {
    for (per_million, low, high) in [(1_000, 50, 150), (100_000, 9_600, 10_400)] {
        let faults = Faults::new(7, per_million, []).unwrap();
        let mut lost = 0;
        for step in 0..100 {
            let loss = faults.loss(step).unwrap();
            lost += (0..1000).filter(|unit| loss.takes(3, *unit, 5, *unit as u16)).count();
        }
        assert!((low..=high).contains(&lost), "{lost} of 100000 at {per_million} per million");
    }
    assert!(Faults::new(7, 0, []).unwrap().loss(0).is_none());
    let all = Faults::new(7, MILLION, []).unwrap().loss(0).unwrap();
    assert!((0..1000).all(|unit| all.takes(0, unit, 0, 0)));
}

#[test]
fn every_part_of_a_message_has_a_say_in_its_loss() {
    let taken = |seed, step, source, core, axon| -> Vec<bool> {
        let loss = Faults::new(seed, 500_000, []).unwrap().loss(step).unwrap();
        (0..64).map(|unit| loss.takes(source, unit, core, axon)).collect()
    };
    let first = taken(1, 1, 1, 1, 1);
    assert_eq!(first, taken(1, 1, 1, 1, 1));
    for other in [
        taken(2, 1, 1, 1, 1),
        taken(1, 2, 1, 1, 1),
        taken(1, 1, 2, 1, 1),
        taken(1, 1, 1, 2, 1),
        taken(1, 1, 1, 1, 2),
    ] {
        assert_ne!(first, other);
    }
}

#[test]
fn dead_cores_are_sorted_and_each_there_once() {
    let faults = Faults::new(0, 0, [5, 2, 5].map(CoreId)).unwrap();
    assert_eq!(faults.dead_cores(), [2, 5].map(CoreId));
    assert_eq!([1, 2, 5].map(|core| faults.is_dead(core)), [false, true, true]);
}

/// One core, `axons` lists of 200 weights each, dense and sparse in turn.
fn map(axons: usize) -> CoreMap {
    let mut text = "\
chip loihi1
core 000 label a
core 000 group cx=0000..0200 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
core 000 format 0 mode=excitatory bits=8 exp=0
"
    .to_owned();
    let dense = " 255".repeat(200);
    let sparse: String = (0..200).map(|target| format!(" {target}:255")).collect();
    for list in 0..axons {
        let form = if list % 2 == 0 {
            format!("dense first=0:{dense}")
        } else {
            format!("sparse:{sparse}")
        };
        text += &format!("core 000 list {list} entry format=0 {form}\n");
    }
    text.extend((0..axons).map(|axon| format!("core 000 axon_in {axon} list={axon} base=0\n")));
    let parts = CoreMapParts::from_text("map", &text, ChipSpec::loihi1()).unwrap();
    CoreMap::new(parts).unwrap()
}

fn dead(map: &CoreMap) -> Vec<bool> {
    let entries = map.cores()[0].lists.iter().flat_map(|list| &list.entries);
    entries.flat_map(|entry| entry.mantissas()).map(|mantissa| *mantissa == 0).collect()
}

#[test]
fn dead_synapses_come_at_their_rate_and_stay_dead_at_higher_ones() {
    let whole = map(50);
    let at = |per_million| dead(&with_dead_synapses(&whole, 3, per_million).unwrap());
    let (few, many) = (at(50_000), at(200_000));
    let count = |dead: &[bool]| dead.iter().filter(|dead| **dead).count();
    assert!((400..=600).contains(&count(&few)), "{} of 10000", count(&few));
    assert!((1900..=2100).contains(&count(&many)), "{} of 10000", count(&many));
    assert!(few.iter().zip(&many).all(|(few, many)| !few || *many));
    assert_ne!(few, dead(&with_dead_synapses(&whole, 4, 50_000).unwrap()));
    assert_eq!(count(&at(MILLION)), 10_000);
}

#[test]
fn a_map_without_dead_synapses_is_the_map() {
    let whole = map(4);
    assert_eq!(with_dead_synapses(&whole, 3, 0).unwrap(), whole);
    let broken = with_dead_synapses(&whole, 3, 500_000).unwrap();
    assert_eq!(broken.utilization(), whole.utilization());
}
