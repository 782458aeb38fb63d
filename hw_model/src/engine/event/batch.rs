//! What arrives at a core in a step, put together before any of it is added.

use std::sync::atomic::Ordering;

use super::spikes::SpikeSets;
use crate::engine::plan::{CorePlan, Link};

/// Spikes of one word that are looked at without asking whether there are so many: few of a core's
/// words have more, and a branch for each spike would be mispredicted once a word.
const AT_ONCE: usize = 4;

/// Deliveries of uniform rows, as [`packed`](crate::engine::plan::Delivery::packed).
#[derive(Debug)]
pub(super) struct Batch {
    /// Those behind the first `len` mean nothing.
    deliveries: Vec<u64>,
    len: usize,
}

impl Batch {
    /// Empty, with room for all that can arrive at one of `cores` in a step.
    pub(super) fn new(cores: &[CorePlan]) -> Self {
        let most = cores.iter().map(|core| core.deliveries).max().unwrap_or(0);
        Self { deliveries: vec![0; most + AT_ONCE], len: 0 }
    }

    /// Size in memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.deliveries[..])
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(super) fn deliveries(&self) -> &[u64] {
        &self.deliveries[..self.len]
    }

    /// Adds what the spikes `before` bring over `link`.
    #[inline(always)]
    pub(super) fn add(&mut self, link: &Link, before: &SpikeSets) {
        if !link.has_single_deliveries() {
            for unit in before.of_chosen(link.source, &link.reaching) {
                for number in link.deliveries_of(unit) {
                    self.deliveries[self.len] = link.deliveries[number].packed();
                    self.len += 1;
                }
            }
            return;
        }
        let words = before.words(link.source).iter().zip(&link.reaching).zip(&link.ranks);
        let last = link.deliveries.len() - 1;
        for ((word, reaching), rank) in words {
            let mut bits = word.load(Ordering::Relaxed) & reaching;
            let mut at = self.len;
            self.len += bits.count_ones() as usize;
            while bits != 0 {
                for slot in &mut self.deliveries[at..at + AT_ONCE] {
                    // With no bit left, any delivery will do.
                    let below = reaching & (bits ^ bits.wrapping_sub(1)) >> 1;
                    let number = (rank + below.count_ones()) as usize;
                    *slot = link.deliveries[number.min(last)].packed();
                    bits &= bits.wrapping_sub(1);
                }
                at += AT_ONCE;
            }
        }
    }
}
