//! Where worker threads meet at the end of a step.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Spins briefly, then yields: a step takes microseconds, and a machine may be shared.
#[derive(Debug)]
pub(super) struct StepBarrier {
    members: usize,
    arrived: AtomicUsize,
    generation: AtomicUsize,
}

const SPINS_BEFORE_YIELD: u32 = 200;

impl StepBarrier {
    pub(super) fn new(members: usize) -> Self {
        Self { members, arrived: AtomicUsize::new(0), generation: AtomicUsize::new(0) }
    }

    /// Returns when all members have called it; what each wrote before, all see afterwards.
    pub(super) fn wait(&self) {
        let generation = self.generation.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.members {
            self.arrived.store(0, Ordering::Relaxed);
            self.generation.store(generation.wrapping_add(1), Ordering::Release);
            return;
        }
        let mut spins = 0;
        while self.generation.load(Ordering::Acquire) == generation {
            spins += 1;
            if spins < SPINS_BEFORE_YIELD {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}
