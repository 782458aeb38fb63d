//! Degraded conditions of the BDETT line of work: what a driver is put through besides the
//! conditions of the success table.

use crate::closed_loop::TrialConfig;
use crate::net::weight_fault::WeightFault;
use crate::world::laser_fault::LaserFault;

/// Something that is worse than it should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degradation {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// What is degraded.
    pub part: DegradedPart,
}

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DegradedPart {
    /// In front of the network: every driver can fly with it.
    Laser(LaserFault),
    /// In the network, before it is compiled; it is drawn anew for each seed.
    Weights(WeightFault),
}

/// All of them (Zyunduo/dynamic-threshold).
pub const DEGRADATIONS: [Degradation; 6] = [
    Degradation { name: "beams-near", part: DegradedPart::Laser(LaserFault::Near) },
    Degradation { name: "beams-far", part: DegradedPart::Laser(LaserFault::Far) },
    Degradation { name: "laser-noise", part: DegradedPart::Laser(LaserFault::Noise) },
    Degradation { name: "weights-8-bit", part: DegradedPart::Weights(WeightFault::EightBit) },
    Degradation { name: "weights-noise", part: DegradedPart::Weights(WeightFault::Noise) },
    Degradation { name: "weights-pruned", part: DegradedPart::Weights(WeightFault::Pruned) },
];

impl Degradation {
    /// The one of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        DEGRADATIONS.iter().find(|degradation| degradation.name == name)
    }

    /// What it does to the weights, if it is there.
    pub fn weights(&self) -> Option<WeightFault> {
        match self.part {
            DegradedPart::Weights(fault) => Some(fault),
            DegradedPart::Laser(_) => None,
        }
    }

    /// `config` with the degraded laser, if it is there.
    pub fn config(&self, config: &TrialConfig) -> TrialConfig {
        match self.part {
            DegradedPart::Laser(fault) => {
                TrialConfig { laser_fault: Some(fault), ..config.clone() }
            }
            DegradedPart::Weights(_) => config.clone(),
        }
    }
}
