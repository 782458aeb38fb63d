use super::*;

const SHAPE: Shape = Shape { channels: 3, height: 4, width: 5 };

#[test]
fn sizes_are_those_of_every_number_of_equal_parts() {
    for n in 1..200usize {
        let mut expected: Vec<usize> = (1..=n).map(|parts| n.div_ceil(parts)).collect();
        expected.dedup();
        assert_eq!(sizes(n), expected, "{n}");
    }
    assert_eq!(sizes(1 << 24).last(), Some(&1));
}

#[test]
fn every_tiling_holds_every_neuron_once() {
    let none_seen = |_: &[usize; 3]| 0;
    let all = tilings(SHAPE, 60, 60, none_seen);
    assert_eq!((all[0].n_tiles, all[all.len() - 1].n_tiles), (1, 60));
    for tiling in all {
        let tiles: Vec<Tile> = tiling.tiles(SHAPE).collect();
        assert_eq!(tiles.len(), tiling.n_tiles);
        let mut neurons: Vec<usize> = tiles.iter().flat_map(|tile| tile.neurons(SHAPE)).collect();
        neurons.sort_unstable();
        assert_eq!(neurons, (0..60).collect::<Vec<_>>(), "{tiling:?}");
    }
    assert!(tilings(SHAPE, 60, 7, none_seen).iter().all(|tiling| tiling.n_tiles <= 7));
    assert!(tilings(SHAPE, 4, 60, none_seen).iter().all(|t| t.size.iter().product::<usize>() <= 4));
    assert_eq!(tilings(SHAPE, 4, 7, none_seen), []);
}

#[test]
fn of_equally_many_tiles_the_cheapest_comes_first() {
    // Rows cost more than columns, so tiles are wide.
    let tiling = tilings(SHAPE, 15, 60, |size| 10 * size[1] + size[2])[0];
    assert_eq!((tiling.size, tiling.n_tiles), ([3, 1, 5], 4));
}

#[test]
fn channels_of_a_pixel_are_neighbours_and_pixels_run_by_row() {
    let tile = Tile { channels: 1..3, rows: 2..4, columns: 1..3 };
    let expected = [(1, 2, 1), (2, 2, 1), (1, 2, 2), (2, 2, 2), (1, 3, 1), (2, 3, 1), (1, 3, 2)];
    let neurons = tile.neurons(SHAPE);
    assert_eq!(neurons[..7], expected.map(|(c, y, x)| SHAPE.neuron(c, y, x)));
    assert_eq!((tile.pixel(2, 1), tile.pixel(2, 2), tile.pixel(3, 1)), (0, 2, 4));
    assert_eq!(tile.label("p", SHAPE), "p[c1..3,y2..4,x1..3]");
    assert_eq!(Tile::flat(2..4).label("p", Shape::flat(9)), "p[2..4]");
    assert_eq!(Tile::flat(0..9).label("p", Shape::flat(9)), "p");
}
