use std::panic::{AssertUnwindSafe, catch_unwind};

use super::*;

#[test]
fn all_members_meet_step_by_step() {
    let barrier = StepBarrier::new(3);
    let done = [const { AtomicUsize::new(0) }; 3];
    std::thread::scope(|scope| {
        for own in 0..3 {
            let (barrier, done) = (&barrier, &done);
            scope.spawn(move || {
                let member = barrier.member();
                for step in 0..500 {
                    done[own].store(step + 1, Ordering::Relaxed);
                    assert!(member.wait());
                    assert!(done.iter().all(|steps| steps.load(Ordering::Relaxed) > step));
                    assert!(member.wait());
                }
            });
        }
    });
}

#[test]
fn no_one_waits_for_a_member_that_panicked() {
    let barrier = StepBarrier::new(3);
    let waited = std::thread::scope(|scope| {
        let waiting: Vec<_> = (0..2).map(|_| scope.spawn(|| barrier.member().wait())).collect();
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let _member = barrier.member();
            panic!("as the test wants");
        }));
        assert!(panicked.is_err());
        waiting.into_iter().map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    assert_eq!(waited, [false, false]);
}
