//! Broken chips: every trial flies on one of its own, whose faults are drawn from the trial's
//! streams. So trials stay independent of each other, and a success rate is that of chips with such
//! damage, not of one that was lucky.

use hw_model::faults::{FaultError, check_rate, with_dead_synapses};
use hw_model::id::CoreId;
use hw_model::{CoreMap, Faults};
use thiserror::Error;

use crate::rng::{Streams, stream};

/// How much of a chip is broken. With equal streams, more damage of a kind holds all of the lesser:
/// the same synapses and cores are dead, and others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Damage {
    /// Share of spike messages that are lost, the host's included.
    pub messages_lost_per_million: u32,
    /// Share of stored weights that are stuck at zero.
    pub dead_synapses_per_million: u32,
    /// Number of cores that do nothing, of those in use.
    pub dead_cores: u32,
}

/// Damage that a driver cannot have.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DamageError {
    /// A rate above one.
    #[error(transparent)]
    Rate(#[from] FaultError),
    /// More dead cores than there are.
    #[error("{dead} dead cores, but {used} in use; take fewer")]
    Cores {
        /// Dead cores asked for.
        dead: u32,
        /// Cores in use.
        used: usize,
    },
    /// Not a compiled network on the event engine.
    #[error("{driver}: only a compiled network on the event engine can be damaged")]
    NoChip {
        /// Label of the driver.
        driver: String,
    },
}

impl Damage {
    pub(super) fn check(&self, map: &CoreMap) -> Result<(), DamageError> {
        check_rate("messages lost", self.messages_lost_per_million)?;
        check_rate("dead synapses", self.dead_synapses_per_million)?;
        let (dead, used) = (self.dead_cores, map.cores().len());
        if dead as usize > used { Err(DamageError::Cores { dead, used }) } else { Ok(()) }
    }

    /// The map of one trial's chip; `None` when no synapse is dead.
    pub(super) fn map(&self, map: &CoreMap, streams: &Streams) -> Option<CoreMap> {
        let seed = || streams.at(stream::FAULTS_SYNAPSES, 0).bits();
        let per_million = self.dead_synapses_per_million;
        let broken = || with_dead_synapses(map, seed(), per_million).expect("the rate was checked");
        (per_million > 0).then(broken)
    }

    /// What else is broken of one trial's chip, of which `cores` are in use.
    pub(super) fn faults(&self, cores: usize, streams: &Streams) -> Faults {
        let seed = streams.at(stream::FAULTS_MESSAGES, 0).bits();
        let mut order: Vec<CoreId> = (0..cores as u16).map(CoreId).collect();
        let mut draw = streams.at(stream::FAULTS_CORES, 0);
        for at in 0..self.dead_cores as usize {
            order.swap(at, at + draw.below((cores - at) as u64) as usize);
        }
        order.truncate(self.dead_cores as usize);
        Faults::new(seed, self.messages_lost_per_million, order).expect("the rate was checked")
    }
}

#[cfg(test)]
#[path = "damage_tests.rs"]
mod tests;
