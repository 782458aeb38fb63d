//! Algorithm 1 in 32-bit floats: plain loops, no matrix library, so that every machine computes
//! the same bits.

use crate::coding::{InputSpikes, decode, encode};
use crate::net::{Bdett, Layer, Network, RateEncoder};
use crate::policy::{Action, Observation, Policy};
use crate::reference::Decision;
use crate::reference::bdett::MovingThresholds;
use crate::rng::Streams;

/// A network laid out for running.
#[derive(Debug, Clone)]
pub struct FloatNetwork {
    steps: u32,
    layers: Vec<FloatLayer>,
}

/// A fully connected layer and its state.
#[derive(Debug, Clone)]
pub(super) struct FloatLayer {
    /// Weights by input: `columns[i * neurons + n]`.
    columns: Vec<f32>,
    bias: Vec<f32>,
    keep_current: f32,
    keep_voltage: f32,
    threshold: f32,
    /// In place of the threshold.
    moving: Option<MovingThresholds>,
    current: Vec<f32>,
    voltage: Vec<f32>,
    pub(super) spikes: Vec<bool>,
}

impl FloatNetwork {
    /// Takes a network's weights.
    pub fn new(network: &Network) -> Self {
        Self { steps: network.steps, layers: network.layers.iter().map(FloatLayer::new).collect() }
    }

    /// One decision from zero state: T steps of all layers, each layer in the same step as the
    /// one before it.
    ///
    /// Shapes: `input[step][line]`, T steps.
    pub fn decide(&mut self, input: &InputSpikes) -> Decision {
        let outputs = self.layers.last().map_or(0, |layer| layer.spikes.len());
        let mut decision = Decision::new(self.layers.len(), outputs);
        self.layers.iter_mut().for_each(FloatLayer::reset);
        for step in input.iter().take(self.steps as usize) {
            let mut spikes: &[bool] = step;
            let last = self.layers.len() - 1;
            for (index, layer) in self.layers.iter_mut().enumerate() {
                layer.step(&[spikes]);
                spikes = &layer.spikes;
                decision.add_step(index, spikes, index == last);
            }
        }
        decision
    }
}

impl FloatLayer {
    pub(super) fn new(layer: &Layer) -> Self {
        let columns = (0..layer.inputs)
            .flat_map(|i| (0..layer.neurons).map(move |n| layer.weights[n * layer.inputs + i]));
        Self {
            columns: columns.collect(),
            bias: layer.bias.clone(),
            keep_current: layer.keep_current as f32,
            keep_voltage: layer.keep_voltage as f32,
            threshold: layer.threshold as f32,
            moving: None,
            current: vec![0.0; layer.neurons],
            voltage: vec![0.0; layer.neurons],
            spikes: vec![false; layer.neurons],
        }
    }

    /// The same with thresholds that move.
    pub(super) fn moving(self, rule: Bdett) -> Self {
        Self { moving: Some(MovingThresholds::new(rule, self.bias.len())), ..self }
    }

    pub(super) fn reset(&mut self) {
        self.current.fill(0.0);
        self.voltage.fill(0.0);
        self.spikes.fill(false);
        self.moving.iter_mut().for_each(MovingThresholds::restart);
    }

    /// `c = d_c c + W s + b`, `v = d_v v (1 - s_prev) + c`, `s = [v > threshold]`, where `s` may be
    /// several groups of spikes that share the weights.
    pub(super) fn step(&mut self, inputs: &[&[bool]]) {
        let neurons = self.spikes.len();
        let mut drive = vec![0.0f32; neurons];
        for input in inputs {
            let columns = self.columns.chunks_exact(neurons).zip(*input);
            for (column, _) in columns.filter(|(_, spike)| **spike) {
                drive.iter_mut().zip(column).for_each(|(sum, weight)| *sum += weight);
            }
        }
        let before = self.moving.as_ref().map(|_| self.voltage.clone());
        for (n, drive) in drive.into_iter().enumerate() {
            self.current[n] = self.keep_current * self.current[n] + (drive + self.bias[n]);
            let kept = if self.spikes[n] { 0.0 } else { self.keep_voltage * self.voltage[n] };
            self.voltage[n] = kept + self.current[n];
            self.spikes[n] = self.voltage[n] > self.threshold;
        }
        if let (Some(moving), Some(before)) = (&mut self.moving, before) {
            moving.fire(&before, &self.voltage, &mut self.spikes);
        }
    }
}

/// The float network as a driver.
#[derive(Debug, Clone)]
pub struct FloatPolicy {
    network: FloatNetwork,
    encoder: RateEncoder,
    streams: Streams,
}

impl FloatPolicy {
    /// A driver for `network`; its trial has yet to start.
    pub fn new(network: &Network) -> Self {
        let streams = Streams::new(0, 0);
        Self { network: FloatNetwork::new(network), encoder: network.encoder, streams }
    }
}

impl Policy for FloatPolicy {
    fn start_trial(&mut self, streams: Streams) {
        self.streams = streams;
    }

    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let input = encode(&self.encoder, observation, self.network.steps, &self.streams, tick);
        let counts = self.network.decide(&input).output_counts;
        decode(&counts, self.network.steps)
    }
}
