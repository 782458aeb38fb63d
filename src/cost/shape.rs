//! Sizes of EEM-SAN's layers.

use serde::{Deserialize, Serialize};

use crate::net::EemSan;
use crate::net::eem_san::{FRAMES_PER_TICK, KERNEL, StateCode};

/// A convolution, 4x4, stride 2, one zero around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConvShape {
    /// Channels of the input.
    pub inputs: u64,
    /// Channels of the output.
    pub outputs: u64,
    /// Pixels along a side of the input; the output has half.
    pub side: u64,
}

/// A fully connected layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DenseShape {
    /// Inputs.
    pub inputs: u64,
    /// Outputs.
    pub outputs: u64,
}

/// EEM-SAN with an encoder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shape {
    /// Layers of the encoder.
    pub encoder: Vec<ConvShape>,
    /// `mu`; `sigma` has the same sizes.
    pub readout: DenseShape,
    /// Layers of the middle fuse module: laser, DVS.
    pub branches: [DenseShape; 2],
    /// Layers of the decision module.
    pub decision: Vec<DenseShape>,
    /// Event frames per control tick.
    pub frames: u64,
    /// `T`.
    pub steps: u64,
}

impl ConvShape {
    /// Neurons or outputs.
    pub fn neurons(&self) -> u64 {
        self.outputs * (self.side / 2) * (self.side / 2)
    }

    /// Products if the zeros around the picture are multiplied as well.
    pub fn products_with_border(&self) -> u64 {
        self.neurons() * self.inputs * (KERNEL * KERNEL) as u64
    }

    /// Products with pixels of the picture: along a side, `side / 2` windows have 4 taps each, less
    /// one at either end.
    pub fn products(&self) -> u64 {
        let taps = 2 * self.side - 2;
        self.inputs * self.outputs * taps * taps
    }

    /// Targets of a spike away from the border: `kernel^2 / stride^2` windows, all channels.
    pub fn fan_out(&self) -> u64 {
        4 * self.outputs
    }
}

impl DenseShape {
    /// Products.
    pub fn products(&self) -> u64 {
        self.inputs * self.outputs
    }
}

impl Shape {
    /// Sizes of a network; `None` without an encoder, with another one than HSVAE's, without a middle
    /// fuse module, or with dynamic thresholds: the paper's costs and artificial counterparts are
    /// those of EEM-SAN.
    pub fn of(network: &EemSan) -> Option<Self> {
        let (encoder, dvs) = network.encoder.as_ref().zip(network.dvs.as_ref())?;
        let population = matches!(network.laser.code, StateCode::Population(_));
        if !population || network.dynamic.is_some() || !encoder.kind.is_hsvae() {
            return None;
        }
        let dense = |inputs: usize, outputs: usize| DenseShape {
            inputs: inputs as u64,
            outputs: outputs as u64,
        };
        let convs = encoder.layers.iter().map(|layer| ConvShape {
            inputs: layer.inputs as u64,
            outputs: layer.outputs as u64,
            side: layer.side as u64,
        });
        let readout = &encoder.readout;
        let branches = [network.laser.layer.as_ref()?, dvs.layer.as_ref()?];
        let decision = network.decision.iter();
        Some(Self {
            encoder: convs.collect(),
            readout: dense(readout.weights.len() / readout.bias.len(), readout.bias.len()),
            branches: branches.map(|layer| dense(layer.inputs, layer.neurons)),
            decision: decision.map(|layer| dense(layer.inputs, layer.neurons)).collect(),
            frames: FRAMES_PER_TICK as u64,
            steps: u64::from(network.steps),
        })
    }

    /// Fully connected layers in order: branches, then decision module.
    pub fn dense_layers(&self) -> impl Iterator<Item = &DenseShape> {
        self.branches.iter().chain(&self.decision)
    }

    /// Neurons of the encoder.
    pub fn encoder_neurons(&self) -> u64 {
        self.encoder.iter().map(ConvShape::neurons).sum()
    }

    /// Neurons of middle fuse and decision module.
    pub fn decision_neurons(&self) -> u64 {
        self.dense_layers().map(|layer| layer.outputs).sum()
    }
}
