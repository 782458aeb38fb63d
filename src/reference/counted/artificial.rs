//! The artificial counterparts, counted.

use crate::coding::InputSpikes;
use crate::cost::{Activity, Counts};
use crate::net::{EemSan, EventEncoder};
use crate::reference::counted::Done;
use crate::reference::counted::conv::Conv;
use crate::reference::counted::dense::{Dense, traffic};
use crate::reference::counted::spiking::{by_channel, picture};

/// HSVAE's encoder with ReLU in place of neurons. It has no memory: every frame gives a `mu`, and
/// the state is their mean.
#[derive(Debug, Clone)]
pub struct ArtificialEncoder {
    convolutions: Convolutions,
    mean: Dense,
    deviation: Dense,
}

/// AVAE's encoder as it is: the last layer has no ReLU, and `mu` is read once, of the mean of its
/// outputs over the frames of a tick.
#[derive(Debug, Clone)]
pub struct AvaeEncoder {
    convolutions: Convolutions,
    mean: Dense,
}

/// Layers with ReLU between them.
#[derive(Debug, Clone)]
struct Convolutions {
    layers: Vec<Conv>,
    channels: usize,
}

/// Middle fuse and decision module with ReLU in place of neurons and a sigmoid at the end, run on
/// the spikes of each step; the action is the mean.
#[derive(Debug, Clone)]
pub struct ArtificialDecision {
    branches: Vec<Dense>,
    layers: Vec<Dense>,
}

impl Convolutions {
    fn new(encoder: &EventEncoder) -> Self {
        Self {
            layers: encoder.layers.iter().map(Conv::new).collect(),
            channels: encoder.layers.last().map_or(1, |layer| layer.outputs),
        }
    }

    /// Nothing met by the layers and by what reads them.
    fn activity(&self) -> Activity {
        Activity::new(self.layers.len() + 1, 0)
    }

    /// Sums of the last layer, channel by channel, for a list of active pixels.
    fn apply(&self, frame: &[usize], counts: &mut Counts, activity: &mut Activity) -> Vec<f32> {
        let mut values = self.layers.first().map_or(Vec::new(), |conv| picture(conv, frame));
        for (index, conv) in self.layers.iter().enumerate() {
            if index > 0 {
                values = relu(values);
            }
            activity.layers[index] += conv.traffic(&values);
            values = conv.multiply(&values, counts);
        }
        by_channel(&values, self.channels)
    }

    /// `mu` of these values.
    fn read(
        &self,
        readout: &Dense,
        values: &[f32],
        counts: &mut Counts,
        activity: &mut Activity,
    ) -> Vec<f32> {
        activity.layers[self.layers.len()] += traffic(values);
        readout.multiply(values, counts)
    }
}

impl ArtificialEncoder {
    /// Takes the spiking encoder's weights.
    pub fn new(encoder: &EventEncoder) -> Self {
        let readout = Dense::new(&encoder.readout.weights, &encoder.readout.bias);
        Self { convolutions: Convolutions::new(encoder), mean: readout.clone(), deviation: readout }
    }

    /// The DVS state of these frames, each a list of active pixels.
    pub fn tick(&mut self, frames: &[Vec<usize>]) -> Done<Vec<f32>> {
        let (mut counts, mut activity) = (Counts::default(), self.convolutions.activity());
        let mut states = Vec::new();
        for frame in frames {
            let values = relu(self.convolutions.apply(frame, &mut counts, &mut activity));
            states.push(self.convolutions.read(&self.mean, &values, &mut counts, &mut activity));
            // The paper counts sigma, which nothing reads.
            let mut unread = Counts::default();
            self.deviation.multiply(&values, &mut unread);
            counts.paper += unread.paper;
        }
        Done { output: mean(&states), counts, activity }
    }
}

impl AvaeEncoder {
    /// Takes the weights.
    pub fn new(encoder: &EventEncoder) -> Self {
        let mean = Dense::new(&encoder.readout.weights, &encoder.readout.bias);
        Self { convolutions: Convolutions::new(encoder), mean }
    }

    /// The DVS state of these frames, each a list of active pixels.
    pub fn tick(&mut self, frames: &[Vec<usize>]) -> Done<Vec<f32>> {
        let (mut counts, mut activity) = (Counts::default(), self.convolutions.activity());
        let outputs =
            frames.iter().map(|frame| self.convolutions.apply(frame, &mut counts, &mut activity));
        let outputs = mean(&outputs.collect::<Vec<_>>());
        let output = self.convolutions.read(&self.mean, &outputs, &mut counts, &mut activity);
        Done { output, counts, activity }
    }
}

impl ArtificialDecision {
    /// Takes the spiking modules' weights.
    pub fn new(network: &EemSan) -> Self {
        let dense = |layer: &crate::net::Layer| Dense::new(&layer.weights, &layer.bias);
        let branches = network.branches().filter_map(|branch| branch.layer.as_ref());
        Self {
            branches: branches.map(dense).collect(),
            layers: network.decision.iter().map(dense).collect(),
        }
    }

    /// Each wheel's action, 0 to 1; `inputs[branch][step][line]`.
    pub fn tick(&mut self, inputs: &[InputSpikes]) -> Done<Vec<f32>> {
        let n = self.branches.len() + self.layers.len();
        let (mut counts, mut activity) = (Counts::default(), Activity::new(n, 0));
        let mut actions = Vec::new();
        for step in 0..inputs.first().map_or(0, Vec::len) {
            let mut groups = Vec::new();
            for (index, (dense, input)) in self.branches.iter().zip(inputs).enumerate() {
                let spikes = input[step].iter();
                let input: Vec<f32> = spikes.map(|spike| f32::from(u8::from(*spike))).collect();
                activity.layers[index] += traffic(&input);
                groups.push(relu(dense.multiply(&input, &mut counts)));
            }
            let mut values = fuse(groups, &mut counts);
            for (index, dense) in self.layers.iter().enumerate() {
                activity.layers[self.branches.len() + index] += traffic(&values);
                values = dense.multiply(&values, &mut counts);
                if index + 1 < self.layers.len() {
                    values = relu(values);
                }
            }
            actions.push(values.into_iter().map(sigmoid).collect());
        }
        Done { output: mean(&actions), counts, activity }
    }
}

/// Element-wise sum of the groups; the paper leaves it out.
fn fuse(groups: Vec<Vec<f32>>, counts: &mut Counts) -> Vec<f32> {
    let mut groups = groups.into_iter();
    let mut sums = groups.next().unwrap_or_default();
    for group in groups {
        for (sum, value) in sums.iter_mut().zip(group) {
            *sum += value;
            counts.exact.additions += 1;
            counts.chip.additions += 1;
        }
    }
    sums
}

fn relu(mut values: Vec<f32>) -> Vec<f32> {
    values.iter_mut().for_each(|value| *value = value.max(0.0));
    values
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-x))
}

fn mean(rows: &[Vec<f32>]) -> Vec<f32> {
    let width = rows.first().map_or(0, Vec::len);
    (0..width).map(|i| rows.iter().map(|row| row[i]).sum::<f32>() / rows.len() as f32).collect()
}
