//! What is broken on an emulated chip: spike messages that get lost, cores that do nothing,
//! weights that are stuck at zero.
//!
//! Every draw is a hash of a seed and of what it is about (step, sender, target; or core, list,
//! entry, synapse). So it depends neither on the engine nor on threads, nor on what else is drawn,
//! and a synapse that is dead at one rate is dead at every higher one.

use thiserror::Error;

use crate::core_map::CoreMap;
use crate::id::CoreId;
use crate::synapse::SynapseForm;

/// A share of one, in the unit of all fault rates.
pub const MILLION: u32 = 1_000_000;

/// Faults that a chip has while it runs. Set them with [`crate::Engine::set_faults`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Faults {
    seed: u64,
    messages_lost_per_million: u32,
    /// Sorted.
    dead_cores: Vec<CoreId>,
}

/// A rate that is none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("faults: {what} = {value} per million, must be 0..=1000000; give a share of one")]
pub struct FaultError {
    /// The rate.
    pub what: &'static str,
    /// Its value.
    pub value: u32,
}

impl Faults {
    /// A chip that loses `messages_lost_per_million` of its spike messages, those of the host
    /// included, and on which `dead_cores` do nothing.
    ///
    /// A lost message was sent, and is counted as [`crate::OpCounts::messages_lost`] where it would
    /// have arrived; nothing else happens there. A dead core updates nothing, sends nothing and
    /// ignores what arrives; its state stays 0.
    ///
    /// Errors: a rate above one.
    pub fn new(
        seed: u64,
        messages_lost_per_million: u32,
        dead_cores: impl IntoIterator<Item = CoreId>,
    ) -> Result<Self, FaultError> {
        check_rate("messages lost", messages_lost_per_million)?;
        let mut dead_cores: Vec<CoreId> = dead_cores.into_iter().collect();
        dead_cores.sort_unstable();
        dead_cores.dedup();
        Ok(Self { seed, messages_lost_per_million, dead_cores })
    }

    /// Cores that do nothing, in order, each once.
    pub fn dead_cores(&self) -> &[CoreId] {
        &self.dead_cores
    }

    pub(crate) fn is_dead(&self, core: usize) -> bool {
        self.dead_cores.iter().any(|dead| dead.index() == core)
    }

    /// What happens to messages sent in `step`; `None` when none is ever lost.
    pub(crate) fn loss(&self, step: u64) -> Option<Loss> {
        let per_million = self.messages_lost_per_million;
        let draw = || Loss { key: hashed(hashed(self.seed, MESSAGES), step), per_million };
        (per_million > 0).then(draw)
    }
}

/// Decides which messages of one step are lost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loss {
    key: u64,
    per_million: u32,
}

impl Loss {
    /// Whether the message of unit `unit` of `source` (cores, then ports) to `axon` of `core` is
    /// lost.
    pub(crate) fn takes(&self, source: usize, unit: usize, core: usize, axon: u16) -> bool {
        let from = hashed(self.key, (source as u64) << 32 | unit as u64);
        happens(hashed(from, (core as u64) << 16 | u64::from(axon)), self.per_million)
    }
}

/// `map` with `per_million` of all stored weights stuck at zero, drawn from `seed`. They keep their
/// memory and their operations. A kernel that axons share is stored once, so it loses a weight for
/// all of them.
///
/// Errors: a rate above one.
pub fn with_dead_synapses(
    map: &CoreMap,
    seed: u64,
    per_million: u32,
) -> Result<CoreMap, FaultError> {
    check_rate("dead synapses", per_million)?;
    let mut parts = map.parts().clone();
    let key = hashed(seed, SYNAPSES);
    for (core, about) in parts.cores.iter_mut().enumerate() {
        let of_core = hashed(key, core as u64);
        for (list, stored) in about.lists.iter_mut().enumerate() {
            for (entry, stored) in stored.entries.iter_mut().enumerate() {
                let of_entry = hashed(of_core, (list as u64) << 32 | entry as u64);
                let (SynapseForm::Dense { mantissas, .. } | SynapseForm::Sparse { mantissas, .. }) =
                    &mut stored.form;
                for (index, mantissa) in mantissas.iter_mut().enumerate() {
                    if happens(hashed(of_entry, index as u64), per_million) {
                        *mantissa = 0;
                    }
                }
            }
        }
    }
    Ok(CoreMap::new(parts).expect("every format holds a zero"))
}

/// Errs when `value` of `what` per million is above one.
pub fn check_rate(what: &'static str, value: u32) -> Result<(), FaultError> {
    if value > MILLION { Err(FaultError { what, value }) } else { Ok(()) }
}

/// What draws are for, so that they have nothing in common.
const MESSAGES: u64 = 1;
const SYNAPSES: u64 = 2;

/// Increment and finalizer of SplitMix64 (Steele, Lea and Flood 2014, "Fast splittable
/// pseudorandom number generators").
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// A key that has nothing to do with those of other `part`s.
fn hashed(key: u64, part: u64) -> u64 {
    mixed((key ^ part).wrapping_add(GAMMA))
}

fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Whether something of this rate happens, by the upper half of `draw`.
fn happens(draw: u64, per_million: u32) -> bool {
    ((draw >> 32) * u64::from(MILLION)) >> 32 < u64::from(per_million)
}

#[cfg(test)]
#[path = "faults_tests.rs"]
mod tests;
