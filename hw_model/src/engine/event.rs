//! The event-driven engine: work where spikes are, on one or several threads.
//!
//! Spikes of every source live in two bit sets, one for the step before and one for the step
//! under way. A core reads the former and writes its own part of the latter, so threads never
//! write to the same place and one barrier per step is enough. Sums are of integers, so neither
//! the order of spikes nor the number of threads can change a result.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::barrier::StepBarrier;
use super::lanes::{self, BLOCK, BlockCounts, Lanes, update_block};
use super::plan::{CorePlan, Link, Plan, RowShape, SendCost};
use super::{Engine, Spike, SpikeRecord, Stimulus, add_step_time, barriers_ps, check_faults};
use crate::compartment::{CompartmentState, Widths};
use crate::core_map::CoreMap;
use crate::cost::CostTable;
use crate::counters::OpCounts;
use crate::faults::{Faults, Loss};
use crate::id::{CompartmentIdx, CoreId};

/// Runs a map by its events.
#[derive(Debug)]
pub struct EventEngine {
    map: Arc<CoreMap>,
    plan: Arc<Plan>,
    widths: Widths,
    /// Cores of each thread.
    shares: Vec<usize>,
    cores: Vec<CoreRun>,
    spikes: [SpikeSets; 2],
    faults: Faults,
    chip_counts: OpCounts,
    barriers_ps: Vec<u64>,
    time_ps: Vec<u64>,
    now: u64,
}

/// Mutable part of one core.
#[derive(Debug, Clone)]
struct CoreRun {
    current: Vec<i32>,
    voltage: Vec<i32>,
    refractory: Vec<u8>,
    /// Sum of the effective weights in units of 64.
    accumulators: Vec<i32>,
    /// Whether any compartment may change without input.
    awake: bool,
    /// Whether the core is held.
    held: bool,
    /// Whether the spikes under way to this core were cleared.
    deaf: bool,
    counts: OpCounts,
}

/// One bit per unit of every source (cores, then ports).
#[derive(Debug)]
struct SpikeSets {
    sources: Vec<Vec<AtomicU64>>,
}

impl SpikeSets {
    fn new(sizes: &[usize]) -> Self {
        let words = |size: &usize| (0..size.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        Self { sources: sizes.iter().map(words).collect() }
    }

    fn clear(&self) {
        self.sources.iter().flatten().for_each(|word| word.store(0, Ordering::Relaxed));
    }

    /// Calls `f` with every unit of `source` that spiked, in order.
    fn for_each(&self, source: usize, mut f: impl FnMut(usize)) {
        for (index, word) in self.sources[source].iter().enumerate() {
            let mut bits = word.load(Ordering::Relaxed);
            while bits != 0 {
                f(index * 64 + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        }
    }
}

impl EventEngine {
    /// Ready at step 0 with all state zero, on one thread.
    pub fn new(map: Arc<CoreMap>) -> Self {
        Self::with_threads(map, 1)
    }

    /// The same on `threads` threads (at least one, at most one per core).
    pub fn with_threads(map: Arc<CoreMap>, threads: usize) -> Self {
        let plan = Arc::new(Plan::new(&map));
        let core = |core: &CorePlan| CoreRun::new(core.sends.len());
        let barriers_ps = barriers_ps(&map);
        Self {
            widths: Widths::new(&map.chip().arithmetic),
            shares: plan.shares(threads),
            cores: plan.cores.iter().map(core).collect(),
            spikes: [SpikeSets::new(&plan.source_sizes), SpikeSets::new(&plan.source_sizes)],
            faults: Faults::default(),
            chip_counts: OpCounts::default(),
            time_ps: vec![0; barriers_ps.len()],
            barriers_ps,
            now: 0,
            plan,
            map,
        }
    }

    /// A second engine on the same map at step 0, without faults; weights and routing are shared.
    pub fn fresh(&self) -> Self {
        let cores = self.cores.iter().map(|core| CoreRun::new(core.current.len())).collect();
        Self {
            map: Arc::clone(&self.map),
            plan: Arc::clone(&self.plan),
            widths: self.widths,
            shares: self.shares.clone(),
            cores,
            spikes: [
                SpikeSets::new(&self.plan.source_sizes),
                SpikeSets::new(&self.plan.source_sizes),
            ],
            faults: Faults::default(),
            chip_counts: OpCounts::default(),
            barriers_ps: self.barriers_ps.clone(),
            time_ps: vec![0; self.time_ps.len()],
            now: 0,
        }
    }
}

/// What all threads of a run share.
struct Run<'a> {
    plan: &'a Plan,
    tables: &'a [CostTable],
    widths: Widths,
    /// Whether the vector path computes the same for these widths.
    fast: bool,
    spikes: &'a [SpikeSets; 2],
    faults: &'a Faults,
    stimulus: &'a Stimulus,
    barrier: StepBarrier,
    start: u64,
}

/// What one thread brings back.
#[derive(Debug, Default)]
struct Share {
    spikes: Vec<Spike>,
    /// Time of the slowest core of this thread, step by step, table by table.
    slowest_ps: Vec<u64>,
}

impl Run<'_> {
    /// All steps for `cores`, the first of which has the number `first`.
    fn work(&self, first: usize, cores: &mut [CoreRun], record: &SpikeRecord) -> Share {
        let mut share = Share::default();
        let tables = self.tables.len();
        for step in 0..self.stimulus.steps() {
            let now = self.start + step as u64;
            let [before, under_way] = match now % 2 {
                0 => [&self.spikes[1], &self.spikes[0]],
                _ => [&self.spikes[0], &self.spikes[1]],
            };
            // What arrives now was sent in the step before.
            let loss = now.checked_sub(1).and_then(|sent| self.faults.loss(sent));
            share.slowest_ps.resize((step + 1) * tables, 0);
            for (offset, core) in cores.iter_mut().enumerate() {
                let core_id = first + offset;
                if self.faults.is_dead(core_id) {
                    continue;
                }
                let counted = core.counts;
                let plan = &self.plan.cores[core_id];
                let spikes = &under_way.sources[core_id];
                if core.held {
                    core.lose_spikes(plan, before, loss, spikes);
                } else {
                    let delivered = core.deliver_spikes(plan, before, loss);
                    core.update_compartments(plan, &self.widths, self.fast, delivered, spikes);
                }
                if record.wants(CoreId(core_id as u16)) {
                    under_way.for_each(core_id, |compartment| {
                        let (core, compartment) =
                            (CoreId(core_id as u16), CompartmentIdx(compartment as u16));
                        share.spikes.push(Spike { step: now, core, compartment });
                    });
                }
                let done = core.counts - counted;
                for (slowest, table) in
                    share.slowest_ps[step * tables..].iter_mut().zip(self.tables)
                {
                    *slowest = (*slowest).max(table.core_time_ps(&done));
                }
            }
            if first == 0 {
                self.inject(step, under_way);
            }
            self.barrier.wait();
        }
        share
    }

    fn inject(&self, step: usize, under_way: &SpikeSets) {
        let ports = &under_way.sources[self.plan.cores.len()..];
        ports.iter().flatten().for_each(|word| word.store(0, Ordering::Relaxed));
        for (port, line) in self.stimulus.at(step) {
            let word = &ports[*port as usize][*line as usize / 64];
            word.fetch_or(1 << (line % 64), Ordering::Relaxed);
        }
    }
}

impl CoreRun {
    fn new(compartments: usize) -> Self {
        Self {
            current: vec![0; compartments],
            voltage: vec![0; compartments],
            refractory: vec![0; compartments],
            accumulators: vec![0; compartments],
            awake: true,
            held: false,
            deaf: false,
            counts: OpCounts::default(),
        }
    }

    /// A step of a held core: counts the spikes that arrive, and makes none.
    fn lose_spikes(
        &mut self,
        plan: &CorePlan,
        before: &SpikeSets,
        loss: Option<Loss>,
        spikes: &[AtomicU64],
    ) {
        spikes.iter().for_each(|word| word.store(0, Ordering::Relaxed));
        if std::mem::take(&mut self.deaf) {
            return;
        }
        for link in &plan.links {
            before.for_each(link.source, |unit| {
                let axons = link.axons_of(unit);
                let lost = loss.map_or(0, |loss| {
                    let takes = |axon: &&u16| loss.takes(link.source, unit, link.target, **axon);
                    axons.iter().filter(takes).count()
                });
                self.counts.messages_lost += lost as u64;
                self.counts.deliveries_while_held += (axons.len() - lost) as u64;
            });
        }
    }

    /// Adds the weights of all spikes that arrive; true when there were any.
    fn deliver_spikes(&mut self, plan: &CorePlan, before: &SpikeSets, loss: Option<Loss>) -> bool {
        if std::mem::take(&mut self.deaf) {
            return false;
        }
        let deliveries = self.counts.axon_deliveries;
        for link in &plan.links {
            before.for_each(link.source, |unit| {
                let axons = link.axons_of(unit);
                match loss {
                    None => axons.iter().for_each(|axon| self.accumulate(plan, *axon)),
                    Some(loss) => self.accumulate_some(plan, link, unit, loss),
                }
            });
        }
        self.counts.axon_deliveries != deliveries
    }

    /// The messages of one spike that are not lost.
    #[inline(never)]
    fn accumulate_some(&mut self, plan: &CorePlan, link: &Link, unit: usize, loss: Loss) {
        for axon in link.axons_of(unit) {
            if loss.takes(link.source, unit, link.target, *axon) {
                self.counts.messages_lost += 1;
            } else {
                self.accumulate(plan, *axon);
            }
        }
    }

    #[inline]
    fn accumulate(&mut self, plan: &CorePlan, axon: u16) {
        let (row, base) = plan.axons[usize::from(axon)];
        let row = plan.rows[row as usize];
        let weights = &plan.weights[row.weights_at as usize..][..row.len as usize];
        match row.shape {
            RowShape::Dense { first } => {
                let start = usize::from(base) + usize::from(first);
                let accumulators = &mut self.accumulators[start..][..weights.len()];
                for (sum, weight) in accumulators.iter_mut().zip(weights) {
                    *sum += i32::from(*weight);
                }
            }
            RowShape::Runs { runs_at, n_runs } => {
                let mut weights = weights;
                for (first, len) in &plan.runs[runs_at as usize..][..n_runs as usize] {
                    let start = usize::from(base) + usize::from(*first);
                    let (run, rest) = weights.split_at(usize::from(*len));
                    let accumulators = &mut self.accumulators[start..][..run.len()];
                    for (sum, weight) in accumulators.iter_mut().zip(run) {
                        *sum += i32::from(*weight);
                    }
                    weights = rest;
                }
            }
            RowShape::Sparse { targets_at } => {
                let targets = &plan.targets[targets_at as usize..][..weights.len()];
                for (target, weight) in targets.iter().zip(weights) {
                    self.accumulators[usize::from(base) + usize::from(*target)] +=
                        i32::from(*weight);
                }
            }
        }
        self.counts.axon_deliveries += 1;
        self.counts.synaptic_ops_dense += u64::from(row.ops[0]);
        self.counts.synaptic_ops_sparse += u64::from(row.ops[1]);
        self.counts.synaptic_ops_kernel += u64::from(row.ops[2]);
    }

    /// One step of every compartment; a core that is asleep is only counted.
    fn update_compartments(
        &mut self,
        plan: &CorePlan,
        widths: &Widths,
        fast: bool,
        delivered: bool,
        spikes: &[AtomicU64],
    ) {
        spikes.iter().for_each(|word| word.store(0, Ordering::Relaxed));
        if !delivered && !self.awake {
            self.counts.updates_inactive += self.current.len() as u64;
            return;
        }
        let mut block_counts = BlockCounts::default();
        let mut spiking = 0;
        for block in &plan.blocks {
            let range = block.start..block.start + block.len;
            let lanes = Lanes {
                bias: &plan.biases[range.clone()],
                accumulators: &mut self.accumulators[range.clone()],
                current: &mut self.current[range.clone()],
                voltage: &mut self.voltage[range.clone()],
                refractory: &mut self.refractory[range],
            };
            let bits = update_block(&block.params, widths, fast, lanes, &mut block_counts);
            if bits != 0 {
                spikes[block.start / BLOCK]
                    .fetch_or(bits << (block.start % BLOCK), Ordering::Relaxed);
                spiking += bits.count_ones();
                self.count_messages(&plan.sends[block.start..], bits);
            }
        }
        self.awake = block_counts.awake;
        self.count_updates(&block_counts, spiking);
    }

    fn count_updates(&mut self, block: &BlockCounts, spiking: u32) {
        let counts = &mut self.counts;
        counts.updates_spiking += u64::from(spiking);
        counts.updates_inactive += u64::from(block.inactive);
        counts.updates_active += self.current.len() as u64 - u64::from(spiking + block.inactive);
        counts.accumulator_overflows += u64::from(block.accumulator_overflows);
        counts.current_overflows += u64::from(block.current_overflows);
        counts.bias_sum_overflows += u64::from(block.bias_sum_overflows);
        counts.voltage_clips += u64::from(block.voltage_clips);
    }

    fn count_messages(&mut self, sends: &[SendCost], mut bits: u64) {
        while bits != 0 {
            let cost = sends[bits.trailing_zeros() as usize];
            self.counts.messages += u64::from(cost.messages);
            self.counts.messages_within_tile += u64::from(cost.within_tile);
            self.counts.hops_east_west += u64::from(cost.east_west);
            self.counts.hops_north_south += u64::from(cost.north_south);
            bits &= bits - 1;
        }
    }

    fn state(&self, compartment: usize) -> CompartmentState {
        CompartmentState {
            current: self.current[compartment],
            voltage: self.voltage[compartment],
            refractory_left: self.refractory[compartment],
        }
    }

    fn clear(&mut self) {
        self.current.fill(0);
        self.voltage.fill(0);
        self.refractory.fill(0);
        self.awake = true;
    }
}

impl Engine for EventEngine {
    fn map(&self) -> &CoreMap {
        &self.map
    }

    fn now(&self) -> u64 {
        self.now
    }

    fn run(&mut self, stimulus: &Stimulus, record: &mut SpikeRecord) {
        let workers = self.shares.len();
        let run = Run {
            plan: &self.plan,
            tables: &self.map.chip().cost_tables,
            widths: self.widths,
            fast: lanes::fits(&self.widths),
            spikes: &self.spikes,
            faults: &self.faults,
            stimulus,
            barrier: StepBarrier::new(workers),
            start: self.now,
        };
        let mut shares = Vec::with_capacity(workers);
        if workers == 1 {
            shares.push(run.work(0, &mut self.cores, record));
        } else {
            let record: &SpikeRecord = record;
            crossbeam::thread::scope(|scope| {
                let (mut rest, mut next) = (&mut self.cores[..], 0);
                let mut handles = Vec::with_capacity(workers);
                for len in &self.shares {
                    let (cores, others) = rest.split_at_mut(*len);
                    let (run, first) = (&run, next);
                    handles.push(scope.spawn(move |_| run.work(first, cores, record)));
                    (rest, next) = (others, next + len);
                }
                shares.extend(handles.into_iter().map(|h| h.join().expect("no worker panics")));
            })
            .expect("no worker panics");
        }
        self.merge(shares, stimulus, record);
    }

    fn state(&self, core: CoreId, compartment: CompartmentIdx) -> CompartmentState {
        self.cores[core.index()].state(compartment.index())
    }

    fn core_counts(&self) -> Vec<OpCounts> {
        self.cores.iter().map(|core| core.counts).collect()
    }

    fn total_counts(&self) -> OpCounts {
        OpCounts::total(self.cores.iter().map(|core| &core.counts).chain([&self.chip_counts]))
    }

    fn chip_time_ps(&self) -> &[u64] {
        &self.time_ps
    }

    fn reset(&mut self) {
        for core in &mut self.cores {
            self.chip_counts.host_resets += core.current.len() as u64;
            core.clear();
            core.deaf = false;
        }
        self.spikes.iter().for_each(SpikeSets::clear);
    }

    fn reset_cores(&mut self, cores: &[CoreId], spikes: bool) {
        for core in cores {
            let core = &mut self.cores[core.index()];
            self.chip_counts.host_resets += core.current.len() as u64;
            core.clear();
            core.deaf |= spikes;
        }
    }

    fn set_held(&mut self, cores: &[CoreId], held: bool) {
        cores.iter().for_each(|core| self.cores[core.index()].held = held);
        self.chip_counts.management_writes += cores.len() as u64;
    }

    fn set_faults(&mut self, faults: Faults) {
        check_faults(&self.map, self.now, &faults);
        self.faults = faults;
    }

    fn count_host_reads(&mut self, n: u64) {
        self.chip_counts.host_reads += n;
    }
}

impl Link {
    /// Input axons that a spike of `unit` goes to.
    #[inline]
    fn axons_of(&self, unit: usize) -> &[u16] {
        &self.axons[self.starts[unit] as usize..self.starts[unit + 1] as usize]
    }
}

impl EventEngine {
    /// Puts together what the threads bring back, in an order that does not depend on them.
    fn merge(&mut self, shares: Vec<Share>, stimulus: &Stimulus, record: &mut SpikeRecord) {
        let steps = stimulus.steps();
        let tables = self.time_ps.len();
        for step in 0..steps {
            let mut slowest = vec![0; tables];
            for share in &shares {
                for (all, one) in slowest.iter_mut().zip(&share.slowest_ps[step * tables..]) {
                    *all = (*all).max(*one);
                }
            }
            add_step_time(&mut self.time_ps, &slowest, &self.barriers_ps);
            for (port, line) in stimulus.at(step) {
                let messages = self.plan.port_messages[*port as usize][*line as usize];
                self.chip_counts.host_injections += u64::from(messages);
            }
        }
        let several = shares.len() > 1;
        record.spikes.extend(shares.into_iter().flat_map(|share| share.spikes));
        if several {
            record.spikes.sort_unstable();
        }
        self.chip_counts.barriers += steps as u64;
        self.now += steps as u64;
    }
}
