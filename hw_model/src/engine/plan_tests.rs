use super::*;
use crate::{ChipSpec, CoreMapParts};

/// Cores with as many compartments as `sizes` says.
fn plan(sizes: &[u16]) -> Plan {
    let mut text = "chip loihi1\n".to_owned();
    for (core, size) in sizes.iter().enumerate() {
        text += &format!(
            "core {core} label a\ncore {core} group cx=0..{size} decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1\n"
        );
    }
    let parts = CoreMapParts::from_text("p", &text, ChipSpec::loihi1()).unwrap();
    Plan::new(&CoreMap::new(parts).unwrap())
}

#[test]
fn threads_get_about_equal_work_and_every_core_once() {
    assert_eq!(plan(&[100; 6]).shares(2), [3, 3]);
    assert_eq!(plan(&[100; 6]).shares(3), [2, 2, 2]);
    // Large cores at the end, at the start, and one that outweighs all.
    assert_eq!(plan(&[10, 10, 10, 10, 40]).shares(2), [4, 1]);
    assert_eq!(plan(&[40, 10, 10, 10, 10]).shares(2), [1, 4]);
    assert_eq!(plan(&[1000, 1, 1, 1]).shares(3), [1, 1, 2]);
    assert_eq!(plan(&[1, 1, 1, 1000]).shares(3), [2, 1, 1]);
}

#[test]
fn there_are_never_more_threads_than_cores_and_always_one() {
    assert_eq!(plan(&[5, 5]).shares(7), [1, 1]);
    assert_eq!(plan(&[5, 5]).shares(0), [2]);
    assert_eq!(plan(&[]).shares(3), [0]);
    for threads in 1..=9 {
        let shares = plan(&[3, 0, 900, 2, 0, 0, 7, 1, 0]).shares(threads);
        assert_eq!((shares.len(), shares.iter().sum::<usize>()), (threads, 9));
        assert!(shares.iter().all(|len| *len > 0), "{shares:?}");
    }
}

#[test]
fn what_spikes_cost_to_send_does_not_depend_on_how_it_is_kept() {
    let words = [0x8000_0000_0000_0001u64, 0, 0b11];
    let of_each = |different: u32, largest: u32| -> Vec<SendCost> {
        let cost = |i: u32| SendCost::from([i % different, 1, largest, 2 * (i % different)]);
        (0..130).map(cost).collect()
    };
    for (different, largest, form) in
        [(3, 5, "Few"), (100, 65_535, "Narrow"), (100, 65_536, "Wide")]
    {
        let costs = of_each(different, largest);
        let sends = Sends::new(costs.clone());
        assert!(format!("{sends:?}").starts_with(form), "{different} costs up to {largest}");
        let mut sum = SendCost::default();
        for spike in [0, 63, 128, 129] {
            sum.add(costs[spike], 1);
        }
        assert_eq!(sends.cost(words.into_iter()), sum, "{different} costs up to {largest}");
    }
}
