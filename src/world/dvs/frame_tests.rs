use super::*;

#[test]
fn bits_are_where_they_were_set() {
    let mut frame = EventFrame::default();
    let places = [(0, 0), (127, 0), (63, 5), (64, 5), (127, 127)];
    places.iter().for_each(|(x, y)| frame.set(*x, *y));
    frame.set(63, 5);
    assert_eq!(frame.n_active(), 5);
    let expected: Vec<usize> = places.iter().map(|(x, y)| y * 128 + x).collect();
    assert_eq!(frame.active().collect::<Vec<_>>(), expected);
    assert!(frame.get(64, 5) && !frame.get(65, 5));
    assert_eq!(frame.words()[0], 1);
    assert_eq!(frame.words()[255], 1 << 63);
}

#[test]
fn a_frame_has_one_bit_for_any_number_of_events_of_either_polarity() {
    let event = |t_us, on| Event { t_us, y: 3, x: 4, on };
    let frame = EventFrame::of_events(&[event(1, true), event(2, false), event(3, false)]);
    assert_eq!(frame.active().collect::<Vec<_>>(), [3 * 128 + 4]);
}
