//! A core map laid out for execution: contiguous weights, and for each core where its spikes
//! come from.

use super::dense::shared_lists;
use super::lanes::BLOCK;
use crate::compartment::CompartmentParams;
use crate::core_map::{CompartmentGroup, Core, CoreMap};
use crate::synapse::SynapseForm;

/// A list is run as dense rows when at least this share (1 / n) of their length is used.
const DENSE_SPAN_PER_SYNAPSE: usize = 4;
/// What it takes to begin a run, in weights.
const RUN_COST: usize = 16;

/// Immutable part of an event engine.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) cores: Vec<CorePlan>,
    /// Compartments of each core, then lines of each port.
    pub(super) source_sizes: Vec<usize>,
    /// Messages per line of each port.
    pub(super) port_messages: Vec<Vec<u32>>,
}

/// What a compartment's update takes beside one synapse of an input axon, most of which have no
/// spike in most steps. Only the balance of threads depends on it.
const UPDATE_WORK: u64 = 50;

/// What one core needs to run.
#[derive(Debug)]
pub(super) struct CorePlan {
    /// Compartments that are updated together, in order.
    pub(super) blocks: Vec<Block>,
    /// Bias of every compartment.
    pub(super) biases: Vec<i32>,
    pub(super) rows: Vec<Row>,
    /// All weights of all rows, in units of 64.
    pub(super) weights: Vec<i16>,
    /// First accumulator and length of the runs of rows in several runs.
    pub(super) runs: Vec<(u16, u16)>,
    /// All targets of the sparse rows.
    pub(super) targets: Vec<u16>,
    /// (row, base) of every input axon.
    pub(super) axons: Vec<(u32, u16)>,
    pub(super) links: Vec<Link>,
    /// What a spike of each compartment costs to send.
    pub(super) sends: Vec<SendCost>,
}

/// Compartments of equal parameters, but for their biases, within one word of spikes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) params: CompartmentParams,
    pub(super) start: usize,
    pub(super) len: usize,
}

/// One synapse list, ready to be added to the accumulators.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) shape: RowShape,
    /// First weight in [`CorePlan::weights`].
    pub(super) weights_at: u32,
    /// Number of weights there.
    pub(super) len: u32,
    /// Stored synapses by form, what the chip would add: dense, sparse, shared.
    pub(super) ops: [u32; 3],
}

#[derive(Debug, Clone, Copy)]
pub(super) enum RowShape {
    /// Consecutive accumulators from `first` on.
    Dense { first: u16 },
    /// Consecutive accumulators of each of [`CorePlan::runs`], from `runs_at` on.
    Runs { runs_at: u32, n_runs: u32 },
    /// Accumulators listed in [`CorePlan::targets`] from `targets_at` on.
    Sparse { targets_at: u32 },
}

/// Spikes of one source (a core or a port) that reach a core.
#[derive(Debug)]
pub(super) struct Link {
    pub(super) source: usize,
    /// The core.
    pub(super) target: usize,
    /// Axons of source unit `i` are `axons[starts[i]..starts[i + 1]]`.
    pub(super) starts: Vec<u32>,
    pub(super) axons: Vec<u16>,
}

/// Messages and hops of one spike.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SendCost {
    pub(super) messages: u32,
    pub(super) within_tile: u32,
    pub(super) east_west: u32,
    pub(super) north_south: u32,
}

impl Plan {
    pub(super) fn new(map: &CoreMap) -> Self {
        let core_sizes = map.cores().iter().map(Core::compartments);
        let port_sizes = map.ports().iter().map(|port| port.lines as usize);
        let source_sizes: Vec<usize> = core_sizes.chain(port_sizes).collect();
        let mut links = all_links(map, &source_sizes);
        let cores = map.cores().iter().enumerate();
        Self {
            cores: cores
                .map(|(id, core)| CorePlan::new(map, id, core, std::mem::take(&mut links[id])))
                .collect(),
            port_messages: map
                .ports()
                .iter()
                .map(|port| {
                    let mut messages = vec![0; port.lines as usize];
                    port.targets.iter().for_each(|target| messages[target.line as usize] += 1);
                    messages
                })
                .collect(),
            source_sizes,
        }
    }
}

impl Plan {
    /// Numbers of consecutive cores for at most `threads` threads, with about equal work.
    pub(super) fn shares(&self, threads: usize) -> Vec<usize> {
        let n = self.cores.len();
        let threads = threads.clamp(1, n.max(1));
        let mut sums = Vec::with_capacity(n);
        let total = self.cores.iter().fold(0, |sum, core| {
            sums.push(sum + core.work());
            sum + core.work()
        });
        let mut first = 0;
        let share = |thread: usize| {
            let goal = total * thread as u64 / threads as u64;
            let end = sums.partition_point(|sum| *sum < goal) + 1;
            // At least one core each, for those that follow as well.
            let end = if thread == threads { n } else { end.max(first + 1) };
            let end = end.min(n - (threads - thread).min(n));
            let len = end - first;
            first = end;
            len
        };
        (1..=threads).map(share).collect()
    }
}

impl CorePlan {
    /// Work of a step, roughly.
    fn work(&self) -> u64 {
        let synapses = |(row, _): &(u32, u16)| u64::from(self.rows[*row as usize].len);
        UPDATE_WORK * self.sends.len() as u64 + self.axons.iter().map(synapses).sum::<u64>()
    }

    fn new(map: &CoreMap, id: usize, core: &Core, links: Vec<Link>) -> Self {
        let mut plan = Self {
            blocks: blocks(map, core),
            biases: core.params(&map.chip().arithmetic).iter().map(|p| p.bias).collect(),
            rows: Vec::with_capacity(core.lists.len()),
            weights: Vec::new(),
            runs: Vec::new(),
            targets: Vec::new(),
            axons: core.axons_in.iter().map(|axon| (axon.list, axon.base)).collect(),
            links,
            sends: send_costs(map, id, core),
        };
        let shared = shared_lists(core);
        for (list, shared) in shared.into_iter().enumerate() {
            plan.add_row(core, list, shared);
        }
        plan
    }

    /// Lays list number `list` out: entries are summed per target, which integers allow.
    fn add_row(&mut self, core: &Core, list: usize, shared: bool) {
        let entries = &core.lists[list].entries;
        let mut ops = [0u32; 3];
        let mut synapses: Vec<(usize, i32)> = Vec::new();
        for entry in entries {
            let form = match entry.form {
                _ if shared => 2,
                SynapseForm::Dense { .. } => 0,
                SynapseForm::Sparse { .. } => 1,
            };
            ops[form] += entry.len() as u32;
            let format = core.formats[usize::from(entry.format)];
            synapses.extend(
                entry.synapses().map(|(target, mantissa)| {
                    (target, i32::from(format.effective_steps(mantissa)))
                }),
            );
        }
        synapses.sort_by_key(|(target, _)| *target);
        let weights_at = self.weights.len() as u32;
        let shape = self.add_weights(&synapses);
        self.rows.push(Row { shape, weights_at, len: self.weights.len() as u32 - weights_at, ops });
    }

    fn add_weights(&mut self, synapses: &[(usize, i32)]) -> RowShape {
        let first = synapses.first().map_or(0, |(target, _)| *target);
        let span = synapses.last().map_or(0, |(target, _)| *target + 1) - first;
        let mut dense = vec![0i32; span];
        synapses.iter().for_each(|(target, weight)| dense[target - first] += weight);
        let fits = dense.iter().all(|sum| i16::try_from(*sum).is_ok());
        let runs = runs(synapses);
        let length: usize = runs.iter().map(|(_, len)| len).sum();
        let n_runs = runs.len();
        let worth_it = |length: usize| fits && length <= DENSE_SPAN_PER_SYNAPSE * synapses.len();
        if n_runs > 1 && length + RUN_COST * n_runs <= span && worth_it(length + RUN_COST * n_runs)
        {
            let runs_at = self.runs.len() as u32;
            for (start, len) in runs {
                let sums = &dense[start - first..][..len];
                self.weights.extend(sums.iter().map(|sum| *sum as i16));
                self.runs.push((start as u16, len as u16));
            }
            return RowShape::Runs { runs_at, n_runs: n_runs as u32 };
        }
        if worth_it(span) {
            self.weights.extend(dense.iter().map(|sum| *sum as i16));
            return RowShape::Dense { first: first as u16 };
        }
        let targets_at = self.targets.len() as u32;
        self.targets.extend(synapses.iter().map(|(target, _)| *target as u16));
        self.weights.extend(synapses.iter().map(|(_, weight)| *weight as i16));
        RowShape::Sparse { targets_at }
    }
}

/// First target and length of the stretches between gaps that are worth a new run. `synapses` are
/// sorted by target.
fn runs(synapses: &[(usize, i32)]) -> Vec<(usize, usize)> {
    let near = |a: &(usize, i32), b: &(usize, i32)| b.0 <= a.0 + RUN_COST;
    let run = |run: &[(usize, i32)]| (run[0].0, run[run.len() - 1].0 + 1 - run[0].0);
    synapses.chunk_by(near).map(run).collect()
}

/// Groups of equal parameters but for the bias, cut where a word of spikes ends.
fn blocks(map: &CoreMap, core: &Core) -> Vec<Block> {
    let arithmetic = &map.chip().arithmetic;
    let alike = |a: &CompartmentGroup, b: &CompartmentGroup| {
        let bias = (a.bias_mantissa, a.bias_exponent);
        let len = a.len;
        *a == CompartmentGroup { bias_mantissa: bias.0, bias_exponent: bias.1, len, ..*b }
    };
    let mut blocks = Vec::new();
    let mut start = 0;
    for groups in core.groups.chunk_by(alike) {
        let params = groups[0].params(arithmetic);
        let end = start + groups.iter().map(|group| usize::from(group.len)).sum::<usize>();
        while start < end {
            let len = (BLOCK - start % BLOCK).min(end - start);
            blocks.push(Block { params, start, len });
            start += len;
        }
    }
    blocks
}

fn send_costs(map: &CoreMap, id: usize, core: &Core) -> Vec<SendCost> {
    let mesh = &map.chip().mesh;
    let (x, y) = mesh.tile(id as u16);
    let mut costs = vec![SendCost::default(); core.compartments()];
    for axon in &core.axons_out {
        let (to_x, to_y) = mesh.tile(axon.core.0);
        let cost = &mut costs[axon.compartment.index()];
        cost.messages += 1;
        cost.within_tile += u32::from((x, y) == (to_x, to_y));
        cost.east_west += u32::from(x.abs_diff(to_x));
        cost.north_south += u32::from(y.abs_diff(to_y));
    }
    costs
}

/// For each core, the links from every source that reaches it, in source order.
fn all_links(map: &CoreMap, source_sizes: &[usize]) -> Vec<Vec<Link>> {
    let mut links: Vec<Vec<Link>> = map.cores().iter().map(|_| Vec::new()).collect();
    let n_cores = map.cores().len();
    for (source, core) in map.cores().iter().enumerate() {
        let edges =
            core.axons_out.iter().map(|a| (a.core.index(), a.compartment.index(), a.axon.0));
        add_links(&mut links, source, source_sizes[source], edges.collect());
    }
    for (port_idx, port) in map.ports().iter().enumerate() {
        let edges = port.targets.iter().map(|t| (t.core.index(), t.line as usize, t.axon.0));
        let source = n_cores + port_idx;
        add_links(&mut links, source, source_sizes[source], edges.collect());
    }
    links
}

fn add_links(
    links: &mut [Vec<Link>],
    source: usize,
    size: usize,
    mut edges: Vec<(usize, usize, u16)>,
) {
    edges.sort_unstable();
    for edges in edges.chunk_by(|a, b| a.0 == b.0) {
        let starts = (0..=size).map(|unit| edges.partition_point(|e| e.1 < unit) as u32).collect();
        let axons = edges.iter().map(|edge| edge.2).collect();
        let target = edges[0].0;
        links[target].push(Link { source, target, starts, axons });
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
