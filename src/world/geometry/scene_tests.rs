use parry2d::math::Pose as ParryPose;
use parry2d::query::RayCast;
use parry2d::shape::{Ball, Cuboid};
use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::world::geometry::{ConvexPolygon, Disc};
use crate::world::test_data::{any_shape, point};

#[test]
fn an_empty_scene_has_no_hits_and_infinite_clearance() {
    let scene = StaticScene::new(vec![]);
    assert_eq!(scene.ray_range_m(Point2::origin(), 1.0, 40.0), None);
    assert_eq!(scene.nearest(Point2::origin()), None);
    assert_eq!(scene.clearance_m(Point2::origin()), f64::INFINITY);
}

#[test]
fn a_hit_beyond_the_maximum_is_no_hit() {
    let post = Disc::new(Point2::new(5.0, 0.0), 1.0).unwrap();
    let scene = StaticScene::new(vec![Shape::Disc(post)]);
    assert_eq!(scene.ray_range_m(Point2::origin(), 0.0, 4.0), Some(4.0));
    assert_eq!(scene.ray_range_m(Point2::origin(), 0.0, 3.999), None);
    assert_eq!(scene.ray_range_m(Point2::origin(), 3.0, 40.0), None);
}

#[test]
fn the_nearer_of_two_obstacles_is_hit() {
    let post = |x_m: f64| Shape::Disc(Disc::new(Point2::new(x_m, 0.0), 0.5).unwrap());
    let scene = StaticScene::new(vec![post(6.0), post(3.0), post(-1.0)]);
    let hit = scene.ray_hit(Point2::origin(), Vector2::new(1.0, 0.0), 40.0);
    assert_eq!(hit, Some(RayHit { range_m: 2.5, obstacle_idx: 1 }));
    assert_eq!(scene.nearest(Point2::new(0.0, 0.0)), Some((2, 0.5)));
}

proptest! {
    #[test]
    fn the_tree_gives_the_bits_of_a_plain_loop(
        shapes in vec(any_shape(), 1..30), origin in point(), angle_rad in -3.2..3.2_f64,
    ) {
        let scene = StaticScene::new(shapes);
        let along = direction(angle_rad);
        let ranges_m = scene.shapes().iter().filter_map(|s| s.ray_range_m(origin, along));
        let range_m = ranges_m.filter(|range_m| *range_m <= 8.0).reduce(f64::min);
        prop_assert_eq!(scene.ray_range_m(origin, angle_rad, 8.0), range_m);
        let distances_m = scene.shapes().iter().map(|shape| shape.distance_m(origin));
        prop_assert_eq!(Some(scene.clearance_m(origin)), distances_m.reduce(f64::min));
        if let Some(range_m) = range_m {
            prop_assert!(range_m >= scene.clearance_m(origin) - 1e-9);
        }
    }

    #[test]
    fn boxes_and_discs_agree_with_parrys_own(
        centre in point(), yaw_rad in -3.0..3.0_f64, half in (0.2..3.0_f64, 0.2..3.0_f64),
        origin in point(), angle_rad in -3.2..3.2_f64,
    ) {
        let along = direction(angle_rad);
        // Range to both shapes, scaled: rays that only graze may differ in f32.
        let mine = |scale: f64| {
            let size_m = 2.0 * scale * Vector2::new(half.0, half.1);
            let rectangle = ConvexPolygon::rectangle(centre, yaw_rad, size_m).unwrap();
            let disc = Disc::new(centre, scale * half.0).unwrap();
            [rectangle.ray_range_m(origin, along), disc.ray_range_m(origin, along)]
        };
        let place = ParryPose::new(to_parry(centre.coords), yaw_rad as f32);
        let ray = Ray::new(to_parry(origin.coords), to_parry(along));
        let half_m = to_parry(Vector2::new(half.0, half.1));
        let theirs = [
            Cuboid::new(half_m).cast_ray(&place, &ray, 100.0, true),
            Ball::new(half.0 as f32).cast_ray(&place, &ray, 100.0, true),
        ];
        for (shape, theirs) in theirs.into_iter().enumerate() {
            prop_assert!(theirs.is_some() || mine(0.99)[shape].is_none());
            prop_assert!(theirs.is_none() || mine(1.01)[shape].is_some());
            if let (Some(mine), Some(theirs)) = (mine(1.0)[shape], theirs) {
                prop_assert!((mine - f64::from(theirs)).abs() < 0.02, "{mine} {theirs}");
            }
        }
    }
}
