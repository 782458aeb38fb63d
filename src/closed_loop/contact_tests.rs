use nalgebra::Point2;

use super::*;
use crate::closed_loop::{TrialConfig, TrialOutcome};
use crate::policy::Action;
use crate::rng::Streams;
use crate::world::World;
use crate::world::test_data::{field, mover, rectangle};

/// How a robot comes to its end that stands in the middle, looks east and does `action`.
fn end(world: &World, action: (f64, f64)) -> TrialOutcome {
    let (start, goal) = (Pose::new(0.0, 0.0, 0.0), Point2::new(9.0, 0.0));
    let config = TrialConfig { ticks_max: 100, ..TrialConfig::eem_san(1.0) };
    let mut trial = Trial::new(world, start, goal, &config, Streams::new(1, 0)).unwrap();
    while trial.end().is_none() {
        trial.drive(Action { left: action.0, right: action.1 });
    }
    trial.into_outcome()
}

const STAND: (f64, f64) = (0.0, 0.0);

fn touched(from: [f64; 2], to: [f64; 2]) -> MoverContact {
    let cart = mover("cart", from, to, 1.0);
    let outcome = end(&field(vec![], vec![cart]), STAND);
    assert_eq!(outcome.hit.as_deref(), Some("cart"));
    outcome.mover_contact.unwrap()
}

#[test]
fn a_mover_that_comes_ahead_was_in_view_of_the_camera() {
    let contact = touched([4.0, 0.0], [-4.0, 0.0]);
    assert_eq!(contact.side(), Side::Ahead);
    let seen = MoverContact { bearing_mrad: 0, ticks: 20, camera_ticks: 20, laser_ticks: 20 };
    assert_eq!(contact, seen);
}

#[test]
fn beside_the_camera_the_laser_alone_sees() {
    let left = touched([0.4, 4.0], [0.4, -4.0]);
    assert_eq!(left.side(), Side::Beside);
    assert_eq!((left.ticks, left.camera_ticks, left.laser_ticks), (20, 0, 20));
    let right = touched([0.4, -4.0], [0.4, 4.0]);
    assert_eq!(right, MoverContact { bearing_mrad: -left.bearing_mrad, ..left });
    assert!(left.bearing_mrad > 0);
}

#[test]
fn behind_the_robot_nothing_sees() {
    let contact = touched([-4.0, 0.0], [4.0, 0.0]);
    assert_eq!(contact.side(), Side::Behind);
    assert_eq!((contact.ticks, contact.camera_ticks, contact.laser_ticks), (20, 0, 0));
}

#[test]
fn farther_than_six_metres_the_camera_does_not_see() {
    let cart = mover("cart", [7.4, 0.0], [-4.0, 0.0], 10.0);
    let contact = end(&field(vec![], vec![cart]), STAND).mover_contact.unwrap();
    // Contact after 0.7 s; within 6 m after 0.14 s.
    assert_eq!((contact.ticks, contact.camera_ticks, contact.laser_ticks), (14, 11, 14));
}

#[test]
fn a_short_flight_is_looked_at_from_its_start() {
    // 0.57 m at 1.05 m/s.
    assert_eq!(touched([1.0, 0.0], [-4.0, 0.0]).ticks, 11);
    let at_once = touched([0.3, 0.0], [-4.0, 0.0]);
    assert_eq!((at_once.ticks, at_once.side()), (0, Side::Ahead));
}

#[test]
fn a_wall_hides_a_mover() {
    let wall = rectangle("wall", [-1.0, 0.8], [0.14, 0.9]);
    let cart = || mover("cart", [0.4, 4.0], [0.4, -4.0], 5.0);
    let seen = |obstacles| end(&field(obstacles, vec![cart()]), STAND).mover_contact.unwrap();
    let (free, hidden) = (seen(vec![]), seen(vec![wall]));
    assert_eq!((free.ticks, free.laser_ticks), (hidden.ticks, free.ticks));
    assert!((1..free.laser_ticks).contains(&hidden.laser_ticks), "{hidden:?}");
}

#[test]
fn what_stands_and_what_ends_well_has_no_mover_contact() {
    let crate_ahead = field(vec![rectangle("crate", [1.0, -1.0], [2.0, 1.0])], vec![]);
    let outcome = end(&crate_ahead, (1.0, 1.0));
    assert_eq!((outcome.hit.as_deref(), outcome.mover_contact), (Some("crate"), None));
    let outcome = end(&field(vec![], vec![]), STAND);
    assert_eq!((outcome.hit, outcome.mover_contact), (None, None));
}

#[test]
fn sides_meet_at_45_and_90_degrees() {
    let side = |bearing_mrad| {
        MoverContact { bearing_mrad, ticks: 0, camera_ticks: 0, laser_ticks: 0 }.side()
    };
    for sign in [1, -1] {
        assert_eq!([785, 786].map(|mrad| side(sign * mrad)), [Side::Ahead, Side::Beside]);
        assert_eq!([1570, 1571].map(|mrad| side(sign * mrad)), [Side::Beside, Side::Behind]);
        assert_eq!(side(sign * 3141), Side::Behind);
    }
}
