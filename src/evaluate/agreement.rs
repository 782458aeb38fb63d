//! A compiled EEM-SAN beside its float network on equal observations and random draws.

use std::collections::VecDeque;

use hw_model::Engine;
use serde::{Deserialize, Serialize};

use crate::coding::LayerSpikes;
use crate::host::{ChipUse, Deployment, EemSanChipPolicy, Schedule};
use crate::net::EemSan;
use crate::policy::{Action, Observation, Policy};
use crate::reference::EemSanPolicy;
use crate::rng::Streams;

/// A map and a network that are not of one kind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AgreementError {
    /// The map has no program for an EEM-SAN.
    #[error("{map}: not a map of an EEM-SAN; compile one with `spikeloop compile eem-san -o MAP`")]
    NotEemSan {
        /// Network of the map.
        map: String,
    },
    /// Layers of other names or sizes.
    #[error(
        "map of {map}: layers {found}, but {network} has {expected}; give the network that the \
         map was compiled from"
    )]
    Layers {
        /// Network of the map.
        map: String,
        /// The float network.
        network: String,
        /// Layers of the map.
        found: String,
        /// Layers of the network.
        expected: String,
    },
    /// Codes of other sizes.
    #[error(
        "map of {map}: codes of {found:?} lines, but {network} has {expected:?}; give the network \
         that the map was compiled from"
    )]
    Codes {
        /// Network of the map.
        map: String,
        /// The float network.
        network: String,
        /// Lines of the map's codes.
        found: Vec<usize>,
        /// Lines of the network's codes.
        expected: Vec<usize>,
    },
    /// A float network that no map is compiled from.
    #[error(
        "{network}: dynamic thresholds (BDETT), which no map has; give the network that the map was \
         compiled from"
    )]
    DynamicThresholds {
        /// The float network.
        network: String,
    },
}

/// Both networks and what was counted so far.
#[derive(Debug)]
pub struct Comparison {
    float: EemSanPolicy,
    chip: EemSanChipPolicy,
    /// Steps by which each layer of the chip is behind the float network's.
    delays: Vec<u64>,
    /// Spikes of the float network that the chip has yet to make, by layer and step.
    ahead: Vec<VecDeque<Vec<u32>>>,
    counted: Agreement,
}

/// How far chip and float network agree.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Control ticks compared.
    pub ticks: u64,
    /// Ticks with the same action.
    pub equal_actions: u64,
    /// Sum over ticks of the mean absolute difference of both wheels, as fractions of the range.
    pub action_difference_sum: f64,
    /// Largest absolute difference of a wheel.
    pub action_difference_max: f64,
    /// Sum over ticks of the mean absolute difference of the DVS state's numbers, which have unit
    /// deviation in training.
    pub state_difference_sum: f64,
    /// Layers: encoder, branches, decision module.
    pub layers: Vec<LayerAgreement>,
}

/// Spikes of one layer.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerAgreement {
    /// Name.
    pub layer: String,
    /// Neurons.
    pub neurons: u64,
    /// Steps compared.
    pub steps: u64,
    /// Spikes of the float network.
    pub float: u64,
    /// Spikes of the chip.
    pub chip: u64,
    /// Spikes of the same neuron in the same step.
    pub both: u64,
    /// Spikes of the same neuron in the same control tick, in whatever step.
    pub both_in_tick: u64,
}

impl LayerAgreement {
    /// Share of the spikes of either that are spikes of both; `None` when there were none.
    pub fn share(&self) -> Option<f64> {
        self.share_of(self.both)
    }

    /// The same, for spikes of a neuron in the same control tick.
    pub fn share_in_tick(&self) -> Option<f64> {
        self.share_of(self.both_in_tick)
    }

    fn share_of(&self, both: u64) -> Option<f64> {
        let either = self.float.saturating_add(self.chip).saturating_sub(both);
        (either > 0).then(|| both as f64 / either as f64)
    }
}

impl Comparison {
    /// Ready to compare; `engine` must run the map of `deployment`.
    ///
    /// Errors: a map of something else, or of an EEM-SAN with other layers.
    pub fn new(
        network: &EemSan,
        deployment: &Deployment,
        engine: Box<dyn Engine>,
    ) -> Result<Self, AgreementError> {
        let not_eem_san = || AgreementError::NotEemSan { map: deployment.network.clone() };
        let chip = EemSanChipPolicy::new(deployment, engine).ok_or_else(not_eem_san)?;
        let populations = deployment.map.populations().iter();
        let found: Vec<(&str, usize)> = populations.map(|p| (p.name.as_str(), p.len())).collect();
        let expected = network.layers();
        if found != expected {
            return Err(AgreementError::Layers {
                map: deployment.network.clone(),
                network: network.name.clone(),
                found: listed(&found),
                expected: listed(&expected),
            });
        }
        if network.dynamic.is_some() {
            return Err(AgreementError::DynamicThresholds { network: network.name.clone() });
        }
        let lines: Vec<usize> = network.branches().map(|branch| branch.code.lines()).collect();
        if chip.code_lines() != lines {
            return Err(AgreementError::Codes {
                map: deployment.network.clone(),
                network: network.name.clone(),
                found: chip.code_lines(),
                expected: lines,
            });
        }
        let layer = |(name, neurons): (&str, usize)| LayerAgreement {
            layer: name.to_owned(),
            neurons: neurons as u64,
            ..LayerAgreement::default()
        };
        let layers: Vec<LayerAgreement> = expected.into_iter().map(layer).collect();
        let (float, delays) = match chip.schedule() {
            Schedule::Held | Schedule::HeldCleared => {
                (EemSanPolicy::new(network), vec![0; layers.len()])
            }
            Schedule::Streaming => (EemSanPolicy::streaming(network), chip.delays()),
        };
        let counted = Agreement { layers, ..Agreement::default() };
        Ok(Self { float, chip, delays, ahead: Vec::new(), counted })
    }

    /// Steps by which each layer of the chip is behind the float network's; the float network has
    /// the same delays in what it reads and when it acts. All 0 unless the map streams.
    pub fn delays(&self) -> &[u64] {
        &self.delays
    }

    /// Both begin a trial with the same random streams.
    pub fn start_trial(&mut self, streams: Streams) {
        self.float.start_trial(streams);
        self.chip.start_trial(streams);
        let silence = |delay: &u64| VecDeque::from(vec![Vec::new(); *delay as usize]);
        self.ahead = self.delays.iter().map(silence).collect();
    }

    /// Both decide on the same observation; the action is the float network's. A layer of the chip
    /// that is behind is compared with what the float network's layer did so many steps before.
    ///
    /// Panics before a trial.
    pub fn tick(&mut self, observation: &Observation, tick: u64) -> Action {
        let (action, float) = self.float.act_watched(observation, tick);
        let (on_chip, chip) = self.chip.act_watched(observation, tick);
        self.counted.add(&action, &on_chip);
        self.counted.add_states(self.float.dvs_state(), self.chip.dvs_state());
        assert_eq!(self.ahead.len(), float.len(), "layers of a trial");
        let layers = self.ahead.iter_mut().zip(float).zip(&chip);
        let due = layers.map(|((ahead, float), chip)| {
            ahead.extend(float);
            ahead.drain(..chip.len()).collect()
        });
        let due: LayerSpikes = due.collect();
        self.counted.add_spikes(&due, &chip);
        action
    }

    /// What was counted so far.
    pub fn agreement(&self) -> &Agreement {
        &self.counted
    }

    /// What the chip did so far.
    pub fn chip_use(&self) -> ChipUse {
        self.chip.chip_use()
    }
}

impl Agreement {
    fn add(&mut self, float: &Action, chip: &Action) {
        let (left, right) = ((float.left - chip.left).abs(), (float.right - chip.right).abs());
        self.ticks += 1;
        self.equal_actions += u64::from(float == chip);
        self.action_difference_sum += (left + right) / 2.0;
        self.action_difference_max = self.action_difference_max.max(left).max(right);
    }

    fn add_states(&mut self, float: &[f32], chip: &[f32]) {
        let apart = float.iter().zip(chip).map(|(a, b)| f64::from((a - b).abs()));
        self.state_difference_sum += apart.sum::<f64>() / float.len().max(1) as f64;
    }

    fn add_spikes(&mut self, float: &LayerSpikes, chip: &LayerSpikes) {
        for (layer, (float, chip)) in self.layers.iter_mut().zip(float.iter().zip(chip)) {
            for (float, chip) in float.iter().zip(chip) {
                let both = float.iter().filter(|neuron| chip.binary_search(neuron).is_ok());
                layer.steps += 1;
                layer.float += float.len() as u64;
                layer.chip += chip.len() as u64;
                layer.both += both.count() as u64;
            }
            let (float, chip) = (counts(float, layer.neurons), counts(chip, layer.neurons));
            let least = float.iter().zip(&chip).map(|(a, b)| u64::from(*a.min(b)));
            layer.both_in_tick += least.sum::<u64>();
        }
    }
}

/// Spikes of each neuron over all steps.
fn counts(steps: &[Vec<u32>], neurons: u64) -> Vec<u32> {
    let mut counts = vec![0; neurons as usize];
    steps.iter().flatten().for_each(|neuron| counts[*neuron as usize] += 1);
    counts
}

fn listed(layers: &[(&str, usize)]) -> String {
    let layers = layers.iter().map(|(name, neurons)| format!("{name} ({neurons})"));
    layers.collect::<Vec<_>>().join(", ")
}
