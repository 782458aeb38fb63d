use core::f64::consts::PI;

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::world::geometry::{Shape, StaticScene};
use crate::world::test_data::{any_shape, point};

proptest! {
    #[test]
    fn a_scan_gives_the_bits_of_one_query_per_ray_and_obstacle(
        shapes in vec(any_shape(), 0..12), position in point(), yaw_rad in -3.2..3.2_f64,
        zero_rad in -TAU..0.0,
    ) {
        let scene = StaticScene::new(shapes);
        let fan = RayFan::new(zero_rad, TAU / 97.0, 0, 97);
        let mut scan = fan.scan(&Pose::new(position.x, position.y, yaw_rad));
        scene.cast(&mut scan);
        for (direction, range_m) in scan.directions.iter().zip(scan.ranges_m()) {
            let ranges_m =
                scene.shapes().iter().filter_map(|s| s.ray_range_m(position, *direction));
            prop_assert_eq!(*range_m, ranges_m.fold(f64::INFINITY, f64::min));
        }
    }

    #[test]
    fn a_window_is_nearly_as_narrow_as_the_shape(shape in any_shape(), position in point()) {
        prop_assume!(shape.distance_m(position) > 0.5);
        let fan = RayFan::new(-PI, TAU / 720.0, 0, 720);
        let window = match &shape {
            Shape::Polygon(polygon) => polygon.bearing_window(position),
            Shape::Disc(disc) => disc.bearing_window(position),
        };
        let mut scan = fan.scan(&Pose::new(position.x, position.y, 0.0));
        let tested = core::cell::Cell::new(0);
        scan.see(window, |origin, direction| {
            tested.set(tested.get() + 1);
            shape.ray_range_m(origin, direction)
        });
        let hits = scan.ranges_m().iter().filter(|range_m| range_m.is_finite()).count();
        prop_assert!(tested.get() <= hits + 6, "{} rays tested, {hits} hit", tested.get());
    }
}

#[test]
fn rays_count_from_the_first_and_turn_with_the_heading() {
    let fan = RayFan::new(0.0, 0.5, 1, 3);
    assert_eq!(fan.n_rays(), 3);
    let mut scan = fan.scan(&Pose::new(0.0, 0.0, 1.0));
    let at_2_rad = Point2::from(direction(2.0) * 4.0);
    scan.see_disc(&Disc::new(at_2_rad, 1.0).unwrap());
    let ranges_m = scan.ranges_m();
    // Relative to the heading the rays are at 0.5, 1 and 1.5 rad.
    assert!((ranges_m[1] - 3.0).abs() < 1e-12, "{ranges_m:?}");
    assert!(ranges_m[0].is_infinite() && ranges_m[2].is_infinite(), "{ranges_m:?}");
}
