use super::*;

#[test]
fn results_stand_in_order_whatever_the_threads() {
    let squares: Vec<usize> = (0..50).map(|i| i * i).collect();
    for threads in [0, 1, 2, 7, 100] {
        let done = in_turn(50, threads, |i| Ok::<_, ()>(i * i));
        assert_eq!(done.as_ref(), Ok(&squares), "{threads} threads");
    }
    assert_eq!(in_turn(0, 3, Ok::<_, ()>), Ok(Vec::new()));
}

#[test]
fn the_first_error_is_told_and_ends_its_thread() {
    let worked = AtomicUsize::new(0);
    let work = |i| {
        worked.fetch_add(1, Ordering::Relaxed);
        if i < 3 { Ok(i) } else { Err(i) }
    };
    for threads in [1, 2] {
        worked.store(0, Ordering::Relaxed);
        assert_eq!(in_turn(50, threads, work), Err(3));
        assert_eq!(worked.load(Ordering::Relaxed), 3 + threads);
    }
}
