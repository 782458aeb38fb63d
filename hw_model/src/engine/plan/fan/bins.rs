//! Pushed synapses, sorted roughly by where they go before their weights are added.
//!
//! Sums of many cores do not fit into the nearest cache, and a spike's synapses reach all of them:
//! fetching a sum takes longer than adding to it. So the synapses of many spikes are first copied,
//! run by run, into bins of a few cores each; then one bin after the other is added up.

use std::sync::Arc;

use super::{first, place, weight};

/// Cores of a bin, as a power of two: their sums take two thirds of a nearest cache of 48 KB, or most
/// of one of 32 KB. With fewer, more but shorter runs are copied, which takes longer.
const CORES_BITS: u32 = 3;
/// Cores of a bin. The first bin of a thread may begin with cores of the thread before, whose sums
/// stay zero: so a place says by itself where in its bin it is.
pub(super) const CORES: usize = 1 << CORES_BITS;
/// All bins are added up when one has more synapses than this.
const FULL: usize = 8192;
/// Synapses that are copied at once.
pub(super) const AT_ONCE: usize = 16;
/// Spikes that come between two looks at how full the bins are.
pub(super) const BATCH: usize = 32;
/// Bins of a thread below which binning does not pay: sums of few cores are near as they are.
const N_MIN: usize = 2;
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
    /// [bins, `capacity`].
    words: Vec<u32>,
    /// Words of a bin. It is not looked at within a batch, and what is copied at once may go beyond
    /// a run's end.
    capacity: usize,
    /// Synapses in each bin.
    filled: Vec<usize>,
}

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
        let n = n_cores.div_ceil(CORES);
        let len = |(start, end): &(u32, u32)| (end - start) as usize;
        let units = ranges.iter().filter(|range| len(range) > 0).count();
        if n < N_MIN || ranges.iter().map(len).sum::<usize>() < RUN_MEAN_MIN * n * units {
            return None;
        }
        let mut runs = vec![0u8; ranges.len() * n];
        for ((start, end), runs) in ranges.iter().zip(runs.chunks_exact_mut(n)) {
            for word in &words[*start as usize..*end as usize] {
                let place = place(*word, layout.place_bits) as usize - layout.first;
                let run = &mut runs[place >> shift];
                *run = run.checked_add(1)?;
            }
        }
        let longest = runs.iter().copied().max().map_or(0, usize::from);
        let capacity = FULL + BATCH * longest + AT_ONCE;
        let (runs, words) = (runs.into(), vec![0; n * capacity]);
        Some(Self { n, layout, runs, words, capacity, filled: vec![0; n] })
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
        let bins = self.words.chunks_exact_mut(self.capacity);
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
        let Places { place_bits, stride_bits, .. } = self.layout;
        let places = (1 << (stride_bits + CORES_BITS)) - 1;
        let bins = self.words.chunks_exact(self.capacity).zip(&mut self.filled);
        let cores = sums.chunks_mut(places + 1).zip(counts.chunks_mut(CORES));
        for ((bin, filled), (sums, counts)) in bins.zip(cores) {
            let words = &bin[..std::mem::take(filled)];
            count(words, self.layout, counts);
            add(words, sums, place_bits, places);
        }
    }

    /// Size in memory of what all copies share.
    pub(super) fn shared_bytes(&self) -> usize {
        size_of_val(&self.runs[..])
    }

    /// Size in memory of what each copy has of its own.
    pub(super) fn state_bytes(&self) -> usize {
        size_of_val(&self.words[..]) + size_of_val(&self.filled[..])
    }
}

/// Adds weights to `sums`, of which `places` picks the one by the lowest bits of a word.
///
/// Not inlined: among all that a step does, the numbers that this loop needs do not stay in
/// registers.
#[inline(never)]
fn add(words: &[u32], sums: &mut [i32], place_bits: u32, places: usize) {
    let mut add = |word: u32| sums[word as usize & places] += weight(word, place_bits);
    let (fours, rest) = words.as_chunks::<4>();
    for four in fours {
        add(four[0]);
        add(four[1]);
        add(four[2]);
        add(four[3]);
    }
    rest.iter().for_each(|word| add(*word));
}

/// Words that are counted side by side.
const LANES: usize = 8;

/// Adds the synapses, and in the upper half the axons, of each core of a bin.
#[inline(always)]
fn count(words: &[u32], layout: Places, counts: &mut [u64]) {
    let Places { place_bits, stride_bits, .. } = layout;
    // In each lane eight bits for each core, that 255 words cannot overflow.
    const { assert!(CORES * u8::BITS as usize <= u64::BITS as usize) };
    let core = |word: u32| u64::from((word >> stride_bits) % CORES as u32 * u8::BITS);
    for words in words.chunks(LANES * usize::from(u8::MAX)) {
        let (mut synapses, mut axons) = ([0u64; LANES], [0u64; LANES]);
        let (eights, rest) = words.as_chunks::<LANES>();
        for words in eights {
            for lane in 0..LANES {
                synapses[lane] += 1 << core(words[lane]);
                axons[lane] += u64::from(first(words[lane], place_bits)) << core(words[lane]);
            }
        }
        for (lane, word) in rest.iter().enumerate() {
            synapses[lane] += 1 << core(*word);
            axons[lane] += u64::from(first(*word, place_bits)) << core(*word);
        }
        for (core, count) in counts.iter_mut().enumerate() {
            let of_core = |lanes: &[u64; LANES]| {
                lanes.iter().map(|lane| u64::from(lane.to_le_bytes()[core])).sum::<u64>()
            };
            *count += of_core(&synapses) + (of_core(&axons) << 32);
        }
    }
}
