//! Where worker threads meet at the end of a step.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Spins briefly, then yields: a step takes microseconds, and a machine may be shared.
#[derive(Debug)]
pub(super) struct StepBarrier {
    members: usize,
    arrived: AtomicUsize,
    generation: AtomicUsize,
    /// A member panicked and will not come.
    broken: AtomicBool,
}

const SPINS_BEFORE_YIELD: u32 = 200;

impl StepBarrier {
    pub(super) fn new(members: usize) -> Self {
        Self {
            members,
            arrived: AtomicUsize::new(0),
            generation: AtomicUsize::new(0),
            broken: AtomicBool::new(false),
        }
    }

    /// A thread that will come to every step; if it panics, no one waits for it.
    pub(super) fn member(&self) -> Member<'_> {
        Member { barrier: self }
    }
}

/// One of the threads that meet.
#[derive(Debug)]
pub(super) struct Member<'a> {
    barrier: &'a StepBarrier,
}

impl Member<'_> {
    /// True when all members have called it; what each wrote before, all see afterwards. False when
    /// one has panicked: there are no more steps.
    pub(super) fn wait(&self) -> bool {
        let barrier = self.barrier;
        let generation = barrier.generation.load(Ordering::Acquire);
        if barrier.arrived.fetch_add(1, Ordering::AcqRel) + 1 == barrier.members {
            barrier.arrived.store(0, Ordering::Relaxed);
            barrier.generation.store(generation.wrapping_add(1), Ordering::Release);
            return true;
        }
        let mut spins = 0;
        while barrier.generation.load(Ordering::Acquire) == generation {
            if barrier.broken.load(Ordering::Relaxed) {
                return false;
            }
            spins += 1;
            if spins < SPINS_BEFORE_YIELD {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
        true
    }
}

impl Drop for Member<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.barrier.broken.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
#[path = "barrier_tests.rs"]
mod tests;
