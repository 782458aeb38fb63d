//! Synapse lists: what an input axon reaches when a spike arrives on it.
//!
//! A list is a sequence of entries; all weights of an entry share one [`SynapseFormat`]. Targets
//! are offsets: the axon adds its own base compartment, so several axons can share one stored
//! list at different places (this is how a convolution kernel is shared). Dense and sparse lists
//! are the same thing with one axon each.

mod lists;

pub use lists::SynapseLists;

use serde::{Deserialize, Serialize};

use crate::spec::{Packing, PackingRule};
use crate::weight::SynapseFormat;

/// Weights of consecutive compartments, or of chosen ones.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum SynapseForm {
    /// One weight for each compartment from `first` on; zero weights are stored and cost an
    /// operation each.
    Dense {
        /// Offset of the first target.
        first: u16,
        /// Mantissas in target order.
        mantissas: Vec<i16>,
    },
    /// A weight for each listed compartment; `targets` increase strictly.
    Sparse {
        /// Offsets of the targets.
        targets: Vec<u16>,
        /// Mantissas in the same order.
        mantissas: Vec<i16>,
    },
}

/// Synapses of one format.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SynapseEntry {
    /// Index of the format in its core.
    pub format: u8,
    /// Targets and mantissas.
    pub form: SynapseForm,
}

impl SynapseEntry {
    /// Stored synapses, zero weights of dense entries included.
    pub fn len(&self) -> usize {
        self.mantissas().len()
    }

    /// True when nothing is stored.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Mantissas in storage order.
    pub fn mantissas(&self) -> &[i16] {
        match &self.form {
            SynapseForm::Dense { mantissas, .. } | SynapseForm::Sparse { mantissas, .. } => {
                mantissas
            }
        }
    }

    /// Every synapse as (target offset, mantissa).
    pub fn synapses(&self) -> Box<dyn Iterator<Item = (usize, i16)> + '_> {
        match &self.form {
            SynapseForm::Dense { first, mantissas } => {
                Box::new((usize::from(*first)..).zip(mantissas.iter().copied()))
            }
            SynapseForm::Sparse { targets, mantissas } => {
                Box::new(targets.iter().map(|t| usize::from(*t)).zip(mantissas.iter().copied()))
            }
        }
    }

    /// One past the largest target offset; 0 for an empty entry.
    pub fn target_end(&self) -> usize {
        match &self.form {
            SynapseForm::Dense { first, mantissas } => usize::from(*first) + mantissas.len(),
            SynapseForm::Sparse { targets, .. } => {
                targets.last().map_or(0, |last| usize::from(*last) + 1)
            }
        }
    }
}

/// All synapses of one input axon.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SynapseList {
    /// Entries in storage order.
    pub entries: Vec<SynapseEntry>,
}

/// Bits of the prefix of a memory entry: 4 for the format, 6 for the number of synapses.
const ENTRY_PREFIX_BITS: u64 = 10;
const WORD_BITS: u64 = 64;

impl SynapseList {
    /// Memory words of 64 bit that the list takes.
    ///
    /// `compartments` is the size of the core's largest target range: it sets the index width.
    pub fn words(&self, formats: &[SynapseFormat], packing: &Packing, compartments: usize) -> u64 {
        let entry_bits = |entry: &SynapseEntry| {
            let bits = SynapseBits::of(entry, formats, packing, compartments);
            match packing.rule {
                PackingRule::Nxtf => bits.nxtf(entry.len() as u64),
                PackingRule::Nengo => bits.nengo(entry.len() as u64),
            }
        };
        let bits: u64 = self.entries.iter().map(entry_bits).sum();
        let words = bits.div_ceil(WORD_BITS);
        let rest = bits % WORD_BITS;
        // NxTF keeps one more word when the last one is exactly or nearly full.
        let spare = packing.rule == PackingRule::Nxtf && bits > 0 && (rest == 0 || rest >= 59);
        words + u64::from(spare)
    }
}

/// Width of the parts of an entry.
struct SynapseBits {
    per_synapse: u64,
    index: u64,
    sparse: bool,
}

impl SynapseBits {
    fn of(
        entry: &SynapseEntry,
        formats: &[SynapseFormat],
        packing: &Packing,
        compartments: usize,
    ) -> Self {
        let weight_bits = u64::from(formats[usize::from(entry.format)].weight_bits);
        Self {
            per_synapse: weight_bits + u64::from(packing.delay_bits) + u64::from(packing.tag_bits),
            index: index_bits(compartments),
            sparse: matches!(entry.form, SynapseForm::Sparse { .. }),
        }
    }

    /// NxTF `data_structures.py`: entries of at most 60; a dense one carries its first index.
    fn nxtf(&self, n: u64) -> u64 {
        let entries = n.div_ceil(60);
        let index = if self.sparse { n * self.index } else { entries * self.index };
        entries * ENTRY_PREFIX_BITS + n * self.per_synapse + index
    }

    /// nengo-loihi `block.py:527-549`: entries of at most 64, each rounded up to whole words.
    fn nengo(&self, n: u64) -> u64 {
        let per_synapse = self.per_synapse + if self.sparse { self.index } else { 0 };
        let entry = |n: u64| (n * per_synapse + ENTRY_PREFIX_BITS).next_multiple_of(WORD_BITS);
        (n / 64) * entry(64) + if !n.is_multiple_of(64) { entry(n % 64) } else { 0 }
    }
}

/// Register widths for an index: 6 to 10 bits (NxTF; nengo-loihi `SynapseConfig` has 6..=12).
fn index_bits(compartments: usize) -> u64 {
    let needed = usize::BITS - compartments.saturating_sub(1).leading_zeros();
    u64::from(needed.max(6))
}

#[cfg(test)]
#[path = "synapse_tests.rs"]
mod tests;
