//! What this machine can do: plain accumulation of the weights that a run adds, and nothing else.
//!
//! The spikes of a run are known beforehand, so what remains for each core and step is a list of
//! weight rows, in the order in which the engine meets them. They are added to the core's sums by
//! the widest vectors that the CPU has. There is no routing, no compartment, no counter and no
//! barrier: an engine that did all of that for nothing would be as fast.
//!
//! Weights are stored as `i8` where they fit once the power of two that all of a core's have in
//! common is left out, else as `i16`. Sums are `i16` where no spikes at all could overflow them,
//! else `i32`.

use std::ops::Range;

use hw_model::core_map::Core;
use hw_model::engine::{Engine, SpikeRecord};
use hw_model::{CoreMap, EventEngine};
use pulp::{Arch, NullaryFnOnce};

use crate::networks::Case;

/// Targets so near each other belong to one run; what lies between them is stored as 0.
const GAP_MAX: usize = 16;
/// Lists of shorter runs are stored as pairs of target and weight.
const RUN_LEN_MIN: usize = 8;

/// A run of a case, ready to be accumulated.
pub(crate) struct Roofline {
    cores: Vec<CoreWork>,
    /// Synaptic operations of the run, as the engine counts them.
    synaptic_ops: u64,
}

struct CoreWork {
    rows: Box<dyn Rows>,
    /// Row and first compartment of every delivery, step by step.
    deliveries: Vec<(u32, u16)>,
    /// Deliveries of each step.
    steps: Vec<Range<usize>>,
    synaptic_ops: u64,
}

impl Roofline {
    /// Runs `case` by the event engine and keeps what it accumulates, which must be `expected`
    /// operations.
    pub(crate) fn new(case: &Case, expected: u64) -> Self {
        let map = &case.map;
        let mut engine = EventEngine::new(map.clone());
        let mut record = SpikeRecord::all(map);
        engine.run(&case.stimulus, &mut record);
        let cores = map.cores().iter().zip(arrivals(case, &record));
        let cores: Vec<CoreWork> = cores.map(|(core, all)| CoreWork::new(core, all)).collect();
        let synaptic_ops = cores.iter().map(|core| core.synaptic_ops).sum();
        let counted = engine.total_counts().synaptic_ops();
        assert_eq!(synaptic_ops, counted, "another number of operations than the engine's");
        assert_eq!(synaptic_ops, expected, "write this number beside the network in chip.rs");
        let mut roofline = Self { cores, synaptic_ops };
        roofline.check(map);
        roofline
    }

    /// All steps, the cores divided into `threads` parts of about equal work.
    pub(crate) fn run(&mut self, threads: usize) {
        let arch = Arch::new();
        let steps = self.cores.first().map_or(0, |core| core.steps.len());
        let work = |cores: &mut [CoreWork]| {
            for step in 0..steps {
                for core in &mut *cores {
                    let deliveries = &core.deliveries[core.steps[step].clone()];
                    core.rows.add(arch, deliveries);
                }
            }
        };
        if threads == 1 {
            return work(&mut self.cores);
        }
        let (total, mut rest, mut done) = (self.synaptic_ops, &mut self.cores[..], 0);
        crossbeam::thread::scope(|scope| {
            for thread in 1..=threads as u64 {
                let goal = total * thread / threads as u64;
                let mut end = 0;
                while end < rest.len() && (done < goal || thread == threads as u64) {
                    done += rest[end].synaptic_ops;
                    end += 1;
                }
                let (part, others) = std::mem::take(&mut rest).split_at_mut(end);
                rest = others;
                scope.spawn(move |_| work(part));
            }
        })
        .expect("no worker panics");
    }

    /// Panics unless one run gives the sums that the map itself says.
    fn check(&mut self, map: &CoreMap) {
        self.run(1);
        for (core_idx, (work, core)) in self.cores.iter().zip(map.cores()).enumerate() {
            let mut expected = vec![0i64; core.compartments()];
            for (list, base) in &work.deliveries {
                for (target, weight) in synapses(core, *list as usize) {
                    expected[usize::from(*base) + target] += i64::from(weight);
                }
            }
            let factor = common_factor(core);
            for (sum, expected) in work.rows.sums().into_iter().zip(expected) {
                // Sums are never cleared, so they may have wrapped.
                let expected = expected / i64::from(factor);
                assert_eq!(sum, expected as i16, "core {core_idx}");
            }
        }
    }
}

/// What arrives at a core: input axons as (list, base), in the engine's order.
#[derive(Default)]
struct Arrivals {
    axons: Vec<(u32, u16)>,
    /// Axons of each step.
    steps: Vec<Range<usize>>,
}

/// What arrives at each core.
fn arrivals(case: &Case, record: &SpikeRecord) -> Vec<Arrivals> {
    let map = &case.map;
    let mut arrivals: Vec<Arrivals> = map.cores().iter().map(|_| Arrivals::default()).collect();
    // A spike arrives in the step after its own; spikes are sorted by step, core, compartment.
    let mut spikes = record.spikes.iter().peekable();
    for step in 0..case.stimulus.steps() {
        let mut arrive = |core: usize, axon: usize| {
            let axon = map.cores()[core].axons_in[axon];
            arrivals[core].axons.push((axon.list, axon.base));
        };
        while let Some(spike) = spikes.next_if(|spike| spike.step + 1 == step as u64) {
            let axons = &map.cores()[spike.core.index()].axons_out;
            let first = axons.partition_point(|axon| axon.compartment < spike.compartment);
            let of_spike = axons[first..].iter().take_while(|a| a.compartment == spike.compartment);
            of_spike.for_each(|axon| arrive(axon.core.index(), axon.axon.index()));
        }
        let injected = step.checked_sub(1).map_or(&[][..], |before| case.stimulus.at(before));
        for (port, line) in injected {
            let targets = &map.ports()[*port as usize].targets;
            let first = targets.partition_point(|target| target.line < *line);
            let of_line = targets[first..].iter().take_while(|target| target.line == *line);
            of_line.for_each(|target| arrive(target.core.index(), target.axon.index()));
        }
        for Arrivals { axons, steps } in &mut arrivals {
            let start = steps.last().map_or(0, |step: &Range<usize>| step.end);
            steps.push(start..axons.len());
        }
    }
    arrivals
}

/// Synapses of a list as (target, effective weight in units of 64).
fn synapses(core: &Core, list: usize) -> impl Iterator<Item = (usize, i32)> {
    core.lists[list].entries.iter().flat_map(|entry| {
        let format = core.formats[usize::from(entry.format)];
        entry
            .synapses()
            .map(move |(target, mantissa)| (target, i32::from(format.effective_steps(mantissa))))
    })
}

/// The largest power of two that divides every weight of a core.
fn common_factor(core: &Core) -> i32 {
    let lists = 0..core.lists.len();
    let bits = lists.flat_map(|list| synapses(core, list)).fold(0, |bits, (_, w)| bits | w);
    1 << bits.trailing_zeros().min(15)
}

impl CoreWork {
    fn new(core: &Core, arrivals: Arrivals) -> Self {
        let ops: Vec<u64> = (0..core.lists.len()).map(|list| ops(core, list)).collect();
        let Arrivals { axons: deliveries, steps } = arrivals;
        let synaptic_ops = deliveries.iter().map(|(list, _)| ops[*list as usize]).sum();
        Self { rows: rows(core), deliveries, steps, synaptic_ops }
    }
}

/// Stored synapses of a list.
fn ops(core: &Core, list: usize) -> u64 {
    core.lists[list].entries.iter().map(|entry| entry.len() as u64).sum()
}

/// Lists of a core laid out by the narrowest types that hold weights and sums.
fn rows(core: &Core) -> Box<dyn Rows> {
    let factor = common_factor(core);
    let mut magnitudes = vec![0i64; core.compartments()];
    let mut narrow = true;
    let mut merged = vec![0; core.compartments()];
    let lists = (0..core.lists.len()).map(|list| {
        let mut synapses: Vec<(usize, i32)> = synapses(core, list).collect();
        synapses.sort_by_key(|(target, _)| *target);
        synapses.iter().for_each(|(target, weight)| merged[*target] += weight / factor);
        synapses.dedup_by_key(|(target, _)| *target);
        synapses.iter_mut().for_each(|(target, w)| *w = std::mem::take(&mut merged[*target]));
        narrow &= synapses.iter().all(|(_, weight)| i8::try_from(*weight).is_ok());
        synapses
    });
    let lists: Vec<Vec<(usize, i32)>> = lists.collect();
    for axon in &core.axons_in {
        for (target, weight) in &lists[axon.list as usize] {
            magnitudes[usize::from(axon.base) + target] += i64::from(weight.abs());
        }
    }
    let small = magnitudes.iter().all(|sum| *sum <= i64::from(i16::MAX));
    let sums = core.compartments();
    match (narrow, small) {
        (true, true) => Box::new(Layout::<i8, i16>::new(&lists, sums)),
        (true, false) => Box::new(Layout::<i8, i32>::new(&lists, sums)),
        (false, true) => Box::new(Layout::<i16, i16>::new(&lists, sums)),
        (false, false) => Box::new(Layout::<i16, i32>::new(&lists, sums)),
    }
}

/// Rows of one core, of whatever types.
trait Rows: Send {
    /// Adds the rows of `deliveries`.
    fn add(&mut self, arch: Arch, deliveries: &[(u32, u16)]);

    /// Low bits of the sums.
    fn sums(&self) -> Vec<i16>;
}

/// Weights of type `W`, sums of type `S`.
struct Layout<W, S> {
    rows: Vec<Shape>,
    weights: Vec<W>,
    /// First target and length.
    runs: Vec<(u16, u16)>,
    /// Of the rows in pairs.
    pairs: Vec<(u16, W)>,
    sums: Vec<S>,
}

enum Shape {
    /// Weights from `weights_at` on, one run after the other.
    Runs { weights_at: u32, runs: Range<u32> },
    /// Targets and weights.
    Pairs(Range<u32>),
}

/// Types that sums may have.
trait Accumulator: Copy + Default + Send {
    fn wrapping_add(self, other: Self) -> Self;
    fn low_bits(self) -> i16;
}

impl Accumulator for i16 {
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        self.wrapping_add(other)
    }

    fn low_bits(self) -> i16 {
        self
    }
}

impl Accumulator for i32 {
    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        self.wrapping_add(other)
    }

    fn low_bits(self) -> i16 {
        self as i16
    }
}

impl<W: Copy + TryFrom<i32> + Default, S: Accumulator + From<W>> Layout<W, S> {
    fn new(lists: &[Vec<(usize, i32)>], sums: usize) -> Self {
        let mut layout = Self {
            rows: Vec::with_capacity(lists.len()),
            weights: Vec::new(),
            runs: Vec::new(),
            pairs: Vec::new(),
            sums: vec![S::default(); sums],
        };
        for synapses in lists {
            let shape = layout.shape_of(synapses);
            layout.rows.push(shape);
        }
        layout
    }

    /// Stores the weights of one list, whose targets rise.
    fn shape_of(&mut self, synapses: &[(usize, i32)]) -> Shape {
        let weight = |w: i32| W::try_from(w).ok().expect("the type was chosen so");
        let near = |a: &(usize, i32), b: &(usize, i32)| b.0 <= a.0 + GAP_MAX;
        let n_runs = synapses.chunk_by(near).count();
        if synapses.len() < RUN_LEN_MIN * n_runs {
            let start = self.pairs.len() as u32;
            self.pairs.extend(synapses.iter().map(|(target, w)| (*target as u16, weight(*w))));
            return Shape::Pairs(start..self.pairs.len() as u32);
        }
        let (weights_at, runs_at) = (self.weights.len() as u32, self.runs.len() as u32);
        for run in synapses.chunk_by(near) {
            let (first, start) = (run[0].0, self.weights.len());
            let len = run[run.len() - 1].0 + 1 - first;
            self.weights.resize(start + len, W::default());
            for (target, w) in run {
                self.weights[start + target - first] = weight(*w);
            }
            self.runs.push((first as u16, len as u16));
        }
        Shape::Runs { weights_at, runs: runs_at..self.runs.len() as u32 }
    }

    #[inline(always)]
    fn add_row(&mut self, row: usize, base: u16) {
        match &self.rows[row] {
            Shape::Runs { weights_at, runs } => {
                let mut at = *weights_at as usize;
                for (first, len) in &self.runs[runs.start as usize..runs.end as usize] {
                    let (first, len) = (usize::from(base + first), usize::from(*len));
                    let sums = &mut self.sums[first..first + len];
                    for (sum, weight) in sums.iter_mut().zip(&self.weights[at..at + len]) {
                        *sum = sum.wrapping_add(S::from(*weight));
                    }
                    at += len;
                }
            }
            Shape::Pairs(pairs) => {
                for (target, weight) in &self.pairs[pairs.start as usize..pairs.end as usize] {
                    let sum = &mut self.sums[usize::from(base + target)];
                    *sum = sum.wrapping_add(S::from(*weight));
                }
            }
        }
    }
}

impl<W, S> Rows for Layout<W, S>
where
    W: Copy + TryFrom<i32> + Default + Send,
    S: Accumulator + From<W>,
{
    fn add(&mut self, arch: Arch, deliveries: &[(u32, u16)]) {
        arch.dispatch(AddRows { layout: self, deliveries });
    }

    fn sums(&self) -> Vec<i16> {
        self.sums.iter().map(|sum| sum.low_bits()).collect()
    }
}

/// Compiled once for each kind of vectors; a closure would not be.
struct AddRows<'a, W, S> {
    layout: &'a mut Layout<W, S>,
    deliveries: &'a [(u32, u16)],
}

impl<W, S> NullaryFnOnce for AddRows<'_, W, S>
where
    W: Copy + TryFrom<i32> + Default,
    S: Accumulator + From<W>,
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (row, base) in self.deliveries {
            self.layout.add_row(*row as usize, *base);
        }
    }
}
