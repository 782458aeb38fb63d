use proptest::prelude::*;

use super::*;
use crate::rng::Streams;
use crate::world::arena::Arena;
use crate::world::robot::ROBOT_RADIUS_M;
use crate::world::test_data::{cylinder, field, mover, rectangle, san, san_world};

fn read(text: &str) -> Result<Vec<Pair>, PairsError> {
    pairs_from_json(text.as_bytes(), "pairs.json")
}

fn refuse(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

fn courtyard() -> World {
    World::new(Arena::named("courtyard-moving").unwrap())
}

fn generate(world: &World, n: usize, rules: PairRules) -> Result<Vec<Pair>, PairsError> {
    generate_pairs(world, n, rules, Streams::new(42, 0))
}

#[test]
fn entries_may_hold_more_numbers_than_needed() {
    let pairs = read(r#"{"n": 1, "starts": [[1, 2, 6.5, 9]], "goals": [[3, 4, 5]]}"#).unwrap();
    let start = Pose::new(1.0, 2.0, 6.5);
    assert_eq!(pairs, [Pair { start, goal: Point2::new(3.0, 4.0) }]);
    assert!(pairs[0].start.yaw_rad < 1.0);
    assert_eq!(pairs[0].distance_m(), libm::sqrt(8.0));
}

#[test]
fn refused_files_say_what_is_wrong() {
    assert_eq!(
        refuse("[]"),
        "pairs.json: invalid length 0, expected struct PairsRecord with 2 elements at line 1 \
         column 2; expected {\"starts\": [[x, y, yaw], ..], \"goals\": [[x, y], ..]}"
    );
    assert_eq!(
        refuse(r#"{"starts": [[0, 0, 0]], "goals": []}"#),
        "pairs.json: 1 starts and 0 goals, must be as many and at least 1"
    );
    assert!(refuse(r#"{"starts": [], "goals": []}"#).contains("0 starts and 0 goals"));
    assert_eq!(
        refuse(r#"{"starts": [[0, 0, 0], [0, 0]], "goals": [[0, 0], [0, 0]]}"#),
        "pairs.json: trial 1: start has 2 numbers, needs 3"
    );
    assert_eq!(
        refuse(r#"{"starts": [[0, 0, 0]], "goals": [[0]]}"#),
        "pairs.json: trial 0: goal has 1 numbers, needs 2"
    );
    let many =
        |n| format!(r#"{{"starts": {}, "goals": {}}}"#, list("[0,0,0]", n), list("[0,0]", n));
    assert_eq!(
        refuse(&many(10_001)),
        "pairs.json: 10001 pairs, limit 10000 (PAIRS_MAX); split them"
    );
    assert_eq!(read(&many(10_000)).unwrap().len(), 10_000);
    let missing = read_pairs("no/such.json".as_ref()).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.json: cannot be read: "), "{missing}");
}

fn list(entry: &str, n: usize) -> String {
    format!("[{}]", vec![entry; n].join(","))
}

#[test]
fn a_file_over_the_limit_is_not_read() {
    let path = std::env::temp_dir().join(format!("spikeloop-pairs-{}.json", std::process::id()));
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(crate::world::bounded_file::FILE_BYTES_MAX + 1).unwrap();
    let message = read_pairs(&path).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    let expected = ": larger than 4194304 bytes (FILE_BYTES_MAX); not a pairs file?";
    assert_eq!(message, format!("{}{expected}", path.display()));
}

#[test]
fn ends_that_do_not_fit_the_arena_name_the_trial() {
    let world = field(vec![rectangle("crate", [2.0, -1.0], [4.0, 1.0])], vec![]);
    let pair = |x_m: f64, goal: [f64; 2]| Pair {
        start: Pose::new(x_m, 0.0, 0.0),
        goal: Point2::from(goal),
    };
    let check = |pairs: &[Pair]| check_pairs(pairs, &world, ROBOT_RADIUS_M, "pairs.json");
    let refuse = |pairs: &[Pair]| check(pairs).unwrap_err().to_string();
    assert!(check(&[pair(0.0, [5.0, 5.0])]).is_ok());
    assert_eq!(
        refuse(&[pair(0.0, [5.0, 5.0]), pair(0.0, [0.0, 10.5])]),
        "pairs.json: trial 1: goal (0, 10.5) is outside of arena field; another arena's file?"
    );
    assert_eq!(
        refuse(&[pair(1.875, [5.0, 5.0])]),
        "pairs.json: trial 0: start (1.875, 0) is 0.125 m from crate, at least 0.18 m (robot \
         radius); move it, or use another arena"
    );
    assert!(refuse(&[pair(f64::NAN, [5.0, 5.0])]).contains("start (NaN, 0) is outside"));
}

#[test]
fn generated_pairs_keep_the_rules_and_are_never_the_same_twice() {
    let world = courtyard();
    let pairs = generate(&world, 200, PairRules::default()).unwrap();
    for pair in &pairs {
        assert!(pair.distance_m() >= 6.0);
        for point in [pair.start.position, pair.goal] {
            assert!(world.nearest(point, 0).unwrap().distance_m >= 0.5);
        }
    }
    check_pairs(&pairs, &world, ROBOT_RADIUS_M, "made").unwrap();
    assert!(pairs.windows(2).all(|two| two[0] != two[1]));
    let first = pairs[0].start.rounded_mm_mrad();
    assert_eq!((first, pairs[0].goal), (FIRST_START, Point2::new(FIRST_GOAL[0], FIRST_GOAL[1])));
}

const FIRST_START: [i32; 3] = [-2194, 2468, -404];
const FIRST_GOAL: [f64; 2] = [6.926, -0.356];

#[test]
fn the_first_pairs_do_not_depend_on_how_many_are_asked_for() {
    let world = courtyard();
    let rules = PairRules::default();
    let (few, many) = (generate(&world, 5, rules).unwrap(), generate(&world, 20, rules).unwrap());
    assert_eq!(few, many[..5]);
}

#[test]
fn draws_that_cannot_succeed_end_with_an_error() {
    let full = field(vec![rectangle("block", [-10.0, -10.0], [10.0, 9.9])], vec![]);
    assert_eq!(
        generate(&full, 1, PairRules::default()).unwrap_err().to_string(),
        "arena field has no free start: 10000 tries (TRIES_MAX), none 0.5 m clear of everything; \
         take obstacles out of it, or fly pairs of your own (`drive --pairs`)"
    );
    let far = PairRules { distance_m_min: 30.0, clearance_m: 0.5 };
    assert_eq!(
        generate(&courtyard(), 3, far).unwrap_err().to_string(),
        "arena courtyard-moving: 10000 tries (TRIES_MAX) for pair 0, no goal 30 m or more from a \
         start and 0.5 m clear; make the arena larger or emptier, or fly pairs of your own (`drive --pairs`)"
    );
    let nonsense = PairRules { distance_m_min: f64::NAN, clearance_m: 0.5 };
    assert_eq!(
        generate(&courtyard(), 1, nonsense).unwrap_err().to_string(),
        "pair rules: distance_m_min is NaN m, must be 0..=1000 m"
    );
    let negative = PairRules { distance_m_min: 6.0, clearance_m: -1.0 };
    assert!(generate(&courtyard(), 1, negative).unwrap_err().to_string().contains("clearance_m"));
    assert_eq!(
        generate(&courtyard(), 10_001, PairRules::default()).unwrap_err().to_string(),
        "courtyard-moving: 10001 pairs, limit 10000 (PAIRS_MAX); split them"
    );
}

#[test]
fn generated_starts_keep_clear_of_movers_at_time_zero() {
    let posts = (0..9).map(|i| cylinder(&format!("p{i}"), [f64::from(i) - 4.0, 9.0], 0.1));
    let cart = mover("cart", [0.0, 0.0], [5.0, 0.0], 1.0);
    let world = field(posts.collect(), vec![cart]);
    let wide = PairRules { distance_m_min: 1.0, clearance_m: 4.0 };
    for pair in generate(&world, 50, wide).unwrap() {
        assert!(pair.start.position.coords.norm() >= 4.25, "{pair:?}");
    }
}

#[test]
fn pairs_survive_writing_and_reading() {
    let pairs = generate(&courtyard(), 20, PairRules::default()).unwrap();
    let again = read(&pairs_to_json(&pairs)).unwrap();
    for (before, after) in pairs.iter().zip(&again) {
        assert_eq!(before.start.rounded_mm_mrad(), after.start.rounded_mm_mrad());
        assert!((before.goal - after.goal).norm() < 1e-12);
    }
    assert_eq!(again.len(), 20);
}

#[test]
fn published_pairs_fit_the_published_worlds() {
    let Some(path) = san("san_eval_positions.json") else { return };
    let pairs = read_pairs(&path).unwrap();
    assert_eq!(pairs.len(), 200);
    for file in ["san_evaluation_world.json", "bdett_dynamic_world.json"] {
        let world = san_world(file).unwrap();
        check_pairs(&pairs, &world, ROBOT_RADIUS_M, "positions").unwrap();
    }
    let lengths_m = pairs.iter().map(Pair::distance_m);
    let shortest_m = lengths_m.fold(f64::INFINITY, f64::min);
    assert!((shortest_m - 10.09).abs() < 0.01, "{shortest_m}");
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
        prop_assert!(pairs_from_json(&bytes, "noise").is_err());
    }

    #[test]
    fn damaged_pairs_never_panic(place in 0_usize..200, text in "[-0-9.e\\[\\]{},\"n]{1,4}") {
        let good = r#"{"starts": [[1.5, 2, 3], [4, 5, 6]], "goals": [[7, 8], [9.25, 10]]}"#;
        let mut bytes = good.as_bytes().to_vec();
        let place = place % bytes.len();
        bytes.splice(place..(place + text.len()).min(good.len()), text.bytes());
        if let Ok(pairs) = pairs_from_json(&bytes, "damaged") {
            prop_assert!(!pairs.is_empty());
            let world = field(vec![], vec![]);
            // Either verdict is right; neither may panic, however large the numbers.
            let inside = |p: Point2<f64>| p.x.abs() <= 10.0 && p.y.abs() <= 10.0;
            let all = pairs.iter().all(|pair| inside(pair.start.position) && inside(pair.goal));
            prop_assert_eq!(check_pairs(&pairs, &world, 0.18, "damaged").is_ok(), all);
        }
    }
}
