//! EEM-SAN as trained: spiking encoder of event frames, population codes, fused decision module.
//!
//! One safetensors file holds all of it. Tensors of the encoder begin with `hsvae.`, those of the
//! rest with `actor.`; [`EemSan::from_bytes`] lists them. Without `hsvae.` tensors it is the
//! laser-only control.

use safetensors::SafeTensors;
use serde::{Deserialize, Serialize};

use crate::net::error::NetError;
use crate::net::network::Layer;
use crate::net::tensors::{self, TensorReader};
use crate::policy::{FRAME_COLUMNS, LASER_SECTORS};

/// Numbers of robot and laser state: goal direction and term, two speeds, 18 laser terms.
pub const ROBOT_STATE: usize = 4 + LASER_SECTORS;

/// Event frames per control tick.
pub const FRAMES_PER_TICK: usize = 5;

/// `d_c`, `d_v` of all neurons (Sec. 4.1).
const KEEP: (f64, f64) = (0.5, 0.75);

/// `T`, steps per decision (Sec. 4.1).
const STEPS: u32 = 5;

/// Side and stride of all kernels, and the zeros around a picture (Table 1).
pub const KERNEL: usize = 4;

/// A trained EEM-SAN, or its laser-only control.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EemSan {
    /// Name.
    pub name: String,
    /// `T`: steps per decision.
    pub steps: u32,
    /// Encoder of event frames; `None` for the laser-only control.
    pub encoder: Option<EventEncoder>,
    /// Population code and first layer of robot and laser state (22 dimensions).
    pub laser: PopulationBranch,
    /// The same for the DVS state (64 dimensions), when there is an encoder.
    pub dvs: Option<PopulationBranch>,
    /// Layers of the decision module; the first one takes the spikes of both branches.
    pub decision: Vec<Layer>,
}

/// HSVAE's encoder and the readout of its last voltages. State lives for an episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventEncoder {
    /// Convolutions, 4x4, stride 2, one zero around.
    pub layers: Vec<ConvLayer>,
    /// Threshold of all their neurons.
    pub threshold: f64,
    /// `d_c`.
    pub keep_current: f64,
    /// `d_v`.
    pub keep_voltage: f64,
    /// `mu` of the last layer's voltages, scaled to zero mean and unit deviation.
    pub readout: Readout,
}

/// A convolution of spiking neurons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConvLayer {
    /// Name.
    pub name: String,
    /// Channels of the input.
    pub inputs: usize,
    /// Channels of the output.
    pub outputs: usize,
    /// Pixels along a side of the input; the output has half.
    pub side: usize,
    /// [outputs, inputs, 4, 4].
    pub weights: Vec<f32>,
    /// One for each output channel; added to the current every step.
    pub bias: Vec<f32>,
}

/// A fully connected layer that the host computes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Readout {
    /// [outputs, inputs].
    pub weights: Vec<f32>,
    /// One for each output.
    pub bias: Vec<f32>,
}

/// Gaussian population code (eq. 6) and the spiking layer that it feeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PopulationBranch {
    /// Neurons per dimension.
    pub neurons: usize,
    /// Centres, [dimensions, neurons].
    pub mean: Vec<f32>,
    /// Widths, [dimensions, neurons].
    pub deviation: Vec<f32>,
    /// The layer of the middle fuse module.
    pub layer: Layer,
}

impl ConvLayer {
    /// Neurons of the layer.
    pub fn neurons(&self) -> usize {
        self.outputs * (self.side / 2) * (self.side / 2)
    }
}

impl PopulationBranch {
    /// Dimensions of the state.
    pub fn dimensions(&self) -> usize {
        self.mean.len() / self.neurons
    }

    /// Strength of stimulation of every neuron, `exp(-((s - mean) / deviation)^2 / 2)` (eq. 6),
    /// its probability to spike per step.
    pub fn activity(&self, state: &[f32]) -> Vec<f64> {
        gaussian_activity(&self.mean, &self.deviation, self.neurons, state)
    }
}

/// [`PopulationBranch::activity`] of centres and widths, `neurons` for each number of `state`.
pub fn gaussian_activity(
    mean: &[f32],
    deviation: &[f32],
    neurons: usize,
    state: &[f32],
) -> Vec<f64> {
    let fields = mean.chunks(neurons).zip(deviation.chunks(neurons));
    let mut activity = Vec::with_capacity(mean.len());
    for (value, (means, deviations)) in state.iter().zip(fields) {
        activity.extend(means.iter().zip(deviations).map(|(mean, deviation)| {
            let offset = f64::from(value - mean) / f64::from(*deviation);
            libm::exp(-0.5 * offset * offset)
        }));
    }
    activity
}

impl Readout {
    /// `mu` of the inputs.
    pub fn apply(&self, inputs: &[f32]) -> Vec<f32> {
        let rows = self.weights.chunks_exact(inputs.len()).zip(&self.bias);
        let dot = |row: &[f32]| row.iter().zip(inputs).map(|(w, v)| w * v).sum::<f32>();
        rows.map(|(row, bias)| dot(row) + bias).collect()
    }
}

impl EemSan {
    /// Reads a trained network; `file` is the name that errors mention.
    ///
    /// Tensors: `hsvae.encoder.K.weight`, `.bias`, `hsvae.threshold`, `hsvae.mu.weight`, `.bias`,
    /// `hsvae.latent.mean`, `.deviation`; `actor.population.B.mean`, `.deviation`,
    /// `actor.fuse.B.weight`, `.bias`, `.r` for B = `laser`, `dvs`; `actor.decision.K.weight`,
    /// `.bias`, `.r`. K counts from 1; thresholds are `tanh(r)`.
    ///
    /// Errors: not safetensors; a tensor missing, of another shape, not finite; a layer without
    /// neurons; a threshold or a width not above 0.
    pub fn from_bytes(name: &str, file: &str, bytes: &[u8]) -> Result<Self, NetError> {
        let tensors = tensors::open(file, bytes)?;
        let parts = Parts { file, tensors: &tensors };
        let encoder = parts.encoder("hsvae.")?;
        let laser = parts.branch("laser", ROBOT_STATE)?;
        let latent = encoder.as_ref().map(|encoder| encoder.readout.bias.len());
        let dvs = latent.map(|latent| parts.branch("dvs", latent)).transpose()?;
        if let Some(dvs) = dvs.as_ref().filter(|dvs| dvs.layer.neurons != laser.layer.neurons) {
            let found = dvs.layer.neurons.to_string();
            let limit = format!("{}, as fuse.laser: spikes are added", laser.layer.neurons);
            return Err(parts.value("fuse.dvs", "neurons", found, limit));
        }
        let decision = parts.decision(laser.layer.neurons)?;
        Ok(Self { name: name.to_owned(), steps: STEPS, encoder, laser, dvs, decision })
    }

    /// Reads an encoder alone, as `spikeloop train hsvae` writes it (no prefix before the names), or
    /// that of an EEM-SAN.
    ///
    /// Errors: as [`EemSan::from_bytes`]; no encoder in the file.
    pub fn encoder_from_bytes(file: &str, bytes: &[u8]) -> Result<EventEncoder, NetError> {
        let tensors = tensors::open(file, bytes)?;
        let parts = Parts { file, tensors: &tensors };
        let found = parts.encoder("")?.map_or_else(|| parts.encoder("hsvae."), |e| Ok(Some(e)));
        found?.ok_or_else(|| NetError::Tensor {
            file: file.to_owned(),
            layer: "encoder.1".to_owned(),
            tensor: "encoder.1.weight".to_owned(),
            found: "nothing".to_owned(),
            expected: "F32 [channels, 1, 4, 4]".to_owned(),
        })
    }

    /// Newest event frames that the DVS state lacks on a chip that streams: each layer of the
    /// encoder is a frame behind the one before it, the first behind the host.
    pub fn streamed_frames(&self) -> usize {
        self.encoder.as_ref().map_or(0, |encoder| encoder.layers.len())
    }

    /// Control ticks between an observation and its action on a chip that streams: one until the
    /// codes are injected, and those until the window of the last layer is over.
    pub fn streamed_ticks(&self) -> usize {
        let steps = self.steps as usize;
        // The codes come after one tick, the last window begins a step per layer later.
        (2 * steps + 1 + self.decision.len()).div_ceil(steps) - 1
    }

    /// Name and neurons of every layer: encoder, branches, decision module.
    pub fn layers(&self) -> Vec<(&str, usize)> {
        let encoder = self.encoder.iter().flat_map(|encoder| &encoder.layers);
        let encoder = encoder.map(|layer| (layer.name.as_str(), layer.neurons()));
        encoder.chain(self.dense_layers().map(|l| (l.name.as_str(), l.neurons))).collect()
    }

    /// All fully connected layers: those of the branches, then the decision module.
    pub fn dense_layers(&self) -> impl Iterator<Item = &Layer> {
        let branches = [Some(&self.laser), self.dvs.as_ref()].into_iter().flatten();
        branches.map(|branch| &branch.layer).chain(&self.decision)
    }
}

struct Parts<'a> {
    file: &'a str,
    tensors: &'a SafeTensors<'a>,
}

impl Parts<'_> {
    fn reader<'b>(&'b self, layer: &'b str) -> TensorReader<'b> {
        TensorReader { file: self.file, layer, tensors: self.tensors }
    }

    fn encoder(&self, prefix: &str) -> Result<Option<EventEncoder>, NetError> {
        let (mut layers, mut inputs, mut side) = (Vec::<ConvLayer>::new(), 1, FRAME_COLUMNS);
        loop {
            let layer = format!("encoder.{}", layers.len() + 1);
            let tensor = self.reader(&layer);
            let name = format!("{prefix}{layer}");
            let Some(shape) = tensor.shape(&format!("{name}.weight")) else { break };
            let outputs = shape.first().copied().unwrap_or(0);
            self.some_neurons(&layer, outputs)?;
            let expected = [outputs, inputs, KERNEL, KERNEL];
            let weights = tensor.read(&format!("{name}.weight"), &expected)?;
            let bias = tensor.read(&format!("{name}.bias"), &[outputs])?;
            if side < 2 {
                let limit = format!("at most {}: frames halve", layers.len());
                return Err(self.value(&layer, "layers", (layers.len() + 1).to_string(), limit));
            }
            layers.push(ConvLayer { name: layer, inputs, outputs, side, weights, bias });
            (inputs, side) = (outputs, side / 2);
        }
        let Some(last) = layers.last() else { return Ok(None) };
        let read = self.readout(prefix, last.neurons())?;
        let tensor = self.reader("encoder");
        let threshold = f64::from(tensor.read(&format!("{prefix}threshold"), &[1])?[0]);
        self.above_zero("encoder", "threshold", threshold)?;
        let (keep_current, keep_voltage) = KEEP;
        Ok(Some(EventEncoder { layers, threshold, keep_current, keep_voltage, readout: read }))
    }

    /// `mu`, with the latent vector's mean and deviation worked into it.
    fn readout(&self, prefix: &str, inputs: usize) -> Result<Readout, NetError> {
        let tensor = self.reader("mu");
        let outputs =
            tensor.shape(&format!("{prefix}mu.weight")).and_then(|shape| shape.first().copied());
        let outputs = outputs.unwrap_or(inputs);
        self.some_neurons("mu", outputs)?;
        let mut weights = tensor.read(&format!("{prefix}mu.weight"), &[outputs, inputs])?;
        let mut bias = tensor.read(&format!("{prefix}mu.bias"), &[outputs])?;
        let mean = tensor.read(&format!("{prefix}latent.mean"), &[outputs])?;
        let deviation = tensor.read(&format!("{prefix}latent.deviation"), &[outputs])?;
        for output in 0..outputs {
            self.above_zero("mu", "latent.deviation", f64::from(deviation[output]))?;
            bias[output] = (bias[output] - mean[output]) / deviation[output];
            let row = &mut weights[output * inputs..(output + 1) * inputs];
            row.iter_mut().for_each(|weight| *weight /= deviation[output]);
        }
        Ok(Readout { weights, bias })
    }

    fn branch(&self, name: &str, dimensions: usize) -> Result<PopulationBranch, NetError> {
        let place = format!("population.{name}");
        let tensor = self.reader(&place);
        let shape = tensor.shape(&format!("actor.{place}.mean")).unwrap_or_default();
        let neurons = shape.last().copied().unwrap_or(10);
        self.some_neurons(&place, neurons)?;
        let mean = tensor.read(&format!("actor.{place}.mean"), &[dimensions, neurons])?;
        let deviation = tensor.read(&format!("actor.{place}.deviation"), &[dimensions, neurons])?;
        for deviation in &deviation {
            self.above_zero(&place, "deviation", f64::from(*deviation))?;
        }
        let layer = self.dense(&format!("fuse.{name}"), dimensions * neurons)?;
        Ok(PopulationBranch { neurons, mean, deviation, layer })
    }

    fn decision(&self, fused: usize) -> Result<Vec<Layer>, NetError> {
        let (mut layers, mut inputs) = (Vec::<Layer>::new(), fused);
        loop {
            let name = format!("decision.{}", layers.len() + 1);
            let there = self.reader(&name).shape(&format!("actor.{name}.weight")).is_some();
            if !there && !layers.is_empty() {
                break;
            }
            layers.push(self.dense(&name, inputs)?);
            inputs = layers.last().map_or(0, |layer| layer.neurons);
        }
        if inputs != 2 {
            let name = format!("decision.{}", layers.len());
            return Err(self.value(&name, "neurons", inputs.to_string(), "2: the wheels".into()));
        }
        Ok(layers)
    }

    fn dense(&self, name: &str, inputs: usize) -> Result<Layer, NetError> {
        let tensor = self.reader(name);
        let shape = tensor.shape(&format!("actor.{name}.weight")).unwrap_or_default();
        let neurons = shape.first().copied().unwrap_or(1);
        self.some_neurons(name, neurons)?;
        let weights = tensor.read(&format!("actor.{name}.weight"), &[neurons, inputs])?;
        let bias = tensor.read(&format!("actor.{name}.bias"), &[neurons])?;
        let r = tensor.read(&format!("actor.{name}.r"), &[1])?[0];
        let threshold = f64::from(libm::tanhf(r));
        self.above_zero(name, "threshold tanh(r)", threshold)?;
        let (keep_current, keep_voltage) = KEEP;
        let name = name.to_owned();
        Ok(Layer { name, inputs, neurons, weights, bias, keep_current, keep_voltage, threshold })
    }

    fn some_neurons(&self, place: &str, neurons: usize) -> Result<(), NetError> {
        if neurons > 0 {
            return Ok(());
        }
        Err(self.value(place, "neurons", neurons.to_string(), "1 or more".to_owned()))
    }

    fn above_zero(&self, place: &str, what: &'static str, value: f64) -> Result<(), NetError> {
        if value > 0.0 {
            return Ok(());
        }
        let limit = "above 0; train it to stay there".to_owned();
        Err(self.value(place, what, value.to_string(), limit))
    }

    fn value(&self, place: &str, what: &'static str, value: String, limit: String) -> NetError {
        NetError::Value { file: self.file.to_owned(), place: place.to_owned(), what, value, limit }
    }
}
