use super::*;
use crate::closed_loop::TrialConfig;
use crate::rng::Streams;
use crate::world::World;
use crate::world::arena::Arena;
use crate::world::dvs::CAMERA_DEG;
use crate::world::geometry::Pose;

const CAMERA: Knowledge = Knowledge::Camera { field_of_view_deg: CAMERA_DEG };

/// A robot in the middle that looks east, past a wall in the north-east.
fn known(from: [f64; 2], to: [f64; 2], knowledge: Knowledge) -> Option<[f64; 2]> {
    let json = format!(
        r#"{{"name": "t", "arena": {{"xmin": -9.0, "xmax": 9.0, "ymin": -9.0, "ymax": 9.0}},
        "obstacles": [{{"name": "bar", "shape": "box", "x": 2.0, "y": 1.5, "yaw": 0.0,
        "size": [2.0, 0.4], "height": 1.0}}], "movers": [{{"name": "m", "x": {}, "y": {},
        "to": [{}, {}], "radius": 0.25, "height": 0.5, "speed": 1.5}}]}}"#,
        from[0], from[1], to[0], to[1]
    );
    let world = World::new(Arena::from_json(json.as_bytes(), "t", None).unwrap());
    let (start, goal) = (Pose::new(0.0, 0.0, 0.0), Point2::new(8.0, 0.0));
    let config = TrialConfig::eem_san(1.0);
    let trial = Trial::new(&world, start, goal, &config, Streams::new(1, 0)).unwrap();
    let forecast = forecast(&trial, knowledge);
    assert_eq!(forecast.len(), STEPS);
    let last = forecast.last().unwrap().first()?;
    Some([last.0.x, last.0.y].map(|x| (x * 1e6).round() / 1e6))
}

#[test]
fn in_view_of_the_camera_a_mover_goes_on() {
    let (from, to) = ([4.0, -1.0], [4.0, 8.0]);
    assert_eq!(known(from, to, Knowledge::Everything), Some([4.0, 2.0]));
    assert_eq!(known(from, to, CAMERA), Some([4.0, 2.0]));
    assert_eq!(known(from, to, Knowledge::Laser), Some([4.0, -1.0]));
}

#[test]
fn turns_at_the_end_of_a_track_are_known_to_who_knows_everything() {
    let (from, to) = ([4.0, -1.0], [4.0, 0.5]);
    assert_eq!(known(from, to, Knowledge::Everything), Some([4.0, -1.0]));
    assert_eq!(known(from, to, CAMERA), Some([4.0, 2.0]));
}

#[test]
fn beside_the_camera_and_far_away_a_mover_stands() {
    for from in [[1.0, -2.0], [6.5, -1.0]] {
        let to = [from[0], from[1] - 5.0];
        assert_eq!(known(from, to, CAMERA), Some(from));
        assert_eq!(known(from, to, Knowledge::Laser), Some(from));
    }
}

#[test]
fn behind_the_robot_or_a_wall_a_mover_is_unknown() {
    for from in [[-2.0, 0.0], [2.0, 3.0]] {
        let to = [from[0], from[1] + 5.0];
        assert_eq!(known(from, to, CAMERA), None);
        assert_eq!(known(from, to, Knowledge::Laser), None);
        assert!(known(from, to, Knowledge::Everything).is_some());
    }
}

#[test]
fn a_wider_lens_shows_more() {
    let (from, to) = ([1.0, -2.0], [1.0, -7.0]);
    let wide = |field_of_view_deg| known(from, to, Knowledge::Camera { field_of_view_deg });
    assert_eq!(wide(90), Some([1.0, -2.0]));
    assert_eq!(wide(126), Some([1.0, -2.0]));
    assert_eq!(wide(128), Some([1.0, -5.0]));
}
