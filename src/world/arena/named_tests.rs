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
    let maps = ["map1", "map2", "train1", "train2", "train3", "train4"];
    assert_eq!(list_named()[..2], ["courtyard", "courtyard-moving"]);
    assert_eq!(list_named()[2..], maps);
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

/// Cells of 0.1 m clear of everything static by a robot's radius and half of a cell.
fn robot_cells(world: &World) -> BTreeSet<(i32, i32)> {
    let mut cells = free_cells(world, crate::world::robot::ROBOT_RADIUS_M + 0.05);
    let inside = |i: i32, j: i32| Point2::new(0.1 * f64::from(i), 0.1 * f64::from(j));
    cells.retain(|(i, j)| world.arena().bounds().contains(inside(*i, *j)));
    cells
}

#[test]
fn all_free_space_of_every_map_is_connected_for_the_robot() {
    for (name, n_min) in [("map1", 20_000), ("map2", 20_000), ("train1", 9000), ("train4", 9000)] {
        let world = World::new(Arena::named(name).unwrap());
        let cells = robot_cells(&world);
        assert!(cells.len() > n_min, "{name}: {}", cells.len());
        assert_eq!(reached_from_any(cells.clone()), cells.len(), "{name}");
    }
    for name in ["train2", "train3"] {
        let cells = robot_cells(&World::new(Arena::named(name).unwrap()));
        assert_eq!(reached_from_any(cells.clone()), cells.len(), "{name}");
    }
}

/// Speeds along the axes in EEM-SAN's table of obstacle speeds, m/s.
const SPEEDS: [[f64; 2]; 11] = [
    [1.4, 0.0],
    [1.4, 0.0],
    [1.4, 0.0],
    [1.2, 1.2],
    [0.0, 1.4],
    [0.0, 1.4],
    [0.0, 1.4],
    [1.4, 0.0],
    [1.3, 1.3],
    [1.4, 0.0],
    [0.0, 1.4],
];

#[test]
fn evaluation_maps_have_eleven_movers_with_the_speeds_of_the_paper() {
    for name in ["map1", "map2"] {
        let arena = Arena::named(name).unwrap();
        assert_eq!(arena.movers().len(), 11, "{name}");
        for (mover, speed) in arena.movers().iter().zip(SPEEDS) {
            let along = (mover.to() - mover.from()).normalize() * mover.speed_m_per_s();
            for (found, expected) in [(along.x, speed[0]), (along.y, speed[1])] {
                assert!((found.abs() - expected).abs() < 0.02, "{name} {}: {along:?}", mover.name);
            }
            assert_eq!((mover.radius_m(), mover.height_m), (0.25, 0.5));
        }
    }
}

#[test]
fn tracks_are_clear_and_heights_differ() {
    for name in &list_named()[2..] {
        let arena = Arena::named(name).unwrap();
        for mover in arena.movers() {
            assert!((mover.to() - mover.from()).norm() >= 1.8, "{name} {}", mover.name);
            for obstacle in arena.obstacles() {
                let clear_m = obstacle.shape.distance_to_segment_m(mover.from(), mover.to());
                assert!(clear_m > 0.25 + 0.15, "{name} {} {}", mover.name, obstacle.name);
            }
        }
        let heights = arena.obstacles().iter().map(|obstacle| obstacle.height_m);
        assert!(heights.clone().all(|height_m| height_m >= 0.45), "{name}");
        assert!(*name == "train1" || heights.into_iter().any(|height_m| height_m != 1.0), "{name}");
    }
    let n_movers = |name| Arena::named(name).unwrap().movers().len();
    assert_eq!(["train1", "train2", "train3", "train4"].map(n_movers), [0, 0, 3, 6]);
}

#[test]
fn every_map_round_trips_and_loses_its_movers_on_request() {
    for name in &list_named()[2..] {
        let arena = Arena::named(name).unwrap();
        let again = Arena::from_json(arena.to_json().as_bytes(), name, None).unwrap();
        assert_eq!(again.to_json(), arena.to_json(), "{name}");
        let still = arena.clone().without_movers();
        assert!(still.movers().is_empty());
        assert_eq!(still.obstacles(), arena.obstacles());
    }
}

#[test]
fn evaluation_pairs_are_clear_of_everything_at_the_start() {
    use crate::rng::Streams;
    use crate::world::pairs::{PairRules, generate_pairs};
    for name in ["map1", "map2"] {
        let world = World::new(Arena::named(name).unwrap());
        let streams = Streams::new(EVALUATION_SEED, 0);
        let rules = PairRules::default();
        let pairs = generate_pairs(&world, EVALUATION_PAIRS, rules, streams).unwrap();
        assert_eq!(pairs.len(), 200);
        for pair in pairs {
            assert!(pair.distance_m() >= 6.0);
            assert!(world.nearest(pair.start.position, 0).unwrap().distance_m >= 0.5);
            assert!(world.nearest(pair.goal, 0).unwrap().distance_m >= 0.5);
        }
    }
}
