use proptest::prelude::*;

use super::*;
use crate::world::arena::list_named;
use crate::world::test_data::san;

const FRAME: &str = r#""arena": {"xmin": -10, "xmax": 10, "ymin": -10, "ymax": 10}"#;

fn read(text: &str) -> Result<Arena, ArenaError> {
    Arena::from_json(text.as_bytes(), "dir/yard.json", None)
}

/// The message for an arena that holds one list of things.
fn refuse(list: &str, thing: &str) -> String {
    read(&format!(r#"{{{FRAME}, "{list}": [{thing}]}}"#)).unwrap_err().to_string()
}

fn obstacle(thing: &str) -> String {
    refuse("obstacles", &format!(r#"{{"name": "a", "height": 1, {thing}}}"#))
}

fn mover_error(thing: &str) -> String {
    refuse("movers", &format!(r#"{{"name": "m", "radius": 0.2, "height": 1, {thing}}}"#))
}

#[test]
fn a_file_without_name_is_called_after_the_file() {
    assert_eq!(read(&format!("{{{FRAME}}}")).unwrap().name(), "yard");
    assert_eq!(read(&format!(r#"{{"name": "n", {FRAME}}}"#)).unwrap().name(), "n");
}

#[test]
fn names_that_no_table_can_show_are_refused() {
    let named = |text: String| read(&text).unwrap_err().to_string();
    let rest = "must be 1..=256 characters on one line; rename it";
    let arena = named(format!(r#"{{"name": "a\nb", {FRAME}}}"#));
    assert_eq!(arena, format!(r#"dir/yard.json: arena: name "a\nb", {rest}"#));
    let long = "x".repeat(257);
    let disc = r#""height": 1, "shape": "cylinder", "x": 0, "y": 0, "radius": 1"#;
    let obstacle = refuse("obstacles", &format!(r#"{{"name": "{long}", {disc}}}"#));
    assert_eq!(obstacle, format!(r#"dir/yard.json: obstacle: name "{long}", {rest}"#));
    let mover =
        r#"{"name": "", "radius": 0.2, "height": 1, "x": 0, "y": 0, "to": [2, 0], "speed": 1}"#;
    assert_eq!(refuse("movers", mover), format!(r#"dir/yard.json: mover: name "", {rest}"#));
}

#[test]
fn a_missing_file_is_named_with_the_built_in_arenas() {
    let message = Arena::open("no/such.json").unwrap_err().to_string();
    assert!(message.starts_with("no/such.json: cannot be read: "), "{message}");
    assert!(message.ends_with("; built-in arenas are courtyard, courtyard-moving, map1, map2, train1, train2, train3, train4"), "{message}");
}

#[test]
fn a_file_over_the_limit_is_not_read() {
    let path = std::env::temp_dir().join(format!("spikeloop-large-{}.json", std::process::id()));
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(bounded_file::FILE_BYTES_MAX + 1).unwrap();
    let message = Arena::open(path.to_str().unwrap()).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    let expected = ": larger than 4194304 bytes (FILE_BYTES_MAX); not an arena?";
    assert_eq!(message, format!("{}{expected}", path.display()));
}

#[test]
fn text_that_is_no_arena_says_where() {
    let syntax = |text: &str| read(text).unwrap_err().to_string();
    let tail = "; see the built-in arenas for the format";
    assert_eq!(
        syntax("{"),
        format!("dir/yard.json: EOF while parsing an object at line 1 column 1{tail}")
    );
    assert_eq!(syntax("{}"), "dir/yard.json: no \"arena\" with xmin, xmax, ymin, ymax");
    assert_eq!(
        syntax(r#"{"arena": {"xmin": 1e999}}"#),
        format!("dir/yard.json: number out of range at line 1 column 24{tail}")
    );
    assert_eq!(
        syntax(r#"{"arena": {"xmin": 0, "xmax": 1, "ymin": 0}}"#),
        format!("dir/yard.json: missing field `ymax` at line 1 column 43{tail}")
    );
}

#[test]
fn misspelt_keys_are_found_at_every_level() {
    let yard = "dir/yard.json: ";
    let tail = "; correct or remove it";
    assert_eq!(
        read(&format!(r#"{{{FRAME}, "obstacle": []}}"#)).unwrap_err().to_string(),
        format!("{yard}the file: unknown key \"obstacle\"{tail}")
    );
    assert_eq!(
        read(r#"{"arena": {"xmin": 0, "xmax": 9, "ymin": 0, "ymax": 9, "z": 1}}"#)
            .unwrap_err()
            .to_string(),
        format!("{yard}arena: unknown key \"z\"{tail}")
    );
    assert_eq!(
        obstacle(r#""shape": "cylinder", "radius": 1, "x": 0, "y": 0, "jaw": 0"#),
        format!("{yard}a: unknown key \"jaw\"{tail}")
    );
    assert_eq!(
        mover_error(r#""x": 0, "y": 0, "to": [1, 0], "speed": 1, "pause": 1"#),
        format!("{yard}m: unknown key \"pause\"{tail}")
    );
}

#[test]
fn obstacles_that_make_no_sense_are_refused() {
    let a = "dir/yard.json: a: ";
    assert_eq!(
        obstacle(r#""shape": "sphere""#),
        format!("{a}shape \"sphere\" unknown; use box, polygon or cylinder (a mover: cylinder)")
    );
    assert_eq!(
        obstacle(r#""shape": "polygon""#),
        format!("{a}\"vertices\" is missing; a polygon needs it")
    );
    assert_eq!(
        obstacle(r#""shape": "cylinder", "radius": 1, "x": 1"#),
        format!("{a}\"y\" is missing; a cylinder needs it")
    );
    assert_eq!(obstacle(r#""shape": "box""#), format!("{a}\"size\" is missing; a box needs it"));
    assert_eq!(
        obstacle(r#""shape": "box", "x": 0, "y": 0, "yaw": 0, "size": [1, -2]"#),
        format!("{a}box size 1 x -2 m, both must be above 0")
    );
    assert_eq!(
        obstacle(
            r#""shape": "box", "x": 0, "y": 0, "yaw": 0, "size": [2, 2],
               "vertices": [[-1, -1], [1, -1], [1, 1], [-1, 1.5]]"#
        ),
        format!(
            "{a}vertices are 0.5 m off the box given by x, y, yaw and size, at most 0.001 m; \
             give one of both"
        )
    );
    assert_eq!(
        obstacle(r#""shape": "polygon", "vertices": [[0, 0], [1, 0], [2, 0]]"#),
        format!(
            "{a}area 0 m2, at least 0.0001 m2 (AREA_M2_MIN); the vertices are on one line, or \
             the outline crosses itself"
        )
    );
    assert_eq!(
        refuse(
            "walls",
            r#"{"name": "w", "height": 0.2, "shape": "cylinder", "x": 0, "y": 0, "radius": 1}"#
        ),
        "dir/yard.json: w: height 0.2 m, must be 0.44..=100 m (the laser scans at 0.44 m)"
    );
}

#[test]
fn movers_that_make_no_sense_are_refused() {
    let m = "dir/yard.json: m: ";
    assert_eq!(
        mover_error(r#""x": 0, "y": 0, "speed": 1"#),
        format!("{m}\"to\" is missing; a mover needs it")
    );
    assert_eq!(
        mover_error(r#""x": 0, "y": 0, "speed": 1, "bdett_v_out": [1, 0]"#),
        format!("{m}\"free_run_forward_m\" is missing; a mover with bdett_v_out needs it")
    );
    assert_eq!(
        mover_error(
            r#""x": 0, "y": 0, "speed": 1, "bdett_v_out": [0, 0], "free_run_forward_m": 1"#
        ),
        format!("{m}direction (0, 0) of bdett_v_out has no length")
    );
    assert_eq!(
        mover_error(r#""x": 0, "y": 0, "to": [1, 0], "speed": 1, "shape": "box""#),
        format!("{m}shape \"box\" unknown; use box, polygon or cylinder (a mover: cylinder)")
    );
    assert!(mover_error(r#""x": 0, "y": 0, "to": [0, 0], "speed": 1"#).contains("track is 0 m"));
    let nameless = r#"{"x": 0, "y": 0, "to": [1, 0], "speed": -1, "radius": 0.2, "height": 1}"#;
    assert!(refuse("movers", nameless).starts_with("dir/yard.json: mover without name: speed -1"));
}

#[test]
fn a_box_may_be_given_either_way() {
    let only_vertices = r#""shape": "box", "vertices": [[0, 0], [0, 1], [2, 1], [2, 0]]"#;
    let only_pose = r#""shape": "box", "x": 1, "y": 0.5, "yaw": 0, "size": [2, 1]"#;
    let extent = |thing: &str| {
        let text = format!(r#"{{{FRAME}, "obstacles": [{{"name": "a", "height": 1, {thing}}}]}}"#);
        read(&text).unwrap().obstacles()[0].shape.extent()
    };
    assert_eq!(extent(only_vertices), extent(only_pose));
}

#[test]
fn a_file_may_be_called_like_a_room() {
    let folder = std::env::temp_dir().join(format!("spikeloop-room-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("kiosk#3");
    std::fs::write(&path, format!("{{{FRAME}}}")).unwrap();
    assert_eq!(Arena::open(path.to_str().unwrap()).unwrap().obstacles().len(), 0);
    let none = Arena::open(folder.join("kiosk#4").to_str().unwrap()).unwrap_err().to_string();
    assert!(none.contains("kiosk: "), "{none}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn rooms_are_chosen_by_number() {
    let rooms = format!(r#"{{"environments": [{{{FRAME}}}, {{{FRAME}}}]}}"#);
    let choose = |room| Arena::from_json(rooms.as_bytes(), "dir/rooms.json", room);
    assert_eq!(choose(Some(2)).unwrap().name(), "rooms#2");
    assert_eq!(
        choose(None).unwrap_err().to_string(),
        "dir/rooms.json: has 2 rooms; choose one with dir/rooms.json#1 to dir/rooms.json#2"
    );
    for room in [0, 3] {
        assert_eq!(
            choose(Some(room)).unwrap_err().to_string(),
            format!(
                "dir/rooms.json: room #{room} asked for, has 2 (0: a single arena, take it \
                 without #)"
            )
        );
    }
    let nested = format!(r#"{{"environments": [{rooms}]}}"#);
    let nested = Arena::from_json(nested.as_bytes(), "dir/rooms.json", Some(1));
    assert!(nested.unwrap_err().to_string().contains("unknown key \"environments\""));
    assert_eq!(split_room("a#b/c.json#12"), ("a#b/c.json", Some(12)));
    assert_eq!(split_room("a#b.json"), ("a#b.json", None));
}

#[test]
fn published_worlds_load() {
    let Some(path) = san("") else { return };
    let open = |file: &str| Arena::open(path.join(file).to_str().unwrap());
    let evaluation = open("san_evaluation_world.json").unwrap();
    assert_eq!((evaluation.name(), evaluation.obstacles().len()), ("san_evaluation_world", 37));
    let dynamic = open("bdett_dynamic_world.json").unwrap();
    assert_eq!((dynamic.obstacles().len(), dynamic.movers().len()), (33, 11));
    let first = &dynamic.movers()[0];
    assert_eq!((first.name.as_str(), first.speed_m_per_s()), ("mover1", 1.4));
    assert!((first.to() - Point2::new(2.75, 3.5)).norm() < 1e-12, "{}", first.to());
    let message = open("san_training_worlds.json").unwrap_err().to_string();
    assert!(message.contains("has 4 rooms; choose one with "), "{message}");
    for (room, n) in [(1, 4), (2, 8), (3, 8), (4, 10)] {
        let arena = open(&format!("san_training_worlds.json#{room}")).unwrap();
        assert_eq!(arena.obstacles().len(), n, "room {room}");
    }
    same_after_writing(&evaluation);
    same_after_writing(&dynamic);
}

#[test]
fn built_in_arenas_survive_writing_and_reading() {
    list_named().iter().for_each(|name| same_after_writing(&Arena::named(name).unwrap()));
}

/// JSON numbers are read to the last bit but one, so coordinates are compared to 1e-12 m.
fn same_after_writing(arena: &Arena) {
    let again = Arena::from_json(arena.to_json().as_bytes(), "again", None).unwrap();
    assert_eq!((again.name(), again.bounds()), (arena.name(), arena.bounds()));
    assert_eq!(again.obstacles().len(), arena.obstacles().len());
    for (before, after) in arena.obstacles().iter().zip(again.obstacles()) {
        assert_eq!((&before.name, before.height_m), (&after.name, after.height_m));
        assert!(largest_gap_m(&before.shape, &after.shape) < 1e-12, "{}", before.name);
    }
    assert_eq!(again.movers().len(), arena.movers().len());
    for (before, after) in arena.movers().iter().zip(again.movers()) {
        assert_eq!((&before.name, before.height_m), (&after.name, after.height_m));
        assert_eq!(before.radius_m(), after.radius_m());
        assert_eq!(before.speed_m_per_s(), after.speed_m_per_s());
        let gap_m = (before.from() - after.from()).norm() + (before.to() - after.to()).norm();
        assert!(gap_m < 1e-12, "{}", before.name);
    }
}

fn largest_gap_m(a: &Shape, b: &Shape) -> f64 {
    match (a, b) {
        (Shape::Polygon(a), Shape::Polygon(b)) => {
            assert_eq!(a.vertices().len(), b.vertices().len());
            let gaps_m = a.vertices().iter().zip(b.vertices()).map(|(a, b)| (a - b).norm());
            gaps_m.fold(0.0, f64::max)
        }
        (Shape::Disc(a), Shape::Disc(b)) => {
            (a.centre() - b.centre()).norm() + (a.radius_m() - b.radius_m()).abs()
        }
        _ => f64::INFINITY,
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Arena::from_json(&bytes, "noise", Some(1)).is_err());
    }

    #[test]
    fn damaged_arenas_never_panic_and_stay_within_the_limits(
        edits in proptest::collection::vec((any::<u16>(), damage()), 1..4),
    ) {
        let mut bytes = Arena::named("courtyard-moving").unwrap().to_json().into_bytes();
        for (place, text) in edits {
            let place = usize::from(place) % bytes.len();
            let end = (place + text.len()).min(bytes.len());
            bytes.splice(place..end, text.bytes());
        }
        if let Ok(arena) = Arena::from_json(&bytes, "damaged", None) {
            prop_assert!(check::arena(&arena, "damaged").is_ok());
            let world = crate::world::World::new(arena);
            let nearest = world.nearest(Point2::origin(), 12345);
            prop_assert!(nearest.is_some_and(|nearest| nearest.distance_m.is_finite()));
        }
    }
}

/// Text that arenas are made of, in the wrong place.
fn damage() -> impl Strategy<Value = String> {
    prop_oneof![
        "[0-9]{1,3}",
        Just("-".to_owned()),
        Just("e9".to_owned()),
        Just("null".to_owned()),
        Just("[".to_owned()),
        Just("{}".to_owned()),
        Just("\"".to_owned()),
        Just(" ".to_owned()),
        Just("\u{7f}".to_owned()),
    ]
}
