//! How many cores each layer gets where there are more than the fewest.
//!
//! A step of the chip lasts as long as its slowest core. So cores are shared out so that the busiest of
//! those that work at the same time has the least to do, by what it did in a run before: its synaptic operations and updates, which its
//! cores share, the spikes that it gets, which reach each of its cores, and the messages that it
//! sends, one to each core that its spikes go to. The barrier at the end of a step lasts longer for more
//! tiles, so that not all cores that are there need be worth it.

use hw_model::cost::CostTable;
use hw_model::{ChipSpec, OpCounts};

use crate::compile::graph::{IntegerGraph, Source};

/// How the layers of a network are split over cores.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Split {
    /// Over as few cores as can be.
    #[default]
    Fewest,
    /// With at most so many neurons of a layer on a core (SAN's published mapping has 128).
    NeuronsPerCore(usize),
    /// Over at most so many cores, as many as make steps shorter, shared out so that the busiest core has
    /// the least to do.
    Cores(usize),
}

impl Split {
    /// What is asked for by a number of cores, or else by a largest number of neurons of a layer on a core.
    pub fn asked(cores: Option<usize>, neurons_per_core: Option<usize>) -> Self {
        let split = cores.map(Self::Cores).or(neurons_per_core.map(Self::NeuronsPerCore));
        split.unwrap_or_default()
    }
}

/// What a network did in a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Work {
    /// Layer by layer.
    pub layers: Vec<LayerWork>,
    /// Steps of the run, each with a barrier.
    pub steps: u64,
}

/// What a layer did in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayerWork {
    /// Sum over its cores.
    pub counts: OpCounts,
    /// Number of the phase that it works in: layers of other phases are held meanwhile.
    pub phase: usize,
}

/// What a layer did in a run, in picoseconds: the sum of what the chip's cost tables say, which are
/// several opinions of one chip; without any, in operations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Load {
    neurons: u64,
    phase: usize,
    /// Of the whole layer: it is shared by its cores.
    shared: u64,
    /// Of each of its cores, however many there are.
    each: u64,
    /// Of the whole layer, for each core that its spikes go to.
    per_target: u64,
    /// Layers that its spikes go to.
    targets: Vec<usize>,
}

impl Load {
    /// Loads of a graph's layers, given what each did when it lay on so many `cores`.
    pub(super) fn measured(
        graph: &IntegerGraph,
        chip: &ChipSpec,
        work: &[LayerWork],
        cores: &[usize],
    ) -> Vec<Self> {
        let price = |counts: &OpCounts| {
            let of_table = |table: &CostTable| table.core_time_ps(counts);
            chip.cost_tables.iter().map(of_table).sum::<u64>()
        };
        let load = |(population, (work, cores)): (usize, (&LayerWork, &usize))| {
            let LayerWork { counts, phase } = *work;
            let none = OpCounts::default();
            let arrived = price(&OpCounts { axon_deliveries: counts.axon_deliveries, ..none });
            let sent = price(&OpCounts { messages: counts.updates_spiking, ..none });
            let own = match price(&OpCounts { axon_deliveries: 0, messages: 0, ..counts }) {
                0 => counts.synaptic_ops() + counts.compartment_updates(),
                priced => priced,
            };
            // A core of a picture gets the inputs of its tile, one of another layer all of them.
            let (shared, each) = match graph.is_picture(population) {
                true => (own + arrived, 0),
                false => (own, arrived / (*cores).max(1) as u64),
            };
            let from = Source::Population(population);
            let from = graph.projections.iter().filter(|p| p.sources.contains(&from));
            let mut targets: Vec<usize> = from.map(|projection| projection.target).collect();
            targets.sort_unstable();
            targets.dedup();
            let neurons = graph.populations[population].neurons as u64;
            Self { neurons, phase, shared, each, per_target: sent, targets }
        };
        work.iter().zip(cores).enumerate().map(load).collect()
    }

    /// What its fullest core does in a step, with `most` neurons on it, when layers have so many
    /// `cores`.
    fn busy(&self, most: usize, cores: &[usize]) -> u64 {
        let onto: usize = self.targets.iter().map(|target| cores[*target]).sum();
        let whole = self.shared + self.per_target * onto as u64;
        self.each + whole * most as u64 / self.neurons.max(1)
    }
}

/// What the barriers of so many steps take on so many cores, in picoseconds: the sum of what the chip's
/// cost tables say, as in [`Load`].
pub(super) fn barriers_ps(chip: &ChipSpec, steps: u64, cores: usize) -> u64 {
    let tiles = chip.mesh.tiles_of(cores);
    let of_step = chip.cost_tables.iter().map(|table| table.barrier_ps(tiles)).sum::<u64>();
    steps.saturating_mul(of_step)
}

/// A way to cut a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cut {
    /// Neurons on its fullest core.
    pub(super) most: usize,
    /// Its cores.
    pub(super) cores: usize,
}

/// Of some ways to cut a layer, fewest cores first, those that leave less on the fullest core than all
/// before them.
pub(super) fn useful(cuts: impl Iterator<Item = Cut>) -> Vec<Cut> {
    let mut useful: Vec<Cut> = Vec::new();
    for cut in cuts {
        if useful.last().is_none_or(|last| cut.most < last.most) {
            useful.push(cut);
        }
    }
    useful
}

/// Times that layers are shared out anew, as what a layer sends depends on the cores of others.
const ROUNDS: usize = 4;

/// The largest number of neurons on a core of each layer, so that the layers have at most `budget`
/// cores together, given the ways to cut each (the first has the fewest cores, as by [`useful`]).
///
/// What the fullest cores of the busiest layers, one of each phase, have to do together, and what
/// `barriers` says of the number of cores, is the least that there is with so many, for what layers send
/// in the round before; of several such ways the one with the fewest cores.
pub(super) fn share_out(
    loads: &[Load],
    cuts: &[Vec<Cut>],
    budget: usize,
    barriers: &dyn Fn(usize) -> u64,
) -> Vec<usize> {
    let mut phases: Vec<usize> = loads.iter().map(|load| load.phase).collect();
    phases.sort_unstable();
    phases.dedup();
    let mut chosen: Vec<Cut> = cuts.iter().map(|cuts| cuts[0]).collect();
    for _ in 0..ROUNDS {
        let cores: Vec<usize> = chosen.iter().map(|cut| cut.cores).collect();
        let layers = loads.iter().zip(cuts).map(|(load, cuts)| {
            let busy = |cut: &Cut| (load.busy(cut.most, &cores), *cut);
            Layer { phase: load.phase, cuts: cuts.iter().map(busy).collect() }
        });
        let layers: Vec<Layer> = layers.collect();
        let Some(limits) = least(&layers, &phases, budget, barriers) else { break };
        let within = |layer: &Layer| {
            let phase = phases.iter().position(|phase| *phase == layer.phase);
            layer.within(limits[phase.expect("its phase is there")])
        };
        let found: Option<Vec<Cut>> = layers.iter().map(within).collect();
        chosen = found.expect("the limits are those of cuts");
    }
    chosen.iter().map(|cut| cut.most).collect()
}

/// What the fullest core of a layer has to do, cut by cut: less and less.
struct Layer {
    phase: usize,
    cuts: Vec<(u64, Cut)>,
}

impl Layer {
    /// The first cut with which no core has more than `limit` to do.
    fn within(&self, limit: u64) -> Option<Cut> {
        let at = self.cuts.partition_point(|(busy, _)| *busy > limit);
        self.cuts.get(at).map(|(_, cut)| *cut)
    }
}

/// Cores, what the busiest cores of all phases so far have to do together, and each of them.
type Plan = (usize, u64, Vec<u64>);

/// The busiest core of each phase in the best plan with at most `budget` cores; `None` where there is
/// none.
fn least(
    layers: &[Layer],
    phases: &[usize],
    budget: usize,
    barriers: &dyn Fn(usize) -> u64,
) -> Option<Vec<u64>> {
    let mut plans: Vec<Plan> = vec![(0, 0, Vec::new())];
    for phase in phases {
        let layers = || layers.iter().filter(|layer| layer.phase == *phase);
        let mut limits: Vec<u64> = layers().flat_map(|l| &l.cuts).map(|(busy, _)| *busy).collect();
        limits.sort_unstable();
        limits.dedup();
        let cores = |limit: &u64| {
            let cuts = layers().map(|layer| layer.within(*limit));
            cuts.map(|cut| cut.map(|cut| cut.cores)).sum::<Option<usize>>()
        };
        let steps: Vec<(usize, u64)> =
            limits.iter().filter_map(|limit| Some((cores(limit)?, *limit))).collect();
        let mut all: Vec<Plan> = Vec::new();
        for (before, sum, limits) in &plans {
            for (cores, limit) in steps.iter().filter(|(cores, _)| before + cores <= budget) {
                let limits = limits.iter().copied().chain([*limit]).collect();
                all.push((before + cores, sum + limit, limits));
            }
        }
        // Fewest cores first, and more of them only for less to do.
        all.sort_unstable();
        plans = Vec::new();
        for plan in all {
            if plans.last().is_none_or(|last: &Plan| plan.1 < last.1) {
                plans.push(plan);
            }
        }
    }
    let best = plans.into_iter().min_by_key(|(cores, sum, _)| sum.saturating_add(barriers(*cores)));
    best.map(|(_, _, limits)| limits)
}

#[cfg(test)]
#[path = "split_tests.rs"]
mod tests;
