use serde::Deserialize;

use super::*;
use crate::rng::{Streams, stream};
use crate::world::test_data::{cylinder, field, mover, rectangle, san, san_world};

fn draw() -> Draw {
    Streams::new(5, 0).at(stream::LASER_NOISE, 0)
}

fn front_m(noise_m: f64, world: &World, pose: Pose) -> [f64; N_FRONT_SECTORS] {
    Laser::new(noise_m).front_m(world, 0, &pose, &mut draw())
}

#[derive(Deserialize)]
struct Golden {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: u32,
    kind: String,
    #[serde(default)]
    pose: Option<[f64; 3]>,
    #[serde(default)]
    scan_m: Option<[f64; N_FRONT_SECTORS]>,
}

#[test]
fn scans_of_recorded_poses_equal_the_golden_ones() {
    let (Some(world), Some(path)) =
        (san_world("san_evaluation_world.json"), san("san_io_golden.json"))
    else {
        return;
    };
    let golden: Golden = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let mut errors_m = Vec::new();
    for case in golden.cases.iter().filter(|case| case.kind == "route") {
        let ([x_m, y_m, yaw_rad], expected_m) = (case.pose.unwrap(), case.scan_m.unwrap());
        let scan_m = front_m(0.0, &world, Pose::new(x_m, y_m, yaw_rad));
        for (found_m, expected_m) in scan_m.iter().zip(expected_m) {
            let error_m = (found_m - expected_m).abs();
            assert!(error_m < 2e-4, "case {}: {found_m} m, expected {expected_m} m", case.id);
            errors_m.push(error_m);
        }
    }
    let worst_m = errors_m.iter().copied().fold(0.0, f64::max);
    println!("{} sectors, largest error {worst_m:e} m", errors_m.len());
    assert_eq!(errors_m.len(), 40 * N_FRONT_SECTORS);
}

#[test]
fn the_first_value_is_left_and_the_last_is_right() {
    let at_left = field(vec![cylinder("post", [0.0, 3.0], 1.0)], vec![]);
    let seen = |scan_m: [f64; N_FRONT_SECTORS]| -> Vec<usize> {
        (0..N_FRONT_SECTORS).filter(|sector| scan_m[*sector] > 0.0).collect()
    };
    assert_eq!(seen(front_m(0.0, &at_left, Pose::new(0.0, 0.0, 0.0))), [0, 1]);
    let turned_left = front_m(0.0, &at_left, Pose::new(0.0, 0.0, PI));
    assert_eq!(seen(turned_left), [16, 17]);
    let ahead = front_m(0.0, &at_left, Pose::new(0.0, 0.0, 0.5 * PI));
    assert_eq!(seen(ahead), [7, 8, 9, 10]);
}

#[test]
fn a_sector_is_the_upper_median_and_a_miss_counts_as_zero() {
    let mut readings_m: Vec<f64> = (0..20).map(|i| f64::from((i * 7) % 20)).collect();
    assert_eq!(upper_median(&mut readings_m), 10.0);
    let laser = Laser::new(0.0);
    assert_eq!(laser.reading_m(f64::INFINITY, &mut draw()), 0.0);
    assert_eq!(laser.reading_m(40.5, &mut draw()), 0.0);
    assert_eq!(laser.reading_m(39.5, &mut draw()), 39.5);
    assert_eq!(laser.reading_m(0.05, &mut draw()), 0.15);
}

#[test]
fn a_room_is_seen_all_round() {
    let walls = vec![
        rectangle("east", [5.0, -6.0], [6.0, 6.0]),
        rectangle("west", [-6.0, -6.0], [-5.0, 6.0]),
        rectangle("north", [-6.0, 5.0], [6.0, 6.0]),
        rectangle("south", [-6.0, -6.0], [6.0, -5.0]),
    ];
    let world = field(walls, vec![]);
    let pose = Pose::new(1.0, -2.0, 0.3);
    let full_m = Laser::new(0.0).full_m(&world, 0, &pose, &mut draw());
    for (sector, median_m) in full_m.iter().enumerate() {
        // The median is the range at one of the two middle rays of the sector.
        let step_rad = (SENSOR_RAD.1 - SENSOR_RAD.0) / 719.0;
        let range_m = |ray: usize| {
            let angle_rad = pose.yaw_rad + SENSOR_RAD.0 + PI + ray as f64 * step_rad;
            world.scene().ray_range_m(pose.position, angle_rad, 40.0).unwrap()
        };
        let rays = sector * RAYS_PER_SECTOR..(sector + 1) * RAYS_PER_SECTOR;
        let mut ranges_m: Vec<f64> = rays.map(range_m).collect();
        ranges_m.sort_by(f64::total_cmp);
        assert!((median_m - ranges_m[10]).abs() < 1e-9, "sector {sector}: {median_m}");
    }
}

#[test]
fn the_full_scan_contains_the_front_scan_with_the_same_noise() {
    let world = World::new(crate::world::arena::Arena::named("courtyard").unwrap());
    let pose = Pose::new(2.5, 2.5, -2.0);
    let front_m = front_m(0.01, &world, pose);
    let full_m = Laser::new(0.01).full_m(&world, 0, &pose, &mut draw());
    let in_order: Vec<f64> =
        (0..9).rev().chain((27..36).rev()).map(|sector| full_m[sector]).collect();
    assert_eq!(in_order, front_m);
}

#[test]
fn the_noise_of_a_ray_does_not_depend_on_what_others_hit() {
    // A mover behind the left shoulder changes the left sectors only.
    let wall = || vec![rectangle("wall", [4.0, -9.0], [5.0, 9.0])];
    let alone = field(wall(), vec![]);
    let passing = field(wall(), vec![mover("cart", [0.0, 2.0], [0.0, 4.0], 1.0)]);
    let pose = Pose::new(0.0, 0.0, 0.0);
    let (a_m, b_m) = (front_m(0.01, &alone, pose), front_m(0.01, &passing, pose));
    assert_ne!(a_m[0], b_m[0]);
    assert_eq!(a_m[3..], b_m[3..]);
}

#[test]
fn noise_has_the_deviation_asked_for() {
    let laser = Laser::new(0.05);
    let mut draw = draw();
    let readings_m: Vec<f64> = (0..4000).map(|_| laser.reading_m(10.0, &mut draw)).collect();
    let mean_m = readings_m.iter().sum::<f64>() / 4000.0;
    let variance_m2 = readings_m.iter().map(|r| (r - mean_m) * (r - mean_m)).sum::<f64>() / 4000.0;
    assert!((mean_m - 10.0).abs() < 0.004, "{mean_m}");
    assert!((variance_m2.sqrt() - 0.05).abs() < 0.003, "{variance_m2}");
}
