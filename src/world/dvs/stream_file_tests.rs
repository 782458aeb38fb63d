use proptest::prelude::*;

use super::*;

fn event(t_us: u64, x: u8, y: u8, on: bool) -> Event {
    Event { t_us, y, x, on }
}

fn sample() -> EventStream {
    let mut stream = EventStream::default();
    stream.push_step(&[event(1, 0, 0, true), event(10_000, 127, 127, false)]);
    stream.push_step(&[]);
    stream.push_step(&[event(20_001, 5, 6, true)]);
    stream
}

#[test]
fn what_was_written_is_read_and_replays_the_same_frames() {
    let stream = sample();
    let read = EventStream::from_npz("e.npz", stream.to_npz("e.npz").unwrap()).unwrap();
    assert_eq!(read, stream);
    let active: Vec<usize> = read.frames().map(|frame| frame.n_active()).collect();
    assert_eq!(active, [2, 0, 1]);
    assert!(read.frames().next().unwrap().get(127, 127));
}

#[test]
fn a_file_on_disk_is_the_same() {
    let path = std::env::temp_dir().join(format!("spikeloop-events-{}.npz", std::process::id()));
    sample().write(&path).unwrap();
    let read = EventStream::read(&path);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(read.unwrap(), sample());
    let message = EventStream::read(&path).unwrap_err().to_string();
    assert!(message.contains("cannot read"), "{message}");
    let message = sample().write(&path.join("x.npz")).unwrap_err().to_string();
    assert!(message.contains("x.npz: cannot write the events: "), "{message}");
}

#[test]
fn pushed_steps_follow_each_other_whatever_their_clock() {
    let mut stream = EventStream::default();
    stream.push_step(&[event(730_001, 1, 1, true), event(740_000, 2, 1, true)]);
    stream.push_step(&[event(1, 3, 1, true)]);
    let times: Vec<u64> = stream.events().iter().map(|event| event.t_us).collect();
    assert_eq!(times, [1, 10_000, 10_001]);
    assert_eq!(stream.n_steps(), 2);
}

fn refuse(arrays: &[(&str, Vec<i32>)]) -> String {
    let arrays: Vec<(String, Vec<i32>)> =
        arrays.iter().map(|(name, values)| ((*name).to_owned(), values.clone())).collect();
    EventStream::from_npz("e.npz", npz::to_bytes(&arrays).unwrap()).unwrap_err().to_string()
}

#[test]
fn refused_files_say_what_is_wrong() {
    let with = |t: Vec<i32>, x: Vec<i32>, p: Vec<i32>, duration: Vec<i32>| {
        let y = vec![0; t.len()];
        refuse(&[("t", t), ("x", x), ("y", y), ("p", p), ("duration", duration)])
    };
    assert_eq!(
        with(vec![1, 2], vec![1], vec![1, 0], vec![10_000]),
        "e.npz: t has 2 elements, x has 1; every event needs all of t, x, y, p"
    );
    assert_eq!(
        with(vec![1, 2], vec![1, 128], vec![1, 0], vec![10_000]),
        "e.npz: x[1] is 128, must be 0..=127"
    );
    assert_eq!(
        with(vec![5, 4], vec![1, 1], vec![1, 0], vec![10_000]),
        "e.npz: t[1] is 4, must be 5..=10000"
    );
    assert_eq!(
        with(vec![5, 10_001], vec![1, 1], vec![1, 0], vec![10_000]),
        "e.npz: t[1] is 10001, must be 5..=10000"
    );
    assert_eq!(with(vec![1], vec![1], vec![2], vec![10_000]), "e.npz: p[0] is 2, must be 0..=1");
    for duration in [vec![15], vec![-10_000], vec![], vec![10_000, 20_000]] {
        let message = with(vec![1], vec![1], vec![1], duration.clone());
        assert!(
            message.starts_with(&format!("e.npz: duration {duration:?} us, must be one")),
            "{message}"
        );
    }
    assert!(refuse(&[("duration", vec![0])]).contains("array t"));
}

#[test]
fn a_stream_too_long_for_a_file_is_refused() {
    let stream = EventStream { events: vec![], n_steps: 300_000 };
    let message = stream.to_npz("e.npz").unwrap_err().to_string();
    assert!(message.starts_with("e.npz: duration [3000000000] us"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_stream_round_trips(
        steps in prop::collection::vec(
            prop::collection::vec((1..=10_000_u64, 0..128_u8, 0..128_u8, any::<bool>()), 0..20),
            0..6,
        )
    ) {
        let mut stream = EventStream::default();
        let mut frames = Vec::new();
        for step in steps {
            let mut events: Vec<Event> =
                step.into_iter().map(|(t, x, y, on)| event(t, x, y, on)).collect();
            events.sort();
            frames.push(EventFrame::of_events(&events));
            stream.push_step(&events);
        }
        let read = EventStream::from_npz("e.npz", stream.to_npz("e.npz").unwrap()).unwrap();
        prop_assert_eq!(&read, &stream);
        prop_assert_eq!(read.frames().collect::<Vec<_>>(), frames);
    }

    #[test]
    fn damaged_files_never_panic(at in 0usize..2000, value in any::<u8>(), cut in 0usize..2000) {
        let mut bytes = sample().to_npz("e.npz").unwrap();
        let len = bytes.len();
        bytes[at % len] = value;
        let _ = EventStream::from_npz("e.npz", bytes[..cut.min(len)].to_vec());
        if let Ok(stream) = EventStream::from_npz("e.npz", bytes) {
            prop_assert_eq!(stream.frames().count() as u64, stream.n_steps());
        }
    }
}
