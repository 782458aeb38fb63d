//! Short synapse lists, pushed by their sources.
//!
//! Where a spike reaches only one or a few compartments of each core, as in a random sparse
//! network, fetching a row for every core and source takes longer than adding it. Such synapses are
//! stored source by source: all that a spike adds, on whichever core, is one stretch of memory.

use super::links::FanEdge;
use super::rows::{Layout, ListIs};
use crate::core_map::CoreMap;

/// Marks the first synapse of an axon in [`Fans::targets`].
const FIRST: u32 = 1 << 31;

/// Bytes that memory gives at once.
const CACHE_LINE: usize = 64;
/// Spikes whose synapses are fetched together.
const BATCH: usize = 16;

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
    /// Place of the sum, with [`FIRST`].
    targets: Vec<u32>,
    /// In units of 64.
    weights: Vec<i16>,
    axons: Vec<u16>,
}

/// The part of [`Fans`] that reaches the cores of one thread, and its sums.
#[derive(Debug, Default)]
pub(in crate::engine) struct Fan {
    /// First of [`Fans::cores`].
    first: usize,
    n_cores: usize,
    /// First and end of the synapses of each unit.
    ranges: Vec<(u32, u32)>,
    sums: Vec<i32>,
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
                fans.targets.push((base + u32::from(*target)) | first);
                fans.weights.push(*weight);
                fans.axons.push(axon);
            }
            fans.starts[unit as usize + 1] = fans.targets.len() as u32;
        }
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
            let targets = &self.targets[range[0] as usize..range[1] as usize];
            let from = targets.partition_point(|target| within(*target, first));
            let to = targets.partition_point(|target| within(*target, end));
            (range[0] + from as u32, range[0] + to as u32)
        };
        let n_cores = end - first;
        let ranges =
            if n_cores == 0 { Vec::new() } else { self.starts.windows(2).map(range).collect() };
        Fan {
            first,
            n_cores,
            ranges,
            sums: vec![0; n_cores << self.stride_bits],
            counts: vec![0; n_cores],
        }
    }

    /// Sources that push anything, each with its first unit.
    #[inline(always)]
    pub(in crate::engine) fn sources(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let pushing = self.pushes.iter().enumerate().filter(|(_, pushes)| **pushes);
        pushing.map(|(source, _)| (source, self.first_units[source]))
    }

    /// Reads a value of each cache line of the synapses in `range`.
    #[inline(always)]
    fn met(&self, range: std::ops::Range<usize>) -> u32 {
        let mut met = 0;
        for lines in self.targets[range.clone()].chunks(CACHE_LINE / size_of::<u32>()) {
            met ^= lines[0];
        }
        for lines in self.weights[range].chunks(CACHE_LINE / size_of::<i16>()) {
            met ^= lines[0] as u32;
        }
        met
    }

    /// Size in memory.
    pub(in crate::engine) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.targets[..])
            + size_of_val(&self.weights[..])
            + size_of_val(&self.axons[..])
    }
}

impl Fan {
    /// Whether there is nothing to push.
    pub(in crate::engine) fn is_empty(&self) -> bool {
        self.n_cores == 0
    }

    /// Size in memory.
    pub(in crate::engine) fn bytes(&self) -> usize {
        size_of_val(&self.ranges[..]) + size_of_val(&self.sums[..]) + size_of_val(&self.counts[..])
    }

    /// A copy without any input.
    pub(in crate::engine) fn fresh(&self) -> Self {
        Self {
            first: self.first,
            n_cores: self.n_cores,
            ranges: self.ranges.clone(),
            sums: vec![0; self.sums.len()],
            counts: vec![0; self.n_cores],
        }
    }

    /// Spikes of `units` of a source, the first of which is `first_unit` of all.
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
            let mut batch = [(0, 0); BATCH];
            let mut n = 0;
            let mut met = 0;
            while n < BATCH
                && let Some(unit) = units.next()
            {
                let (start, end) = self.ranges[first_unit + unit];
                batch[n] = (start as usize, end as usize);
                n += 1;
                met ^= fans.met(start as usize..end as usize);
            }
            std::hint::black_box(met);
            for (start, end) in &batch[..n] {
                self.push_range(fans, *start..*end);
            }
            if n < BATCH {
                return;
            }
        }
    }

    #[inline(always)]
    fn push_range(&mut self, fans: &Fans, range: std::ops::Range<usize>) {
        let offset = (self.first << fans.stride_bits) as u32;
        for (target, weight) in fans.targets[range.clone()].iter().zip(&fans.weights[range]) {
            let sum = ((target & !FIRST) - offset) as usize;
            self.sums[sum] += i32::from(*weight);
            self.counts[sum >> fans.stride_bits] += 1 + (u64::from(target >> 31) << 32);
        }
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
            let target = fans.targets[index];
            let place = (target & !FIRST) as usize - (self.first << fans.stride_bits);
            let of_thread = place >> fans.stride_bits;
            if target & FIRST != 0 {
                let core = usize::from(fans.cores[self.first + of_thread]);
                taken = takes(PushedAxon { source, unit, core, axon: fans.axons[index] });
            }
            if taken {
                self.sums[place] += i32::from(fans.weights[index]);
                self.counts[of_thread] += 1 + (u64::from(target >> 31) << 32);
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
