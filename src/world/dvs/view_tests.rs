use super::*;
use crate::world::arena::Obstacle;
use crate::world::test_data::{cylinder, field, mover, rectangle};

const LOOKING_EAST: Pose = Pose { position: nalgebra::Point2::new(0.0, 0.0), yaw_rad: 0.0 };

/// Every surface in its own even shade, so that what is seen can be told apart.
fn plain() -> CameraConfig {
    CameraConfig { contrast: 0.0, ..CameraConfig::default() }
}

fn hits(world: &World, pose: &Pose) -> Vec<Vec<(f64, f64)>> {
    let mut view = View::new(world, &plain());
    view.draw(pose, 0, 0.0);
    let of =
        |column: &Column| column.hits().iter().map(|hit| (hit.depth_m, hit.height_m)).collect();
    view.columns.iter().map(of).collect()
}

/// Rows that column `x` covers with things.
fn covered(world: &World, x: usize) -> core::ops::Range<usize> {
    let mut view = View::new(world, &plain());
    view.draw(&LOOKING_EAST, 0, 0.0);
    draw_column(&mut view.columns[x], &view.projection, x, &mut view.shades)
}

#[test]
fn a_wall_at_a_known_distance_spans_the_computed_rows_and_columns() {
    // 90 degrees over 128 pixels: 64 px per unit of slope. At 2 m the top of 1 m is 0.6 / 2 * 64 =
    // 19.2 px above the horizon, the foot 0.4 / 2 * 64 = 12.8 px below it.
    let world = field(vec![rectangle("wall", [2.0, -1.0], [3.0, 1.0])], vec![]);
    assert_eq!(covered(&world, 64), 45..77);
    // Its edges are at slope 0.5 on both sides: columns 32..96.
    let columns = hits(&world, &LOOKING_EAST);
    let seen: Vec<usize> = (0..COLUMNS).filter(|x| !columns[*x].is_empty()).collect();
    assert_eq!((seen[0], seen[seen.len() - 1], seen.len()), (32, 95, 64));
    assert!(columns[32..96].iter().all(|hits| hits.len() == 1 && (hits[0].0 - 2.0).abs() < 1e-9));
}

#[test]
fn left_is_left_in_the_picture_for_any_heading() {
    let world = field(vec![rectangle("wall", [-0.5, 3.0], [0.0, 4.0])], vec![]);
    let columns = hits(&world, &Pose::new(0.0, 0.0, core::f64::consts::FRAC_PI_2));
    // Looking north, west is left: slopes -1/6..0.
    let seen: Vec<usize> = (0..COLUMNS).filter(|x| !columns[*x].is_empty()).collect();
    assert_eq!((seen[0], seen[seen.len() - 1]), (53, 63));
}

#[test]
fn what_is_higher_shows_behind_what_is_lower() {
    let low = Obstacle { height_m: 0.5, ..rectangle("low", [2.0, -1.0], [2.5, 1.0]) };
    let high = Obstacle { height_m: 2.0, ..rectangle("high", [4.0, -2.0], [5.0, 2.0]) };
    let world = field(vec![high, low], vec![]);
    // Foot of the low one at row 76.8, its top at 60.8; top of the high one at 64 - 1.6 / 4 * 64.
    assert_eq!(covered(&world, 64), 38..77);
    let mut config = plain();
    config.contrast = 1.0;
    let mut view = View::new(&world, &config);
    view.draw(&LOOKING_EAST, 0, 0.0);
    let hidden = field(vec![rectangle("low", [2.0, -1.0], [2.5, 1.0])], vec![]);
    assert_eq!(covered(&hidden, 64).start, 45);
    assert_eq!(view.columns[64].hits().len(), 2);
}

#[test]
fn a_cylinder_is_seen_between_its_tangents_and_nearest_in_the_middle() {
    let world = field(vec![cylinder("post", [5.0, 0.0], 1.0)], vec![]);
    let columns = hits(&world, &LOOKING_EAST);
    // Tangents at slope 1 / sqrt(24): 13.06 px from the middle.
    let seen: Vec<usize> = (0..COLUMNS).filter(|x| !columns[*x].is_empty()).collect();
    assert_eq!((seen[0], seen[seen.len() - 1]), (51, 76));
    assert!((columns[64][0].0 - 4.0).abs() < 1e-3, "{:?}", columns[64]);
    // The ray through any column meets the circle.
    for (x, hits) in columns.iter().enumerate().filter(|(_, hits)| !hits.is_empty()) {
        let depth_m = hits[0].0;
        let right_m = depth_m * (x as f64 - 63.5) / 64.0;
        let radius_m = libm::hypot(right_m, depth_m - 5.0);
        assert!((radius_m - 1.0).abs() < 1e-9, "column {x}: {radius_m}");
    }
}

#[test]
fn depths_equal_those_of_rays_against_the_arena() {
    let world = World::new(crate::world::arena::Arena::named("map2").unwrap().without_movers());
    let projection = Projection::new(&plain());
    let mut compared = 0;
    for pose in [Pose::new(0.0, 0.0, 0.3), Pose::new(-9.5, -9.5, 0.8), Pose::new(3.3, -8.8, 2.0)] {
        if world.scene().clearance_m(pose.position) < 0.2 {
            continue;
        }
        let mut view = View::new(&world, &plain());
        view.draw(&pose, 0, 0.0);
        for (x, column) in view.columns.iter().enumerate() {
            let slope = projection.slope(x);
            let angle_rad = pose.yaw_rad - libm::atan(slope);
            let range_m = world.scene().ray_range_m(pose.position, angle_rad, 100.0).unwrap();
            let depth_m = range_m / libm::sqrt(1.0 + slope * slope);
            let nearest_m = column.hits()[0].depth_m;
            assert!((nearest_m - depth_m).abs() < 1e-6, "column {x}: {nearest_m} {depth_m}");
            compared += 1;
        }
    }
    assert!(compared >= 2 * COLUMNS, "{compared}");
}

#[test]
fn paint_moves_with_a_mover_and_floor_and_walls_stay() {
    // Driving along with a mover at the same speed: its pixels stay the same, the floor does not.
    let world = field(vec![], vec![mover("cart", [2.0, 0.0], [8.0, 0.0], 1.0)]);
    let mut view = View::new(&world, &CameraConfig::default());
    let before = view.draw(&LOOKING_EAST, 0, 0.0).to_vec();
    let after = view.draw(&Pose::new(0.5, 0.0, 0.0), 50, 0.0).to_vec();
    let standing = view.draw(&LOOKING_EAST, 50, 0.0).to_vec();
    let same = |a: &[u8], b: &[u8], rows: core::ops::Range<usize>| {
        let pixels = rows.flat_map(|y| (60..68).map(move |x| y * COLUMNS + x));
        pixels.filter(|pixel| a[*pixel] == b[*pixel]).count()
    };
    assert_eq!(same(&before, &after, 50..70), 20 * 8);
    assert!(same(&before, &after, 90..128) < 38 * 8);
    // Seen from one place, the floor stays and the mover, now farther, does not.
    assert_eq!(same(&before, &standing, 90..128), 38 * 8);
    assert!(same(&before, &standing, 40..75) < 35 * 8);
}

#[test]
fn displacement_counts_turns_and_near_things() {
    let world = field(vec![rectangle("wall", [2.0, -9.0], [3.0, 9.0])], vec![]);
    let mut view = View::new(&world, &plain());
    view.draw(&LOOKING_EAST, 0, 0.0);
    let px =
        |x_m, yaw_rad| view.displacement_px(&LOOKING_EAST, &Pose::new(x_m, 0.0, yaw_rad), 0.01);
    assert!((px(0.0, 0.05) - 3.2).abs() < 1e-9);
    assert!((px(0.01, 0.0) - 0.32).abs() < 1e-9);
    assert_eq!(px(0.0, 0.0), 0.0);
}
