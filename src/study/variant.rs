//! One chip, and how a network is put on it.

use hw_model::{ChipError, ChipSpec};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::compile::policy::WEIGHT_BITS_MAX;
use crate::compile::{CompileError, Policy, Split};
use crate::evaluate::{Damage, DamageError, Driver, EngineKind};
use crate::host::{Deployment, Schedule};
use crate::net::Controller;

/// Bits of current and voltage on Loihi, sign included.
const STATE_BITS: u8 = 24;

/// Loihi 1 but for what is named here. [`Variant::default`] is what `compile` makes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// Quantization policy.
    pub policy: String,
    /// Bits of a stored weight.
    pub weight_bits: u8,
    /// Bits of the current, sign included.
    pub current_bits: u8,
    /// Bits of the voltage, sign included.
    pub voltage_bits: u8,
    /// Share of spike messages that are lost.
    pub messages_lost_per_million: u32,
    /// Share of stored weights that are stuck at zero.
    pub dead_synapses_per_million: u32,
    /// Cores in use that do nothing.
    pub dead_cores: u32,
    /// Most neurons of one layer on a core, in place of as many as fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neurons_per_core: Option<usize>,
    /// Cores to share the layers out over, in place of as few as can be. Not beside
    /// `neurons_per_core`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cores: Option<usize>,
}

/// A variant that cannot fly.
#[derive(Debug, Error)]
pub enum VariantError {
    /// No such chip.
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// The network does not go onto it.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// It cannot be broken like this.
    #[error(transparent)]
    Damage(#[from] DamageError),
}

impl Default for Variant {
    fn default() -> Self {
        Self {
            policy: "nearest".to_owned(),
            weight_bits: WEIGHT_BITS_MAX,
            current_bits: STATE_BITS,
            voltage_bits: STATE_BITS,
            messages_lost_per_million: 0,
            dead_synapses_per_million: 0,
            dead_cores: 0,
            neurons_per_core: None,
            cores: None,
        }
    }
}

impl Variant {
    /// The same on a whole chip: variants with equal ones compile to equal maps.
    pub fn undamaged(&self) -> Self {
        let Damage { messages_lost_per_million, dead_synapses_per_million, dead_cores } =
            Damage::default();
        Self { messages_lost_per_million, dead_synapses_per_million, dead_cores, ..self.clone() }
    }

    /// The network compiled for this chip; an EEM-SAN in the schedule held.
    ///
    /// Errors: a width that there is not, or whatever keeps the network off this chip.
    pub fn compile(&self, network: &Controller) -> Result<Deployment, VariantError> {
        let chip = ChipSpec::loihi1().with_state_bits(self.current_bits, self.voltage_bits)?;
        let policy = Policy::named(&self.policy)?.with_weight_bits(self.weight_bits)?;
        let split = Split::asked(self.cores, self.neurons_per_core);
        Ok(Deployment::of_controller(network, &policy, &chip, split, Schedule::Held)?)
    }

    /// `deployment` as a driver on chips that are broken like this one.
    ///
    /// Errors: more dead cores than are in use, or a share above one.
    pub fn driver(&self, deployment: Deployment) -> Result<Driver, VariantError> {
        let driver = Driver::chip(deployment, EngineKind::Event).expect("a compiled controller");
        Ok(driver.damaged(Damage {
            messages_lost_per_million: self.messages_lost_per_million,
            dead_synapses_per_million: self.dead_synapses_per_million,
            dead_cores: self.dead_cores,
        })?)
    }
}
