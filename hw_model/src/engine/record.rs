//! Spikes that a run keeps.

use crate::core_map::CoreMap;
use crate::id::{CompartmentIdx, CoreId};

/// One spike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Spike {
    /// Step in which it was made.
    pub step: u64,
    /// Core of the compartment.
    pub core: CoreId,
    /// The compartment.
    pub compartment: CompartmentIdx,
}

/// Spikes of chosen cores, sorted by (step, core, compartment) after each run.
#[derive(Debug, Clone, Default)]
pub struct SpikeRecord {
    recorded: Vec<bool>,
    /// The spikes.
    pub spikes: Vec<Spike>,
}

/// Spikes of one population as (step, neuron), sorted.
pub type PopulationSpikes = Vec<(u64, u32)>;

impl SpikeRecord {
    /// Records nothing.
    pub fn none() -> Self {
        Self::default()
    }

    /// Records every core of `map`.
    pub fn all(map: &CoreMap) -> Self {
        Self { recorded: vec![true; map.cores().len()], spikes: Vec::new() }
    }

    /// Records the cores on which population number `population` lies.
    pub fn of_population(map: &CoreMap, population: usize) -> Self {
        let mut recorded = vec![false; map.cores().len()];
        for slice in &map.populations()[population].slices {
            recorded[slice.core.index()] = true;
        }
        Self { recorded, spikes: Vec::new() }
    }

    /// Whether spikes of `core` are kept.
    pub fn wants(&self, core: CoreId) -> bool {
        self.recorded.get(core.index()).copied().unwrap_or(false)
    }

    /// The recorded spikes sorted into the populations of `map`.
    pub fn by_population(&self, map: &CoreMap) -> Vec<PopulationSpikes> {
        let sites = neuron_sites(map);
        let mut populations = vec![Vec::new(); map.populations().len()];
        for spike in &self.spikes {
            if let Some((population, neuron)) = sites[spike.core.index()][spike.compartment.index()]
            {
                populations[population].push((spike.step, neuron));
            }
        }
        populations.iter_mut().for_each(|spikes: &mut PopulationSpikes| spikes.sort_unstable());
        populations
    }
}

/// For each core and compartment: population and neuron number, if it belongs to one.
fn neuron_sites(map: &CoreMap) -> Vec<Vec<Option<(usize, u32)>>> {
    let mut sites: Vec<Vec<_>> =
        map.cores().iter().map(|core| vec![None; core.compartments()]).collect();
    for (index, population) in map.populations().iter().enumerate() {
        let mut neuron = 0;
        for slice in &population.slices {
            for offset in 0..usize::from(slice.len) {
                sites[slice.core.index()][slice.first.index() + offset] = Some((index, neuron));
                neuron += 1;
            }
        }
    }
    sites
}
