//! The fixed-point reference: every synapse of every axon in every step, nothing clever.
//!
//! It shares with the event engine only the compartment's arithmetic and the definition of the
//! effective weight, both of which are tested against published vectors.

use std::sync::Arc;

use super::slowest::{ChipTime, Slowest};
use super::{Engine, Spike, SpikeRecord, Stimulus, barriers_ps, check_faults};
use crate::compartment::{CompartmentParams, CompartmentState, Widths, update};
use crate::core_map::{Core, CoreMap};
use crate::cost::CostTable;
use crate::counters::OpCounts;
use crate::faults::Faults;
use crate::id::{AxonIdx, CompartmentIdx, CoreId};
use crate::synapse::SynapseForm;

/// Runs a map the obvious way.
#[derive(Debug)]
pub struct DenseEngine {
    map: Arc<CoreMap>,
    widths: Widths,
    params: Vec<Vec<CompartmentParams>>,
    state: Vec<Vec<CompartmentState>>,
    /// Spikes that arrive in the next step: how often on each axon of each core.
    arriving: Vec<Vec<u32>>,
    /// Messages that would arrive at each core in the next step, had they not been lost.
    lost: Vec<u64>,
    faults: Faults,
    /// Which cores are held.
    held: Vec<bool>,
    /// Axons that share their list with another axon, by core and list.
    shared: Vec<Vec<bool>>,
    counts: Vec<OpCounts>,
    chip_counts: OpCounts,
    time: ChipTime,
    now: u64,
}

/// What is sent in a step: how often to each axon of each core, and what is lost on the way there.
struct Leaving {
    axons: Vec<Vec<u32>>,
    lost: Vec<u64>,
}

impl DenseEngine {
    /// Ready at step 0 with all state zero.
    pub fn new(map: Arc<CoreMap>) -> Self {
        let arithmetic = &map.chip().arithmetic;
        let barriers_ps = barriers_ps(&map);
        Self {
            widths: Widths::new(arithmetic),
            params: map.cores().iter().map(|core| core.params(arithmetic)).collect(),
            state: map
                .cores()
                .iter()
                .map(|c| vec![CompartmentState::default(); c.compartments()])
                .collect(),
            arriving: map.cores().iter().map(|core| vec![0; core.axons_in.len()]).collect(),
            lost: vec![0; map.cores().len()],
            faults: Faults::default(),
            held: vec![false; map.cores().len()],
            shared: map.cores().iter().map(shared_lists).collect(),
            counts: vec![OpCounts::default(); map.cores().len()],
            chip_counts: OpCounts::default(),
            time: ChipTime::new(map.cores().len(), barriers_ps),
            now: 0,
            map,
        }
    }

    fn step(&mut self, injected: &[(u32, u32)], record: &mut SpikeRecord) {
        let before = self.counts.clone();
        let axons = self.arriving.iter().map(|axons| vec![0; axons.len()]).collect();
        let mut leaving = Leaving { axons, lost: vec![0; self.lost.len()] };
        let map = Arc::clone(&self.map);
        for (core_id, core) in map.cores().iter().enumerate() {
            if self.faults.is_dead(core_id) {
                continue;
            }
            self.counts[core_id].messages_lost += self.lost[core_id];
            if self.held[core_id] {
                let lost = self.arriving[core_id].iter().map(|spikes| u64::from(*spikes));
                self.counts[core_id].deliveries_while_held += lost.sum::<u64>();
                continue;
            }
            let input = self.accumulate(core_id, core);
            self.update_core(core_id, core, &input, &mut leaving, record);
        }
        self.inject(injected, &mut leaving);
        (self.arriving, self.lost) = (leaving.axons, leaving.lost);
        self.chip_counts.barriers += 1;
        self.add_time(&before);
        self.now += 1;
    }

    /// Adds spike count x weight for every stored synapse of every input axon.
    fn accumulate(&mut self, core_id: usize, core: &Core) -> Vec<i64> {
        let mut input = vec![0i64; core.compartments()];
        for (axon_idx, axon) in core.axons_in.iter().enumerate() {
            let spikes = self.arriving[core_id][axon_idx];
            self.counts[core_id].axon_deliveries += u64::from(spikes);
            for entry in &core.lists[axon.list as usize].entries {
                let format = core.formats[usize::from(entry.format)];
                for (target, mantissa) in entry.synapses() {
                    let weight = 64 * i64::from(format.effective_steps(mantissa));
                    input[usize::from(axon.base) + target] += i64::from(spikes) * weight;
                }
                let ops = u64::from(spikes) * entry.len() as u64;
                let counts = &mut self.counts[core_id];
                match (&entry.form, self.shared[core_id][axon.list as usize]) {
                    (_, true) => counts.synaptic_ops_kernel += ops,
                    (SynapseForm::Dense { .. }, false) => counts.synaptic_ops_dense += ops,
                    (SynapseForm::Sparse { .. }, false) => counts.synaptic_ops_sparse += ops,
                }
            }
        }
        input
    }

    fn update_core(
        &mut self,
        core_id: usize,
        core: &Core,
        input: &[i64],
        leaving: &mut Leaving,
        record: &mut SpikeRecord,
    ) {
        for (compartment, input) in input.iter().enumerate() {
            let state = self.state[core_id][compartment];
            let done = update(&self.params[core_id][compartment], &self.widths, state, *input);
            self.state[core_id][compartment] = done.state;
            let counts = &mut self.counts[core_id];
            counts.updates_spiking += u64::from(done.spike);
            counts.updates_inactive += u64::from(done.inactive && !done.spike);
            counts.updates_active += u64::from(!done.inactive && !done.spike);
            counts.accumulator_overflows += u64::from(done.accumulator_overflowed);
            counts.current_overflows += u64::from(done.current_overflowed);
            counts.bias_sum_overflows += u64::from(done.bias_sum_overflowed);
            counts.voltage_clips += u64::from(done.voltage_clipped);
            if done.spike {
                let site = (CoreId(core_id as u16), CompartmentIdx(compartment as u16));
                self.send(core, site, leaving);
                if record.wants(site.0) {
                    record.spikes.push(Spike { step: self.now, core: site.0, compartment: site.1 });
                }
            }
        }
    }

    fn send(&mut self, core: &Core, from: (CoreId, CompartmentIdx), leaving: &mut Leaving) {
        let mesh = &self.map.chip().mesh;
        let (x, y) = mesh.tile(from.0.0);
        for axon in core.axons_out.iter().filter(|axon| axon.compartment == from.1) {
            self.message((from.0.index(), from.1.index()), (axon.core, axon.axon), leaving);
            let (to_x, to_y) = mesh.tile(axon.core.0);
            let counts = &mut self.counts[from.0.index()];
            counts.messages += 1;
            counts.messages_within_tile += u64::from((x, y) == (to_x, to_y));
            counts.hops_east_west += u64::from(x.abs_diff(to_x));
            counts.hops_north_south += u64::from(y.abs_diff(to_y));
        }
    }

    /// A message on its way, or lost.
    fn message(&self, from: (usize, usize), to: (CoreId, AxonIdx), leaving: &mut Leaving) {
        let (core, axon) = (to.0.index(), to.1);
        match self.faults.loss(self.now) {
            Some(loss) if loss.takes(from.0, from.1, core, axon.0) => leaving.lost[core] += 1,
            _ => leaving.axons[core][axon.index()] += 1,
        }
    }

    fn inject(&mut self, injected: &[(u32, u32)], leaving: &mut Leaving) {
        let map = Arc::clone(&self.map);
        for (port, line) in injected {
            let from = (map.cores().len() + *port as usize, *line as usize);
            for target in &map.ports()[*port as usize].targets {
                if target.line == *line {
                    self.message(from, (target.core, target.axon), leaving);
                    self.chip_counts.host_injections += 1;
                }
            }
        }
    }

    fn add_time(&mut self, before: &[OpCounts]) {
        let slowest = |table: &CostTable| {
            let mut slowest = Slowest::default();
            for (core, (now, before)) in self.counts.iter().zip(before).enumerate() {
                slowest.see(core, table.core_time_ps(&(*now - *before)));
            }
            slowest
        };
        let slowest: Vec<Slowest> = self.map.chip().cost_tables.iter().map(slowest).collect();
        self.time.add(&slowest);
    }
}

/// For each list of a core: whether several axons use it.
fn shared_lists(core: &Core) -> Vec<bool> {
    list_users(core).into_iter().map(|users| users > 1).collect()
}

/// For each list of a core: how many axons use it.
pub(super) fn list_users(core: &Core) -> Vec<u32> {
    let mut users = vec![0u32; core.lists.len()];
    core.axons_in.iter().for_each(|axon| users[axon.list as usize] += 1);
    users
}

impl Engine for DenseEngine {
    fn map(&self) -> &CoreMap {
        &self.map
    }

    fn now(&self) -> u64 {
        self.now
    }

    fn run(&mut self, stimulus: &Stimulus, record: &mut SpikeRecord) {
        for step in 0..stimulus.steps() {
            self.step(stimulus.at(step), record);
        }
    }

    fn state(&self, core: CoreId, compartment: CompartmentIdx) -> CompartmentState {
        self.state[core.index()][compartment.index()]
    }

    fn core_counts(&self) -> Vec<OpCounts> {
        self.counts.clone()
    }

    fn total_counts(&self) -> OpCounts {
        OpCounts::total(self.counts.iter().chain([&self.chip_counts]))
    }

    fn chip_time_ps(&self) -> &[u64] {
        &self.time.total_ps
    }

    fn slowest_ps(&self) -> &[u64] {
        &self.time.slowest_ps
    }

    fn reset(&mut self) {
        for core in &mut self.state {
            self.chip_counts.host_resets += core.len() as u64;
            core.fill(CompartmentState::default());
        }
        self.arriving.iter_mut().for_each(|axons| axons.fill(0));
        self.lost.fill(0);
    }

    fn reset_cores(&mut self, cores: &[CoreId], spikes: bool) {
        for core in cores.iter().map(|core| core.index()) {
            self.chip_counts.host_resets += self.state[core].len() as u64;
            self.state[core].fill(CompartmentState::default());
            if spikes {
                self.arriving[core].fill(0);
                self.lost[core] = 0;
            }
        }
    }

    fn set_held(&mut self, cores: &[CoreId], held: bool) {
        cores.iter().for_each(|core| self.held[core.index()] = held);
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
