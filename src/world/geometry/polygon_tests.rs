use super::*;

fn polygon(vertices: &[[f64; 2]]) -> Result<ConvexPolygon, ShapeError> {
    ConvexPolygon::new(vertices.iter().map(|vertex| Point2::from(*vertex)).collect())
}

const TRAPEZOID: [[f64; 2]; 4] = [[-3.0, 1.0], [0.0, 1.0], [1.5, 3.0], [-3.0, 3.0]];

#[test]
fn both_winding_orders_give_the_same_outline() {
    let mut clockwise = TRAPEZOID;
    clockwise.reverse();
    let (a, b) = (polygon(&TRAPEZOID).unwrap(), polygon(&clockwise).unwrap());
    assert!(signed_area_m2(a.vertices()) > 0.0);
    assert_eq!(a.vertices(), b.vertices());
    let below = Point2::new(-1.0, 0.0);
    assert_eq!(a.distance_m(below), 1.0);
    assert_eq!(a.ray_range_m(below, Vector2::new(0.0, 1.0)), Some(1.0));
    assert_eq!(a.ray_range_m(below, Vector2::new(0.0, -1.0)), None);
}

#[test]
fn rays_from_inside_have_no_length_and_rays_along_an_edge_hit() {
    let square = polygon(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]).unwrap();
    let right = Vector2::new(1.0, 0.0);
    assert_eq!(square.ray_range_m(Point2::new(1.0, 1.0), right), Some(0.0));
    assert_eq!(square.ray_range_m(Point2::new(-3.0, 2.0), right), Some(3.0));
    assert_eq!(square.ray_range_m(Point2::new(-3.0, 2.0 + 1e-9), right), None);
    assert_eq!(square.ray_range_m(Point2::new(5.0, 1.0), right), None);
}

#[test]
fn collinear_vertices_are_convex() {
    assert!(polygon(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0]]).is_ok());
}

#[test]
fn outlines_that_cross_or_fold_back_are_refused() {
    let on_circle = |i: usize| {
        let angle_rad = TAU * 2.0 * i as f64 / 5.0;
        [libm::cos(angle_rad), libm::sin(angle_rad)]
    };
    let pentagram: Vec<[f64; 2]> = (0..5).map(on_circle).collect();
    assert!(matches!(polygon(&pentagram), Err(ShapeError::NotConvex { .. })));
    let bow_tie = [[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.0]];
    assert!(matches!(polygon(&bow_tie), Err(ShapeError::Area { .. })));
    let spike_out = [[0.0, 0.0], [3.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
    assert!(matches!(polygon(&spike_out), Err(ShapeError::NotConvex { .. })));
    let spike_in =
        [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    assert!(matches!(polygon(&spike_in), Err(ShapeError::NotConvex { .. })));
    let twice_round = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [0.0, 2.0]];
    assert!(matches!(polygon(&twice_round), Err(ShapeError::NotConvex { .. })));
}

#[test]
fn a_turned_rectangle_has_its_corners_where_they_belong() {
    let yaw_rad = core::f64::consts::FRAC_PI_2;
    let upright =
        ConvexPolygon::rectangle(Point2::new(1.0, 1.0), yaw_rad, Vector2::new(4.0, 2.0)).unwrap();
    let (low, high) = upright.extent();
    assert!((low - Point2::new(0.0, -1.0)).norm() < 1e-12, "{low}");
    assert!((high - Point2::new(2.0, 3.0)).norm() < 1e-12, "{high}");
}
