//! What `compile` writes and `run` and `drive` read: a core map and the host's program for it.

use std::path::Path;
use std::sync::Arc;

use hw_model::container::{self, Kind};
use hw_model::engine::Stimulus;
use hw_model::error::ContainerError;
use hw_model::{ChipSpec, CoreMap, CoreMapParts, MapError};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::coding::InputSpikes;
use crate::compile::quantize::{BIAS_PORT, INPUT_PORT, Quantized, quantize};
use crate::compile::{CompileError, IntegerGraph, Policy, Split, place, quantize_eem_san};
use crate::cost::Shape;
use crate::host::eem_san_program::{EemSanProgram, Schedule};
use crate::host::work;
use crate::net::integer::IntegerNet;
use crate::net::{Controller, EemSan, MAP_LABEL, Network, RateEncoder};

const KIND: Kind = Kind {
    label: MAP_LABEL,
    version: 3,
    advice: "compile the network again with `spikeloop compile`",
};

/// A compiled network.
#[derive(Debug, Clone)]
pub struct Deployment {
    /// Name of the network.
    pub network: String,
    /// Name of the quantization policy; "integer" when there was nothing to quantize.
    pub policy: String,
    /// The chip's part.
    pub map: Arc<CoreMap>,
    /// The host's part; `None` for a network without encoder and decoder.
    pub program: Option<DecisionProgram>,
    /// The host's part of an EEM-SAN.
    pub eem_san: Option<EemSanProgram>,
    /// Mantissas per unit of the float weights, by layer.
    pub scales: Vec<(String, f64)>,
}

/// The same as plain data, as it lies in the file.
#[derive(Debug, Serialize, Deserialize)]
struct DeploymentFile {
    network: String,
    policy: String,
    #[serde(with = "hw_model::core_map::packed")]
    map: CoreMapParts,
    program: Option<DecisionProgram>,
    eem_san: Option<EemSanProgram>,
    scales: Vec<(String, f64)>,
}

/// How the host makes one decision with the chip. Steps count from 0 at the start of a decision;
/// a spike injected in step `t` arrives in step `t + 1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecisionProgram {
    /// `T`: steps for which inputs are injected and outputs are counted.
    pub steps: u32,
    /// Chip steps per decision: T and one for each population on the way.
    pub chip_steps: u32,
    /// Index of the port for encoded spikes.
    pub input_port: u32,
    /// Index of the port with one always-on line for each layer.
    pub bias_port: u32,
    /// First step in which each bias line is injected; it goes on for T steps.
    pub bias_starts: Vec<u32>,
    /// First step of each population's window, by population of the map; T steps long.
    pub window_starts: Vec<u32>,
    /// Index of the output population.
    pub output: u32,
    /// Observation to spike probabilities.
    pub encoder: RateEncoder,
}

/// A deployment file that cannot be used.
#[derive(Debug, Error)]
pub enum DeploymentError {
    /// Not a core map at all.
    #[error("{file}: not a core map; make one with `spikeloop compile NETWORK -o MAP`")]
    NotMap {
        /// The file.
        file: String,
    },
    /// Not a sound container.
    #[error(transparent)]
    Container(ContainerError),
    /// The map in it does not pass the chip's checks.
    #[error("{file}: {source}")]
    Map {
        /// The file.
        file: String,
        /// What does not fit.
        source: Box<MapError>,
    },
    /// The host program does not go with the map.
    #[error("{file}: host program: {problem}; compile the network again with `spikeloop compile`")]
    Program {
        /// The file.
        file: String,
        /// What is wrong.
        problem: String,
    },
}

impl From<ContainerError> for DeploymentError {
    fn from(error: ContainerError) -> Self {
        match error {
            ContainerError::Label { file, .. } => Self::NotMap { file },
            other => Self::Container(other),
        }
    }
}

impl Deployment {
    /// Compiles a network of either kind; `schedule` is for an EEM-SAN.
    ///
    /// Errors: as [`Deployment::compile`] and [`Deployment::compile_eem_san`].
    pub fn of_controller(
        network: &Controller,
        policy: &Policy,
        chip: &ChipSpec,
        split: Split,
        schedule: Schedule,
    ) -> Result<Self, CompileError> {
        match network {
            Controller::Described(network) => Self::compile(network, policy, chip, split),
            Controller::EemSan(network) => {
                Self::compile_eem_san(network, policy, chip, split, schedule)
            }
        }
    }

    /// Compiles a float network.
    ///
    /// Errors: as [`quantize`] and [`place::place`].
    pub fn compile(
        network: &Network,
        policy: &Policy,
        chip: &ChipSpec,
        split: Split,
    ) -> Result<Self, CompileError> {
        let quantized = quantize(network, policy, chip)?;
        let scales = network.layers.iter().zip(&quantized.layers);
        let scales: Vec<_> = scales.map(|(layer, q)| (layer.name.clone(), q.scale)).collect();
        Self::placed(&quantized.graph, chip, split, |map| Self {
            network: network.name.clone(),
            policy: policy.label(),
            program: Some(DecisionProgram::new(network, &quantized, &map)),
            eem_san: None,
            scales: scales.clone(),
            map: Arc::new(map),
        })
    }

    /// Places a graph; `with` adds the host's part to a map.
    fn placed(
        graph: &IntegerGraph,
        chip: &ChipSpec,
        split: Split,
        with: impl Fn(CoreMap) -> Self,
    ) -> Result<Self, CompileError> {
        let map = match split {
            Split::Fewest => place::place(graph, chip, None)?,
            Split::NeuronsPerCore(most) => place::place(graph, chip, Some(most))?,
            Split::Cores(cores) => {
                place::spread(graph, chip, cores, |map| work::of_populations(&with(map)))?
            }
        };
        Ok(with(map))
    }

    /// Compiles an EEM-SAN or its laser-only control.
    ///
    /// Errors: as [`quantize_eem_san`] and [`place::place`]; streaming without an encoder, or with
    /// one that is reset at each control tick.
    pub fn compile_eem_san(
        network: &EemSan,
        policy: &Policy,
        chip: &ChipSpec,
        split: Split,
        schedule: Schedule,
    ) -> Result<Self, CompileError> {
        if network.told {
            return Err(CompileError::Told { network: network.name.clone() });
        }
        if schedule == Schedule::Streaming && network.encoder.is_none() {
            return Err(CompileError::NothingToStream { network: network.name.clone() });
        }
        let quantized = quantize_eem_san(network, policy, chip)?;
        let forgets = network.encoder.as_ref().filter(|encoder| !encoder.kind.carries());
        let schedule = match (schedule, forgets) {
            (Schedule::Streaming, Some(encoder)) => {
                return Err(CompileError::ResetStreaming {
                    network: network.name.clone(),
                    layers: encoder.layers.len(),
                });
            }
            (Schedule::Held, Some(_)) => Schedule::HeldCleared,
            (schedule, _) => schedule,
        };
        let scales = quantized.layers.iter().map(|(name, q)| (name.clone(), q.scale));
        let scales: Vec<_> = scales.collect();
        Self::placed(&quantized.graph, chip, split, |map| Self {
            network: network.name.clone(),
            policy: policy.label(),
            program: None,
            eem_san: Some(EemSanProgram::new(network, &quantized, &map, schedule)),
            scales: scales.clone(),
            map: Arc::new(map),
        })
    }

    /// SHA-256 of what decides how it drives: the core map and the host's program, which has codes,
    /// windows and schedules of its own. Without a program it is the core map's own digest.
    pub fn digest(&self) -> String {
        match (&self.program, &self.eem_san) {
            (_, Some(program)) => container::digest(&(self.map.digest(), program)),
            (Some(program), None) => container::digest(&(self.map.digest(), program)),
            (None, None) => self.map.digest(),
        }
    }

    /// Whether it can drive: there is a host program for observations and actions.
    pub fn can_drive(&self) -> bool {
        self.program.is_some() || self.eem_san.is_some()
    }

    /// Whether it takes the frames of an event camera.
    pub fn takes_frames(&self) -> bool {
        self.eem_san.as_ref().is_some_and(|program| program.encoder.is_some())
    }

    /// Sizes of an EEM-SAN's layers; `None` of anything else.
    pub fn eem_san_shape(&self) -> Option<Shape> {
        self.eem_san.as_ref().and_then(|program| program.shape(&self.map))
    }

    /// Places an integer network.
    ///
    /// Errors: as [`place::place`].
    pub fn of_integers(
        net: IntegerNet,
        chip: &ChipSpec,
        split: Split,
    ) -> Result<Self, CompileError> {
        let network = net.name.clone();
        Self::placed(&IntegerGraph::from(net), chip, split, |map| Self {
            network: network.clone(),
            policy: "integer".to_owned(),
            map: Arc::new(map),
            program: None,
            eem_san: None,
            scales: Vec::new(),
        })
    }

    /// Bytes of the deployment's file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let file = DeploymentFile {
            network: self.network.clone(),
            policy: self.policy.clone(),
            map: self.map.parts().clone(),
            program: self.program.clone(),
            eem_san: self.eem_san.clone(),
            scales: self.scales.clone(),
        };
        container::to_bytes(KIND, &file)
    }

    /// Reads a file and checks everything in it.
    ///
    /// Errors: a damaged container, a map beyond its chip, a program that does not go with it.
    pub fn read(path: &Path) -> Result<Self, DeploymentError> {
        Self::checked(&path.display().to_string(), container::read(KIND, path)?)
    }

    /// The same from memory; `file` is the name that errors mention.
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Result<Self, DeploymentError> {
        Self::checked(file, container::from_bytes(KIND, file, bytes)?)
    }

    fn checked(file: &str, content: DeploymentFile) -> Result<Self, DeploymentError> {
        let map = CoreMap::new(content.map).map_err(|source| DeploymentError::Map {
            file: file.to_owned(),
            source: Box::new(source),
        })?;
        let decision = content.program.as_ref().map(|program| program.check(&map));
        let eem_san = content.eem_san.as_ref().map(|program| program.check(&map));
        for checked in [decision, eem_san].into_iter().flatten() {
            checked
                .map_err(|problem| DeploymentError::Program { file: file.to_owned(), problem })?;
        }
        Ok(Self {
            network: content.network,
            policy: content.policy,
            map: Arc::new(map),
            program: content.program,
            eem_san: content.eem_san,
            scales: content.scales,
        })
    }
}

impl DecisionProgram {
    /// The program for a freshly compiled network.
    fn new(network: &Network, quantized: &Quantized, map: &CoreMap) -> Self {
        let relays = u32::from(network.relay);
        // Inputs injected from step 0 on reach the first population in step 1.
        let window_start = |name: &str| {
            let layer = network.layers.iter().position(|layer| layer.name == name);
            layer.map_or(1, |layer| layer as u32 + 1 + relays)
        };
        let port = |name: &str| map.port(name).expect("quantize makes the port") as u32;
        let populations = quantized.graph.populations.iter();
        Self {
            steps: network.steps,
            chip_steps: network.steps + network.layers.len() as u32 + relays,
            input_port: port(INPUT_PORT),
            bias_port: port(BIAS_PORT),
            // A bias travels like the inputs, and layer k works k steps after the first.
            bias_starts: (0..network.layers.len() as u32).collect(),
            window_starts: populations.map(|p| window_start(&p.name)).collect(),
            output: quantized.graph.populations.len() as u32 - 1,
            encoder: network.encoder,
        }
    }

    /// What the host injects in step `step` of a decision: encoded spikes while there are any,
    /// and the bias lines whose layer is about to open.
    ///
    /// Shapes: `input[step][line]`, T steps. `map` must be the one the program was made for.
    pub fn stimulus(&self, map: &CoreMap, input: &InputSpikes, step: u32) -> Stimulus {
        let lines = input.get(step as usize).map_or(&[][..], Vec::as_slice);
        let inputs = lines.iter().enumerate().filter(|(_, spike)| **spike);
        let inputs = inputs.map(|(line, _)| (0, self.input_port, line as u32));
        let open = |start: &u32| (*start..start + self.steps).contains(&step);
        let biases = self.bias_starts.iter().enumerate().filter(|(_, start)| open(start));
        let biases = biases.map(|(line, _)| (0, self.bias_port, line as u32));
        Stimulus::new(map, 1, inputs.chain(biases))
            .expect("the program was checked against the map")
    }

    /// First step of the output's window.
    pub fn output_start(&self) -> u32 {
        self.window_starts[self.output as usize]
    }

    /// Whether population `population` is in its window in step `step`.
    pub fn in_window(&self, population: usize, step: u32) -> bool {
        let start = self.window_starts[population];
        (start..start + self.steps).contains(&step)
    }

    /// What does not go with `map`, in words.
    fn check(&self, map: &CoreMap) -> Result<(), String> {
        let bad_scale = |(_, scale): &(&str, f64)| !(*scale > 0.0 && scale.is_finite());
        if let Some((name, scale)) = self.encoder.scales().into_iter().find(bad_scale) {
            return Err(format!("encoder: {name} = {scale}, must be positive and finite"));
        }
        let lines = |port: u32| map.ports().get(port as usize).map(|port| port.lines as usize);
        let steps_max = 1 << 16;
        if self.steps == 0 || self.chip_steps > steps_max || self.steps > self.chip_steps {
            return Err(format!("{} of {} steps", self.steps, self.chip_steps));
        }
        if lines(self.input_port) != Some(crate::net::encoder::RATE_INPUTS) {
            return Err(format!("input port has {:?} lines", lines(self.input_port)));
        }
        if lines(self.bias_port).is_none_or(|lines| lines < self.bias_starts.len()) {
            return Err(format!("bias port has {:?} lines", lines(self.bias_port)));
        }
        if self.window_starts.len() != map.populations().len() {
            return Err(format!(
                "windows for {} populations, the map has {}",
                self.window_starts.len(),
                map.populations().len()
            ));
        }
        let late = self.window_starts.iter().chain(&self.bias_starts).find(|s| **s > steps_max);
        if let Some(late) = late {
            return Err(format!("a window starts at step {late}"));
        }
        match map.populations().get(self.output as usize).map(|p| p.len()) {
            Some(2) => Ok(()),
            other => Err(format!("output population has {other:?} neurons, 2 expected")),
        }
    }
}

#[cfg(test)]
#[path = "deployment_tests.rs"]
mod tests;
