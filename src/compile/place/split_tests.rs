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
    share_out(loads, &cuts(loads), budget)
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
fn phases_are_served_by_what_they_gain_per_core() {
    let later = |load: Load| Load { phase: 1, ..load };
    let loads = [load(20, 100, 0), later(load(2, 100, 0)), later(load(2, 10, 0))];
    assert_eq!(most(&loads, 4), [10, 2, 2]);
    assert_eq!(most(&loads, 5), [10, 1, 2]);
    // In one phase the second layer gets none while the first has more to do.
    let loads = [load(20, 1000, 0), load(20, 300, 0)];
    assert_eq!(cores(&loads, 5), [4, 1]);
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
fn equal_layers_are_served_in_their_order() {
    let loads = [load(8, 80, 0), load(8, 80, 0), load(8, 80, 0)];
    assert_eq!(cores(&loads, 4), [2, 1, 1]);
    assert_eq!(cores(&loads, 5), [2, 2, 1]);
}

#[test]
fn a_picture_is_cut_as_its_tiles_allow() {
    // Two tiles would leave as much on one of them as one, and three take more than are left.
    let tiles = [(8, 1), (8, 2), (4, 3), (2, 9)].map(|(most, cores)| Cut { most, cores });
    let cuts = vec![useful(tiles.into_iter())];
    assert_eq!(cuts[0].len(), 3);
    let loads = [load(8, 80, 0)];
    assert_eq!(share_out(&loads, &cuts, 2), [8]);
    assert_eq!(share_out(&loads, &cuts, 8), [4]);
    assert_eq!(share_out(&loads, &cuts, 9), [2]);
}
