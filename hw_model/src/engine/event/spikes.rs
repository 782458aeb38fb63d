//! Spikes under way.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// One bit per unit of every source (cores, then ports).
///
/// Each word has one writer; readers come after the barrier.
#[derive(Debug)]
pub(super) struct SpikeSets {
    sources: Vec<SourceSpikes>,
}

/// Spikes of one source.
#[derive(Debug)]
pub(super) struct SourceSpikes {
    words: Vec<AtomicU64>,
    /// Whether there may be any.
    any: AtomicBool,
}

impl SourceSpikes {
    /// Takes all spikes back.
    #[inline(always)]
    pub(super) fn clear(&self) {
        if self.any.load(Ordering::Relaxed) {
            self.words.iter().for_each(|word| word.store(0, Ordering::Relaxed));
            self.any.store(false, Ordering::Relaxed);
        }
    }

    /// One bit for each unit.
    #[inline(always)]
    pub(super) fn words(&self) -> impl Iterator<Item = u64> + Clone + '_ {
        self.words.iter().map(|word| word.load(Ordering::Relaxed))
    }

    /// Units `64 * word + i` for each bit `i` spike.
    #[inline(always)]
    pub(super) fn add(&self, word: usize, bits: u64) {
        let word = &self.words[word];
        word.store(word.load(Ordering::Relaxed) | bits, Ordering::Relaxed);
        self.any.store(true, Ordering::Relaxed);
    }
}

impl SpikeSets {
    pub(super) fn new(sizes: &[usize]) -> Self {
        let source = |size: &usize| SourceSpikes {
            words: (0..size.div_ceil(64)).map(|_| AtomicU64::new(0)).collect(),
            any: AtomicBool::new(false),
        };
        Self { sources: sizes.iter().map(source).collect() }
    }

    pub(super) fn clear(&self) {
        self.sources.iter().for_each(SourceSpikes::clear);
    }

    /// Spikes of all sources.
    #[inline(always)]
    pub(super) fn sources(&self) -> &[SourceSpikes] {
        &self.sources
    }

    /// The words of `source`; none when nothing spiked.
    #[inline(always)]
    pub(super) fn words(&self, source: usize) -> &[AtomicU64] {
        let source = &self.sources[source];
        if source.any.load(Ordering::Relaxed) { &source.words } else { &[] }
    }

    /// Every unit of `source` that spiked, in order.
    #[inline(always)]
    pub(super) fn of(&self, source: usize) -> Units<'_> {
        Units { words: self.words(source), chosen: &[], next: 0, bits: 0 }
    }

    /// The same of those units alone that have a bit in `chosen`, which is not empty.
    #[inline(always)]
    pub(super) fn of_chosen<'a>(&'a self, source: usize, chosen: &'a [u64]) -> Units<'a> {
        Units { words: self.words(source), chosen, next: 0, bits: 0 }
    }
}

/// Units that spiked. An iterator of its own, not a chain of closures: those would not become part
/// of the function that is compiled for an instruction set.
#[derive(Debug)]
pub(super) struct Units<'a> {
    words: &'a [AtomicU64],
    /// Empty for all.
    chosen: &'a [u64],
    /// Word after the one of `bits`.
    next: usize,
    bits: u64,
}

impl Iterator for Units<'_> {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        while self.bits == 0 {
            let word = self.words.get(self.next)?.load(Ordering::Relaxed);
            self.bits = match self.chosen.get(self.next) {
                Some(chosen) => word & chosen,
                None => word,
            };
            self.next += 1;
        }
        let unit = (self.next - 1) * 64 + self.bits.trailing_zeros() as usize;
        self.bits &= self.bits - 1;
        Some(unit)
    }
}
