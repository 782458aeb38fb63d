use super::*;
use crate::policy::{Action, Observation};
use crate::world::arena::Arena;
use crate::world::pairs::{PairRules, generate_pairs, read_pairs};
use crate::world::test_data::{cylinder, field, mover, rectangle, san, san_world};

/// Always the same action; remembers what it saw.
struct Constant {
    action: Action,
    seen: Vec<Observation>,
}

impl Policy for Constant {
    fn start_trial(&mut self, _streams: Streams) {
        self.seen.clear();
    }

    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        assert_eq!(tick, self.seen.len() as u64);
        self.seen.push(observation.clone());
        self.action
    }
}

fn constant(left: f64, right: f64) -> Constant {
    Constant { action: Action { left, right }, seen: vec![] }
}

fn quiet() -> TrialConfig {
    TrialConfig { laser_noise_m: 0.0, action_noise: false, ..TrialConfig::san() }
}

fn fly(
    world: &World,
    goal: [f64; 2],
    config: &TrialConfig,
    policy: &mut dyn Policy,
) -> TrialOutcome {
    let start = Pose::new(0.0, 0.0, 0.0);
    run_trial(world, start, Point2::from(goal), config, policy, Streams::new(1, 0)).unwrap()
}

#[test]
fn a_straight_way_to_the_goal_succeeds_at_the_tick_that_ends_within_it() {
    let world = field(vec![], vec![]);
    let outcome = fly(&world, [3.0, 0.0], &quiet(), &mut constant(1.0, 1.0));
    // 0.05 m per tick: after 50 ticks the centre is at 2.5 m, not nearer than 0.5 m.
    assert_eq!((outcome.outcome, outcome.hit), (Outcome::Success, None));
    assert_eq!((outcome.ticks, outcome.decisions), (51, 51));
    assert!((outcome.path_m - 2.55).abs() < 1e-9);
    assert!((outcome.time_s - 5.1).abs() < 1e-9);
    assert!((outcome.mean_speed_m_per_s - 0.5).abs() < 1e-9);
    assert!((outcome.end_goal_distance_m - 0.45).abs() < 1e-9);
    assert_eq!(outcome.trajectory.len(), 52);
    assert_eq!(outcome.trajectory[0..3], [[0, 0, 0], [50, 0, 0], [100, 0, 0]]);
}

#[test]
fn contact_ends_the_trial_between_ticks_and_names_the_obstacle() {
    let world = field(vec![rectangle("crate", [1.001, -1.0], [2.0, 1.0])], vec![]);
    let outcome = fly(&world, [8.0, 0.0], &quiet(), &mut constant(1.0, 1.0));
    assert_eq!(outcome.outcome, Outcome::Collision);
    assert_eq!(outcome.hit.as_deref(), Some("crate"));
    // Contact needs x > 0.821 m: the first step of 5 mm beyond it is the 165th.
    assert_eq!(outcome.trajectory.last(), Some(&[825, 0, 0]));
    assert!((outcome.time_s - 1.65).abs() < 1e-9, "{}", outcome.time_s);
    assert_eq!(outcome.ticks, 17);
}

#[test]
fn movers_and_the_edge_of_the_arena_are_hit_too() {
    let cart = mover("cart", [4.0, 0.0], [-4.0, 0.0], 0.5);
    let outcome = fly(&field(vec![], vec![cart]), [9.0, 0.0], &quiet(), &mut constant(1.0, 1.0));
    assert_eq!(outcome.hit.as_deref(), Some("cart"));
    assert!((outcome.time_s - 3.58).abs() < 1e-9, "{}", outcome.time_s);
    let far = TrialConfig { wheel_speed_m_per_s_max: 0.7, ..quiet() };
    let outcome = fly(&field(vec![], vec![]), [0.0, 9.0], &far, &mut constant(1.0, 1.0));
    assert_eq!(outcome.hit.as_deref(), Some("bounds"));
    assert_eq!(outcome.trajectory.last(), Some(&[10_003, 0, 0]));
}

#[test]
fn the_goal_wins_over_contact_at_the_end_of_a_tick_but_not_before() {
    // After tick 17 the centre is at 0.85 m, within 0.5 m of the goal.
    let goal = [1.33, 0.0];
    let crate_at = |x_m: f64| field(vec![rectangle("crate", [x_m, -1.0], [9.0, 1.0])], vec![]);
    let touch_at_the_end = crate_at(0.85 + 0.18 - 0.001);
    let outcome = fly(&touch_at_the_end, goal, &quiet(), &mut constant(1.0, 1.0));
    assert_eq!((outcome.outcome, outcome.ticks), (Outcome::Success, 17));
    let touch_before = crate_at(0.84 + 0.18 - 0.001);
    let outcome = fly(&touch_before, goal, &quiet(), &mut constant(1.0, 1.0));
    assert_eq!(outcome.outcome, Outcome::Collision);
}

#[test]
fn circling_runs_out_of_time() {
    let config = TrialConfig { ticks_max: 30, ..quiet() };
    let outcome = fly(&field(vec![], vec![]), [9.0, 9.0], &config, &mut constant(0.0, 1.0));
    assert_eq!((outcome.outcome, outcome.ticks), (Outcome::TimeOut, 30));
    assert!((outcome.time_s - 3.0).abs() < 1e-9);
}

#[test]
fn a_trial_that_starts_at_its_goal_or_in_contact_ends_without_a_decision() {
    let world = field(vec![cylinder("post", [0.2, 0.0], 0.1)], vec![]);
    let at_goal = fly(&world, [0.3, 0.0], &quiet(), &mut constant(1.0, 1.0));
    assert_eq!((at_goal.outcome, at_goal.decisions), (Outcome::Success, 0));
    let in_contact = fly(&world, [5.0, 0.0], &quiet(), &mut constant(1.0, 1.0));
    assert_eq!((in_contact.outcome, in_contact.decisions), (Outcome::Collision, 0));
    assert_eq!((in_contact.time_s, in_contact.mean_speed_m_per_s), (0.0, 0.0));
    assert_eq!(in_contact.trajectory, [[0, 0, 0]]);
}

#[test]
fn observations_are_actual_speeds_goal_and_ranges() {
    let world = field(vec![rectangle("wall", [6.0, -9.0], [7.0, 9.0])], vec![]);
    let config = TrialConfig { actuators: "lag".parse().unwrap(), ticks_max: 3, ..quiet() };
    let mut policy = constant(0.0, 1.0);
    fly(&world, [0.0, 4.0], &config, &mut policy);
    let [first, second, third] = &policy.seen[..] else { panic!("{:?}", policy.seen.len()) };
    assert_eq!((first.linear_m_per_s, first.angular_rad_per_s), (0.0, 0.0));
    assert_eq!(first.goal_distance_m, 4.0);
    assert!((first.goal_direction_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((first.laser_m[8] - 6.0).abs() < 0.1, "{:?}", first.laser_m);
    assert_eq!(second.angular_rad_per_s, 0.0);
    let reached = 1.8 * (1.0 - libm::exp(-0.1 / 0.3));
    assert!((third.angular_rad_per_s - reached).abs() < 1e-12);
    assert!((third.linear_m_per_s - 0.275 / 1.8 * reached).abs() < 1e-12);
    assert!(third.goal_direction_rad < first.goal_direction_rad);
}

#[test]
fn actions_are_clipped_and_noise_is_a_hundredth() {
    let world = field(vec![], vec![]);
    let path_m = |config: &TrialConfig, action: f64| {
        let config = TrialConfig { ticks_max: 100, ..config.clone() };
        fly(&world, [9.0, 9.0], &config, &mut constant(action, action)).path_m
    };
    assert_eq!(path_m(&quiet(), 7.0), path_m(&quiet(), 1.0));
    assert_eq!(path_m(&quiet(), -7.0), path_m(&quiet(), 0.0));
    let noisy = TrialConfig { action_noise: true, ..quiet() };
    let (clean_m, noisy_m) = (path_m(&quiet(), 0.5), path_m(&noisy, 0.5));
    assert_ne!(clean_m, noisy_m);
    // 0.99 of the action, and a mean of 200 draws of a hundredth.
    let expected_m = clean_m - 0.45 * 10.0 * 0.005;
    assert!((noisy_m - expected_m).abs() < 0.02, "{noisy_m} {expected_m}");
}

#[test]
fn an_action_that_is_no_number_is_stopped_with_its_tick() {
    let world = field(vec![], vec![]);
    let flown = std::panic::catch_unwind(|| {
        fly(&world, [9.0, 9.0], &quiet(), &mut constant(f64::NAN, 0.0)).ticks
    });
    let panic = flown.unwrap_err();
    let text = panic.downcast_ref::<String>().unwrap();
    assert_eq!(text, "policy returned Action { left: NaN, right: 0.0 } at tick 0");
}

#[test]
fn settings_outside_of_their_limits_are_refused() {
    let world = field(vec![], vec![]);
    let refuse = |config: &TrialConfig, start: Pose| {
        let goal = Point2::new(5.0, 0.0);
        let made = Trial::new(&world, start, goal, config, Streams::new(1, 0));
        made.unwrap_err().to_string()
    };
    let here = Pose::new(0.0, 0.0, 0.0);
    for control_hz in [0, 30, 200] {
        assert_eq!(
            refuse(&TrialConfig { control_hz, ..quiet() }, here),
            format!(
                "control rate {control_hz} Hz must divide the physics rate of 100 Hz \
                 (PHYSICS_HZ); SAN uses 10, EEM-SAN 20 (--control-hz)"
            )
        );
    }
    assert_eq!(
        refuse(&TrialConfig { wheel_speed_m_per_s_max: 0.01, ..quiet() }, here),
        "trial: wheel speed (m/s) is 0.01, must be 0.05..=10; change it with --v-max"
    );
    let named = [
        (TrialConfig { ticks_max: 0, ..quiet() }, "tick limit is 0"),
        (TrialConfig { goal_radius_m: f64::NAN, ..quiet() }, "goal radius (m) is NaN"),
        (TrialConfig { robot_radius_m: -1.0, ..quiet() }, "robot radius (m) is -1"),
        (TrialConfig { laser_noise_m: f64::INFINITY, ..quiet() }, "laser noise (m) is inf"),
    ];
    for (config, expected) in named {
        assert!(refuse(&config, here).contains(expected), "{expected}");
    }
    let lost = Pose::new(f64::NAN, 0.0, 0.0);
    assert!(refuse(&quiet(), lost).contains("start x (m) is NaN"));
    let dizzy = Pose::new(0.0, 0.0, f64::INFINITY);
    assert!(refuse(&quiet(), dizzy).contains("start yaw (rad) is NaN"));
}

/// Successes, collisions, time-outs and ticks of the straight driver.
fn straight(world: &World, pairs: &[crate::world::pairs::Pair], config: &TrialConfig) -> [u64; 4] {
    let mut sums = [0; 4];
    for (trial, pair) in pairs.iter().enumerate() {
        let streams = Streams::new(1, trial as u64);
        let outcome =
            run_trial(world, pair.start, pair.goal, config, &mut StraightToGoal, streams).unwrap();
        sums[outcome.outcome as usize] += 1;
        sums[3] += outcome.ticks;
    }
    sums
}

#[test]
fn straight_to_goal_in_the_courtyards_always_gives_the_same_numbers() {
    let results = ["courtyard", "courtyard-moving"].map(|name| {
        let world = World::new(Arena::named(name).unwrap());
        let streams = Streams::new(1, 0);
        let pairs = generate_pairs(&world, 100, PairRules::default(), streams).unwrap();
        let result = straight(&world, &pairs, &TrialConfig::eem_san(1.0));
        assert_eq!(result, straight(&world, &pairs, &TrialConfig::eem_san(1.0)));
        println!("{name}: success, collision, time-out, ticks {result:?}");
        result
    });
    assert_eq!(results, STRAIGHT_COURTYARDS);
}

const STRAIGHT_COURTYARDS: [[u64; 4]; 2] = [[17, 83, 0, 9581], [15, 85, 0, 9253]];

#[test]
fn straight_to_goal_in_sans_world_reaches_one_goal() {
    let (Some(world), Some(path)) =
        (san_world("san_evaluation_world.json"), san("san_eval_positions.json"))
    else {
        return;
    };
    let pairs = read_pairs(&path).unwrap();
    let result = straight(&world, &pairs, &TrialConfig::san());
    println!("success, collision, time-out, ticks {result:?}");
    assert_eq!(result, [1, 199, 0, 12_419]);
}

#[test]
fn a_trial_depends_on_its_seed_and_on_nothing_else() {
    let world = World::new(Arena::named("courtyard-moving").unwrap());
    let fly = |seed| {
        let (start, goal) = (Pose::new(-2.0, -9.0, 1.0), Point2::new(2.5, 9.0));
        let streams = Streams::new(seed, 3);
        let config = TrialConfig { actuators: "lag".parse().unwrap(), ..TrialConfig::san() };
        run_trial(&world, start, goal, &config, &mut StraightToGoal, streams).unwrap()
    };
    assert_eq!(fly(1), fly(1));
    assert_ne!(fly(1).trajectory, fly(2).trajectory);
}

#[test]
fn an_observer_sees_every_physics_step_and_changes_nothing() {
    let world = field(vec![rectangle("crate", [6.001, -1.0], [7.0, 1.0])], vec![]);
    let config = TrialConfig::eem_san(1.0);
    let start = Pose::new(0.0, 0.0, 0.4);
    let trial = || Trial::new(&world, start, Point2::new(9.0, 0.0), &config, Streams::new(1, 0));
    let (mut plain, mut watched) = (trial().unwrap(), trial().unwrap());
    let mut seen: Vec<(u64, Pose)> = Vec::new();
    while plain.end().is_none() {
        plain.tick(&mut StraightToGoal);
        watched.tick_with(&mut StraightToGoal, |step, pose| seen.push((step, *pose)));
        assert_eq!(seen.last().unwrap(), &(watched.steps(), watched.robot().pose()));
    }
    let steps: Vec<u64> = seen.iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, (1..=watched.steps()).collect::<Vec<_>>());
    assert!(steps.len() > 50, "{}", steps.len());
    assert_eq!(plain.into_outcome(), watched.into_outcome());
}
