//! How much of every resource a map takes, as used / limit.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{Core, CoreMap};
use crate::spec::ChipSpec;

/// One resource of one core (or of the chip).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Usage {
    /// What is taken.
    pub used: u64,
    /// What there is.
    pub limit: u64,
}

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.used, self.limit)
    }
}

/// Everything that one core takes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoreUse {
    /// Core number.
    pub core: u16,
    /// What lies there.
    pub label: String,
    /// Compartments.
    pub compartments: Usage,
    /// Input axons.
    pub input_axons: Usage,
    /// Output axons.
    pub output_axons: Usage,
    /// Synapse memory in 64-bit words, by the chip's packing rule.
    pub synapse_words: Usage,
    /// Synapse formats.
    pub synapse_formats: Usage,
    /// Stored synapses.
    pub synapses: u64,
}

/// Memory words that the lists of a core take.
pub(super) fn synapse_words(chip: &ChipSpec, core: &Core) -> u64 {
    let compartments = core.compartments();
    core.lists.iter().map(|list| list.words(&core.formats, &chip.packing, compartments)).sum()
}

/// Stored synapses of a core.
fn synapses(core: &Core) -> u64 {
    core.lists.iter().flat_map(|list| &list.entries).map(|entry| entry.len() as u64).sum()
}

impl CoreMap {
    /// Cores in use of those there are.
    pub fn core_usage(&self) -> Usage {
        Usage { used: self.cores().len() as u64, limit: self.chip().limits.cores.into() }
    }

    /// Use of every resource, core by core.
    pub fn utilization(&self) -> Vec<CoreUse> {
        let limits = &self.chip().limits;
        let usage = |used: usize, limit: u32| Usage { used: used as u64, limit: limit.into() };
        let of_core = |(index, core): (usize, &Core)| CoreUse {
            core: index as u16,
            label: core.label.clone(),
            compartments: usage(core.compartments(), limits.compartments_per_core),
            input_axons: usage(core.axons_in.len(), limits.input_axons_per_core),
            output_axons: usage(core.axons_out.len(), limits.output_axons_per_core),
            synapse_words: Usage {
                used: synapse_words(self.chip(), core),
                limit: limits.synapse_words_per_core.into(),
            },
            synapse_formats: usage(core.formats.len(), limits.synapse_formats_per_core),
            synapses: synapses(core),
        };
        self.cores().iter().enumerate().map(of_core).collect()
    }
}
