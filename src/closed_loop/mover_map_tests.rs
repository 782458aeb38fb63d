use super::*;

fn mover(way_m: [f64; 2], velocity_m_per_s: [f64; 2]) -> Sighted {
    let distance_m = libm::hypot(way_m[0], way_m[1]);
    Sighted { way_m, distance_m, velocity_m_per_s, radius_m: 0.25 }
}

/// The numbers of a sector.
fn at(map: &[f32], sector: usize) -> [f32; 4] {
    std::array::from_fn(|kind| map[kind * SECTORS + sector])
}

#[test]
fn a_mover_ahead_fills_the_middle_sectors_with_what_it_does() {
    let map = map_of([mover([3.0, 0.0], [-1.5, 0.75])].into_iter());
    // Half of 6 m away; 0.6 over 3 m; it closes at full speed and goes left at half of that.
    assert_eq!(at(&map, 7), [1.25, 0.5, 1.25, 0.625]);
    assert_eq!(at(&map, 8), at(&map, 7));
    assert!(map[..6].iter().chain(&map[10..SECTORS]).all(|near| *near == 0.0), "{map:?}");
    assert_eq!(map_of(std::iter::empty()), vec![0.0; NUMBERS]);
}

#[test]
fn left_is_left_and_the_nearest_counts() {
    let left = mover([2.0, 1.5], [0.0, 0.0]);
    let map = map_of([left].into_iter());
    let seen: Vec<usize> = (0..SECTORS).filter(|sector| map[*sector] > 0.0).collect();
    assert!(!seen.is_empty() && seen.iter().all(|sector| *sector < 4), "{seen:?}");
    let (near, far) = (mover([1.0, 0.0], [1.0, 0.0]), mover([4.0, 0.0], [-1.0, 0.0]));
    let both = map_of([far, near].into_iter());
    assert_eq!(at(&both, 8), at(&map_of([near, far].into_iter()), 8));
    assert!(at(&both, 8)[2] < 0.0, "the near one goes away");
    let large = both.iter().map(|number| number.abs()).fold(0.0, f32::max);
    assert!(large <= LARGEST, "{large}");
}
