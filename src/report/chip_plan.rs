//! What a compiled network takes of a chip and where it lies, as data for pictures.

use comfy_table::Table;
use hw_model::CoreMap;
use hw_model::core_map::{CoreUse, Usage};
use hw_model::spec::Mesh;
use serde::{Deserialize, Serialize};

use crate::host::Deployment;
use crate::report::tables::plain;

/// Most cores of a chip that is drawn.
const CORES_MAX: u64 = 1 << 14;

/// A network on its chip; part of what `inspect --json` prints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChipPlan {
    /// Name of the network.
    pub network: String,
    /// Quantization policy.
    pub policy: String,
    /// Name of the chip.
    pub chip: String,
    /// SHA-256 of the core map.
    pub map_digest: String,
    /// Where the cores lie.
    pub mesh: Mesh,
    /// Cores in use of those there are.
    pub cores: Usage,
    /// Use of every resource of each core in use.
    pub utilization: Vec<CoreUse>,
    /// Populations of the map.
    pub populations: Vec<PlannedLayer>,
    /// The population that has most compartments of each core in use.
    pub layer_of_core: Vec<Option<usize>>,
}

/// A population and how many cores it lies on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedLayer {
    /// Name.
    pub name: String,
    /// Neurons.
    pub neurons: u64,
    /// Cores that hold any of them.
    pub cores: u64,
}

impl ChipPlan {
    /// Plan of a compiled network.
    pub fn new(deployment: &Deployment) -> Self {
        Self::of_map(&deployment.network, &deployment.policy, &deployment.map)
    }

    /// Plan of a core map with the names of its network and quantization policy.
    pub fn of_map(network: &str, policy: &str, map: &CoreMap) -> Self {
        let layer = |population: &hw_model::core_map::Population| PlannedLayer {
            name: population.name.clone(),
            neurons: population.len() as u64,
            cores: population.cores().len() as u64,
        };
        Self {
            network: network.to_owned(),
            policy: policy.to_owned(),
            chip: map.chip().name.clone(),
            map_digest: map.digest(),
            mesh: map.chip().mesh.clone(),
            cores: map.core_usage(),
            utilization: map.utilization(),
            populations: map.populations().iter().map(layer).collect(),
            layer_of_core: layer_of_core(map),
        }
    }

    /// Errs with what is wrong when it came from a file and cannot be drawn.
    pub fn check(&self) -> Result<(), String> {
        let Mesh { tiles_x, tiles_y, cores_per_tile } = self.mesh;
        let places = u64::from(tiles_x) * u64::from(tiles_y) * u64::from(cores_per_tile);
        let (used, limit) = (self.utilization.len() as u64, self.cores.limit);
        if limit > places.min(CORES_MAX) || used > limit {
            return Err(format!(
                "{used} cores in use of {limit}, on a mesh of {places}; at most {CORES_MAX}"
            ));
        }
        let populations = self.populations.len();
        let layers = self.layer_of_core.iter().flatten();
        if self.layer_of_core.len() as u64 != used || layers.max() >= Some(&populations) {
            return Err(format!(
                "layers of {} cores, {used} expected, numbered below {populations}",
                self.layer_of_core.len()
            ));
        }
        Ok(())
    }
}

/// What every layer takes: sums over the cores that are mostly its own.
pub fn layer_table(plan: &ChipPlan) -> Table {
    let mut table =
        plain(&["layer", "neurons", "cores", "compartments", "synapses", "synapse words", "of"]);
    for (index, layer) in plan.populations.iter().enumerate() {
        let own = plan.utilization.iter().zip(&plan.layer_of_core);
        let own: Vec<&CoreUse> =
            own.filter(|(_, of)| **of == Some(index)).map(|(core, _)| core).collect();
        let sum = |of: fn(&CoreUse) -> u64| {
            own.iter().fold(0u64, |sum, core| sum.saturating_add(of(core))).to_string()
        };
        table.add_row([
            layer.name.clone(),
            layer.neurons.to_string(),
            layer.cores.to_string(),
            sum(|core| core.compartments.used),
            sum(|core| core.synapses),
            sum(|core| core.synapse_words.used),
            sum(|core| core.synapse_words.limit),
        ]);
    }
    table
}

/// The population that has most compartments of each core.
pub(super) fn layer_of_core(map: &CoreMap) -> Vec<Option<usize>> {
    let mut most = vec![(0, None); map.cores().len()];
    for (index, population) in map.populations().iter().enumerate() {
        let mut of_core = vec![0u32; map.cores().len()];
        population.slices.iter().for_each(|s| of_core[s.core.index()] += u32::from(s.len));
        for (most, count) in most.iter_mut().zip(of_core) {
            if count > most.0 {
                *most = (count, Some(index));
            }
        }
    }
    most.into_iter().map(|(_, layer)| layer).collect()
}
