//! Short synapse lists, pushed by their sources.
//!
//! Where a spike reaches only one or a few compartments of each core, as in a random sparse
//! network, fetching a row for every core and source takes longer than adding it. Such synapses are
//! stored source by source: all that a spike adds, on whichever core, is one stretch of memory.

mod bins;

use std::sync::Arc;

use super::links::FanEdge;
use super::rows::{Layout, ListIs};
use crate::core_map::CoreMap;
use bins::{AT_ONCE, BATCH, Bins, CORES, Places};

/// Marks the first synapse of an axon in targets.
const FIRST: u32 = 1 << 31;

/// Bytes that memory gives at once.
const CACHE_LINE: usize = 64;

/// All pushed synapses of a map, sorted by source unit, then core, then axon.
#[derive(Debug, Default)]
pub(in crate::engine) struct Fans {
    /// Cores that they reach, in order.
    cores: Vec<u16>,
    /// Sums of each of those cores: a power of two.
    stride_bits: u32,
    /// First unit of each source.
    first_units: Vec<usize>,
    /// Whether a source pushes anything.
    pushes: Vec<bool>,
    /// Synapses of unit `i` are those from `starts[i]` to `starts[i + 1]`.
    starts: Vec<u32>,
    synapses: Synapses,
    axons: Vec<u16>,
}

/// Places of sums, with [`FIRST`], and weights in units of 64.
#[derive(Debug)]
enum Synapses {
    /// One word each, where that holds all of them: in the lowest `place_bits` the place, then a
    /// bit for the first synapse of an axon, then the weight.
    Packed {
        /// With [`AT_ONCE`] more at the end.
        words: Vec<u32>,
        place_bits: u32,
    },
    Apart {
        targets: Vec<u32>,
        weights: Vec<i16>,
    },
}

impl Default for Synapses {
    fn default() -> Self {
        Self::Apart { targets: Vec::new(), weights: Vec::new() }
    }
}

impl Synapses {
    /// Packed where all places and weights fit.
    fn new(targets: Vec<u32>, weights: Vec<i16>) -> Self {
        let largest = targets.iter().map(|target| target & !FIRST).max().unwrap_or(0);
        let place_bits = (u32::BITS - largest.leading_zeros()).max(1);
        let weight_bits = 31 - place_bits.min(30);
        let limit = 1i32 << (weight_bits - 1);
        if weights.iter().any(|weight| !(-limit..limit).contains(&i32::from(*weight))) {
            return Self::Apart { targets, weights };
        }
        let word = |(target, weight): (u32, i16)| {
            let weight = (i32::from(weight) as u32) << (place_bits + 1);
            weight | (target >> 31) << place_bits | (target & !FIRST)
        };
        let after = std::iter::repeat_n(0, AT_ONCE);
        let words = targets.into_iter().zip(weights).map(word).chain(after).collect();
        Self::Packed { words, place_bits }
    }

    fn get(&self, index: usize) -> (u32, i32) {
        match self {
            Self::Packed { words, place_bits } => unpacked(words[index], *place_bits),
            Self::Apart { targets, weights } => (targets[index], i32::from(weights[index])),
        }
    }

    /// Reads a value of each cache line of the synapses in `range`.
    #[inline(always)]
    fn met(&self, range: std::ops::Range<usize>) -> u32 {
        let (words, weights) = match self {
            Self::Packed { words, .. } => (&words[range], &[][..]),
            Self::Apart { targets, weights } => (&targets[range.clone()], &weights[range]),
        };
        let mut met = 0;
        for lines in words.chunks(CACHE_LINE / size_of::<u32>()) {
            met ^= lines[0];
        }
        for lines in weights.chunks(CACHE_LINE / size_of::<i16>()) {
            met ^= lines[0] as u32;
        }
        met
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Packed { words, .. } => size_of_val(&words[..]),
            Self::Apart { targets, weights } => {
                size_of_val(&targets[..]) + size_of_val(&weights[..])
            }
        }
    }
}

/// Place with [`FIRST`], and weight of a packed synapse.
#[inline(always)]
fn unpacked(word: u32, place_bits: u32) -> (u32, i32) {
    (first(word, place_bits) << 31 | place(word, place_bits), weight(word, place_bits))
}

/// Place of a packed synapse.
#[inline(always)]
fn place(word: u32, place_bits: u32) -> u32 {
    word & ((1 << place_bits) - 1)
}

/// 1 for the first synapse of an axon, 0 for others.
#[inline(always)]
fn first(word: u32, place_bits: u32) -> u32 {
    word >> place_bits & 1
}

/// Weight of a packed synapse.
#[inline(always)]
fn weight(word: u32, place_bits: u32) -> i32 {
    (word as i32) >> (place_bits + 1)
}

/// The part of [`Fans`] that reaches the cores of one thread, and its sums.
#[derive(Debug, Default)]
pub(in crate::engine) struct Fan {
    /// First of [`Fans::cores`]: where a bin begins.
    first: usize,
    n_cores: usize,
    /// First and end of the synapses of each unit.
    ranges: Arc<[(u32, u32)]>,
    sums: Vec<i32>,
    /// On the way to `sums`, where these are too many for the nearest cache.
    bins: Option<Bins>,
    /// Synaptic operations, and axons in the upper half, of each core since it last took them.
    counts: Vec<u64>,
}

/// What a fan brought to a core in a step.
#[derive(Debug)]
pub(in crate::engine) struct Pushed<'a> {
    pub(in crate::engine) synaptic_ops: u64,
    pub(in crate::engine) axons: u64,
    /// In units of 64; to be left at zero.
    pub(in crate::engine) sums: &'a mut [i32],
}

/// One pushed axon: where it comes from and where it goes.
#[derive(Debug, Clone, Copy)]
pub(in crate::engine) struct PushedAxon {
    pub(in crate::engine) source: usize,
    pub(in crate::engine) unit: usize,
    pub(in crate::engine) core: usize,
    pub(in crate::engine) axon: u16,
}

impl Fans {
    pub(super) fn new(
        map: &CoreMap,
        layouts: &[Layout],
        source_sizes: &[usize],
        mut edges: Vec<FanEdge>,
    ) -> Self {
        if edges.is_empty() {
            return Self::default();
        }
        edges.sort_unstable();
        let mut cores: Vec<u16> = edges.iter().map(|(_, core, _)| *core).collect();
        cores.sort_unstable();
        cores.dedup();
        let sums = |core: &u16| map.cores()[usize::from(*core)].compartments();
        let largest = cores.iter().map(sums).max().unwrap_or(1);
        let mut place = vec![0; map.cores().len()];
        cores.iter().enumerate().for_each(|(place_, core)| place[usize::from(*core)] = place_);
        let first_units = source_sizes.iter().scan(0, |next, size| {
            *next += size;
            Some(*next - size)
        });
        let n_units: usize = source_sizes.iter().sum();
        let mut fans = Self {
            stride_bits: largest.next_power_of_two().trailing_zeros(),
            first_units: first_units.collect(),
            starts: vec![0; n_units + 1],
            ..Self::default()
        };
        let (mut targets, mut weights) = (Vec::new(), Vec::new());
        for (unit, core, axon) in edges {
            let about = map.cores()[usize::from(core)].axons_in[usize::from(axon)];
            let ListIs::Fan(synapses) = &layouts[usize::from(core)].lists[about.list as usize]
            else {
                unreachable!("only these become fan edges")
            };
            let base =
                (place[usize::from(core)] << fans.stride_bits) as u32 + u32::from(about.base);
            for (index, (target, weight)) in synapses.iter().enumerate() {
                let first = if index == 0 { FIRST } else { 0 };
                targets.push((base + u32::from(*target)) | first);
                weights.push(*weight);
                fans.axons.push(axon);
            }
            fans.starts[unit as usize + 1] = targets.len() as u32;
        }
        fans.synapses = Synapses::new(targets, weights);
        // Units without any begin where the one before ends.
        (0..n_units).for_each(|unit| {
            fans.starts[unit + 1] = fans.starts[unit + 1].max(fans.starts[unit]);
        });
        let pushes = fans.first_units.iter().zip(source_sizes);
        fans.pushes =
            pushes.map(|(first, size)| fans.starts[*first] < fans.starts[first + size]).collect();
        fans.cores = cores;
        fans
    }

    /// The part that reaches `cores`.
    pub(in crate::engine) fn part(&self, cores: std::ops::Range<usize>) -> Fan {
        let place = |core: usize| self.cores.partition_point(|there| usize::from(*there) < core);
        let (first, end) = (place(cores.start), place(cores.end));
        let within =
            |target: u32, place: usize| ((target & !FIRST) >> self.stride_bits) < place as u32;
        let range = |range: &[u32]| {
            let before = |place: usize| {
                let (mut low, mut high) = (range[0], range[1]);
                while low < high {
                    let middle = low.midpoint(high);
                    if within(self.synapses.get(middle as usize).0, place) {
                        low = middle + 1;
                    } else {
                        high = middle;
                    }
                }
                low
            };
            (before(first), before(end))
        };
        if first == end {
            return Fan::default();
        }
        let ranges: Arc<[_]> = self.starts.windows(2).map(range).collect();
        let first = first - first % CORES;
        let n_cores = end - first;
        let sums = n_cores << self.stride_bits;
        let bins = match &self.synapses {
            Synapses::Packed { words, place_bits } => {
                let (place_bits, stride_bits) = (*place_bits, self.stride_bits);
                let layout = Places { place_bits, first: first << stride_bits, stride_bits };
                Bins::new(words, &ranges, n_cores, layout)
            }
            Synapses::Apart { .. } => None,
        };
        Fan { first, n_cores, ranges, sums: vec![0; sums], bins, counts: vec![0; n_cores] }
    }

    /// Sources that push anything, each with its first unit.
    #[inline(always)]
    pub(in crate::engine) fn sources(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let pushing = self.pushes.iter().enumerate().filter(|(_, pushes)| **pushes);
        pushing.map(|(source, _)| (source, self.first_units[source]))
    }

    /// Size in memory.
    pub(in crate::engine) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + self.synapses.bytes() + size_of_val(&self.axons[..])
    }
}

impl Fan {
    /// Whether there is nothing to push.
    pub(in crate::engine) fn is_empty(&self) -> bool {
        self.n_cores == 0
    }

    /// Size in memory of what all copies share.
    pub(in crate::engine) fn shared_bytes(&self) -> usize {
        size_of_val(&self.ranges[..]) + self.bins.as_ref().map_or(0, Bins::shared_bytes)
    }

    /// Size in memory of what each copy has of its own.
    pub(in crate::engine) fn state_bytes(&self) -> usize {
        size_of_val(&self.sums[..])
            + size_of_val(&self.counts[..])
            + self.bins.as_ref().map_or(0, Bins::state_bytes)
    }

    /// A copy without any input.
    pub(in crate::engine) fn fresh(&self) -> Self {
        Self {
            first: self.first,
            n_cores: self.n_cores,
            ranges: Arc::clone(&self.ranges),
            sums: vec![0; self.sums.len()],
            bins: self.bins.clone(),
            counts: vec![0; self.n_cores],
        }
    }

    /// Spikes of `units` of a source, the first of which is `first_unit` of all; [`Fan::settle`]
    /// follows the last source.
    ///
    /// The stretches of several spikes lie far apart and are longer than what a CPU looks ahead, so
    /// one value of each of their cache lines is read first: the fetches overlap.
    #[inline(always)]
    pub(in crate::engine) fn push(
        &mut self,
        fans: &Fans,
        first_unit: usize,
        mut units: impl Iterator<Item = usize>,
    ) {
        loop {
            let mut batch = [(0, 0, 0); BATCH];
            let mut n = 0;
            while n < BATCH
                && let Some(unit) = units.next()
            {
                let (start, end) = self.ranges[first_unit + unit];
                batch[n] = (first_unit + unit, start as usize, end as usize);
                n += 1;
            }
            let batch = &batch[..n];
            let mut met = 0;
            for (unit, start, end) in batch {
                met ^= fans.synapses.met(*start..*end);
                met ^= self.bins.as_ref().map_or(0, |bins| bins.met(*unit));
            }
            std::hint::black_box(met);
            match (&fans.synapses, &mut self.bins) {
                (Synapses::Packed { words, .. }, Some(bins)) => {
                    for (unit, start, _) in batch {
                        bins.put(*unit, &words[*start..]);
                    }
                    if bins.are_full() {
                        self.settle();
                    }
                }
                _ => {
                    for (_, start, end) in batch {
                        self.push_range(fans, *start..*end);
                    }
                }
            }
            if n < BATCH {
                return;
            }
        }
    }

    /// Adds up what is on the way.
    #[inline(always)]
    pub(in crate::engine) fn settle(&mut self) {
        if let Some(bins) = &mut self.bins {
            bins.empty(&mut self.sums, &mut self.counts);
        }
    }

    #[inline(always)]
    fn push_range(&mut self, fans: &Fans, range: std::ops::Range<usize>) {
        match &fans.synapses {
            Synapses::Packed { words, place_bits } => {
                for word in &words[range] {
                    let (target, weight) = unpacked(*word, *place_bits);
                    self.add(fans, target, weight);
                }
            }
            Synapses::Apart { targets, weights } => {
                for (target, weight) in targets[range.clone()].iter().zip(&weights[range]) {
                    self.add(fans, *target, i32::from(*weight));
                }
            }
        }
    }

    /// Place among the sums of the thread.
    #[inline(always)]
    fn sum_of(&self, fans: &Fans, target: u32) -> usize {
        (target & !FIRST) as usize - (self.first << fans.stride_bits)
    }

    #[inline(always)]
    fn add(&mut self, fans: &Fans, target: u32, weight: i32) {
        let sum = self.sum_of(fans, target);
        self.sums[sum] += weight;
        self.counts[sum >> fans.stride_bits] += 1 + (u64::from(target >> 31) << 32);
    }

    /// The same for those axons alone that `takes` lets pass.
    pub(in crate::engine) fn push_some(
        &mut self,
        fans: &Fans,
        (source, first_unit, unit): (usize, usize, usize),
        mut takes: impl FnMut(PushedAxon) -> bool,
    ) {
        let (start, end) = self.ranges[first_unit + unit];
        let mut taken = false;
        for index in start as usize..end as usize {
            let (target, weight) = fans.synapses.get(index);
            let of_thread = self.sum_of(fans, target) >> fans.stride_bits;
            if target & FIRST != 0 {
                let core = usize::from(fans.cores[self.first + of_thread]);
                taken = takes(PushedAxon { source, unit, core, axon: fans.axons[index] });
            }
            if taken {
                self.add(fans, target, weight);
            }
        }
    }

    /// What was pushed to `core` since this was last asked; `None` for nothing.
    #[inline(always)]
    pub(in crate::engine) fn take(&mut self, fans: &Fans, core: usize) -> Option<Pushed<'_>> {
        if self.n_cores == 0 {
            return None;
        }
        let cores = &fans.cores[self.first..][..self.n_cores];
        let place = cores.binary_search(&(core as u16)).ok()?;
        let counts = std::mem::take(&mut self.counts[place]);
        let sums = &mut self.sums[place << fans.stride_bits..][..1 << fans.stride_bits];
        let pushed =
            Pushed { synaptic_ops: counts & u64::from(u32::MAX), axons: counts >> 32, sums };
        (counts != 0).then_some(pushed)
    }
}
