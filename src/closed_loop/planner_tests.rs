use super::*;
use crate::closed_loop::TrialConfig;
use crate::rng::Streams;
use crate::world::World;
use crate::world::arena::Arena;

fn world(movers: &str) -> World {
    let json = format!(
        r#"{{"name": "t", "arena": {{"xmin": -5.0, "xmax": 5.0, "ymin": -5.0, "ymax": 5.0}},
        "obstacles": [{{"name": "bar", "shape": "box", "x": 0.0, "y": 0.5, "yaw": 0.0,
        "size": [0.4, 5.0], "height": 1.0}}], "movers": [{movers}]}}"#
    );
    World::new(Arena::from_json(json.as_bytes(), "t", None).unwrap())
}

fn drive(world: &World, start: Pose, goal: Point2<f64>) -> crate::closed_loop::TrialOutcome {
    let config = TrialConfig::eem_san(1.0);
    let terrain = Terrain::new(world);
    let planner = Planner::new(&terrain, goal, 1.0, Knowledge::Everything);
    let mut trial = Trial::new(world, start, goal, &config, Streams::new(1, 0)).unwrap();
    while trial.end().is_none() {
        let (action, _) = planner.plan(&trial);
        trial.drive(action);
    }
    trial.into_outcome()
}

#[test]
fn planner_goes_round_a_bar_by_the_shorter_way() {
    let world = world("");
    let outcome = drive(&world, Pose::new(-3.0, 0.0, 0.0), Point2::new(3.0, 0.0));
    assert_eq!(outcome.outcome, crate::closed_loop::Outcome::Success);
    assert!(outcome.path_m < 9.0, "way {} m", outcome.path_m);
    assert!(outcome.trajectory.iter().all(|[_, y, _]| *y < 3000), "not over the top");
}

#[test]
fn planner_waits_for_a_mover_that_blocks_the_gap() {
    let gap = r#"{"name": "m", "x": -1.0, "y": -3.5, "to": [1.0, -3.5], "radius": 0.25,
        "height": 0.5, "speed": 1.4}"#;
    let outcome = drive(&world(gap), Pose::new(-3.0, -3.0, 0.0), Point2::new(3.0, -3.0));
    assert_eq!(outcome.outcome, crate::closed_loop::Outcome::Success, "{outcome:?}");
}

#[test]
fn way_is_longer_than_the_straight_line_behind_a_bar() {
    let world = world("");
    let terrain = Terrain::new(&world);
    let ways = terrain.ways_to(Point2::new(3.0, 0.0), 1.0);
    let open_s = terrain.time_s(&ways, &Pose::new(2.0, 0.0, 0.0)).unwrap();
    let turned_s = terrain.time_s(&ways, &Pose::new(2.0, 0.0, 3.1)).unwrap();
    let behind_s = terrain.time_s(&ways, &Pose::new(-3.0, 0.0, -0.5)).unwrap();
    assert!((open_s - 1.0).abs() < 0.15, "{open_s}");
    assert!(turned_s > open_s + 0.6 && turned_s < open_s + 1.6, "{turned_s}");
    assert!(behind_s > 6.5 && behind_s < 10.0, "{behind_s}");
    assert_eq!(terrain.time_s(&ways, &Pose::new(-6.0, 0.0, 0.0)), None);
}

#[test]
fn actions_are_numbered_by_level() {
    assert_eq!(action_of(0), Action { left: 0.0, right: 0.0 });
    assert_eq!(action_of(5), Action { left: 0.0, right: 1.0 });
    assert_eq!(action_of(35), Action { left: 1.0, right: 1.0 });
}
