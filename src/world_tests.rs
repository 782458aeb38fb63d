use super::test_data::{cylinder, field, mover, rectangle};
use super::*;

#[test]
fn nearest_names_the_obstacle_the_mover_or_the_bounds() {
    let world = field(
        vec![rectangle("crate", [2.0, -1.0], [4.0, 1.0]), cylinder("post", [0.0, 5.0], 0.5)],
        vec![mover("cart", [-5.0, 0.0], [-5.0, 4.0], 1.0)],
    );
    let nearest = |x, y, step| world.nearest(Point2::new(x, y), step).unwrap();
    assert_eq!(nearest(1.0, 0.0, 0), Nearest { name: "crate", distance_m: 1.0 });
    assert_eq!(nearest(3.0, 0.5, 0), Nearest { name: "crate", distance_m: 0.0 });
    assert_eq!(nearest(0.0, 4.0, 0), Nearest { name: "post", distance_m: 0.5 });
    assert_eq!(nearest(-4.0, 0.0, 0), Nearest { name: "cart", distance_m: 0.75 });
    assert_eq!(nearest(10.001, 0.0, 0), Nearest { name: BOUNDS_NAME, distance_m: 0.0 });
    // Four seconds later the mover is at the far end of its track.
    assert!((nearest(-4.0, 4.0, 400).distance_m - 0.75).abs() < 1e-12);
    assert_eq!(nearest(-4.0, 4.0, 400).name, "cart");
}

#[test]
fn an_empty_world_has_no_nearest_thing_inside_its_bounds() {
    assert_eq!(field(vec![], vec![]).nearest(Point2::origin(), 0), None);
}

#[test]
fn scans_see_movers_where_they_are_at_the_step() {
    let world = field(vec![], vec![mover("cart", [3.0, 0.0], [7.0, 0.0], 1.0)]);
    let fan = geometry::RayFan::new(0.0, 0.1, 0, 1);
    let range_m = |step| {
        let mut scan = fan.scan(&geometry::Pose::new(0.0, 0.0, 0.0));
        world.cast(&mut scan, step);
        scan.ranges_m()[0]
    };
    assert_eq!(range_m(0), 2.75);
    assert!((range_m(100) - 3.75).abs() < 1e-12);
    assert!((range_m(500) - 5.75).abs() < 1e-12);
}
