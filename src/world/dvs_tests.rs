use super::*;
use crate::world::arena::{Arena, Obstacle};
use crate::world::test_data::{cylinder, field, mover, rectangle};

fn quiet() -> CameraConfig {
    CameraConfig { pixels: PixelConfig::quiet(), ..CameraConfig::default() }
}

/// Frames and events along poses, the first one is the start.
fn film(
    world: &World,
    config: &CameraConfig,
    poses: &[Pose],
    subframes_max: usize,
) -> (Vec<EventFrame>, Vec<Event>) {
    let mut camera = EventCamera::new(world, config, Streams::new(4, 2), &poses[0]).unwrap();
    camera.subframes_max = subframes_max;
    let mut events = Vec::new();
    let frames = poses[1..]
        .iter()
        .map(|pose| {
            let frame = camera.advance(pose);
            events.extend(camera.events());
            frame
        })
        .collect();
    (frames, events)
}

/// A way through the gaps of `map1` with turns, at speed and turn rate per second.
fn way(n: usize, speed_m_per_s: f64, turn_rad_per_s: f64) -> Vec<Pose> {
    let mut poses = vec![Pose::new(-9.2, -6.9, 0.0)];
    for step in 0..n {
        let sign = if step / 60 % 2 == 0 { 1.0 } else { -1.0 };
        let last = poses[poses.len() - 1];
        poses.push(last.after_arc(speed_m_per_s * 0.01, sign * turn_rad_per_s * 0.01));
    }
    poses
}

fn map(name: &str) -> World {
    World::new(Arena::named(name).unwrap())
}

#[test]
fn nothing_moves_and_nothing_is_noisy_no_events() {
    let world = World::new(Arena::named("map1").unwrap().without_movers());
    let (frames, events) = film(&world, &quiet(), &[Pose::new(-9.2, -6.9, 0.3); 51], 4);
    assert_eq!(events, []);
    assert_eq!(frames, vec![EventFrame::default(); 50]);
}

#[test]
fn without_contrast_a_mover_makes_no_events() {
    let world = field(vec![], vec![mover("cart", [3.0, 2.0], [3.0, -2.0], 2.0)]);
    let even = CameraConfig { contrast: 0.0, mover_contrast: 0.0, ..quiet() };
    let (_, events) = film(&world, &even, &[Pose::new(0.0, 0.0, 0.0); 201], 4);
    assert_eq!(events, []);
}

/// The robot turns before a pillar or a mover of the same size; all else is one even shade.
#[test]
fn a_mover_makes_many_times_the_events_of_a_pillar() {
    let poses: Vec<Pose> = (0..=50).map(|n| Pose::new(0.0, 0.0, 0.01 * f64::from(n))).collect();
    let events = |world: &World| {
        let (_, events) = film(world, &quiet(), &poses, 4);
        let bare = film(&field(vec![], vec![]), &quiet(), &poses, 4).1;
        events.len().abs_diff(bare.len())
    };
    let pillar = events(&field(vec![cylinder("post", [3.0, 0.5], 0.25)], vec![]));
    let slow = mover("cart", [3.0, 0.5], [3.0, 0.6], 0.01);
    let mover = events(&field(vec![], vec![slow]));
    assert!(mover > 3 * pillar && pillar > 0, "{mover} {pillar}");
}

#[test]
fn events_at_a_moving_edge_have_the_sign_of_the_change_and_come_in_its_order() {
    // A cylinder passes from left to right, 0.4 px per step. Fast pixels leave no tail of a change
    // to the next step.
    let world = field(vec![], vec![mover("cart", [3.0, 2.0], [3.0, -2.0], 2.0)]);
    let pixels = PixelConfig { cutoff_hz: 1e5, ..PixelConfig::quiet() };
    let config = CameraConfig { contrast: 1.0, pixels, ..CameraConfig::default() };
    let pose = Pose::new(0.0, 0.0, 0.0);
    let mut camera = EventCamera::new(&world, &config, Streams::new(1, 0), &pose).unwrap();
    let mut before = camera.picture().to_vec();
    let (mut signs, mut first_us) = ([0, 0], [None; COLUMNS]);
    for _ in 0..200 {
        camera.advance(&pose);
        for event in camera.events() {
            let pixel = usize::from(event.y) * COLUMNS + usize::from(event.x);
            assert_eq!(event.on, camera.picture()[pixel] > before[pixel], "{event:?}");
            signs[usize::from(event.on)] += 1;
            if event.y == 62 {
                first_us[usize::from(event.x)].get_or_insert(event.t_us);
            }
        }
        before = camera.picture().to_vec();
    }
    assert!(signs[0] > 100 && signs[1] > 100, "{signs:?}");
    let times: Vec<u64> = [30, 50, 78, 98].iter().filter_map(|x| first_us[*x]).collect();
    assert!(times.len() >= 3 && times.is_sorted(), "{first_us:?}");
}

#[test]
fn runs_replay_exactly_and_other_seeds_and_sensors_differ() {
    let world = map("map1");
    let poses = way(60, 0.8, 1.0);
    let config = CameraConfig::default();
    let first = film(&world, &config, &poses, 4);
    assert_eq!(film(&world, &config, &poses, 4), first);
    let (_, other_sensor) = film(&world, &CameraConfig { device: 1, ..config.clone() }, &poses, 4);
    assert_ne!(other_sensor, first.1);
    let (_, other_paint) = film(&world, &CameraConfig { texture: 1, ..config }, &poses, 4);
    assert_ne!(other_paint, first.1);
}

#[test]
fn frames_are_the_events_of_their_step() {
    let world = map("map2");
    let mut camera = EventCamera::new(
        &world,
        &CameraConfig::default(),
        Streams::new(1, 0),
        &Pose::new(-9.2, -9.0, 0.2),
    )
    .unwrap();
    let mut stream = EventStream::default();
    let mut frames = Vec::new();
    for step in 1..=80_u64 {
        let frame = camera.advance(&Pose::new(-9.2 + 0.01 * step as f64, -9.0, 0.2));
        let start_us = (step - 1) * STEP_US;
        let events = camera.events();
        assert!(events.iter().all(|e| e.t_us > start_us && e.t_us <= step * STEP_US));
        assert!(events.windows(2).all(|pair| pair[0] <= pair[1]));
        stream.push_step(&events);
        frames.push(frame);
    }
    let read = EventStream::from_npz("e.npz", stream.to_npz("e.npz").unwrap()).unwrap();
    assert_eq!(read.frames().collect::<Vec<_>>(), frames);
    assert!(read.events().len() > 1000, "{}", read.events().len());
}

#[test]
fn at_low_speed_more_pictures_change_little_and_at_high_speed_they_are_drawn() {
    let world = map("map1");
    let slow = way(60, 0.3, 0.2);
    let mut camera = EventCamera::new(&world, &quiet(), Streams::new(1, 0), &slow[0]).unwrap();
    for pose in &slow[1..] {
        camera.advance(pose);
    }
    assert_eq!(camera.n_pictures(), 61);
    // Four pictures against one, along a way on which one does.
    let count = |subframes: usize| {
        let mut camera = EventCamera::new(&world, &quiet(), Streams::new(1, 0), &slow[0]).unwrap();
        let mut n = 0;
        for pose in &slow[1..] {
            camera.events.clear();
            for part in 1..=subframes {
                let share = part as f64 / subframes as f64;
                let at = between(&camera.pose, pose, share);
                let shades = camera.view.draw(&at, camera.steps, share);
                let interval = interval(camera.steps, part, subframes);
                camera.pixels.look(shades, interval, &mut camera.events);
            }
            camera.steps += 1;
            camera.pose = *pose;
            n += camera.events.len();
        }
        n as f64
    };
    let (one, four) = (count(1), count(4));
    assert!(one > 1000.0 && (four / one - 1.0).abs() < 0.05, "{one} {four}");
    let fast = way(60, 1.0, 3.8);
    let mut camera = EventCamera::new(&world, &quiet(), Streams::new(1, 0), &fast[0]).unwrap();
    for pose in &fast[1..] {
        camera.advance(pose);
    }
    assert!(camera.n_pictures() >= 120, "{}", camera.n_pictures());
}

#[test]
fn a_thin_post_is_not_jumped_over_when_the_robot_spins() {
    // A dark or light post 1.3 px wide; turning by 6 px per step.
    let world = field(vec![cylinder("post", [5.0, 0.0], 0.05), wall("far", 8.0)], vec![]);
    let poses: Vec<Pose> =
        (0..20).map(|i| Pose::new(0.0, 0.0, -0.9 + 0.094 * f64::from(i))).collect();
    let config = CameraConfig { contrast: 1.0, ..quiet() };
    let (_, one) = film(&world, &config, &poses, 1);
    let (_, four) = film(&world, &config, &poses, 4);
    assert!(four.len() > one.len(), "{} {}", one.len(), four.len());
}

fn wall(name: &str, x_m: f64) -> Obstacle {
    rectangle(name, [x_m, -9.0], [x_m + 0.5, 9.0])
}

#[test]
fn statistics_are_those_of_real_sensors() {
    let world = map("map1");
    let summary = |world: &World, poses: &[Pose]| {
        let config = CameraConfig::default();
        let mut camera = EventCamera::new(world, &config, Streams::new(1, 0), &poses[0]).unwrap();
        let mut activity = Activity::default();
        for pose in &poses[1..] {
            let frame = camera.advance(pose);
            activity.add(&frame, &camera.events());
        }
        activity.summary().unwrap()
    };
    let moving = summary(&world, &way(300, 0.7, 0.4));
    assert!((1e4..1e5).contains(&moving.events_per_s), "{moving:?}");
    assert!((0.5..4.0).contains(&moving.active_percent_median), "{moving:?}");
    assert!((0.6..1.5).contains(&moving.on_per_off.unwrap()), "{moving:?}");
    let empty = World::new(world.arena().clone().without_movers());
    let rest = summary(&empty, &[Pose::new(-9.2, -6.9, 0.0); 301]);
    assert!((100.0..600.0).contains(&rest.events_per_s), "{rest:?}");
}
