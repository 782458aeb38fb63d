use proptest::prelude::*;

use super::*;
use crate::world::test_data::{any_shape, point};

fn message(vertices: &[[f64; 2]]) -> String {
    let points = vertices.iter().map(|vertex| Point2::from(*vertex)).collect();
    ConvexPolygon::new(points).unwrap_err().to_string()
}

#[test]
fn refused_outlines_say_what_is_wrong() {
    assert_eq!(
        message(&[[0.0, 0.0], [1.0, 0.0]]),
        "2 vertices, must be 3..=64 (VERTICES_MAX); split or thin the polygon"
    );
    assert_eq!(
        message(&[[0.0, 0.0], [1.0, 0.0], [f64::NAN, 1.0]]),
        "coordinate NaN m, must be within +-1000 m (COORDINATE_M_MAX); arenas are in metres"
    );
    assert_eq!(
        message(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        "edge from vertex 1 is 0 m long, at least 0.001 m (EDGE_M_MIN); drop the vertex"
    );
    assert_eq!(
        message(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]),
        "area 0 m2, at least 0.0001 m2 (AREA_M2_MIN); the vertices are on one line, or the \
         outline crosses itself"
    );
    assert_eq!(
        message(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0]]),
        "not convex at vertex 2; split the outline into convex polygons"
    );
    assert_eq!(
        Disc::new(Point2::origin(), 0.0).unwrap_err().to_string(),
        "radius 0 m, must be 0.01..=100 m"
    );
    assert_eq!(
        Disc::new(Point2::new(0.0, -1000.5), 1.0).unwrap_err().to_string(),
        "coordinate -1000.5 m, must be within +-1000 m (COORDINATE_M_MAX); arenas are in metres"
    );
}

#[test]
fn more_vertices_than_the_limit_are_refused() {
    let circle: Vec<_> =
        (0..65).map(|i| Point2::from(direction(6.2 * f64::from(i) / 65.0))).collect();
    assert_eq!(ConvexPolygon::new(circle[..64].to_vec()).unwrap().vertices().len(), 64);
    assert_eq!(ConvexPolygon::new(circle).unwrap_err(), ShapeError::Vertices { n: 65 });
}

#[test]
fn distance_to_a_segment_is_zero_when_it_crosses() {
    let square = ConvexPolygon::rectangle(Point2::origin(), 0.0, Vector2::new(2.0, 2.0));
    let shape = Shape::Polygon(square.unwrap());
    let distance_m =
        |a: [f64; 2], b: [f64; 2]| shape.distance_to_segment_m(Point2::from(a), Point2::from(b));
    assert_eq!(distance_m([-5.0, 0.0], [5.0, 0.5]), 0.0);
    assert_eq!(distance_m([0.0, 0.0], [0.1, 0.0]), 0.0);
    assert_eq!(distance_m([-5.0, 3.0], [5.0, 3.0]), 2.0);
    assert_eq!(distance_m([4.0, 0.0], [7.0, 0.0]), 3.0);
    assert_eq!(distance_m([4.0, 0.0], [4.0, 0.0]), 3.0);
    let diagonal_m = distance_m([3.0, 0.0], [0.0, 3.0]);
    assert!((diagonal_m - 0.5 * libm::sqrt(2.0)).abs() < 1e-12, "{diagonal_m}");
}

proptest! {
    #[test]
    fn a_ray_is_at_least_as_long_as_the_distance_and_ends_on_the_outline(
        shape in any_shape(), origin in point(), angle_rad in -3.2..3.2_f64,
    ) {
        let direction = direction(angle_rad);
        let distance_m = shape.distance_m(origin);
        if let Some(range_m) = shape.ray_range_m(origin, direction) {
            prop_assert!(range_m >= distance_m - 1e-9, "{range_m} < {distance_m}");
            prop_assert!(shape.distance_m(origin + direction * range_m) < 1e-9);
        }
        // Towards a point of the shape no ray misses.
        let (low, high) = shape.extent();
        let to_centre = nalgebra::center(&low, &high) - origin;
        if to_centre.norm() > 1e-6 {
            let range_m = shape.ray_range_m(origin, to_centre.normalize());
            let inside = shape.distance_m(nalgebra::center(&low, &high)) == 0.0;
            prop_assert!(range_m.is_some() || !inside);
        }
    }

    #[test]
    fn distance_changes_no_faster_than_the_point_moves(
        shape in any_shape(), a in point(), b in point(),
    ) {
        let change_m = (shape.distance_m(a) - shape.distance_m(b)).abs();
        prop_assert!(change_m <= (a - b).norm() + 1e-9);
        let to_segment_m = shape.distance_to_segment_m(a, b);
        for i in 0..=10 {
            let between = a + (b - a) * (0.1 * f64::from(i));
            prop_assert!(shape.distance_m(between) >= to_segment_m - 1e-9);
        }
    }
}
