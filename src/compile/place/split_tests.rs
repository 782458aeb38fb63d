use proptest::prelude::*;

use super::*;

fn load(neurons: u64, shared: u64, each: u64) -> Load {
    Load { neurons, phase: 0, shared, each, per_target: 0, targets: Vec::new() }
}

/// Ways to cut layers that are no pictures.
fn cuts(loads: &[Load]) -> Vec<Vec<Cut>> {
    let of = |load: &Load| {
        let n = load.neurons as usize;
        useful((1..=n).map(|cores| Cut { most: n.div_ceil(cores), cores }))
    };
    loads.iter().map(of).collect()
}

fn most(loads: &[Load], budget: usize) -> Vec<usize> {
    share_out(loads, &cuts(loads), budget, &|_| 0)
}

/// Cores of each layer.
fn cores(loads: &[Load], budget: usize) -> Vec<usize> {
    let most = most(loads, budget);
    loads.iter().zip(most).map(|(load, most)| (load.neurons as usize).div_ceil(most)).collect()
}

#[test]
fn cores_go_to_the_layer_that_has_the_most_to_do() {
    let loads = [load(180, 900, 0), load(180, 100, 0), load(180, 500, 0)];
    assert_eq!(cores(&loads, 3), [1, 1, 1]);
    assert_eq!(cores(&loads, 4), [2, 1, 1]);
    // 900, 500 and 100 over 9, 5 and 1: none has more to do than another.
    assert_eq!(cores(&loads, 15), [9, 1, 5]);
}

#[test]
fn the_fullest_core_counts_and_no_core_is_empty() {
    // Ten neurons over four cores are three on the fullest, as over the five that one less takes.
    assert_eq!(most(&[load(10, 100, 0)], 4), [3]);
    assert_eq!(most(&[load(10, 100, 0)], 5), [2]);
    assert_eq!(most(&[load(10, 100, 0)], 9), [2]);
    assert_eq!(most(&[load(10, 100, 0)], 99), [1]);
}

#[test]
fn phases_share_cores_so_that_both_together_last_the_least() {
    let later = |load: Load| Load { phase: 1, ..load };
    // In one phase the second layer gets none while the first has more to do.
    let loads = [load(20, 1000, 0), load(20, 300, 0)];
    assert_eq!(cores(&loads, 5), [4, 1]);
    // In two, 1000 / 4 + 300 are more than 1000 * 7 / 20 + 300 / 2.
    let loads = [load(20, 1000, 0), later(load(20, 300, 0))];
    assert_eq!(cores(&loads, 5), [3, 2]);
}

#[test]
fn a_layer_with_a_core_for_each_neuron_gets_no_more() {
    let loads = [load(2, 900, 0), load(100, 100, 0)];
    assert_eq!(cores(&loads, 50), [2, 1]);
}

#[test]
fn what_each_core_does_and_what_it_sends_counts() {
    // The second layer is busy with its inputs, which more cores do not change.
    let loads = [load(9, 90, 0), load(9, 9, 100)];
    assert_eq!(cores(&loads, 4), [1, 3]);
    // Each core of the second layer is another message from the first.
    let sender = Load { per_target: 50, targets: vec![1], ..load(10, 10, 0) };
    assert_eq!(sender.busy(10, &[1, 1]), 60);
    assert_eq!(sender.busy(5, &[2, 3]), 80);
}

#[test]
fn cores_that_make_nothing_faster_are_left() {
    let loads = [load(8, 80, 0), load(8, 80, 0), load(8, 80, 0)];
    assert_eq!(cores(&loads, 5), [1, 1, 1]);
    assert_eq!(cores(&loads, 6), [2, 2, 2]);
}

proptest! {
    /// Every other way to share out the cores lasts as long, or longer.
    #[test]
    fn no_way_lasts_less(
        layers in prop::collection::vec((1u64..7, 0u64..500, 0u64..50, 0usize..2), 1..5),
        budget in 0usize..12,
        barrier in 0u64..40,
    ) {
        let of = |(neurons, shared, each, phase): &(u64, u64, u64, usize)| {
            Load { phase: *phase, ..load(*neurons, *shared, *each) }
        };
        let loads: Vec<Load> = layers.iter().map(of).collect();
        let budget = budget + loads.len();
        let lasts = |most: &[usize]| {
            let busiest = |phase: usize| {
                let layers = loads.iter().zip(most).filter(|(load, _)| load.phase == phase);
                layers.map(|(load, most)| load.busy(*most, &vec![1; loads.len()])).max()
            };
            busiest(0).unwrap_or(0) + busiest(1).unwrap_or(0)
        };
        let cores = |most: &[usize]| -> usize {
            loads.iter().zip(most).map(|(load, most)| (load.neurons as usize).div_ceil(*most)).sum()
        };
        let barriers = |cores: usize| barrier * (cores as u64).div_ceil(2);
        let lasts = |most: &[usize]| lasts(most) + barriers(cores(most));
        let found = share_out(&loads, &cuts(&loads), budget, &barriers);
        prop_assert!(cores(&found) <= budget);
        let mut all: Vec<Vec<usize>> = vec![Vec::new()];
        for load in &loads {
            let longer = |most: &Vec<usize>| {
                let most = most.clone();
                (1..=load.neurons as usize).map(move |n| [most.clone(), vec![n]].concat())
            };
            all = all.iter().flat_map(longer).collect();
        }
        let best = all.iter().filter(|most| cores(most) <= budget).map(|most| lasts(most)).min();
        prop_assert_eq!(Some(lasts(&found)), best);
    }
}

#[test]
fn cores_whose_barriers_take_more_than_they_save_are_left() {
    let loads = [load(8, 80, 0)];
    let most = |barrier: u64| {
        share_out(&loads, &cuts(&loads), 8, &|cores| barrier * (cores as u64).div_ceil(4))
    };
    // 10 with two barriers, 20 with one.
    assert_eq!((most(9), most(10), most(11)), (vec![1], vec![2], vec![2]));
}

#[test]
fn a_picture_is_cut_as_its_tiles_allow() {
    // Two tiles would leave as much on one of them as one, and three take more than are left.
    let tiles = [(8, 1), (8, 2), (4, 3), (2, 9)].map(|(most, cores)| Cut { most, cores });
    let cuts = vec![useful(tiles.into_iter())];
    assert_eq!(cuts[0].len(), 3);
    let loads = [load(8, 80, 0)];
    assert_eq!(share_out(&loads, &cuts, 2, &|_| 0), [8]);
    assert_eq!(share_out(&loads, &cuts, 8, &|_| 0), [4]);
    assert_eq!(share_out(&loads, &cuts, 9, &|_| 0), [2]);
}
