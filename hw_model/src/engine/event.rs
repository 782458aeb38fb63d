//! The event-driven engine: work where spikes are, on one or several threads.
//!
//! Spikes of every source live in two bit sets, one for the step before and one for the step
//! under way. A core reads the former and writes its own part of the latter, so threads never
//! write to the same place and one barrier per step is enough. Sums are of integers, so neither
//! the order of spikes nor the number of threads can change a result.

use std::panic::resume_unwind;
use std::sync::Arc;

use pulp::{Arch, NullaryFnOnce};

use super::barrier::StepBarrier;
use super::plan::{Fan, Plan};
use super::slowest::{ChipTime, Slowest};
use super::{Engine, Spike, SpikeRecord, Stimulus, barriers_ps, check_faults, lanes};
use crate::compartment::{CompartmentState, Widths};
use crate::core_map::CoreMap;
use crate::counters::OpCounts;
use crate::faults::{Faults, Loss};
use crate::id::{CompartmentIdx, CoreId};
use batch::Batch;
use core_run::CoreRun;
use spikes::{SourceSpikes, SpikeSets};

mod batch;
mod core_run;
mod spikes;

/// Whether operations are counted. They are; only `benches/counters.sh` builds an engine that does
/// not, to see what they cost.
const COUNTED: bool = !cfg!(uncounted);

/// Bytes of memory that an engine takes, beside the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryUse {
    /// Weights and routing: all engines that come of [`EventEngine::fresh`] share them.
    pub shared: usize,
    /// State of compartments, sums and spikes, of each engine.
    pub state: usize,
}

/// Runs a map by its events.
#[derive(Debug)]
pub struct EventEngine {
    map: Arc<CoreMap>,
    plan: Arc<Plan>,
    widths: Widths,
    /// Cores of each thread.
    shares: Vec<usize>,
    cores: Vec<CoreRun>,
    /// Pushed synapses of each thread's cores.
    fans: Vec<Fan>,
    /// What arrives at a core, for each thread.
    batches: Vec<Batch>,
    spikes: [SpikeSets; 2],
    faults: Faults,
    chip_counts: OpCounts,
    time: ChipTime,
    now: u64,
}

impl EventEngine {
    /// Ready at step 0 with all state zero, on one thread.
    pub fn new(map: Arc<CoreMap>) -> Self {
        Self::with_threads(map, 1)
    }

    /// The same on `threads` threads (at least one, at most one per core).
    pub fn with_threads(map: Arc<CoreMap>, threads: usize) -> Self {
        let plan = Arc::new(Plan::new(&map));
        Self::with_plan(map, plan, threads)
    }

    fn with_plan(map: Arc<CoreMap>, plan: Arc<Plan>, threads: usize) -> Self {
        let shares = plan.shares(threads);
        let mut next = 0;
        let fan = |len: &usize| {
            next += len;
            plan.fans.part(next - len..next)
        };
        let fans = shares.iter().map(fan).collect();
        Self::at_start(map, plan, shares, fans)
    }

    /// At step 0, where `fans` have no input.
    fn at_start(map: Arc<CoreMap>, plan: Arc<Plan>, shares: Vec<usize>, fans: Vec<Fan>) -> Self {
        let barriers_ps = barriers_ps(&map);
        let mut rest = &plan.cores[..];
        let batch = |len: &usize| {
            let (cores, others) = rest.split_at(*len);
            rest = others;
            Batch::new(cores)
        };
        let batches = shares.iter().map(batch).collect();
        Self {
            batches,
            widths: Widths::new(&map.chip().arithmetic),
            shares,
            cores: plan.cores.iter().map(CoreRun::new).collect(),
            fans,
            spikes: [SpikeSets::new(&plan.source_sizes), SpikeSets::new(&plan.source_sizes)],
            faults: Faults::default(),
            chip_counts: OpCounts::default(),
            time: ChipTime::new(plan.cores.len(), barriers_ps),
            now: 0,
            plan,
            map,
        }
    }

    /// The same on as many threads as have enough to do, at most `threads`: a step of a small map is
    /// over before a second thread has been told of it.
    pub fn with_threads_at_most(map: Arc<CoreMap>, threads: usize) -> Self {
        let plan = Arc::new(Plan::new(&map));
        let threads = plan.threads_that_pay(threads);
        Self::with_plan(map, plan, threads)
    }

    /// Number of threads that run.
    pub fn threads(&self) -> usize {
        self.shares.len()
    }

    /// What the engine takes of the machine's memory.
    pub fn memory(&self) -> MemoryUse {
        let cores = self.cores.iter().map(CoreRun::bytes).sum::<usize>();
        let fans = self.fans.iter().map(Fan::state_bytes).sum::<usize>();
        let shared_fans = self.fans.iter().map(Fan::shared_bytes).sum::<usize>();
        let batches = self.batches.iter().map(Batch::bytes).sum::<usize>();
        let spikes =
            2 * self.plan.source_sizes.iter().map(|size| size.div_ceil(64) * 8).sum::<usize>();
        MemoryUse {
            shared: self.plan.bytes() + shared_fans,
            state: cores + fans + batches + spikes,
        }
    }

    /// A second engine on the same map at step 0, without faults; weights and routing are shared.
    pub fn fresh(&self) -> Self {
        let (map, plan) = (Arc::clone(&self.map), Arc::clone(&self.plan));
        let fans = self.fans.iter().map(Fan::fresh).collect();
        Self::at_start(map, plan, self.shares.clone(), fans)
    }
}

/// What all threads of a run share.
struct Run<'a> {
    plan: &'a Plan,
    widths: Widths,
    /// Whether the vector path computes the same for these widths.
    fast: bool,
    spikes: &'a [SpikeSets; 2],
    faults: &'a Faults,
    stimulus: &'a Stimulus,
    barrier: StepBarrier,
    start: u64,
}

/// All steps of one thread, compiled for several instruction sets.
struct Work<'a> {
    run: &'a Run<'a>,
    /// Number of the first of `cores`.
    first: usize,
    cores: &'a mut [CoreRun],
    fan: &'a mut Fan,
    batch: &'a mut Batch,
    record: &'a SpikeRecord,
}

/// What one thread brings back.
#[derive(Debug, Default)]
struct Share {
    spikes: Vec<Spike>,
    /// The slowest core of this thread, step by step, table by table.
    slowest: Vec<Slowest>,
}

impl NullaryFnOnce for Work<'_> {
    type Output = Share;

    #[inline(always)]
    fn call(mut self) -> Share {
        let run = self.run;
        let tables = run.plan.core_times.len();
        let steps = run.stimulus.steps();
        let none = Slowest::default();
        let mut share = Share { spikes: Vec::new(), slowest: vec![none; steps * tables] };
        let member = run.barrier.member();
        for step in 0..steps {
            let slowest = &mut share.slowest[step * tables..][..tables];
            self.step(step, slowest, &mut share.spikes);
            if !member.wait() {
                break;
            }
        }
        share
    }
}

impl Work<'_> {
    #[inline(always)]
    fn step(&mut self, step: usize, slowest: &mut [Slowest], spikes: &mut Vec<Spike>) {
        let run = self.run;
        let now = run.start + step as u64;
        let [before, under_way] = match now % 2 {
            0 => [&run.spikes[1], &run.spikes[0]],
            _ => [&run.spikes[0], &run.spikes[1]],
        };
        // What arrives now was sent in the step before.
        let loss = now.checked_sub(1).and_then(|sent| run.faults.loss(sent));
        if !self.fan.is_empty() {
            self.push(before, loss);
        }
        for (offset, core) in self.cores.iter_mut().enumerate() {
            let core_id = self.first + offset;
            if run.faults.is_dead(core_id) {
                continue;
            }
            let plan = &run.plan.cores[core_id];
            let under_way_here = &under_way.sources()[core_id];
            if core.held {
                core.lose_spikes(plan, before, loss, under_way_here);
            } else {
                let mut done = OpCounts::default();
                let pushed = self.fan.take(&run.plan.fans, core_id);
                let weights = &run.plan.weights;
                let arrived = (before, loss);
                let sums = core.deliver((plan, weights), arrived, pushed, self.batch, &mut done);
                core.update(plan, (&run.widths, run.fast), sums, under_way_here, &mut done);
                if COUNTED {
                    for (slowest, times) in slowest.iter_mut().zip(&run.plan.core_times) {
                        slowest.see(core_id, times.of(&done));
                    }
                    core.counts += &done;
                }
            }
            let core = CoreId(core_id as u16);
            if self.record.wants(core) {
                for compartment in under_way.of(core_id) {
                    let compartment = CompartmentIdx(compartment as u16);
                    spikes.push(Spike { step: now, core, compartment });
                }
            }
        }
        if self.first == 0 {
            run.inject(step, under_way);
        }
    }

    /// Adds what the spikes of the step before push onto the cores of this thread.
    #[inline(always)]
    fn push(&mut self, before: &SpikeSets, loss: Option<Loss>) {
        let (run, fans) = (self.run, &self.run.plan.fans);
        let odd = |core: &CoreRun| core.held || core.deaf;
        if loss.is_some() || !run.faults.dead_cores().is_empty() || self.cores.iter().any(odd) {
            self.push_some(before, loss);
            return;
        }
        for (source, first_unit) in fans.sources() {
            self.fan.push(fans, first_unit, before.of(source));
        }
        self.fan.settle();
    }

    /// The same where messages may be lost, and cores dead, held or deaf.
    #[inline(never)]
    fn push_some(&mut self, before: &SpikeSets, loss: Option<Loss>) {
        let (run, fans) = (self.run, &self.run.plan.fans);
        for (source, first_unit) in fans.sources() {
            for unit in before.of(source) {
                self.fan.push_some(fans, (source, first_unit, unit), |axon| {
                    let core = &mut self.cores[axon.core - self.first];
                    if run.faults.is_dead(axon.core) || core.deaf {
                        return false;
                    }
                    let lost = loss.is_some_and(|loss| {
                        loss.takes(axon.source, axon.unit, axon.core, axon.axon)
                    });
                    core.counts.messages_lost += u64::from(lost);
                    core.counts.deliveries_while_held += u64::from(core.held && !lost);
                    !lost && !core.held
                });
            }
        }
    }
}

impl Run<'_> {
    fn inject(&self, step: usize, under_way: &SpikeSets) {
        let ports = &under_way.sources()[self.plan.cores.len()..];
        ports.iter().for_each(SourceSpikes::clear);
        for (port, line) in self.stimulus.at(step) {
            ports[*port as usize].add(*line as usize / 64, 1 << (line % 64));
        }
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
            widths: self.widths,
            fast: lanes::fits(&self.widths),
            spikes: &self.spikes,
            faults: &self.faults,
            stimulus,
            barrier: StepBarrier::new(workers),
            start: self.now,
        };
        let arch = Arch::new();
        let mut shares = Vec::with_capacity(workers);
        if let ([fan], [batch]) = (&mut self.fans[..], &mut self.batches[..]) {
            let cores = &mut self.cores[..];
            shares.push(arch.dispatch(Work { run: &run, first: 0, cores, fan, batch, record }));
        } else {
            let record: &SpikeRecord = record;
            crossbeam::thread::scope(|scope| {
                let (mut rest, mut first) = (&mut self.cores[..], 0);
                let mut handles = Vec::with_capacity(workers);
                let threads = self.shares.iter().zip(&mut self.fans).zip(&mut self.batches);
                for ((len, fan), batch) in threads {
                    let (cores, others) = rest.split_at_mut(*len);
                    let work = Work { run: &run, first, cores, fan, batch, record };
                    handles.push(scope.spawn(move |_| arch.dispatch(work)));
                    (rest, first) = (others, first + len);
                }
                for handle in handles {
                    // The others end at the barrier.
                    shares.push(handle.join().unwrap_or_else(|panic| resume_unwind(panic)));
                }
            })
            .unwrap_or_else(|panic| resume_unwind(panic));
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
        &self.time.total_ps
    }

    fn slowest_ps(&self) -> &[u64] {
        &self.time.slowest_ps
    }

    fn reset(&mut self) {
        for (core, plan) in self.cores.iter_mut().zip(&self.plan.cores) {
            self.chip_counts.host_resets += plan.compartments as u64;
            core.clear();
            core.deaf = false;
        }
        self.spikes.iter().for_each(SpikeSets::clear);
    }

    fn reset_cores(&mut self, cores: &[CoreId], spikes: bool) {
        for core in cores {
            self.chip_counts.host_resets += self.plan.cores[core.index()].compartments as u64;
            let core = &mut self.cores[core.index()];
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

impl EventEngine {
    /// Puts together what the threads bring back, in an order that does not depend on them.
    fn merge(&mut self, shares: Vec<Share>, stimulus: &Stimulus, record: &mut SpikeRecord) {
        let steps = stimulus.steps();
        let tables = self.time.total_ps.len();
        let mut slowest = vec![Slowest::default(); tables];
        for step in 0..steps {
            slowest.fill(Slowest::default());
            // Threads have cores in their order.
            for share in &shares {
                for (all, one) in slowest.iter_mut().zip(&share.slowest[step * tables..]) {
                    all.see(usize::from(one.core), one.ps);
                }
            }
            self.time.add(&slowest);
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
