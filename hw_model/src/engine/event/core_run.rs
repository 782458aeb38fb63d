//! One core of the event engine: spikes in, compartments, spikes out.

use std::ops::AddAssign;

use aligned_vec::{AVec, CACHELINE_ALIGN};

use super::COUNTED;
use super::batch::Batch;
use super::spikes::{SourceSpikes, SpikeSets};
use crate::compartment::{CompartmentState, Widths};
use crate::counters::OpCounts;
use crate::engine::lanes::{BLOCK, BlockCounts, Lanes, update_each, update_whole};
use crate::engine::plan::{
    CHUNK, CorePlan, Delivery, Fit, Link, Pool, Pushed, Rest, Row, Run, SECOND_FORM, SendCost,
    Uniform,
};
use crate::faults::Loss;

/// Mutable part of one core.
#[derive(Debug)]
pub(super) struct CoreRun {
    current: AVec<i32>,
    voltage: AVec<i32>,
    refractory: Vec<u8>,
    sums: Sums,
    /// Whether the compartments of a block may change without input.
    awake: Vec<bool>,
    /// Blocks of compartments with input in this step.
    touched: Touched,
    /// Whether the core is held.
    pub(super) held: bool,
    /// Whether the spikes under way to this core were cleared.
    pub(super) deaf: bool,
    pub(super) counts: OpCounts,
}

/// Sums of the weights that arrive, as wide as the weights need them.
#[derive(Debug)]
enum Sums {
    Narrow(AVec<i16>),
    Wide(AVec<i32>),
}

/// One bit for each block of [`BLOCK`] compartments; the last stands for all that follow.
#[derive(Debug, Clone, Copy, Default)]
struct Touched(u64);

impl Touched {
    /// Adds `len` compartments from `first` on; perhaps the block after them, too.
    #[inline(always)]
    fn add(&mut self, first: usize, len: usize) {
        self.0 |= Self::of_len(len).0 << (first / BLOCK).min(63);
    }

    /// `len` compartments from any of the first block on; perhaps the block after them, too.
    #[inline(always)]
    fn of_len(len: usize) -> Self {
        let blocks = (len + BLOCK - 2) / BLOCK + 1;
        Self(if blocks < 64 { (1 << blocks) - 1 } else { u64::MAX })
    }

    #[inline(always)]
    fn holds(self, compartment: usize) -> bool {
        self.0 >> (compartment / BLOCK).min(63) & 1 != 0
    }
}

impl CoreRun {
    pub(super) fn new(plan: &CorePlan) -> Self {
        let len = plan.sums;
        Self {
            current: zeros(len),
            voltage: zeros(len),
            refractory: vec![0; len],
            sums: match plan.fit {
                Fit::Weights8Sums16 | Fit::Weights16Sums16 => Sums::Narrow(zeros(len)),
                Fit::Weights16Sums32 => Sums::Wide(zeros(len)),
            },
            awake: vec![true; plan.blocks.len()],
            touched: Touched::default(),
            held: false,
            deaf: false,
            counts: OpCounts::default(),
        }
    }

    /// A step of a held core: counts the spikes that arrive, and makes none.
    #[inline(never)]
    pub(super) fn lose_spikes(
        &mut self,
        plan: &CorePlan,
        before: &SpikeSets,
        loss: Option<Loss>,
        spikes: &SourceSpikes,
    ) {
        spikes.clear();
        if std::mem::take(&mut self.deaf) {
            return;
        }
        for link in &plan.links {
            for unit in before.of_chosen(link.source, &link.reaching) {
                let lost = loss.map_or(0, |loss| link.lost(loss, unit));
                self.counts.messages_lost += lost as u64;
                self.counts.deliveries_while_held += (link.deliveries_of(unit).len() - lost) as u64;
            }
        }
    }

    /// Adds the weights of all spikes that arrive. Where what was `pushed` is all of them, its sums
    /// stay where they are and come back for [`CoreRun::update`].
    #[inline(always)]
    pub(super) fn deliver<'p>(
        &mut self,
        (plan, pool): (&CorePlan, &Pool),
        (before, loss): (&SpikeSets, Option<Loss>),
        pushed: Option<Pushed<'p>>,
        batch: &mut Batch,
        done: &mut OpCounts,
    ) -> Option<&'p mut [i32]> {
        if std::mem::take(&mut self.deaf) {
            return None;
        }
        self.touched = match &mut self.sums {
            Sums::Narrow(sums) if plan.fit == Fit::Weights8Sums16 => {
                deliver(plan, &pool.narrow, sums, (before, loss), batch, done)
            }
            Sums::Narrow(sums) => deliver(plan, &pool.wide, sums, (before, loss), batch, done),
            Sums::Wide(sums) => deliver(plan, &pool.wide, sums, (before, loss), batch, done),
        };
        let (Some(pushed), Sums::Wide(sums)) = (pushed, &mut self.sums) else { return None };
        if COUNTED {
            done.axon_deliveries += pushed.axons;
            done.synaptic_ops_sparse += pushed.synaptic_ops;
        }
        self.touched = Touched(u64::MAX);
        // Nothing else arrives, and there is a sum for each compartment of the last block.
        if plan.links.is_empty() && pushed.sums.len() >= plan.compartments.next_multiple_of(BLOCK) {
            return Some(pushed.sums);
        }
        for (sum, pushed) in sums.iter_mut().zip(pushed.sums) {
            *sum += std::mem::take(pushed);
        }
        None
    }

    /// One step of every compartment with the core's own sums or, where there are some, with
    /// `others`; blocks that are asleep are only counted.
    #[inline(always)]
    pub(super) fn update(
        &mut self,
        plan: &CorePlan,
        (widths, fast): (&Widths, bool),
        others: Option<&mut [i32]>,
        spikes: &SourceSpikes,
        done: &mut OpCounts,
    ) {
        spikes.clear();
        let state = State {
            current: &mut self.current,
            voltage: &mut self.voltage,
            refractory: &mut self.refractory,
            awake: &mut self.awake,
            touched: self.touched,
        };
        match &mut self.sums {
            Sums::Narrow(sums) => update(plan, widths, fast, sums, state, spikes, done),
            Sums::Wide(sums) => {
                let sums = others.unwrap_or(&mut sums[..]);
                update(plan, widths, fast, sums, state, spikes, done)
            }
        }
        self.touched = Touched::default();
    }

    pub(super) fn state(&self, compartment: usize) -> CompartmentState {
        CompartmentState {
            current: self.current[compartment],
            voltage: self.voltage[compartment],
            refractory_left: self.refractory[compartment],
        }
    }

    /// Size in memory.
    pub(super) fn bytes(&self) -> usize {
        let sums = match &self.sums {
            Sums::Narrow(sums) => size_of_val(&sums[..]),
            Sums::Wide(sums) => size_of_val(&sums[..]),
        };
        sums + size_of_val(&self.current[..])
            + size_of_val(&self.voltage[..])
            + size_of_val(&self.refractory[..])
            + size_of_val(&self.awake[..])
    }

    pub(super) fn clear(&mut self) {
        self.current.fill(0);
        self.voltage.fill(0);
        self.refractory.fill(0);
        self.awake.fill(true);
    }
}

/// `len` zeros that begin where a vector register's worth of memory does.
fn zeros<T: Copy + Default>(len: usize) -> AVec<T> {
    AVec::from_iter(CACHELINE_ALIGN, std::iter::repeat_n(T::default(), len))
}

/// What was delivered.
#[derive(Debug, Default)]
struct Tally {
    deliveries: u64,
    lost: u64,
    /// Synaptic operations by form.
    ops: [u64; 3],
    touched: Touched,
}

/// Adds the rows of all spikes that arrive over links; the blocks that they reach.
#[inline(always)]
fn deliver<W: Copy, S: Copy + From<W> + AddAssign>(
    plan: &CorePlan,
    weights: &[W],
    sums: &mut [S],
    (before, loss): (&SpikeSets, Option<Loss>),
    batch: &mut Batch,
    done: &mut OpCounts,
) -> Touched {
    let mut tally = Tally::default();
    let uniform = plan.uniform.unwrap_or_default();
    batch.clear();
    for link in &plan.links {
        if link.uniform && loss.is_none() {
            batch.add(link, before);
        } else {
            deliver_any(plan, link, weights, sums, before, loss, &mut tally);
        }
    }
    let arrived = batch.deliveries();
    if !arrived.is_empty() {
        tally.count_uniform(arrived, uniform, sums.len());
        // With numbers that are known there are no branches to mispredict.
        match (uniform.runs, uniform.chunks) {
            (1, 1) => add_all::<W, S, 1, 1>(arrived, uniform, weights, sums),
            (1, 2) => add_all::<W, S, 1, 2>(arrived, uniform, weights, sums),
            (1, 4) => add_all::<W, S, 1, 4>(arrived, uniform, weights, sums),
            (1, 8) => add_all::<W, S, 1, 8>(arrived, uniform, weights, sums),
            (2, 1) => add_all::<W, S, 2, 1>(arrived, uniform, weights, sums),
            (2, 2) => add_all::<W, S, 2, 2>(arrived, uniform, weights, sums),
            _ => {
                for packed in arrived {
                    let delivery = Delivery::unpacked(*packed);
                    add_uniform(delivery, uniform, weights, sums, &mut tally.touched);
                }
            }
        }
    }
    if !COUNTED {
        return tally.touched;
    }
    done.axon_deliveries += tally.deliveries;
    done.messages_lost += tally.lost;
    done.synaptic_ops_dense += tally.ops[0];
    done.synaptic_ops_sparse += tally.ops[1];
    done.synaptic_ops_kernel += tally.ops[2];
    tally.touched
}

impl Tally {
    /// Counts deliveries of uniform rows to `sums` compartments, as [`Delivery::packed`].
    #[inline(always)]
    fn count_uniform(&mut self, arrived: &[u64], uniform: Uniform, sums: usize) {
        let (mut first, mut second, mut blocks) = (0, 0, 0);
        let run = Touched::of_len(uniform.chunks * CHUNK).0;
        let pitch = ((uniform.runs - 1) * uniform.pitch) as u64;
        for packed in arrived {
            let ops = packed >> 48;
            let is_second = ops / u64::from(SECOND_FORM);
            let ops = ops & u64::from(!SECOND_FORM);
            first += ops & is_second.wrapping_sub(1);
            second += ops & is_second.wrapping_neg();
            let base = packed >> 32 & u64::from(u16::MAX);
            blocks |= run << (base / BLOCK as u64 % 64);
            blocks |= run << ((base + pitch) / BLOCK as u64 % 64);
        }
        self.deliveries += arrived.len() as u64;
        self.ops[uniform.forms[0]] += first;
        self.ops[uniform.forms[1]] += second;
        self.touched.0 |= if sums <= 64 * BLOCK { blocks } else { u64::MAX };
    }
}

/// Rows of any shapes, of spikes that may be lost.
#[inline(always)]
fn deliver_any<W: Copy, S: Copy + From<W> + AddAssign>(
    plan: &CorePlan,
    link: &Link,
    weights: &[W],
    sums: &mut [S],
    before: &SpikeSets,
    loss: Option<Loss>,
    tally: &mut Tally,
) {
    for unit in before.of_chosen(link.source, &link.reaching) {
        for number in link.deliveries_of(unit) {
            if let Some(loss) = loss
                && link.loses(loss, unit, number)
            {
                tally.lost += 1;
                continue;
            }
            let delivery = link.deliveries[number];
            if let Some(uniform) = plan.uniform.filter(|_| link.uniform) {
                tally.count_uniform(&[delivery.packed()], uniform, sums.len());
                add_uniform(delivery, uniform, weights, sums, &mut tally.touched);
            } else {
                tally.deliveries += 1;
                let row = &plan.rows[delivery.at as usize];
                for (all, ops) in tally.ops.iter_mut().zip(row.ops) {
                    *all += u64::from(ops);
                }
                add_row(plan, row, usize::from(delivery.base), weights, sums, &mut tally.touched);
            }
        }
    }
}

/// A uniform row of any length.
#[inline(always)]
fn add_uniform<W: Copy, S: Copy + From<W> + AddAssign>(
    delivery: Delivery,
    uniform: Uniform,
    weights: &[W],
    sums: &mut [S],
    touched: &mut Touched,
) {
    let mut weights = &weights[CHUNK * delivery.at as usize..];
    for run in 0..uniform.runs {
        let first = (run * uniform.pitch) as u16;
        let run = Run { first, chunks: uniform.chunks as u16 };
        weights = add_run(usize::from(delivery.base), run, weights, sums, touched);
    }
}

/// Rows of `RUNS` runs of `CHUNKS` chunks.
#[inline(always)]
fn add_all<W: Copy, S: Copy + From<W> + AddAssign, const RUNS: usize, const CHUNKS: usize>(
    arrived: &[u64],
    uniform: Uniform,
    weights: &[W],
    sums: &mut [S],
) {
    let len = CHUNKS * CHUNK;
    for packed in arrived {
        let delivery = Delivery::unpacked(*packed);
        let start = CHUNK * delivery.at as usize;
        let weights = &weights[start..start + RUNS * len];
        for run in 0..RUNS {
            let first = usize::from(delivery.base) + run * uniform.pitch;
            add_chunks(&mut sums[first..][..len], &weights[run * len..][..len]);
        }
    }
}

#[inline(always)]
fn add_row<W: Copy, S: Copy + From<W> + AddAssign>(
    plan: &CorePlan,
    row: &Row,
    base: usize,
    weights: &[W],
    sums: &mut [S],
    touched: &mut Touched,
) {
    let mut weights = &weights[row.weights_at as usize..];
    for run in row.runs {
        weights = add_run(base, run, weights, sums, touched);
    }
    match row.rest {
        Rest::Nothing => (),
        Rest::Runs { at, n } => {
            for run in &plan.runs[at as usize..][..n as usize] {
                weights = add_run(base, *run, weights, sums, touched);
            }
        }
        Rest::Targets { at, n } => {
            for (target, weight) in plan.targets[at as usize..][..n as usize].iter().zip(weights) {
                let target = base + usize::from(*target);
                sums[target] += S::from(*weight);
                touched.add(target, 1);
            }
        }
    }
}

/// Adds one run; the weights after it.
#[inline(always)]
fn add_run<'a, W: Copy, S: Copy + From<W> + AddAssign>(
    base: usize,
    run: Run,
    weights: &'a [W],
    sums: &mut [S],
    touched: &mut Touched,
) -> &'a [W] {
    let (here, rest) = weights.split_at(CHUNK * usize::from(run.chunks));
    let first = base + usize::from(run.first);
    if !here.is_empty() {
        add_chunks(&mut sums[first..][..here.len()], here);
        touched.add(first, here.len());
    }
    rest
}

/// Adds as many weights as there are sums, a multiple of [`CHUNK`].
#[inline(always)]
fn add_chunks<W: Copy, S: Copy + From<W> + AddAssign>(sums: &mut [S], weights: &[W]) {
    let chunks = sums.as_chunks_mut::<CHUNK>().0.iter_mut().zip(weights.as_chunks::<CHUNK>().0);
    for (sums, weights) in chunks {
        // All is read before anything is written: nothing may overlap then.
        let (mut added, weights) = (*sums, *weights);
        for i in 0..CHUNK {
            added[i] += S::from(weights[i]);
        }
        *sums = added;
    }
}

/// State of a core but for its sums.
struct State<'a> {
    current: &'a mut [i32],
    voltage: &'a mut [i32],
    refractory: &'a mut [u8],
    awake: &'a mut [bool],
    touched: Touched,
}

#[inline(always)]
fn update<S: Copy + Default>(
    plan: &CorePlan,
    widths: &Widths,
    fast: bool,
    sums: &mut [S],
    state: State<'_>,
    spikes: &SourceSpikes,
    done: &mut OpCounts,
) where
    i32: From<S>,
{
    let mut counts = BlockCounts::default();
    let mut spiking = 0;
    for (block, awake) in plan.blocks.iter().zip(state.awake) {
        if !*awake && !state.touched.holds(block.start) {
            counts.inactive += block.len as u32;
            continue;
        }
        let range = block.start..block.start + if block.alone { BLOCK } else { block.len };
        let mut lanes = Lanes {
            bias: &plan.biases[range.clone()],
            sums: &mut sums[range.clone()],
            unit_shift: plan.unit_shift,
            current: &mut state.current[range.clone()],
            voltage: &mut state.voltage[range.clone()],
            refractory: &mut state.refractory[range],
        };
        // A bias has at most 15 + 8 bits, whatever the chip.
        let fast = fast && block.alone && block.params.refractory_steps == 1;
        let whole = if fast {
            update_whole(&block.params, widths, &mut lanes, block.len, &mut counts)
        } else {
            None
        };
        let block_done = match whole {
            Some(block_done) => block_done,
            None => update_each(&block.params, widths, &mut lanes, block.len, &mut counts),
        };
        *awake = block_done.awake;
        if block_done.spikes != 0 {
            spikes.add(block.start / BLOCK, block_done.spikes << (block.start % BLOCK));
            spiking += block_done.spikes.count_ones();
        }
    }
    if !COUNTED {
        return;
    }
    // All at once: costs that are not in the cache are fetched side by side.
    let messages = if spiking > 0 { plan.sends.cost(spikes.words()) } else { SendCost::default() };
    done.updates_spiking += u64::from(spiking);
    done.updates_inactive += u64::from(counts.inactive);
    done.updates_active += plan.compartments as u64 - u64::from(spiking + counts.inactive);
    done.accumulator_overflows += u64::from(counts.accumulator_overflows);
    done.current_overflows += u64::from(counts.current_overflows);
    done.bias_sum_overflows += u64::from(counts.bias_sum_overflows);
    done.voltage_clips += u64::from(counts.voltage_clips);
    done.messages += u64::from(messages.messages);
    done.messages_within_tile += u64::from(messages.within_tile);
    done.hops_east_west += u64::from(messages.east_west);
    done.hops_north_south += u64::from(messages.north_south);
}
