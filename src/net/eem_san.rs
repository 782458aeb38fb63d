//! EEM-SAN as trained: spiking encoder of event frames, codes, fused decision module; and the
//! networks that it is compared with, which have some parts of it.
//!
//! One safetensors file holds all of it. Tensors of the encoder begin with `hsvae.`, those of the
//! rest with `actor.`; [`EemSan::from_bytes`] lists them. Without `hsvae.` tensors there are no
//! events, as in the laser-only control.

use safetensors::SafeTensors;
use serde::{Deserialize, Serialize, Serializer};

use crate::net::bdett::Bdett;
use crate::net::encoder::RATE_INPUTS;
use crate::net::encoder_kind::EncoderKind;
use crate::net::error::NetError;
use crate::net::network::Layer;
use crate::net::tensors::{self, TensorReader};
use crate::policy::{FRAME_COLUMNS, LASER_SECTORS, TOLD};

/// Numbers of robot and laser state: goal direction and term, two speeds, 18 laser terms.
pub const ROBOT_STATE: usize = 4 + LASER_SECTORS;

/// Which numbers of robot and laser state have a sign.
const SIGNED: [usize; 2] = [0, 3];

/// Event frames per control tick.
pub const FRAMES_PER_TICK: usize = 5;

/// `d_c`, `d_v` of all neurons (Sec. 4.1).
const KEEP: (f64, f64) = (0.5, 0.75);

/// `T`, steps per decision (Sec. 4.1).
const STEPS: u32 = 5;

/// Side and stride of all kernels, and the zeros around a picture (Table 1).
pub const KERNEL: usize = 4;

/// A trained EEM-SAN, its laser-only control, or another network of its parts.
///
/// Serialized, a network that has only the parts of an EEM-SAN is what it was before there were
/// others, so that its digest stays.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EemSan {
    /// Name.
    pub name: String,
    /// `T`: steps per decision.
    pub steps: u32,
    /// Encoder of event frames; `None` without events.
    pub encoder: Option<EventEncoder>,
    /// Whether the simulator tells it the DVS state, what a faultless encoder could say of movers: no
    /// chip can have such a network, it shows what an encoder is worth.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub told: bool,
    /// Code of robot and laser state (22 dimensions), and its layer.
    pub laser: Branch,
    /// The same for the DVS state (64 dimensions), when there is an encoder or it is told.
    pub dvs: Option<Branch>,
    /// Layers of the decision module; the first one takes the spikes of both branches or, where they
    /// have no layers, of both codes, its inputs being the lines of one code after the other's.
    pub decision: Vec<Layer>,
    /// How thresholds move, if they do: those of the layers are the ones at the start of a trial.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamic: Option<Bdett>,
}

/// HSVAE's encoder and the readout of its last voltages, or one that it is compared with.
///
/// Artificial neurons give their drive at once, as neurons do that keep neither current nor
/// voltage; the readout takes the mean of the last layer's over the frames of a tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventEncoder {
    /// What its neurons are, and how long state lives.
    #[serde(skip_serializing_if = "EncoderKind::is_hsvae")]
    pub kind: EncoderKind,
    /// Convolutions, 4x4, stride 2, one zero around.
    pub layers: Vec<ConvLayer>,
    /// Threshold of all their neurons; 0 of artificial ones.
    pub threshold: f64,
    /// `d_c`; 0 of artificial neurons.
    pub keep_current: f64,
    /// `d_v`; 0 of artificial neurons.
    pub keep_voltage: f64,
    /// `mu` of what is read of the last layer, scaled to zero mean and unit deviation.
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

/// How a state becomes spikes, and the layer of the middle fuse module that they feed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Branch {
    /// Code.
    pub code: StateCode,
    /// The layer; `None` with naive fusion, for all branches.
    #[serde(serialize_with = "bare")]
    pub layer: Option<Layer>,
}

/// A code: probability of each of its lines to spike per step.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum StateCode {
    /// Gaussian receptive fields.
    Population(PopulationCode),
    /// SAN's code of robot and laser state.
    Rate,
}

/// Gaussian population code (eq. 6).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PopulationCode {
    /// Neurons per dimension.
    pub neurons: usize,
    /// Centres, [dimensions, neurons].
    pub mean: Vec<f32>,
    /// Widths, [dimensions, neurons].
    pub deviation: Vec<f32>,
}

/// A layer as itself, none as nothing.
fn bare<S: Serializer>(layer: &Option<Layer>, to: S) -> Result<S::Ok, S::Error> {
    match layer {
        Some(layer) => layer.serialize(to),
        None => to.serialize_unit(),
    }
}

impl ConvLayer {
    /// Neurons of the layer.
    pub fn neurons(&self) -> usize {
        self.outputs * (self.side / 2) * (self.side / 2)
    }
}

impl StateCode {
    /// Number of lines.
    pub fn lines(&self) -> usize {
        match self {
            Self::Population(code) => code.mean.len(),
            Self::Rate => RATE_INPUTS,
        }
    }

    /// Probability of every line to spike per step: of a population code the strength of stimulation
    /// `exp(-((s - mean) / deviation)^2 / 2)` (eq. 6).
    pub fn activity(&self, state: &[f32]) -> Vec<f64> {
        match self {
            Self::Population(code) => {
                gaussian_activity(&code.mean, &code.deviation, code.neurons, state)
            }
            Self::Rate => rate_activity(state),
        }
    }
}

/// SAN's 24 probabilities of robot and laser state: goal direction and turning speed are split by
/// their sign.
///
/// Shapes: `state` has [`ROBOT_STATE`] numbers, result [`RATE_INPUTS`].
pub fn rate_activity(state: &[f32]) -> Vec<f64> {
    let mut activity = Vec::with_capacity(RATE_INPUTS);
    for (number, value) in state.iter().enumerate() {
        activity.push(f64::from(value.max(0.0)));
        if SIGNED.contains(&number) {
            activity.push(f64::from((-value).max(0.0)));
        }
    }
    activity
}

/// [`StateCode::activity`] of centres and widths, `neurons` for each number of `state`.
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
    /// `actor.fuse.B.weight`, `.bias` for B = `laser`, `dvs`; `actor.decision.K.weight`, `.bias`. K
    /// counts from 1. `hsvae.kind` says which encoder it is: 1 is AVAE, which has no
    /// `hsvae.threshold`, 2 is FSVAE, none HSVAE ([`EncoderKind`]). Thresholds of layers are `tanh`
    /// of their `.r`, or their `.threshold`, or all of them move by the rule `actor.bdett`
    /// ([`Bdett`]). With `actor.told` there is a DVS state without an encoder, as many numbers as that
    /// says. Without `actor.fuse.laser.weight` fusion is naive, without
    /// `actor.population.laser.mean` robot and laser state have SAN's rate code.
    ///
    /// Errors: not safetensors; a tensor missing, of another shape, not finite; a layer without
    /// neurons; a threshold or a width not above 0; a rule that cannot be; an encoder of no known
    /// kind.
    pub fn from_bytes(name: &str, file: &str, bytes: &[u8]) -> Result<Self, NetError> {
        let tensors = tensors::open(file, bytes)?;
        if !tensors.names().iter().any(|name| name.starts_with("actor.")) {
            return Err(NetError::NotEemSan { file: file.to_owned() });
        }
        let parts = Parts { file, tensors: &tensors };
        let encoder = parts.encoder("hsvae.")?;
        let dynamic = parts.dynamic()?;
        let start = dynamic.map(|rule| f64::from(rule.initial));
        let laser = parts.branch("laser", ROBOT_STATE, start)?;
        let told = parts.told(encoder.is_some())?;
        let latent = encoder.as_ref().map(|encoder| encoder.readout.bias.len()).or(told);
        let dvs = latent.map(|latent| parts.branch("dvs", latent, start)).transpose()?;
        let inputs = parts.fused(&laser, dvs.as_ref())?;
        let decision = parts.decision(inputs, start)?;
        let name = name.to_owned();
        let told = told.is_some();
        Ok(Self { name, steps: STEPS, encoder, told, laser, dvs, decision, dynamic })
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
            expected: "F32 or F16 [channels, 1, 4, 4]".to_owned(),
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
        let layers = usize::from(self.laser.layer.is_some()) + self.decision.len();
        (2 * steps + layers).div_ceil(steps) - 1
    }

    /// Name and neurons of every layer: encoder, branches, decision module.
    pub fn layers(&self) -> Vec<(&str, usize)> {
        let encoder = self.encoder.iter().flat_map(|encoder| &encoder.layers);
        let encoder = encoder.map(|layer| (layer.name.as_str(), layer.neurons()));
        encoder.chain(self.dense_layers().map(|l| (l.name.as_str(), l.neurons))).collect()
    }

    /// Robot and laser state, then the DVS state if there is one.
    pub fn branches(&self) -> impl Iterator<Item = &Branch> {
        [Some(&self.laser), self.dvs.as_ref()].into_iter().flatten()
    }

    /// Weights of every spiking layer: encoder, branches, decision module.
    pub fn weights_mut(&mut self) -> Vec<&mut Vec<f32>> {
        let encoder = self.encoder.iter_mut().flat_map(|encoder| &mut encoder.layers);
        let encoder = encoder.map(|layer| &mut layer.weights);
        let branches = [Some(&mut self.laser), self.dvs.as_mut()].into_iter().flatten();
        let fused = branches.filter_map(|branch| branch.layer.as_mut());
        encoder.chain(fused.chain(&mut self.decision).map(|layer| &mut layer.weights)).collect()
    }

    /// All fully connected layers: those of the branches, then the decision module.
    pub fn dense_layers(&self) -> impl Iterator<Item = &Layer> {
        self.branches().filter_map(|branch| branch.layer.as_ref()).chain(&self.decision)
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
        let readout = self.readout(prefix, last.neurons())?;
        let kind = self.kind(prefix)?;
        let (mut threshold, (mut keep_current, mut keep_voltage)) = (0.0, KEEP);
        if kind.spikes() {
            let tensor = self.reader("encoder");
            threshold = f64::from(tensor.read(&format!("{prefix}threshold"), &[1])?[0]);
            self.above_zero("encoder", "threshold", threshold)?;
        } else {
            (keep_current, keep_voltage) = (0.0, 0.0);
        }
        Ok(Some(EventEncoder { kind, layers, threshold, keep_current, keep_voltage, readout }))
    }

    fn kind(&self, prefix: &str) -> Result<EncoderKind, NetError> {
        let name = format!("{prefix}kind");
        if !self.there(&name) {
            return Ok(EncoderKind::Hsvae);
        }
        let found = self.reader("encoder").read(&name, &[1])?[0];
        let kind = EncoderKind::ALL.into_iter().find(|kind| kind.number() == Some(found));
        let limit = "1 (AVAE) or 2 (FSVAE), or no such tensor (HSVAE); train or export again";
        kind.ok_or_else(|| self.value("encoder", "kind", found.to_string(), limit.to_owned()))
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

    fn there(&self, name: &str) -> bool {
        self.tensors.tensor(name).is_ok()
    }

    fn dynamic(&self) -> Result<Option<Bdett>, NetError> {
        const NAME: &str = "actor.bdett";
        if !self.there(NAME) {
            return Ok(None);
        }
        let rule = Bdett::from_array(&self.reader("bdett").read(NAME, &[Bdett::LEN])?);
        self.above_zero("bdett", "initial", f64::from(rule.initial))?;
        self.above_zero("bdett", "temporal_scale", f64::from(rule.temporal_scale))?;
        self.above_zero("bdett", "energy_scale", f64::from(rule.energy_scale))?;
        Ok(Some(rule))
    }

    /// Numbers that the simulator tells, if it does.
    fn told(&self, encoder: bool) -> Result<Option<usize>, NetError> {
        const NAME: &str = "actor.told";
        if !self.there(NAME) {
            return Ok(None);
        }
        let found = self.reader("told").read(NAME, &[1])?[0];
        if encoder {
            let limit = "nothing beside an encoder; take one of both out".to_owned();
            return Err(self.value("told", "numbers", found.to_string(), limit));
        }
        if found != TOLD as f32 {
            return Err(self.value("told", "numbers", found.to_string(), format!("{TOLD}")));
        }
        Ok(Some(TOLD))
    }

    /// `start` is the threshold of layers whose thresholds are dynamic.
    fn branch(
        &self,
        name: &str,
        dimensions: usize,
        start: Option<f64>,
    ) -> Result<Branch, NetError> {
        let code = self.code(name, dimensions)?;
        // One layer makes the fusion that of the paper; then there must be all of them.
        let middle = ["laser", "dvs"].map(|name| format!("actor.fuse.{name}.weight"));
        if !middle.iter().any(|name| self.there(name)) {
            return Ok(Branch { code, layer: None });
        }
        let layer = self.dense(&format!("fuse.{name}"), code.lines(), start)?;
        Ok(Branch { code, layer: Some(layer) })
    }

    fn code(&self, name: &str, dimensions: usize) -> Result<StateCode, NetError> {
        let place = format!("population.{name}");
        let parts = ["mean", "deviation"].map(|part| format!("actor.{place}.{part}"));
        if name == "laser" && self.rate_coded() {
            return Ok(StateCode::Rate);
        }
        let tensor = self.reader(&place);
        let shape = tensor.shape(&parts[0]).unwrap_or_default();
        let neurons = shape.last().copied().unwrap_or(10);
        self.some_neurons(&place, neurons)?;
        let [mean, deviation] = parts.map(|part| tensor.read(&part, &[dimensions, neurons]));
        let (mean, deviation) = (mean?, deviation?);
        for deviation in &deviation {
            self.above_zero(&place, "deviation", f64::from(*deviation))?;
        }
        Ok(StateCode::Population(PopulationCode { neurons, mean, deviation }))
    }

    /// Whether robot and laser state have a rate code: there is no population code for them, and the
    /// first layer has its lines.
    fn rate_coded(&self) -> bool {
        let population = ["mean", "deviation"].map(|p| format!("actor.population.laser.{p}"));
        self.there("actor.decision.1.weight") && !population.iter().any(|name| self.there(name))
    }

    /// Inputs of the decision module.
    fn fused(&self, laser: &Branch, dvs: Option<&Branch>) -> Result<usize, NetError> {
        let Some(layer) = &laser.layer else {
            return Ok(laser.code.lines() + dvs.map_or(0, |dvs| dvs.code.lines()));
        };
        let other = dvs.and_then(|dvs| dvs.layer.as_ref());
        if let Some(other) = other.filter(|other| other.neurons != layer.neurons) {
            let found = other.neurons.to_string();
            let limit = format!("{}, as fuse.laser: spikes are added", layer.neurons);
            return Err(self.value("fuse.dvs", "neurons", found, limit));
        }
        Ok(layer.neurons)
    }

    fn decision(&self, fused: usize, start: Option<f64>) -> Result<Vec<Layer>, NetError> {
        let (mut layers, mut inputs) = (Vec::<Layer>::new(), fused);
        loop {
            let name = format!("decision.{}", layers.len() + 1);
            if !self.there(&format!("actor.{name}.weight")) && !layers.is_empty() {
                break;
            }
            layers.push(self.dense(&name, inputs, start)?);
            inputs = layers.last().map_or(0, |layer| layer.neurons);
        }
        if inputs != 2 {
            let name = format!("decision.{}", layers.len());
            return Err(self.value(&name, "neurons", inputs.to_string(), "2: the wheels".into()));
        }
        Ok(layers)
    }

    fn dense(&self, name: &str, inputs: usize, start: Option<f64>) -> Result<Layer, NetError> {
        let tensor = self.reader(name);
        let shape = tensor.shape(&format!("actor.{name}.weight")).unwrap_or_default();
        let neurons = shape.first().copied().unwrap_or(1);
        self.some_neurons(name, neurons)?;
        let weights = tensor.read(&format!("actor.{name}.weight"), &[neurons, inputs])?;
        let bias = tensor.read(&format!("actor.{name}.bias"), &[neurons])?;
        let threshold = start.map_or_else(|| self.threshold(name), Ok)?;
        let (keep_current, keep_voltage) = KEEP;
        let name = name.to_owned();
        Ok(Layer { name, inputs, neurons, weights, bias, keep_current, keep_voltage, threshold })
    }

    /// A layer's threshold, learned or fixed.
    fn threshold(&self, name: &str) -> Result<f64, NetError> {
        let fixed = format!("actor.{name}.threshold");
        let tensor = self.reader(name);
        let (what, threshold) = if self.there(&fixed) {
            ("threshold", tensor.read(&fixed, &[1])?[0])
        } else {
            let r = tensor.read(&format!("actor.{name}.r"), &[1])?[0];
            ("threshold tanh(r)", libm::tanhf(r))
        };
        self.above_zero(name, what, f64::from(threshold))?;
        Ok(f64::from(threshold))
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
