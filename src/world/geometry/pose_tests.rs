use core::f64::consts::FRAC_PI_2;

use proptest::prelude::*;

use super::*;

#[test]
fn angles_wrap_to_minus_pi_exclusive_pi_inclusive() {
    assert_eq!(wrap_angle(PI), PI);
    assert_eq!(wrap_angle(-PI), PI);
    assert_eq!(wrap_angle(0.0), 0.0);
    assert!((wrap_angle(6.0) - (6.0 - TAU)).abs() < 1e-15);
    assert!((wrap_angle(-100.0) - (-100.0 + 16.0 * TAU)).abs() < 1e-13);
}

#[test]
fn a_quarter_circle_to_the_left_ends_where_it_should() {
    let end = Pose::new(1.0, 2.0, 0.0).after_arc(FRAC_PI_2 * 3.0, FRAC_PI_2);
    assert!((end.position - Point2::new(4.0, 5.0)).norm() < 1e-12, "{end:?}");
    assert_eq!(end.yaw_rad, FRAC_PI_2);
}

#[test]
fn straight_ways_and_turns_on_the_spot_are_exact() {
    let start = Pose::new(1.0, 2.0, 0.0);
    assert_eq!(start.after_arc(0.5, 0.0), Pose::new(1.5, 2.0, 0.0));
    assert_eq!(start.after_arc(0.0, 0.25), Pose::new(1.0, 2.0, 0.25));
}

#[test]
fn bearings_are_left_positive_and_wrap_behind() {
    let pose = Pose::new(0.0, 0.0, 3.0);
    assert!((pose.bearing_rad(Point2::new(-1.0, -0.0)) - (PI - 3.0)).abs() < 1e-12);
    assert!((pose.bearing_rad(Point2::new(-1.0, -1.0)) - (1.25 * PI - 3.0)).abs() < 1e-12);
    assert_eq!(pose.bearing_rad(pose.position), 0.0);
}

#[test]
fn poses_round_to_millimetres_and_milliradians() {
    assert_eq!(Pose::new(-1.23449, 0.0005, 3.2).rounded_mm_mrad(), [-1234, 1, -3083]);
}

proptest! {
    #[test]
    fn an_arc_in_many_parts_is_the_arc(
        yaw_rad in -3.0..3.0_f64, way_m in -5.0..5.0_f64, turn_rad in -6.0..6.0_f64,
    ) {
        let whole = Pose::new(0.0, 0.0, yaw_rad).after_arc(way_m, turn_rad);
        let parts = (0..100).fold(Pose::new(0.0, 0.0, yaw_rad), |pose, _| {
            pose.after_arc(way_m / 100.0, turn_rad / 100.0)
        });
        prop_assert!((whole.position - parts.position).norm() < 1e-11);
        prop_assert!(wrap_angle(whole.yaw_rad - parts.yaw_rad).abs() < 1e-11);
    }
}
