//! Pushed synapses, sorted roughly by where they go before their weights are added.
//!
//! Sums of many cores do not fit into the nearest cache, and a spike's synapses reach all of them:
//! fetching a sum takes longer than adding to it. So the synapses of many spikes are first copied,
//! run by run, into bins of a few cores each; then one bin after the other is added up.

use std::sync::Arc;

use super::{place, unpacked};

/// Cores of a bin, as a power of two: their sums take a quarter to a half of the nearest cache.
const CORES_BITS: u32 = 2;
/// Bits to count the synapses of a core of a bin in.
const COUNT_BITS: u32 = u64::BITS >> CORES_BITS;
/// A bin with more synapses than this is added up.
const FULL: usize = 2048;
/// Synapses that are copied at once.
pub(super) const AT_ONCE: usize = 8;
/// Synapses of a source that its longest run may have, see [`Bins::runs`].
const RUN_MAX: usize = u8::MAX as usize;
/// Spikes that come between two looks at how full the bins are.
pub(super) const BATCH: usize = 32;
/// Bins below which the sums fit into the nearest cache as they are.
const N_MIN: usize = 4;
/// Synapses of a spike and bin, on average, below which binning takes longer than it saves.
const RUN_MEAN_MIN: usize = 2;

/// Where the sums of a thread are, by what packed synapses say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    /// Lowest bits of a word, which are its place.
    pub(super) place_bits: u32,
    /// Place of the thread's first sum.
    pub(super) first: usize,
    /// Sums of each core, as a power of two.
    pub(super) stride_bits: u32,
}

/// Bins of a thread's cores.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    n: usize,
    layout: Places,
    /// How many of a unit's synapses go to each bin, [units, bins].
    runs: Arc<[u8]>,
    /// [bins, `CAPACITY`].
    words: Vec<u32>,
    /// Synapses in each bin.
    filled: Vec<usize>,
}

/// A bin is not looked at within a batch, and what is copied at once may go beyond a run's end.
const CAPACITY: usize = FULL + BATCH * RUN_MAX + AT_ONCE;

const _: () = assert!(CAPACITY < 1 << COUNT_BITS, "counts must not run into each other");

impl Bins {
    /// For the synapses of each unit in `ranges` of `words` and a thread of `n_cores`; `None` where
    /// there are few cores, or runs are too short or too long.
    pub(super) fn new(
        words: &[u32],
        ranges: &[(u32, u32)],
        n_cores: usize,
        layout: Places,
    ) -> Option<Self> {
        let shift = layout.stride_bits + CORES_BITS;
        let n = n_cores.div_ceil(1 << CORES_BITS);
        let len = |(start, end): &(u32, u32)| (end - start) as usize;
        let units = ranges.iter().filter(|range| len(range) > 0).count();
        if n < N_MIN || ranges.iter().map(len).sum::<usize>() < RUN_MEAN_MIN * n * units {
            return None;
        }
        let mut runs = vec![0u8; ranges.len() * n];
        for ((start, end), runs) in ranges.iter().zip(runs.chunks_exact_mut(n)) {
            for word in &words[*start as usize..*end as usize] {
                let (target, _) = unpacked(*word, layout.place_bits);
                let run = &mut runs[place(target, layout.first) >> shift];
                *run = run.checked_add(1)?;
            }
        }
        let (runs, words) = (runs.into(), vec![0; n * CAPACITY]);
        Some(Self { n, layout, runs, words, filled: vec![0; n] })
    }

    /// Reads a value of each cache line of what [`Bins::put`] needs to know of `unit`.
    #[inline(always)]
    pub(super) fn met(&self, unit: usize) -> u32 {
        let runs = &self.runs[unit * self.n..][..self.n];
        u32::from(runs[0] ^ runs[self.n - 1])
    }

    /// Puts the synapses of `unit` into their bins; `words` begins with the first of them and goes
    /// on for [`AT_ONCE`] after the last.
    #[inline(always)]
    pub(super) fn put(&mut self, unit: usize, mut words: &[u32]) {
        let runs = &self.runs[unit * self.n..][..self.n];
        let bins = self.words.chunks_exact_mut(CAPACITY);
        for ((run, bin), filled) in runs.iter().zip(bins).zip(&mut self.filled) {
            let run = usize::from(*run);
            bin[*filled..][..AT_ONCE].copy_from_slice(&words[..AT_ONCE]);
            if run > AT_ONCE {
                bin[*filled..][..run].copy_from_slice(&words[..run]);
            }
            *filled += run;
            words = &words[run..];
        }
    }

    /// Whether a bin has to be emptied before the next [`BATCH`] spikes.
    #[inline(always)]
    pub(super) fn are_full(&self) -> bool {
        self.filled.iter().any(|filled| *filled > FULL)
    }

    /// Adds up what is in the bins, to `sums` and `counts` of a thread's cores.
    #[inline(always)]
    pub(super) fn empty(&mut self, sums: &mut [i32], counts: &mut [u64]) {
        let Places { place_bits, first, stride_bits } = self.layout;
        let shift = stride_bits + CORES_BITS;
        let bins = self.words.chunks_exact(CAPACITY).zip(&mut self.filled);
        let cores = sums.chunks_mut(1 << shift).zip(counts.chunks_mut(1 << CORES_BITS));
        for ((bin, filled), (sums, counts)) in bins.zip(cores) {
            // Synapses and axons of each core of the bin, side by side in one number.
            let (mut synapses, mut axons) = (0u64, 0u64);
            for word in &bin[..std::mem::take(filled)] {
                let (target, weight) = unpacked(*word, place_bits);
                let place = place(target, first) & ((1 << shift) - 1);
                sums[place] += weight;
                let core = COUNT_BITS * (place >> stride_bits) as u32;
                synapses += 1 << core;
                axons += u64::from(target >> 31) << core;
            }
            for (core, count) in counts.iter_mut().enumerate() {
                let of_core =
                    |counts: u64| counts >> (COUNT_BITS * core as u32) & ((1 << COUNT_BITS) - 1);
                *count += of_core(synapses) + (of_core(axons) << 32);
            }
        }
    }

    /// Size in memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.runs[..]) + size_of_val(&self.words[..])
    }
}
