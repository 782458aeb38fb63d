//! A program for the chip: what lies on which core and who talks to whom.
//!
//! [`CoreMapParts`] is plain data that anyone can fill; [`CoreMap`] is parts that have passed
//! every check of [`CoreMap::new`]. There is no other way to get one, so a `CoreMap` in hand is
//! always within the limits of its chip.

use serde::{Deserialize, Serialize};

use crate::compartment::CompartmentParams;
use crate::container;
use crate::error::MapError;
use crate::id::{AxonIdx, CompartmentIdx, CoreId};
use crate::spec::{Arithmetic, ChipSpec};
use crate::synapse::{SynapseList, SynapseLists};
use crate::weight::SynapseFormat;

mod check;
pub mod packed;
mod text;
mod utilization;

pub(crate) use text::MapReader;

pub use utilization::{CoreUse, Usage};

/// Everything that makes up a core map, unchecked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoreMapParts {
    /// The chip that the map is for.
    pub chip: ChipSpec,
    /// Cores in use; a core's position is its [`CoreId`].
    pub cores: Vec<Core>,
    /// Named sets of compartments.
    pub populations: Vec<Population>,
    /// Named inputs from the host.
    pub ports: Vec<HostPort>,
}

/// Contents of one core.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Core {
    /// What lies here, for people.
    pub label: String,
    /// Compartments by equal parameters, in order.
    pub groups: Vec<CompartmentGroup>,
    /// Synapse formats in use.
    pub formats: Vec<SynapseFormat>,
    /// Stored synapse lists.
    pub lists: SynapseLists,
    /// Input axons; a position is an [`AxonIdx`].
    pub axons_in: Vec<AxonIn>,
    /// Output axons, sorted by compartment, then target.
    pub axons_out: Vec<AxonOut>,
}

/// Consecutive compartments with the same parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct CompartmentGroup {
    /// Number of compartments.
    pub len: u16,
    /// Effective decay of the current per 4096 (register and offset bit together).
    pub decay_current: u16,
    /// Effective decay of the voltage per 4096.
    pub decay_voltage: u16,
    /// Threshold in units of 64.
    pub threshold_mantissa: u32,
    /// Added to the voltage each step: `mantissa << exponent` chip units.
    pub bias_mantissa: i16,
    /// See `bias_mantissa`.
    pub bias_exponent: u8,
    /// `R`: a spike is followed by `R - 1` steps with the voltage held at 0.
    pub refractory_steps: u8,
}

impl CompartmentGroup {
    /// Parameters as the chip executes them.
    pub fn params(&self, arithmetic: &Arithmetic) -> CompartmentParams {
        CompartmentParams::new(
            self.decay_current,
            self.decay_voltage,
            (self.threshold_mantissa << arithmetic.threshold_shift) as i32,
            i32::from(self.bias_mantissa) << self.bias_exponent,
            self.refractory_steps,
        )
    }
}

/// An input axon: a stored list, shifted by a base compartment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxonIn {
    /// Index of the list in its core.
    pub list: u32,
    /// Added to every target offset of the list.
    pub base: u16,
}

/// An output axon: spikes of `compartment` go to `axon` of `core`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct AxonOut {
    /// The sender.
    pub compartment: CompartmentIdx,
    /// Target core.
    pub core: CoreId,
    /// Input axon there.
    pub axon: AxonIdx,
}

/// A named set of compartments, in neuron order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Population {
    /// Name.
    pub name: String,
    /// Where the neurons lie; neuron numbers run through the slices in order.
    pub slices: Vec<Slice>,
}

impl Population {
    /// Number of neurons.
    pub fn len(&self) -> usize {
        self.slices.iter().map(|slice| usize::from(slice.len)).sum()
    }

    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cores that it lies on, sorted.
    pub fn cores(&self) -> Vec<CoreId> {
        let mut cores: Vec<CoreId> = self.slices.iter().map(|slice| slice.core).collect();
        cores.sort_unstable();
        cores.dedup();
        cores
    }

    /// Number of the neuron that lies on `compartment` of `core`; `None` where none of this
    /// population does.
    pub fn neuron_at(&self, core: CoreId, compartment: CompartmentIdx) -> Option<usize> {
        let mut first_neuron = 0;
        for slice in &self.slices {
            let first = slice.first.index();
            let range = first..first + usize::from(slice.len);
            if slice.core == core && range.contains(&compartment.index()) {
                return Some(first_neuron + compartment.index() - first);
            }
            first_neuron += usize::from(slice.len);
        }
        None
    }
}

/// Consecutive compartments of one core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slice {
    /// The core.
    pub core: CoreId,
    /// First compartment.
    pub first: CompartmentIdx,
    /// Number of compartments.
    pub len: u16,
}

/// A named input: the host can make each of its lines spike in any step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostPort {
    /// Name.
    pub name: String,
    /// Number of lines.
    pub lines: u32,
    /// Targets, sorted by line, then target.
    pub targets: Vec<PortTarget>,
}

/// Spikes of `line` go to `axon` of `core`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PortTarget {
    /// Line of the port.
    pub line: u32,
    /// Target core.
    pub core: CoreId,
    /// Input axon there.
    pub axon: AxonIdx,
}

impl Core {
    /// Number of compartments.
    pub fn compartments(&self) -> usize {
        self.groups.iter().map(|group| usize::from(group.len)).sum()
    }

    /// Synapses of all input axons; those of a list count at each axon that uses it.
    pub fn synapses(&self) -> u64 {
        let len = |list: &SynapseList| list.entries.iter().map(|e| e.len() as u64).sum::<u64>();
        let lens: Vec<u64> = self.lists.iter().map(len).collect();
        self.axons_in.iter().map(|axon| lens[axon.list as usize]).sum()
    }

    /// Parameters of each compartment in order.
    pub fn params(&self, arithmetic: &Arithmetic) -> Vec<CompartmentParams> {
        self.groups
            .iter()
            .flat_map(|group| std::iter::repeat_n(group.params(arithmetic), usize::from(group.len)))
            .collect()
    }
}

/// A checked core map.
#[derive(Debug, Clone, PartialEq)]
pub struct CoreMap {
    parts: CoreMapParts,
}

impl CoreMap {
    /// Checks `parts` against the limits and registers of their chip.
    ///
    /// Errors: the first thing that does not fit or does not hang together.
    pub fn new(parts: CoreMapParts) -> Result<Self, MapError> {
        check::check(&parts)?;
        Ok(Self { parts })
    }

    /// The chip that the map is for.
    pub fn chip(&self) -> &ChipSpec {
        &self.parts.chip
    }

    /// Cores in use.
    pub fn cores(&self) -> &[Core] {
        &self.parts.cores
    }

    /// Named sets of compartments.
    pub fn populations(&self) -> &[Population] {
        &self.parts.populations
    }

    /// Inputs from the host.
    pub fn ports(&self) -> &[HostPort] {
        &self.parts.ports
    }

    /// Index of the population called `name`.
    pub fn population(&self, name: &str) -> Option<usize> {
        self.parts.populations.iter().position(|population| population.name == name)
    }

    /// Index of the port called `name`.
    pub fn port(&self, name: &str) -> Option<usize> {
        self.parts.ports.iter().position(|port| port.name == name)
    }

    /// The plain data.
    pub fn parts(&self) -> &CoreMapParts {
        &self.parts
    }

    /// SHA-256 of the whole map: two maps with one digest behave the same.
    pub fn digest(&self) -> String {
        container::digest(&self.parts)
    }

    /// Number of tiles between the first and the last core in use.
    pub fn tiles_in_use(&self) -> u32 {
        self.parts.chip.mesh.tiles_of(self.parts.cores.len())
    }
}
