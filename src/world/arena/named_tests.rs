use std::collections::BTreeSet;

use nalgebra::Point2;

use super::*;
use crate::world::World;

#[test]
fn every_name_opens_and_others_do_not() {
    for name in list_named() {
        assert_eq!(Arena::open(name).unwrap().name(), name);
    }
    assert_eq!(Arena::named("cellar"), None);
    assert_eq!(list_named(), ["courtyard", "courtyard-moving"]);
}

#[test]
fn courtyards_have_the_same_obstacles_and_four_movers() {
    let (still, moving) =
        (Arena::named("courtyard").unwrap(), Arena::named("courtyard-moving").unwrap());
    assert_eq!(still.obstacles(), moving.obstacles());
    assert_eq!(still.obstacles().len(), 4 + 16);
    assert!(still.movers().is_empty());
    assert_eq!(moving.movers().len(), 4);
    for mover in moving.movers() {
        assert_eq!((mover.radius_m(), mover.speed_m_per_s()), (0.25, 0.5));
        let clear_m = |shape: &crate::world::geometry::Shape| {
            shape.distance_to_segment_m(mover.from(), mover.to()) - mover.radius_m()
        };
        for obstacle in moving.obstacles() {
            assert!(clear_m(&obstacle.shape) > 0.5, "{} {}", mover.name, obstacle.name);
        }
    }
}

/// Cells of 0.1 m whose centres are `clearance_m` clear of everything static.
fn free_cells(world: &World, clearance_m: f64) -> BTreeSet<(i32, i32)> {
    let centre = |i: i32, j: i32| Point2::new(0.1 * f64::from(i), 0.1 * f64::from(j));
    let cells = (-100..=100).flat_map(|i| (-100..=100).map(move |j| (i, j)));
    cells.filter(|(i, j)| world.scene().clearance_m(centre(*i, *j)) >= clearance_m).collect()
}

fn reached_from_any(mut cells: BTreeSet<(i32, i32)>) -> usize {
    let mut stack = Vec::from_iter(cells.pop_first());
    let mut n_reached = stack.len();
    while let Some((i, j)) = stack.pop() {
        for next in [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)] {
            if cells.remove(&next) {
                n_reached += 1;
                stack.push(next);
            }
        }
    }
    n_reached
}

#[test]
fn every_free_place_of_the_courtyard_is_reached_by_passages_of_1_6_m() {
    let world = World::new(Arena::named("courtyard").unwrap());
    // Half of the width, less half of a cell.
    let wide = free_cells(&world, 0.75);
    assert!(wide.len() > 5000, "{}", wide.len());
    assert_eq!(reached_from_any(wide.clone()), wide.len());
    let starts = free_cells(&world, 0.5);
    assert_eq!(reached_from_any(starts.clone()), starts.len());
}
