//! Synapse lists laid out for vector instructions.
//!
//! Weights of neighbouring compartments are stored side by side and padded with zeros to whole
//! [`CHUNK`]s, so that adding them needs no remainder loop. Equal rows are stored once for the
//! whole chip: the cores of a convolution have the same kernels. A core whose weights fit 8 bit
//! after a common shift has them so, else in 16; sums take 16 bit where they provably fit whatever
//! spikes arrive, else 32, with weights of 16 ([`Fit`]).

use std::collections::BTreeMap;
use std::sync::Arc;

use aligned_vec::{AVec, CACHELINE_ALIGN};
use pulp::{Arch, NullaryFnOnce};

use super::links::{Delivery, Link};
use crate::core_map::Core;
use crate::engine::dense::list_users;
use crate::synapse::{SynapseEntry, SynapseForm};
use crate::weight::SynapseFormat;

/// Marks the operations of a delivery that are of the second form, see [`Uniform::forms`].
pub(in crate::engine) const SECOND_FORM: u16 = 1 << 15;
/// Weights that are added at once; runs are padded to a multiple of it.
pub(in crate::engine) const CHUNK: usize = 32;
/// A list is run as one dense row when at least this share (1 / n) of its length is used.
const DENSE_SPAN_PER_SYNAPSE: usize = 4;
/// What it takes to begin a run, in weights.
const RUN_COST: usize = 16;
/// Where runs begin: no more than [`RUN_COST`], so that none begins before another ends.
const RUN_ALIGN: usize = 16;
/// How much longer padding may make the rows of a core, so that all have one shape.
const PADDING_MAX: usize = 4;
/// Longest list that its source pushes, synapse by synapse.
const FAN_LEN_MAX: usize = 8;

/// One synapse list, ready to be added to the sums.
#[derive(Debug, Clone, Copy)]
pub(in crate::engine) struct Row {
    /// First weight in [`Pool`].
    pub(in crate::engine) weights_at: u32,
    /// The first runs; those that are not there have no length.
    pub(in crate::engine) runs: [Run; 2],
    pub(in crate::engine) rest: Rest,
    /// Stored synapses by form, what the chip would add: dense, sparse, shared.
    pub(in crate::engine) ops: [u32; 3],
}

/// What a row has beside its first runs, its weights following theirs.
#[derive(Debug, Clone, Copy)]
pub(in crate::engine) enum Rest {
    Nothing,
    /// `n` runs from number `at` on.
    Runs {
        at: u32,
        n: u32,
    },
    /// `n` single targets from number `at` on.
    Targets {
        at: u32,
        n: u32,
    },
}

/// Neighbouring compartments that a row adds to.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::engine) struct Run {
    pub(in crate::engine) first: u16,
    /// Number of chunks of weights.
    pub(in crate::engine) chunks: u16,
}

/// Weights of all cores, in the unit of the core that has them.
#[derive(Debug)]
pub(in crate::engine) struct Pool {
    pub(in crate::engine) narrow: AVec<i8>,
    pub(in crate::engine) wide: AVec<i16>,
}

impl Pool {
    /// Size in memory.
    pub(in crate::engine) fn bytes(&self) -> usize {
        size_of_val(&self.narrow[..]) + size_of_val(&self.wide[..])
    }
}

/// What a core's numbers fit into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::engine) enum Fit {
    /// Weights 8 bit, sums 16.
    Weights8Sums16,
    /// Weights and sums 16 bit.
    Weights16Sums16,
    /// Weights 16 bit, sums 32.
    Weights16Sums32,
}

/// What becomes of the lists of one core.
#[derive(Debug, Default)]
pub(super) struct Layout {
    /// Numbers of its rows among [`Shapes::rows`].
    rows: Vec<usize>,
    /// What each list has become.
    pub(super) lists: Vec<ListIs>,
}

#[derive(Debug, Clone)]
pub(super) enum ListIs {
    /// No axon uses it.
    Unused,
    /// Row `row` of the core, moved by `offset` compartments.
    Row { row: u16, offset: u16 },
    /// Pushed by its sources: compartment and weight in units of 64.
    Fan(Vec<(u16, i16)>),
}

/// A list from its first target on.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Shape {
    ops: [u32; 3],
    kind: Kind,
}

/// Weights in units of 64.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// First compartment of each run, and its weights.
    Runs(Vec<(u16, Vec<i16>)>),
    Sparse(Vec<(u16, i16)>),
}

impl Shape {
    /// All bits that any weight has.
    fn bits(&self) -> i16 {
        self.weights().fold(0, |bits, weight| bits | weight)
    }

    /// Chunks of the longest run; `None` where there are no runs.
    fn chunks(&self) -> Option<usize> {
        match &self.kind {
            Kind::Runs(runs) => runs.iter().map(|(_, run)| run.len().div_ceil(CHUNK)).max(),
            Kind::Sparse(_) => None,
        }
    }

    /// The form of all synapses; `None` when there are several, or too many for a delivery.
    fn form(&self) -> Option<usize> {
        let form = (0..3).find(|form| self.ops[*form] > 0).unwrap_or(0);
        let others = self.ops.iter().sum::<u32>() - self.ops[form];
        (others == 0 && self.ops[form] < u32::from(SECOND_FORM)).then_some(form)
    }

    fn weights(&self) -> impl Iterator<Item = i16> + '_ {
        let (runs, synapses) = match &self.kind {
            Kind::Runs(runs) => (&runs[..], &[][..]),
            Kind::Sparse(synapses) => (&[][..], &synapses[..]),
        };
        let of_runs = runs.iter().flat_map(|(_, weights)| weights.iter().copied());
        of_runs.chain(synapses.iter().map(|(_, weight)| *weight))
    }
}

/// What tells lists apart: entries, formats, whether several axons use it.
type ListKey<'a> = (&'a [SynapseEntry], &'a [SynapseFormat], bool);

/// A list, its row and how far it is moved.
type KnownList<'a> = (ListKey<'a>, (usize, u16));

/// All different rows of a map.
#[derive(Debug, Default)]
pub(super) struct Shapes<'a> {
    rows: Vec<Arc<Shape>>,
    /// Lists with their rows and offsets, by [`sample`].
    lists: BTreeMap<[i16; 8], Vec<KnownList<'a>>>,
    numbers: BTreeMap<Arc<Shape>, usize>,
}

impl<'a> Shapes<'a> {
    /// Lays out the lists of `core`.
    pub(super) fn add(&mut self, core: &'a Core) -> Layout {
        let mut layout = Layout::default();
        let mut places: BTreeMap<usize, u16> = BTreeMap::new();
        for (list, users) in list_users(core).into_iter().enumerate() {
            let entries = &core.lists[list].entries[..];
            let is = if users == 0 {
                ListIs::Unused
            } else if let Some(fan) = fan(core, entries, users) {
                ListIs::Fan(fan)
            } else {
                let (number, offset) = self.row(core, (entries, &core.formats, users > 1));
                let row = *places.entry(number).or_insert_with(|| {
                    layout.rows.push(number);
                    (layout.rows.len() - 1) as u16
                });
                ListIs::Row { row, offset }
            };
            layout.lists.push(is);
        }
        layout
    }

    /// Number of the row, and how far it is moved.
    fn row(&mut self, core: &Core, key: ListKey<'a>) -> (usize, u16) {
        let alike = self.lists.entry(sample(key.0)).or_default();
        if let Some((_, known)) = alike.iter().find(|(there, _)| *there == key) {
            return *known;
        }
        let (offset, shape) = shape(core, key.0, key.2);
        let shape = Arc::new(shape);
        let number = *self.numbers.entry(Arc::clone(&shape)).or_insert_with(|| {
            self.rows.push(shape);
            self.rows.len() - 1
        });
        alike.push((key, (number, offset)));
        (number, offset)
    }

    /// The shape that most rows of a core can be given by padding with zeros, where that does not
    /// make them much longer.
    fn uniform(&self, layout: &Layout) -> Option<Uniform> {
        let rows: Vec<&Shape> = layout.rows.iter().map(|number| &*self.rows[*number]).collect();
        let mut lengths: Vec<usize> = rows.iter().filter_map(|row| row.chunks()).collect();
        lengths.sort_unstable();
        let usual = lengths.get(lengths.len() / 2)?;
        let of_usual_length = |row: &&&Shape| row.chunks().is_some_and(|n| n <= 2 * usual);
        let usual_rows = || rows.iter().filter(of_usual_length);
        let second_run = |row: &&Shape| match &row.kind {
            Kind::Runs(runs) => runs.get(1).map(|(first, _)| usize::from(*first)),
            Kind::Sparse(_) => None,
        };
        let pitch = usual_rows().find_map(second_run);
        let mut forms = Vec::new();
        for form in usual_rows().filter_map(|row| row.form()) {
            if !forms.contains(&form) && forms.len() < 2 {
                forms.push(form);
            }
        }
        let forms = [*forms.first()?, *forms.last()?];
        let chunks = usual_rows().filter_map(|row| row.chunks()).max()?;
        let (runs, pitch) = (1 + usize::from(pitch.is_some()), pitch.unwrap_or(0));
        let uniform = Uniform { runs, chunks, pitch, forms };
        let fitting = rows.iter().filter(|row| uniform.fits(row));
        let (n, used) = fitting
            .fold((0, 0), |(n, used), row| (n + 1, used + row.weights().count().div_ceil(CHUNK)));
        let worth_it = 4 * n >= 3 * rows.len() && runs * chunks * n <= PADDING_MAX * used;
        worth_it.then_some(uniform)
    }
}

/// What most rows of a core have in common.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::engine) struct Uniform {
    /// Number of runs, 1 or 2.
    pub(in crate::engine) runs: usize,
    /// Number of chunks in each.
    pub(in crate::engine) chunks: usize,
    /// From the beginning of the first run to that of the second.
    pub(in crate::engine) pitch: usize,
    /// Forms of their synapses, indices of [`Row::ops`]; the second has [`SECOND_FORM`].
    pub(in crate::engine) forms: [usize; 2],
}

impl Uniform {
    fn fits(&self, shape: &Shape) -> bool {
        let Kind::Runs(runs) = &shape.kind else { return false };
        let second = runs.get(1).map_or(self.pitch, |(first, _)| usize::from(*first));
        runs.len() <= self.runs
            && shape.chunks().is_some_and(|chunks| chunks <= self.chunks)
            && second == self.pitch
            && shape.form().is_some_and(|form| self.forms.contains(&form))
    }
}

/// Some of the weights of a list and its length: few different lists have the same.
fn sample(entries: &[SynapseEntry]) -> [i16; 8] {
    let mut sample = [0; 8];
    for (places, entry) in sample.chunks_exact_mut(4).zip(entries) {
        let mantissas = entry.mantissas();
        places[0] = mantissas.len() as i16;
        for (place, mantissa) in places[1..].iter_mut().zip(mantissas) {
            *place = *mantissa;
        }
    }
    sample
}

/// Rows of one core as they are run.
#[derive(Debug)]
pub(super) struct LaidOut {
    pub(super) rows: Vec<Row>,
    pub(super) runs: Vec<Run>,
    pub(super) targets: Vec<u16>,
    pub(super) fit: Fit,
    pub(super) unit_shift: u32,
    pub(super) uniform: Option<Uniform>,
    /// Number of sums, so that a padded run and a whole block end within them.
    pub(super) sums: usize,
}

/// Writes rows into the pool.
#[derive(Debug)]
pub(super) struct PoolWriter<'a> {
    shapes: &'a Shapes<'a>,
    pool: Pool,
    /// Where a row's weights are, by its number, shift, padding and width.
    places: BTreeMap<PlaceKey, u32>,
}

type PlaceKey = (usize, u32, Option<Uniform>, bool);

impl<'a> PoolWriter<'a> {
    pub(super) fn new(shapes: &'a Shapes<'a>) -> Self {
        let (narrow, wide) = (AVec::new(CACHELINE_ALIGN), AVec::new(CACHELINE_ALIGN));
        Self { shapes, pool: Pool { narrow, wide }, places: BTreeMap::new() }
    }

    pub(super) fn into_pool(self) -> Pool {
        self.pool
    }

    /// Rows, runs and targets of a core with these links, its weights in the pool.
    pub(super) fn lay_out(
        &mut self,
        layout: &Layout,
        links: &mut Vec<Link>,
        compartments: usize,
    ) -> LaidOut {
        let shapes = layout.rows.iter().map(|number| &*self.shapes.rows[*number]);
        let bits = shapes.clone().fold(0, |bits, shape| bits | shape.bits());
        let has_fans = layout.lists.iter().any(|list| matches!(list, ListIs::Fan(_)));
        // What sources push counts in units of 64.
        let unit_shift = if bits == 0 || has_fans { 0 } else { bits.trailing_zeros() };
        let uniform = self.shapes.uniform(layout);
        let reach = uniform.map_or(CHUNK, |uniform| uniform.pitch + uniform.chunks * CHUNK);
        let small = |weight: i16| i8::try_from(weight >> unit_shift).is_ok();
        let all_small = shapes.clone().flat_map(Shape::weights).all(small);
        let mut out = LaidOut {
            rows: Vec::new(),
            runs: Vec::new(),
            targets: Vec::new(),
            fit: if all_small { Fit::Weights8Sums16 } else { Fit::Weights16Sums16 },
            unit_shift,
            uniform,
            sums: compartments.next_multiple_of(super::BLOCK) + reach,
        };
        self.add_rows(layout, &mut out);
        // What sources push is added up in 32 bit.
        if has_fans || self.largest_sum(&out, links) > i32::from(i16::MAX) {
            out.fit = Fit::Weights16Sums32;
            self.add_rows(layout, &mut out);
        }
        if let Some(uniform) = out.uniform {
            let fits = |row: u32| uniform.fits(&self.shapes.rows[layout.rows[row as usize]]);
            *links = std::mem::take(links).into_iter().flat_map(|link| link.split(fits)).collect();
            let uniform_links = links.iter_mut().filter(|link| link.uniform);
            for delivery in uniform_links.flat_map(|link| &mut link.deliveries) {
                let row = &out.rows[delivery.at as usize];
                delivery.at = row.weights_at / CHUNK as u32;
                let first = row.ops[uniform.forms[0]] as u16;
                let all = row.ops.iter().sum::<u32>() as u16;
                delivery.ops = if all == first { all } else { all | SECOND_FORM };
            }
        }
        out
    }

    fn largest_sum(&self, out: &LaidOut, links: &[Link]) -> i32 {
        let Pool { narrow, wide } = &self.pool;
        match out.fit {
            Fit::Weights8Sums16 => Arch::new().dispatch(LargestSum { out, weights: narrow, links }),
            _ => Arch::new().dispatch(LargestSum { out, weights: wide, links }),
        }
    }

    fn add_rows(&mut self, layout: &Layout, out: &mut LaidOut) {
        out.rows.clear();
        out.runs.clear();
        out.targets.clear();
        let narrow = out.fit == Fit::Weights8Sums16;
        for number in &layout.rows {
            let shape = &self.shapes.rows[*number];
            let uniform = out.uniform.filter(|uniform| uniform.fits(shape));
            let key = (*number, out.unit_shift, uniform, narrow);
            let pool = &mut self.pool;
            let weights_at = *self.places.entry(key).or_insert_with(|| {
                let weights = padded(shape, out.unit_shift, uniform);
                if narrow {
                    weights.iter().for_each(|weight| pool.narrow.push(*weight as i8));
                    (pool.narrow.len() - weights.len()) as u32
                } else {
                    weights.iter().for_each(|weight| pool.wide.push(*weight));
                    (pool.wide.len() - weights.len()) as u32
                }
            });
            out.add(shape, weights_at, uniform);
        }
    }
}

impl LaidOut {
    fn add(&mut self, shape: &Shape, weights_at: u32, uniform: Option<Uniform>) {
        let mut row =
            Row { weights_at, runs: [Run::default(); 2], rest: Rest::Nothing, ops: shape.ops };
        match &shape.kind {
            Kind::Runs(runs) => {
                for (index, (first, run)) in runs.iter().enumerate() {
                    let chunks = uniform.map_or(run.len().div_ceil(CHUNK), |all| all.chunks);
                    let run = Run { first: *first, chunks: chunks as u16 };
                    match row.runs.get_mut(index) {
                        Some(place) => *place = run,
                        None => self.runs.push(run),
                    }
                }
                let n = runs.len().saturating_sub(row.runs.len()) as u32;
                if n > 0 {
                    row.rest = Rest::Runs { at: self.runs.len() as u32 - n, n };
                }
                if let Some(Uniform { runs: 2, pitch, chunks, .. }) = uniform {
                    // One that is missing adds zeros.
                    row.runs[1] = Run { first: pitch as u16, chunks: chunks as u16 };
                }
            }
            Kind::Sparse(synapses) => {
                let (at, n) = (self.targets.len() as u32, synapses.len() as u32);
                row.rest = Rest::Targets { at, n };
                self.targets.extend(synapses.iter().map(|(target, _)| *target));
            }
        }
        self.rows.push(row);
    }
}

/// Weights of a row in the unit of its core, with zeros up to whole chunks.
fn padded(shape: &Shape, unit_shift: u32, uniform: Option<Uniform>) -> Vec<i16> {
    let mut weights: Vec<i16> = Vec::new();
    match &shape.kind {
        Kind::Runs(runs) => {
            for (_, run) in runs {
                let chunks = uniform.map_or(run.len().div_ceil(CHUNK), |all| all.chunks);
                weights.extend(run.iter().map(|weight| weight >> unit_shift));
                weights.resize(weights.len() - run.len() + chunks * CHUNK, 0);
            }
            if let Some(all) = uniform {
                weights.resize(all.runs * all.chunks * CHUNK, 0);
            }
        }
        Kind::Sparse(synapses) => {
            weights.extend(synapses.iter().map(|(_, weight)| weight >> unit_shift));
            weights.resize(weights.len().next_multiple_of(CHUNK), 0);
        }
    }
    weights
}

/// The largest sum of either sign that any compartment can have at any moment of a step, when
/// every source spikes.
struct LargestSum<'a, W> {
    out: &'a LaidOut,
    weights: &'a [W],
    links: &'a [Link],
}

impl<W: Copy> NullaryFnOnce for LargestSum<'_, W>
where
    i32: From<W>,
{
    type Output = i32;

    #[inline(always)]
    fn call(self) -> i32 {
        let mut sums = [vec![0i32; self.out.sums], vec![0i32; self.out.sums]];
        for link in self.links {
            for Delivery { at, base, .. } in &link.deliveries {
                let (row, base) = (&self.out.rows[*at as usize], usize::from(*base));
                let mut weights = &self.weights[row.weights_at as usize..];
                for run in row.runs {
                    weights = add_signs(base, run, weights, &mut sums);
                }
                match row.rest {
                    Rest::Nothing => (),
                    Rest::Runs { at, n } => {
                        for run in &self.out.runs[at as usize..][..n as usize] {
                            weights = add_signs(base, *run, weights, &mut sums);
                        }
                    }
                    Rest::Targets { at, n } => {
                        let targets = &self.out.targets[at as usize..][..n as usize];
                        for (target, weight) in targets.iter().zip(weights) {
                            let weight = i32::from(*weight);
                            let sums = &mut sums[usize::from(weight < 0)];
                            let sum = &mut sums[base + usize::from(*target)];
                            *sum = sum.saturating_add(weight.abs());
                        }
                    }
                }
            }
        }
        sums.iter().flatten().fold(0, |largest, sum| largest.max(*sum))
    }
}

/// Adds the magnitudes of a run to the positive and the negative sums; the weights after it.
#[inline(always)]
fn add_signs<'a, W: Copy>(
    base: usize,
    run: Run,
    weights: &'a [W],
    [positive, negative]: &mut [Vec<i32>; 2],
) -> &'a [W]
where
    i32: From<W>,
{
    let (here, rest) = weights.split_at(CHUNK * usize::from(run.chunks));
    let first = base + usize::from(run.first);
    let positive = positive[first..][..here.len()].as_chunks_mut::<CHUNK>().0;
    let negative = negative[first..][..here.len()].as_chunks_mut::<CHUNK>().0;
    let chunks = positive.iter_mut().zip(negative).zip(here.as_chunks::<CHUNK>().0);
    for ((positive, negative), weights) in chunks {
        let (mut above, mut below) = (*positive, *negative);
        for i in 0..CHUNK {
            let weight = i32::from(weights[i]);
            above[i] = above[i].saturating_add(weight.max(0));
            below[i] = below[i].saturating_sub(weight.min(0));
        }
        (*positive, *negative) = (above, below);
    }
    rest
}

/// The synapses of a list that its sources push: a few sparse ones for one axon alone.
fn fan(core: &Core, entries: &[SynapseEntry], users: u32) -> Option<Vec<(u16, i16)>> {
    let sparse = |entry: &SynapseEntry| matches!(entry.form, SynapseForm::Sparse { .. });
    let len = entries.iter().map(SynapseEntry::len).sum::<usize>();
    if users > 1 || !(1..=FAN_LEN_MAX).contains(&len) || !entries.iter().all(sparse) {
        return None;
    }
    Some(synapses(core, entries).into_iter().map(|(target, w)| (target as u16, w)).collect())
}

/// Synapses as (target, weight in units of 64), sorted by target.
fn synapses(core: &Core, entries: &[SynapseEntry]) -> Vec<(usize, i16)> {
    let mut synapses = Vec::with_capacity(entries.iter().map(SynapseEntry::len).sum());
    for entry in entries {
        let format = core.formats[usize::from(entry.format)];
        let weights = entry.mantissas().iter().map(|mantissa| format.effective_steps(*mantissa));
        match &entry.form {
            SynapseForm::Dense { first, .. } => {
                synapses.extend((usize::from(*first)..).zip(weights))
            }
            SynapseForm::Sparse { targets, .. } => {
                synapses.extend(targets.iter().map(|target| usize::from(*target)).zip(weights));
            }
        }
    }
    if !synapses.is_sorted_by_key(|(target, _)| *target) {
        synapses.sort_by_key(|(target, _)| *target);
    }
    synapses
}

/// Where a list begins, and the list from there on. Weights of one target are added up where
/// the sum fits, which integers allow.
fn shape(core: &Core, entries: &[SynapseEntry], shared: bool) -> (u16, Shape) {
    let mut ops = [0u32; 3];
    for entry in entries {
        let form = match entry.form {
            _ if shared => 2,
            SynapseForm::Dense { .. } => 0,
            SynapseForm::Sparse { .. } => 1,
        };
        ops[form] += entry.len() as u32;
    }
    let synapses = synapses(core, entries);
    let first = synapses.first().map_or(0, |(target, _)| target / RUN_ALIGN * RUN_ALIGN);
    (first as u16, Shape { ops, kind: kind(&synapses, first) })
}

fn kind(synapses: &[(usize, i16)], first: usize) -> Kind {
    let span = synapses.last().map_or(0, |(target, _)| *target + 1) - first;
    let mut sums = vec![0i32; span];
    synapses.iter().for_each(|(target, weight)| sums[target - first] += i32::from(*weight));
    let sums: Option<Vec<i16>> = sums.into_iter().map(|sum| i16::try_from(sum).ok()).collect();
    let single = |(target, weight): &(usize, i16)| ((target - first) as u16, *weight);
    let sparse = || Kind::Sparse(synapses.iter().map(single).collect());
    let Some(sums) = sums else { return sparse() };
    let runs = runs(synapses);
    let cost = runs.iter().map(|(_, len)| len + RUN_COST).sum::<usize>();
    let run = |(start, len): (usize, usize)| {
        ((start - first) as u16, sums[start - first..][..len].to_vec())
    };
    let worth_it = |length: usize| length <= DENSE_SPAN_PER_SYNAPSE * synapses.len();
    if runs.len() > 1 && cost <= span && worth_it(cost) {
        Kind::Runs(runs.into_iter().map(run).collect())
    } else if span > 0 && worth_it(span) {
        Kind::Runs(vec![(0, sums)])
    } else {
        sparse()
    }
}

/// First target and length of the stretches between gaps that are worth a new run. `synapses` are
/// sorted by target.
///
/// They begin at multiples of [`RUN_ALIGN`]: so rows of a kernel whose first weights are zero lie
/// like the others.
fn runs(synapses: &[(usize, i16)]) -> Vec<(usize, usize)> {
    let near = |a: &(usize, i16), b: &(usize, i16)| b.0 < a.0 + RUN_COST;
    let run = |run: &[(usize, i16)]| {
        let first = run[0].0 / RUN_ALIGN * RUN_ALIGN;
        (first, run[run.len() - 1].0 + 1 - first)
    };
    synapses.chunk_by(near).map(run).collect()
}
