//! How many cores each layer gets where there are more than the fewest.
//!
//! A step of the chip lasts as long as its slowest core. So further cores go to the layer whose cores
//! have the most to do of those that work at the same time, by what it did in a run before: its synaptic operations and updates, which its
//! cores share, the spikes that it gets, which reach each of its cores, and the messages that it
//! sends, one to each core that its spikes go to.

use hw_model::cost::CostTable;
use hw_model::{ChipSpec, OpCounts};

use crate::compile::graph::{IntegerGraph, Mantissas, Source};

/// How the layers of a network are split over cores.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Split {
    /// Over as few cores as can be.
    #[default]
    Fewest,
    /// With at most so many neurons of a layer on a core (SAN's published mapping has 128).
    NeuronsPerCore(usize),
    /// Over so many cores, or a few less, shared out so that the busiest core has the least to do.
    Cores(usize),
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
            let (phase, work) = (work.phase, &work.counts);
            let mut onto = graph.projections.iter().filter(|p| p.target == population);
            // A core of a picture gets the inputs of its tile, one of another layer all of them.
            let is_picture = onto.any(|p| matches!(p.mantissas, Mantissas::Conv(..)));
            let own = OpCounts { axon_deliveries: 0, messages: 0, ..*work };
            let arrived =
                price(&OpCounts { axon_deliveries: work.axon_deliveries, ..OpCounts::default() });
            let sent = OpCounts { messages: work.updates_spiking, ..OpCounts::default() };
            let from = Source::Population(population);
            let from = graph.projections.iter().filter(|p| p.sources.contains(&from));
            let mut targets: Vec<usize> = from.map(|projection| projection.target).collect();
            targets.sort_unstable();
            targets.dedup();
            let operations = work.synaptic_ops() + work.compartment_updates();
            let own = if price(&own) > 0 { price(&own) } else { operations };
            let (shared, each) = match is_picture {
                true => (own + arrived, 0),
                false => (own, arrived / (*cores).max(1) as u64),
            };
            let neurons = graph.populations[population].neurons as u64;
            Self { neurons, phase, shared, each, per_target: price(&sent), targets }
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

/// The largest number of neurons on a core of each layer, so that the layers have at most `budget`
/// cores together, given the ways to cut each (the first has the fewest cores, as by [`useful`]).
///
/// In each phase the layer whose fullest core has the most to do, the first of several, is the one to
/// get cores. Of these layers one after the other is cut in its next way: that which becomes faster by
/// the most per core. It ends where they take more cores than are left, or have no other way.
pub(super) fn share_out(loads: &[Load], cuts: &[Vec<Cut>], budget: usize) -> Vec<usize> {
    let mut chosen = vec![0; loads.len()];
    let mut cores: Vec<usize> = cuts.iter().map(|cuts| cuts[0].cores).collect();
    let mut phases: Vec<usize> = loads.iter().map(|load| load.phase).collect();
    phases.sort_unstable();
    phases.dedup();
    loop {
        let left = budget.saturating_sub(cores.iter().sum());
        let busy = |layer: usize, cut: usize| loads[layer].busy(cuts[layer][cut].most, &cores);
        let busiest = |phase: &usize| {
            let layers = (0..loads.len()).rev().filter(|layer| loads[*layer].phase == *phase);
            layers.max_by_key(|layer| busy(*layer, chosen[*layer]))
        };
        let step = |layer: usize| {
            let next = cuts[layer].get(chosen[layer] + 1)?;
            let more = next.cores - cores[layer];
            let faster = busy(layer, chosen[layer]) - busy(layer, chosen[layer] + 1);
            (more <= left).then_some(Step { layer, faster, more })
        };
        let steps = phases.iter().filter_map(busiest).filter_map(step);
        let best = steps.reduce(|a, b| if b.is_better(&a) { b } else { a });
        let Some(Step { layer, more, .. }) = best else { break };
        cores[layer] += more;
        chosen[layer] += 1;
    }
    chosen.iter().zip(cuts).map(|(chosen, cuts)| cuts[*chosen].most).collect()
}

/// The next way to cut a layer.
struct Step {
    layer: usize,
    /// What its fullest core has less to do.
    faster: u64,
    /// The cores that this takes.
    more: usize,
}

impl Step {
    /// Whether it gains more per core.
    fn is_better(&self, other: &Self) -> bool {
        let gain = |a: &Self, b: &Self| u128::from(a.faster) * b.more as u128;
        gain(self, other) > gain(other, self)
    }
}

#[cfg(test)]
#[path = "split_tests.rs"]
mod tests;
