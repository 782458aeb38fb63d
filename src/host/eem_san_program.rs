//! The host's part of a compiled EEM-SAN: what to inject, hold, read and clear in a control tick.
//!
//! A layer that is `k` layers away from the host works `k` steps after the host began to inject.
//! Two schedules make the best of it.
//!
//! *Held*. Phases of a control tick, in chip steps; a spike injected in one step arrives
//! in the next, so each phase begins with a step in which the first spikes are under way:
//!
//! ```text
//! encoder   0 inject frame 1   1 .. 5 layer 1   2 .. 6 layer 2   3 .. 7 layer 3   4 .. 8 layer 4
//! decision  0 inject codes     1 .. T branches  2 .. T + 1 layer 1 ...
//! ```
//! A layer of the encoder is held outside its five steps, so that its state lasts and it makes no
//! step of its own; the other phase's cores are held throughout. With that, chip and Algorithm 1
//! (in fixed point) are equal spike for spike. The decision module is cleared after each decision;
//! an encoder that forgets from tick to tick (FSVAE) is cleared after its phase as well.
//!
//! *Streaming*. One chip step for each event frame, and nothing is held. Layer `k` of the encoder
//! works on the frame of `k` steps ago, so the readout lacks the newest frames, and its bias begins
//! `k - 1` steps late in an episode. The codes of one tick are injected during the next; layer `k`
//! of the decision is cleared when its window begins, every T steps. The action of a tick is known
//! two ticks later; until the first one the wheels are told to stand.

use hw_model::CoreMap;
use serde::{Deserialize, Serialize};

use crate::coding::InputSpikes;
use crate::compile::eem_san::{DVS_PORT, LASER_PORT, PIXEL_PORT, QuantizedEemSan};
use crate::compile::quantize::BIAS_PORT;
use crate::cost::{ConvShape, DenseShape, Shape};
use crate::net::eem_san::{
    EemSan, FRAMES_PER_TICK, ROBOT_STATE, Readout, StateCode, gaussian_activity, rate_activity,
};
use crate::net::encoder::RATE_INPUTS;
use crate::policy::{EventFrame, FRAME_COLUMNS, FRAME_PIXELS};

/// Most steps of a phase, and most neurons per dimension of a code.
const STEPS_MAX: u32 = 1 << 16;

/// How encoder and decision module share the chip's steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Schedule {
    /// One after the other, cores held in between: equal to Algorithm 1.
    #[default]
    Held,
    /// Both at the pace of event frames, each layer later than the one before.
    Streaming,
    /// As `Held`, and the encoder is cleared after its phase, as the decision module is: for one
    /// that is at rest at the start of each control tick (FSVAE). Compiling such a network for
    /// `Held` gives this.
    HeldCleared,
}

/// How the host runs an EEM-SAN on the chip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EemSanProgram {
    /// Schedule.
    pub schedule: Schedule,
    /// `T`: steps for which codes are injected and outputs are counted.
    pub steps: u32,
    /// Index of the port with one always-on line for each population.
    pub bias_port: u32,
    /// The encoder's phase; `None` for the laser-only control.
    pub encoder: Option<EncoderPhase>,
    /// Code of robot and laser state.
    pub laser: CodedPort,
    /// Code of the DVS state, when there is an encoder.
    pub dvs: Option<CodedPort>,
    /// Windows of branches and decision module, T steps long; the last one is the output's. Without
    /// branches, the codes go to the first layer of the decision module.
    pub decision: Vec<Window>,
    /// Chip steps of a decision: T and one for each layer on the way.
    pub decision_steps: u32,
}

/// When a population works: from step `start` of its phase on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// The population, which has the bias line of its own number.
    pub population: u32,
    /// First step; at least 1. Its bias line is injected one step earlier.
    pub start: u32,
}

/// The encoder's phase of a control tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EncoderPhase {
    /// Frames per control tick: the length of all windows.
    pub frames: u32,
    /// Index of the port of event frames.
    pub pixel_port: u32,
    /// Windows of the layers, in order.
    pub layers: Vec<Window>,
    /// Chip steps of the phase.
    pub chip_steps: u32,
    /// Chip units of the last layer's voltage for 1 of the float network's.
    pub voltage_unit: f64,
    /// `mu` of the last layer's voltages, which the host computes.
    pub readout: Readout,
}

/// A code and the port that takes its spikes: a Gaussian population code (eq. 6), or SAN's rate code,
/// which has no numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CodedPort {
    /// Index of the port.
    pub port: u32,
    /// Neurons per dimension; 0 for the rate code.
    pub neurons: u32,
    /// Centres, [dimensions, neurons].
    pub mean: Vec<f32>,
    /// Widths, [dimensions, neurons].
    pub deviation: Vec<f32>,
}

impl CodedPort {
    fn new(code: &StateCode, map: &CoreMap, port: &str) -> Self {
        let port = port_of(map, port);
        match code {
            StateCode::Rate => Self { port, neurons: 0, mean: Vec::new(), deviation: Vec::new() },
            StateCode::Population(code) => Self {
                port,
                neurons: code.neurons as u32,
                mean: code.mean.clone(),
                deviation: code.deviation.clone(),
            },
        }
    }

    fn is_rate(&self) -> bool {
        self.neurons == 0 && self.mean.is_empty() && self.deviation.is_empty()
    }

    /// Number of lines.
    pub fn lines(&self) -> usize {
        if self.is_rate() { RATE_INPUTS } else { self.mean.len() }
    }

    /// Gaussians that the host computes for it.
    pub fn gaussians(&self) -> usize {
        self.mean.len()
    }

    /// Probability of each line to spike per step.
    pub fn activity(&self, state: &[f32]) -> Vec<f64> {
        if self.is_rate() {
            return rate_activity(state);
        }
        gaussian_activity(&self.mean, &self.deviation, self.neurons as usize, state)
    }

    fn check(&self, name: &str, map: &CoreMap, dimensions: usize) -> Result<(), String> {
        if self.is_rate() && dimensions == ROBOT_STATE {
            return check_lines(map, name, self.port, RATE_INPUTS);
        }
        let (mean, deviation) = (self.mean.len(), self.deviation.len());
        let neurons = dimensions.checked_mul(self.neurons as usize);
        if self.neurons == 0 || neurons != Some(mean) || mean != deviation {
            return Err(format!(
                "code {name}: {mean} centres and {deviation} widths, {dimensions} times {} expected",
                self.neurons
            ));
        }
        let good = |(m, d): (&f32, &f32)| m.is_finite() && d.is_finite() && *d > 0.0;
        if !self.mean.iter().zip(&self.deviation).all(good) {
            return Err(format!("code {name}: centres must be finite, widths above 0"));
        }
        check_lines(map, name, self.port, mean)
    }
}

fn port_of(map: &CoreMap, name: &str) -> u32 {
    map.port(name).expect("quantize makes the port") as u32
}

fn check_lines(map: &CoreMap, name: &str, port: u32, expected: usize) -> Result<(), String> {
    let lines = map.ports().get(port as usize).map(|port| port.lines as usize);
    if lines == Some(expected) {
        return Ok(());
    }
    Err(format!("port {name} has {lines:?} lines, {expected} expected"))
}

impl Window {
    /// Whether step `step` is in the window, `len` steps long.
    pub fn holds(&self, step: u32, len: u32) -> bool {
        (self.start..self.start + len).contains(&step)
    }

    /// Whether the bias line is injected in step `step`.
    fn biased(&self, step: u32, len: u32) -> bool {
        self.holds(step + 1, len)
    }
}

/// (port, line) of spikes that the host injects in one step.
pub(super) type Injected = Vec<(u64, u32, u32)>;

impl EemSanProgram {
    /// The program for a freshly compiled network.
    pub(super) fn new(
        network: &EemSan,
        quantized: &QuantizedEemSan,
        map: &CoreMap,
        schedule: Schedule,
    ) -> Self {
        let (n_encoder, n_branches) = (quantized.encoder_layers, quantized.branches);
        let phase = network.encoder.as_ref().map(|encoder| {
            let last = &quantized.layers[n_encoder - 1].1;
            let window = |layer| Window { population: layer as u32, start: layer as u32 + 1 };
            EncoderPhase {
                frames: FRAMES_PER_TICK as u32,
                pixel_port: port_of(map, PIXEL_PORT),
                layers: (0..n_encoder).map(window).collect(),
                chip_steps: (FRAMES_PER_TICK + n_encoder) as u32,
                voltage_unit: last.voltage_unit(),
                readout: encoder.readout.clone(),
            }
        });
        // The first one or two layers get the codes, the others follow one after the other.
        let n_first = n_branches.max(1);
        let window = |layer: usize| Window {
            population: (n_encoder + layer) as u32,
            start: (layer + 1).saturating_sub(n_first) as u32 + 1,
        };
        let n_decision = quantized.layers.len() - n_encoder;
        Self {
            schedule,
            steps: network.steps,
            bias_port: port_of(map, BIAS_PORT),
            encoder: phase,
            laser: CodedPort::new(&network.laser.code, map, LASER_PORT),
            dvs: network.dvs.as_ref().map(|dvs| CodedPort::new(&dvs.code, map, DVS_PORT)),
            decision: (0..n_decision).map(window).collect(),
            decision_steps: network.steps + 1 + (n_decision - n_first) as u32,
        }
    }

    /// Window of the output population.
    pub(super) fn output(&self) -> Window {
        *self.decision.last().expect("the program was checked")
    }

    /// What the host injects in step `step` of the encoder's phase.
    pub(super) fn frames_at(
        &self,
        phase: &EncoderPhase,
        frames: &[EventFrame],
        step: u32,
    ) -> Injected {
        let frame = frames.get(step as usize).filter(|_| step < phase.frames);
        let pixels = frame.into_iter().flat_map(EventFrame::active);
        let pixels = pixels.map(|pixel| (0, phase.pixel_port, pixel as u32));
        pixels.chain(self.biases(&phase.layers, phase.frames, step)).collect()
    }

    /// What the host injects in step `step` of a decision. Shapes: `inputs[branch][step][line]`.
    pub(super) fn codes_at(&self, inputs: &[InputSpikes], step: u32) -> Injected {
        let mut injected: Injected = self.biases(&self.decision, self.steps, step).collect();
        for (code, input) in self.codes().zip(inputs) {
            let lines = input.get(step as usize).map_or(&[][..], Vec::as_slice);
            let spiking = lines.iter().enumerate().filter(|(_, spike)| **spike);
            injected.extend(spiking.map(|(line, _)| (0, code.port, line as u32)));
        }
        injected
    }

    /// What the host injects in step `step` of an episode that streams: the frame of this step,
    /// `codes[branch][step of the tick][line]` of the tick before, and the biases of all layers
    /// that the first frame or the first code has reached.
    pub(super) fn streamed_at(
        &self,
        phase: &EncoderPhase,
        frame: &EventFrame,
        codes: &[InputSpikes],
        step: u64,
    ) -> Injected {
        let pixels = frame.active().map(|pixel| (0, phase.pixel_port, pixel as u32));
        let layers = phase.layers.iter().filter(|w| step + 1 >= u64::from(w.start));
        let decision = self.decision.iter().filter(|w| step + 1 >= self.streamed_start(w));
        let biases = layers.chain(decision).map(|w| (0, self.bias_port, w.population));
        let mut injected: Injected = pixels.chain(biases).collect();
        let step_idx = (step % u64::from(phase.frames)) as usize;
        for (code, input) in self.codes().zip(codes) {
            let spiking = input[step_idx].iter().enumerate().filter(|(_, spike)| **spike);
            injected.extend(spiking.map(|(line, _)| (0, code.port, line as u32)));
        }
        injected
    }

    /// First step of a decision window in an episode that streams: codes are there after the first
    /// tick. Further windows follow every T steps.
    pub fn streamed_start(&self, window: &Window) -> u64 {
        u64::from(self.steps) + u64::from(window.start)
    }

    /// Chip steps by which each population is behind the host in an episode that streams: its
    /// spikes in step `s` are those of Algorithm 1 in step `s` less so many, counted from the
    /// first frame (encoder) or from the first tick's decision (the others).
    pub fn delays(&self) -> Vec<u64> {
        let encoder = self.encoder.iter().flat_map(|phase| &phase.layers);
        let encoder = encoder.map(|window| u64::from(window.start));
        encoder.chain(self.decision.iter().map(|window| self.streamed_start(window))).collect()
    }

    fn biases<'a>(
        &'a self,
        windows: &'a [Window],
        len: u32,
        step: u32,
    ) -> impl Iterator<Item = (u64, u32, u32)> + 'a {
        let open = windows.iter().filter(move |window| window.biased(step, len));
        open.map(|window| (0, self.bias_port, window.population))
    }

    /// Codes in the order of the branches.
    pub fn codes(&self) -> impl Iterator<Item = &CodedPort> {
        [Some(&self.laser), self.dvs.as_ref()].into_iter().flatten()
    }

    /// Sizes of the network's layers, from those of `map`'s populations; `None` without an encoder,
    /// population codes or a middle fuse module, for what is no EEM-SAN.
    pub fn shape(&self, map: &CoreMap) -> Option<Shape> {
        let (phase, dvs) = self.encoder.as_ref().zip(self.dvs.as_ref())?;
        let [laser, fused, layers @ ..] = self.decision.as_slice() else { return None };
        if fused.start != laser.start || self.laser.is_rate() {
            return None;
        }
        let neurons = |w: &Window| map.populations()[w.population as usize].len() as u64;
        let (mut encoder, mut inputs, mut side) = (Vec::new(), 1, FRAME_COLUMNS as u64);
        for window in &phase.layers {
            let outputs = neurons(window) / ((side / 2) * (side / 2)).max(1);
            encoder.push(ConvShape { inputs, outputs, side });
            (inputs, side) = (outputs, (side / 2).max(1));
        }
        let dense =
            |inputs: usize, w: &Window| DenseShape { inputs: inputs as u64, outputs: neurons(w) };
        let mut inputs = neurons(laser);
        let layer = |w: &Window| {
            let outputs = neurons(w);
            DenseShape { inputs: std::mem::replace(&mut inputs, outputs), outputs }
        };
        let outputs = phase.readout.bias.len() as u64;
        Some(Shape {
            readout: DenseShape { inputs: encoder.last().map_or(0, ConvShape::neurons), outputs },
            encoder,
            branches: [dense(self.laser.mean.len(), laser), dense(dvs.mean.len(), fused)],
            decision: layers.iter().map(layer).collect(),
            frames: u64::from(phase.frames),
            steps: u64::from(self.steps),
        })
    }

    /// What does not go with `map`, in words.
    pub(super) fn check(&self, map: &CoreMap) -> Result<(), String> {
        self.laser.check(LASER_PORT, map, ROBOT_STATE)?;
        check_lines(map, BIAS_PORT, self.bias_port, map.populations().len())?;
        check_windows("decision", &self.decision, self.steps, self.decision_steps, map)?;
        let output = self.decision.last().ok_or("no layers of a decision")?;
        let outputs = map.populations()[output.population as usize].len();
        if outputs != 2 {
            return Err(format!("output population has {outputs} neurons, 2 expected"));
        }
        if self.schedule == Schedule::HeldCleared && self.encoder.is_none() {
            return Err("there is no encoder to be cleared at each control tick".to_owned());
        }
        let in_step = self.encoder.as_ref().is_some_and(|phase| phase.frames == self.steps);
        if self.schedule == Schedule::Streaming && !in_step {
            return Err(format!("streaming needs an encoder of {} frames per tick", self.steps));
        }
        match (&self.encoder, &self.dvs) {
            (None, None) => (),
            (Some(phase), Some(dvs)) => {
                dvs.check(DVS_PORT, map, phase.readout.bias.len())?;
                self.check_encoder(phase, map)?;
            }
            _ => return Err("an encoder and a code of its state go together".to_owned()),
        }
        let encoder = self.encoder.iter().flat_map(|phase| &phase.layers);
        for (index, window) in encoder.chain(&self.decision).enumerate() {
            if window.population as usize != index {
                return Err(format!(
                    "layer {}: population {}, {index} expected",
                    index + 1,
                    window.population
                ));
            }
        }
        Ok(())
    }

    fn check_encoder(&self, phase: &EncoderPhase, map: &CoreMap) -> Result<(), String> {
        if phase.frames as usize != FRAMES_PER_TICK {
            return Err(format!("{} frames per tick, {FRAMES_PER_TICK} expected", phase.frames));
        }
        check_lines(map, PIXEL_PORT, phase.pixel_port, FRAME_PIXELS)?;
        check_windows("encoder", &phase.layers, phase.frames, phase.chip_steps, map)?;
        let last = phase.layers.last().ok_or("no layers of the encoder")?;
        let neurons = map.populations()[last.population as usize].len();
        let Readout { weights, bias } = &phase.readout;
        if neurons == 0 || bias.len().checked_mul(neurons) != Some(weights.len()) {
            return Err(format!(
                "readout: {} weights and {} biases for {neurons} neurons",
                weights.len(),
                bias.len()
            ));
        }
        let unit = phase.voltage_unit;
        if !(weights.iter().chain(bias).all(|w| w.is_finite()) && unit > 0.0 && unit.is_finite()) {
            return Err("readout: numbers must be finite, the voltage unit above 0".to_owned());
        }
        Ok(())
    }
}

/// Errs unless the windows of a phase are of populations of the map and within the phase's steps.
fn check_windows(
    phase: &str,
    windows: &[Window],
    len: u32,
    chip_steps: u32,
    map: &CoreMap,
) -> Result<(), String> {
    if len == 0 || len > chip_steps || chip_steps > STEPS_MAX {
        return Err(format!("{phase}: windows of {len} in {chip_steps} steps"));
    }
    for Window { population, start } in windows {
        let n = map.populations().len();
        if *population as usize >= n {
            return Err(format!("{phase}: population {population}, the map has {n}"));
        }
        if *start == 0 || *start > chip_steps - len {
            return Err(format!("{phase}: a window of {len} from step {start} of {chip_steps}"));
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "eem_san_program_tests.rs"]
mod tests;
