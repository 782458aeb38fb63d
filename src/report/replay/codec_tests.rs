use proptest::prelude::*;

use super::*;

fn text(numbers: &[u64]) -> String {
    to_base64(&deflated(&leb128(numbers)))
}

/// A tick of a chip with two cores, two layers and one cost table.
fn tick(number: u32) -> ReplayTick {
    let n = u64::from(number);
    ReplayTick {
        laser_mm: vec![8000 - number, 0, 77],
        goal_mm: 5000 - 10 * number,
        speed: [990, -1234 - number as i32],
        frames: vec![vec![], vec![0, 1, 2, 16_383], vec![number]],
        action: [1000, -1000],
        spikes: [vec![3, 4, 9], vec![0, 4, 10, 11]][number as usize % 2].clone(),
        layer_spikes: vec![3, 1 << 40],
        dvs_state: vec![-250, 0, number as i32],
        cores: vec![57_135_905, n, 0, 1],
        dynamic_fj: vec![(1 << 50) + n],
        time_ps: vec![n],
    }
}

#[test]
fn ticks_come_back() {
    for count in [0, 1, 2, 5] {
        let ticks: Vec<ReplayTick> = (0..count).map(tick).collect();
        assert_eq!(of_text(&to_text(&ticks)).unwrap(), ticks);
    }
    let bare = vec![ReplayTick::default(), tick(0), ReplayTick::default(), tick(1)];
    assert_eq!(of_text(&to_text(&bare)).unwrap(), bare);
}

/// The form of the module's documentation, by hand: what replay.js reads.
#[test]
fn numbers_of_a_text_are_in_the_order_that_is_documented() {
    let mut first = ReplayTick { frames: vec![vec![2, 5]], spikes: vec![7], ..Default::default() };
    (first.goal_mm, first.speed) = (100, [10, -3]);
    let mut second = ReplayTick { spikes: vec![7, 8], goal_mm: 98, ..Default::default() };
    second.cores = vec![6];
    let frames = [1, 2, 2, 2, 0];
    let spikes = [1, 7, 1, 8];
    let columns: [&[u64]; 9] = [
        &[0, 0],
        &[1, 200, 1, 3],
        &[2, 20, 5, 2, 19, 6],
        &[2, 0, 0, 2, 0, 0],
        &[0, 0],
        &[0, 0],
        &[0, 1, 12],
        &[0, 0],
        &[0, 0],
    ];
    let numbers = [&[2][..], &frames, &spikes, &columns.concat()].concat();
    assert_eq!(to_text(&[first.clone(), second.clone()]), text(&numbers));
    assert_eq!(of_text(&text(&numbers)).unwrap(), [first, second]);
}

#[test]
fn damaged_text_is_refused() {
    let error = |text: &str| of_text(text).unwrap_err();
    assert!(error("AB!=").starts_with("base64: "), "{}", error("AB!="));
    assert!(error("/////w==").starts_with("deflate: "), "{}", error("/////w=="));
    assert_eq!(error(&to_base64(&deflated(&[0x80]))), "ends too early");
    let long = [[0x81; 9].as_slice(), &[1]].concat();
    assert_eq!(error(&to_base64(&deflated(&long))), "a number of more than 56 bits");
    assert_eq!(error(&text(&[])), "ends too early");
    assert_eq!(error(&text(&[1 << 20])), "ends too early");
    assert_eq!(error(&text(&[1 << 55])), "36028797018963968 ticks, at most 1048576");
    assert_eq!(error(&text(&[1, 65])), "65 frames of a tick, at most 64");
    assert_eq!(error(&text(&[0, 0])), "1 bytes are left over");
    let place = error(&text(&[1, 1, 1, 1 << 32]));
    assert_eq!(place, "place 4294967296, at most 4294967295");
    // A negative range, a distance of two numbers.
    let head = [1, 0, 0];
    let laser = error(&text(&[&head[..], &[1, 1]].concat()));
    assert_eq!(laser, "tick 0: laser_mm: [-1] is not what belongs there");
    let goal = error(&text(&[&head[..], &[0, 2, 2, 2]].concat()));
    assert_eq!(goal, "tick 0: goal_mm: [1, 1] is not what belongs there");
}

proptest! {
    #[test]
    fn any_ticks_come_back(
        places in prop::collection::vec(prop::collection::btree_set(0u32..20_000, 0..60), 0..6),
        numbers in prop::collection::vec(prop::collection::vec(0u64..1 << 53, 0..5), 6),
        signed in prop::array::uniform4(i32::MIN..=i32::MAX),
    ) {
        let places: Vec<Vec<u32>> = places.into_iter().map(|set| set.into_iter().collect()).collect();
        let tick = |index: usize| ReplayTick {
            frames: places.iter().skip(index).cloned().collect(),
            spikes: places.get(index).cloned().unwrap_or_default(),
            cores: numbers[index].clone(),
            dynamic_fj: numbers[5 - index].clone(),
            speed: [signed[index % 4], signed[0]],
            dvs_state: signed[..index % 4].to_vec(),
            laser_mm: numbers[index].iter().map(|n| *n as u32).collect(),
            ..ReplayTick::default()
        };
        let ticks: Vec<ReplayTick> = (0..6).map(tick).collect();
        prop_assert_eq!(of_text(&to_text(&ticks)).unwrap(), ticks);
    }

    #[test]
    fn any_numbers_are_read_or_refused(numbers in prop::collection::vec(0u64..9, 0..60)) {
        if let Ok(ticks) = of_text(&text(&numbers)) {
            prop_assert!(ticks.iter().all(|tick| tick.spikes.is_sorted_by(|a, b| a < b)));
        }
    }
}
