//! The spiking modules, counted.

use crate::coding::InputSpikes;
use crate::cost::{Activity, Counts, Traffic};
use crate::net::{EemSan, EventEncoder};
use crate::reference::counted::Done;
use crate::reference::counted::conv::Conv;
use crate::reference::counted::dense::{Dense, fused, traffic};
use crate::reference::counted::neurons::Neurons;

/// HSVAE's encoder with the state of an episode.
#[derive(Debug, Clone)]
pub struct SpikingEncoder {
    layers: Vec<(Conv, Neurons)>,
    mean: Dense,
    channels: usize,
    /// Whether state goes on from one control tick to the next.
    carries: bool,
}

/// Middle fuse, if there is one, and decision module.
#[derive(Debug, Clone)]
pub struct SpikingDecision {
    branches: Vec<(Dense, Neurons)>,
    layers: Vec<(Dense, Neurons)>,
    /// Whether state goes on from one decision to the next.
    carries: bool,
}

impl SpikingEncoder {
    /// At the start of an episode.
    pub fn new(encoder: &EventEncoder) -> Self {
        let keep = (encoder.keep_current, encoder.keep_voltage);
        let layers = encoder.layers.iter().map(|layer| {
            (Conv::new(layer), Neurons::new(layer.neurons(), keep, encoder.threshold))
        });
        Self {
            layers: layers.collect(),
            mean: Dense::new(&encoder.readout.weights, &encoder.readout.bias),
            channels: encoder.layers.last().map_or(1, |layer| layer.outputs),
            carries: encoder.kind.carries(),
        }
    }

    /// A new episode.
    pub fn reset(&mut self) {
        self.layers.iter_mut().for_each(|(_, neurons)| neurons.reset());
    }

    /// The DVS state after these frames, each a list of active pixels.
    pub fn tick(&mut self, frames: &[Vec<usize>]) -> Done<Vec<f32>> {
        if !self.carries {
            self.reset();
        }
        let n = self.layers.len();
        let (mut counts, mut activity) = (Counts::default(), Activity::new(n + 1, n));
        for (step, frame) in frames.iter().enumerate() {
            let mut spikes = frame.clone();
            for (index, (conv, neurons)) in self.layers.iter_mut().enumerate() {
                activity.layers[index] += conv.traffic(&picture(conv, &spikes));
                let drive = match index {
                    0 => first_layer(conv, &spikes, &mut counts),
                    _ => conv.receive(&spikes, &mut counts),
                };
                neurons.step(&drive, step == 0, index, &mut counts, &mut activity);
                spikes = neurons.spiked();
            }
        }
        let voltages = self.layers.last().map_or(&[][..], |(_, neurons)| &neurons.voltage);
        let voltages = by_channel(voltages, self.channels);
        let mut read = Counts::default();
        let output = self.mean.multiply(&voltages, &mut read);
        // The paper leaves the readout out, and on the chip it is the host's.
        counts.exact += read.exact;
        counts.neurobench += read.neurobench;
        activity.layers[n] += traffic(&voltages);
        Done { output, counts, activity }
    }
}

/// Frames processed as pictures, and on the chip as events: the drive is the same.
fn first_layer(conv: &Conv, events: &[usize], counts: &mut Counts) -> Vec<f32> {
    let (mut dense, mut sparse) = (Counts::default(), Counts::default());
    conv.multiply(&picture(conv, events), &mut dense);
    let drive = conv.receive(events, &mut sparse);
    counts.paper += dense.paper;
    counts.exact += dense.exact;
    counts.neurobench += dense.neurobench;
    counts.chip += sparse.chip;
    drive
}

/// Ones at the given places of a layer's input.
pub(super) fn picture(conv: &Conv, active: &[usize]) -> Vec<f32> {
    let mut picture = vec![0.0; conv.input_size()];
    active.iter().for_each(|at| picture[*at] = 1.0);
    picture
}

/// `[row][column][channel]` as `[channel][row][column]`, the order of trained weights.
pub(super) fn by_channel(values: &[f32], channels: usize) -> Vec<f32> {
    (0..channels).flat_map(|c| values.iter().skip(c).step_by(channels)).copied().collect()
}

impl SpikingDecision {
    /// Takes a network's weights.
    pub fn new(network: &EemSan) -> Self {
        let layer = |layer: &crate::net::Layer| {
            let keep = (layer.keep_current, layer.keep_voltage);
            let neurons = Neurons::new(layer.neurons, keep, layer.threshold);
            let neurons = match network.dynamic {
                Some(rule) => neurons.moving(rule),
                None => neurons,
            };
            (Dense::new(&layer.weights, &layer.bias), neurons)
        };
        let branches = network.branches().filter_map(|branch| branch.layer.as_ref());
        Self {
            branches: branches.map(layer).collect(),
            layers: network.decision.iter().map(layer).collect(),
            carries: network.dynamic.is_some(),
        }
    }

    /// A new trial.
    pub fn reset(&mut self) {
        let all = self.branches.iter_mut().chain(&mut self.layers);
        all.for_each(|(_, neurons)| neurons.reset());
    }

    /// Output spikes of one decision, from zero state unless thresholds are dynamic;
    /// `inputs[branch][step][line]`.
    pub fn tick(&mut self, inputs: &[InputSpikes]) -> Done<Vec<u32>> {
        let (first, n) = (self.branches.len(), self.branches.len() + self.layers.len());
        let (mut counts, mut activity) = (Counts::default(), Activity::new(n, n));
        if !self.carries {
            self.reset();
        }
        let outputs = self.layers.last().map_or(0, |(_, neurons)| neurons.spikes.len());
        let mut output = vec![0; outputs];
        for step in 0..inputs.first().map_or(0, Vec::len) {
            for (index, (branch, input)) in self.branches.iter_mut().zip(inputs).enumerate() {
                let input = [input[step].as_slice()];
                advance(branch, &input, step == 0, index, &mut counts, &mut activity);
            }
            let fused = self.branches.iter().map(|(_, neurons)| neurons.spikes.clone());
            let mut spikes: Vec<Vec<bool>> = fused.collect();
            if spikes.is_empty() {
                spikes.push(inputs.iter().flat_map(|input| &input[step]).copied().collect());
            }
            for (index, layer) in self.layers.iter_mut().enumerate() {
                let groups: Vec<&[bool]> = spikes.iter().map(Vec::as_slice).collect();
                advance(layer, &groups, step == 0, first + index, &mut counts, &mut activity);
                spikes = vec![layer.1.spikes.clone()];
            }
            let last = spikes.iter().flatten();
            output.iter_mut().zip(last).for_each(|(n, spike)| *n += u32::from(*spike));
        }
        Done { output, counts, activity }
    }
}

/// One step of a layer.
fn advance(
    (dense, neurons): &mut (Dense, Neurons),
    groups: &[&[bool]],
    first: bool,
    index: usize,
    counts: &mut Counts,
    activity: &mut Activity,
) {
    let arrivals = groups.iter().flat_map(|group| group.iter()).filter(|spike| **spike).count();
    activity.layers[index] += Traffic { arrivals: arrivals as u64, ..traffic(&fused(groups)) };
    let drive = dense.receive(groups, counts);
    neurons.step(&drive, first, index, counts, activity);
}
