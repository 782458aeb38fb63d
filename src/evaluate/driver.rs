//! What can drive: a float network, a compiled one on an engine, or the straight line.

use std::sync::Arc;

use hw_model::{ChipSpec, DenseEngine, Engine, EventEngine, OpCounts, container};

use crate::closed_loop::planner::Knowledge;
use crate::closed_loop::{StraightToGoal, TrialConfig};
use crate::coding::LayerSpikes;
use crate::evaluate::FlyError;
use crate::evaluate::damage::{Damage, DamageError};
use crate::host::{ChipPolicy, ChipUse, Deployment, EemSanChipPolicy, Schedule};
use crate::net::eem_san::FRAMES_PER_TICK;
use crate::net::{Controller, Network};
use crate::policy::{Action, Observation, Policy};
use crate::reference::{EemSanPolicy, FloatPolicy};
use crate::rng::Streams;
use crate::world::dvs::CAMERA_DEG;

/// Which engine runs a core map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineKind {
    /// The event-driven engine.
    Event,
    /// The dense fixed-point reference.
    Dense,
}

/// What drives.
#[derive(Debug)]
pub enum DriverKind {
    /// The float reference of a network.
    Float(Box<FloatPolicy>),
    /// An EEM-SAN or its laser-only control in floats.
    EemSan(Box<EemSanPolicy>),
    /// A compiled network on an emulated chip.
    Chip {
        /// The compiled network.
        deployment: Box<Deployment>,
        /// An engine at step 0 that each trial copies; `None` for the dense engine.
        template: Option<Box<EventEngine>>,
        /// What is broken of the chip.
        damage: Damage,
    },
    /// Steers at the goal and sees nothing.
    Straight,
    /// Knows all obstacles, and of the movers everything or what sensors show: what is possible.
    Planner(Knowledge),
}

/// A driver that every trial starts afresh.
#[derive(Debug)]
pub struct Driver {
    /// Name in tables.
    pub label: String,
    /// SHA-256 of the network, or of the core map and what the host adds to it; `None` for a driver without one.
    pub digest: Option<String>,
    kind: DriverKind,
}

/// A driver in a trial.
pub(super) enum Active {
    Chip(Box<ChipPolicy>),
    EemSanChip(Box<EemSanChipPolicy>),
    EemSan(Box<EemSanPolicy>),
    Other(Box<dyn Policy>),
}

impl Driver {
    /// The float reference of `network`.
    pub fn float(network: &Network) -> Self {
        let label = format!("{} float", network.name);
        let digest = Some(container::digest(network));
        Self { label, digest, kind: DriverKind::Float(Box::new(FloatPolicy::new(network))) }
    }

    /// The float reference of a network of either kind.
    pub fn controller(controller: &Controller) -> Self {
        let network = match controller {
            Controller::Described(network) => return Self::float(network),
            Controller::EemSan(network) => network,
        };
        let label = format!("{} float", network.name);
        let digest = Some(container::digest(network));
        Self { label, digest, kind: DriverKind::EemSan(Box::new(EemSanPolicy::new(network))) }
    }

    /// A compiled network; `None` when it has no encoder and decoder.
    pub fn chip(deployment: Deployment, engine: EngineKind) -> Option<Self> {
        if !deployment.can_drive() {
            return None;
        }
        let dense = if engine == EngineKind::Dense { ", dense" } else { "" };
        let schedule = deployment.eem_san.as_ref().map(|program| program.schedule);
        let streaming = if schedule == Some(Schedule::Streaming) { ", streaming" } else { "" };
        let chip = &deployment.map.chip().name;
        let other = if *chip == ChipSpec::loihi1().name { "" } else { &format!(", {chip}") };
        let (network, policy) = (&deployment.network, &deployment.policy);
        let label = format!("{network} chip ({policy}{other}{streaming}{dense})");
        let event = engine == EngineKind::Event;
        let template = event.then(|| Box::new(EventEngine::new(Arc::clone(&deployment.map))));
        let digest = Some(deployment.digest());
        let (deployment, damage) = (Box::new(deployment), Damage::default());
        let kind = DriverKind::Chip { deployment, template, damage };
        Some(Self { label, digest, kind })
    }

    /// The same compiled network on chips that are broken, a fresh one for each trial.
    ///
    /// Errors: a driver that is no chip, or whose engine is the dense one; a rate above one; more
    /// dead cores than are in use.
    pub fn damaged(mut self, broken: Damage) -> Result<Self, DamageError> {
        match &mut self.kind {
            DriverKind::Chip { deployment, template: Some(_), damage } => {
                broken.check(&deployment.map)?;
                *damage = broken;
                Ok(self)
            }
            _ => Err(DamageError::NoChip { driver: self.label }),
        }
    }

    /// The baseline that steers at the goal.
    pub fn straight() -> Self {
        Self { label: "straight to goal".to_owned(), digest: None, kind: DriverKind::Straight }
    }

    /// The planner.
    pub fn planner(knowledge: Knowledge) -> Self {
        let known = match knowledge {
            Knowledge::Everything => "knows all".to_owned(),
            Knowledge::Camera { field_of_view_deg: CAMERA_DEG } => {
                "knows what camera and laser show".to_owned()
            }
            Knowledge::Camera { field_of_view_deg } => {
                format!("knows what a camera of {field_of_view_deg} degrees and the laser show")
            }
            Knowledge::Laser => "knows what the laser shows".to_owned(),
        };
        let label = format!("planner ({known})");
        Self { label, digest: None, kind: DriverKind::Planner(knowledge) }
    }

    /// What the planner knows, when this is one; it flies without a [`Policy`].
    pub(super) fn planner_knowledge(&self) -> Option<Knowledge> {
        match self.kind {
            DriverKind::Planner(knowledge) => Some(knowledge),
            _ => None,
        }
    }

    /// The compiled network, when this is one.
    pub fn deployment(&self) -> Option<&Deployment> {
        match &self.kind {
            DriverKind::Chip { deployment, .. } => Some(deployment),
            DriverKind::Float(_)
            | DriverKind::EemSan(_)
            | DriverKind::Straight
            | DriverKind::Planner(_) => None,
        }
    }

    /// Name and neurons of every layer whose spikes it can show, in the order of
    /// [`crate::coding::LayerSpikes`].
    pub fn layers(&self) -> Vec<(String, usize)> {
        let owned = |(name, neurons): (&str, usize)| (name.to_owned(), neurons);
        match &self.kind {
            DriverKind::EemSan(policy) => policy.layers().into_iter().map(owned).collect(),
            DriverKind::Chip { deployment, .. } => {
                let populations = deployment.map.populations().iter();
                populations.map(|population| (population.name.clone(), population.len())).collect()
            }
            DriverKind::Float(_) | DriverKind::Straight | DriverKind::Planner(_) => Vec::new(),
        }
    }

    /// Whether its network takes the frames of an event camera.
    pub fn needs_camera(&self) -> bool {
        match &self.kind {
            DriverKind::EemSan(policy) => policy.takes_frames(),
            DriverKind::Chip { deployment, .. } => deployment.takes_frames(),
            DriverKind::Float(_) | DriverKind::Straight | DriverKind::Planner(_) => false,
        }
    }

    /// Whether the simulator tells it of movers.
    fn is_told(&self) -> bool {
        matches!(&self.kind, DriverKind::EemSan(policy) if policy.is_told())
    }

    /// The settings that this driver flies by: `config`, with a camera when it needs one, and told of
    /// movers when it is.
    ///
    /// Errors: the control rate does not give the network its five event frames per tick.
    pub fn config(&self, config: &TrialConfig) -> Result<TrialConfig, FlyError> {
        if !self.needs_camera() {
            return Ok(TrialConfig { told: self.is_told(), ..config.clone() });
        }
        config.check()?;
        let frames = config.steps_per_tick();
        if frames != FRAMES_PER_TICK as u64 {
            let (driver, control_hz) = (self.label.clone(), config.control_hz);
            return Err(FlyError::Frames { driver, control_hz, frames });
        }
        let camera = config.camera.clone().unwrap_or_default();
        Ok(TrialConfig { camera: Some(camera), ..config.clone() })
    }

    /// Ready for the trial of `streams`.
    pub(super) fn start(&self, streams: &Streams) -> Active {
        match &self.kind {
            DriverKind::Float(policy) => Active::Other(policy.clone()),
            DriverKind::EemSan(policy) => Active::EemSan(policy.clone()),
            DriverKind::Straight | DriverKind::Planner(_) => {
                Active::Other(Box::new(StraightToGoal))
            }
            DriverKind::Chip { deployment, template, damage } => {
                let engine: Box<dyn Engine> = match template {
                    Some(template) => Box::new(on_chip(template, damage, streams)),
                    None => Box::new(DenseEngine::new(Arc::clone(&deployment.map))),
                };
                let checked = "checked when the driver was made";
                if deployment.eem_san.is_some() {
                    let policy = EemSanChipPolicy::new(deployment, engine);
                    return Active::EemSanChip(Box::new(policy.expect(checked)));
                }
                Active::Chip(Box::new(ChipPolicy::new(deployment, engine).expect(checked)))
            }
        }
    }
}

/// An engine on the chip of one trial.
fn on_chip(template: &EventEngine, damage: &Damage, streams: &Streams) -> EventEngine {
    let map = damage.map(template.map(), streams);
    let mut engine = map.map_or_else(|| template.fresh(), |map| EventEngine::new(Arc::new(map)));
    engine.set_faults(damage.faults(template.map().cores().len(), streams));
    engine
}

impl Active {
    pub(super) fn policy(&mut self) -> &mut dyn Policy {
        match self {
            Active::Chip(policy) => policy.as_mut(),
            Active::EemSanChip(policy) => policy.as_mut(),
            Active::EemSan(policy) => policy.as_mut(),
            Active::Other(policy) => policy.as_mut(),
        }
    }

    pub(super) fn chip_use(&self) -> Option<ChipUse> {
        match self {
            Active::Chip(policy) => Some(policy.chip_use()),
            Active::EemSanChip(policy) => Some(policy.chip_use()),
            Active::EemSan(_) | Active::Other(_) => None,
        }
    }

    /// A decision, and the spikes of every layer, where the driver can show them.
    pub(super) fn act_watched(&mut self, seen: &Observation, tick: u64) -> (Action, LayerSpikes) {
        match self {
            Active::Chip(policy) => policy.act_watched(seen, tick),
            Active::EemSanChip(policy) => policy.act_watched(seen, tick),
            Active::EemSan(policy) => policy.act_watched(seen, tick),
            Active::Other(policy) => (policy.act(seen, tick), LayerSpikes::new()),
        }
    }

    /// The DVS state of the last tick; empty where there is none.
    pub(super) fn dvs_state(&self) -> &[f32] {
        match self {
            Active::EemSanChip(policy) => policy.dvs_state(),
            Active::EemSan(policy) => policy.dvs_state(),
            Active::Chip(_) | Active::Other(_) => &[],
        }
    }

    /// Counts of every core; none without a chip.
    pub(super) fn core_counts(&self) -> Vec<OpCounts> {
        match self {
            Active::Chip(policy) => policy.engine().core_counts(),
            Active::EemSanChip(policy) => policy.engine().core_counts(),
            Active::EemSan(_) | Active::Other(_) => Vec::new(),
        }
    }
}
