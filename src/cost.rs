//! What one control tick of EEM-SAN costs, and what its artificial counterparts would (Table 5).
//!
//! Four accountings of the same work:
//!
//! | | `paper` | `exact` | `chip` | `neurobench` |
//! |---|---|---|---|---|
//! | artificial convolution | product and sum per tap, taps outside of the picture too; one addition of the bias per output | product and sum per tap inside; sums begin at the bias | as `exact` | dense: taps inside; effective: input and weight not 0 |
//! | spiking convolution 1 | as an artificial one | as an artificial one | a sum per spike and target | as above |
//! | other spiking convolutions | spikes x 4 x channels, and one bias per output and step | a sum per spike and target | the same | as above |
//! | artificial fully connected | **inputs x inputs**, one bias per output | inputs x outputs | as `exact` | as above |
//! | spiking fully connected | spikes x outputs, one bias per output and step | spikes x outputs | the same | as above |
//! | neuron and step | - | 2 products, 2 sums | 2 products, 3 sums (bias) | membranes that changed |
//! | `mu` of a spiking encoder | - | once per tick | - (the host's) | once per tick |
//! | `mu` of an artificial encoder | each frame | each frame | as `exact` | each frame |
//! | `sigma` | each frame, artificial only | - (nothing reads it) | - | - |
//! | fusing two artificial groups | - | one sum per neuron and step | as `exact` | - |
//!
//! Sources. `paper`: the printed table is met by the counter published with FSVAE
//! (kamata1729/FullySpikingVAE, `utils.py`), whose rule for a fully connected layer squares the
//! inputs, with biases counted by outputs; that gives 61,069,600 products and 61,586,610 sums in
//! row (iv). FSVAE's own rule, biases by the size of the input, would print 6.17e7 sums there in
//! place of 6.16e7. `neurobench`: NeuroBench 2.3.0, `SynapticOperations` and `MembraneUpdates`; a
//! sample is a control tick; a call whose inputs are all -1, 0 or 1 counts as AC, any other as MAC.
//! `chip`: compartments decay and add as `hw_model::compartment::update` does, steps outside of a
//! layer's window are left out; what is artificial cannot run there and counts as in `exact`.
//!
//! Left out everywhere, because it is the same in all rows: population code, random draws,
//! decoding (counts / T, means over frames). Comparisons, selections, ReLU, sigmoid are neither
//! additions nor multiplications; nor are the exponentials and logarithms of BDETT's thresholds, whose
//! other operations are in `exact` and `chip`.
//!
//! Artificial modules run as the paper counts them: the encoder on each of 5 frames, the decision
//! for each of T steps.

mod activity;
mod arithmetic;
mod closed_form;
mod counts;
mod printed;
mod shape;

pub use activity::{Activity, Traffic};
pub use arithmetic::ArithmeticTable;
pub use closed_form::{artificial_ops, closed_form};
pub use counts::{Counts, NeuroBench, Ops};
pub use printed::{PRINTED, Printed, RATIOS, implied_decision_rate, implied_encoder_rate};
pub use shape::{ConvShape, DenseShape, Shape};

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// One thing for each module that a row of the table is made of.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Modules<T> {
    /// HSVAE's encoder as it is.
    pub spiking_encoder: T,
    /// The same layers with ReLU in place of neurons.
    pub artificial_encoder: T,
    /// Middle fuse and decision module as they are.
    pub spiking_decision: T,
    /// The same layers with ReLU, and a sigmoid at the end.
    pub artificial_decision: T,
}

impl AddAssign for Modules<Counts> {
    fn add_assign(&mut self, other: Self) {
        self.spiking_encoder += other.spiking_encoder;
        self.artificial_encoder += other.artificial_encoder;
        self.spiking_decision += other.spiking_decision;
        self.artificial_decision += other.artificial_decision;
    }
}

impl AddAssign<&Self> for Modules<Activity> {
    fn add_assign(&mut self, other: &Self) {
        self.spiking_encoder += &other.spiking_encoder;
        self.artificial_encoder += &other.artificial_encoder;
        self.spiking_decision += &other.spiking_decision;
        self.artificial_decision += &other.artificial_decision;
    }
}

/// A row of Table 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Row {
    /// (i): spiking encoder, spiking decision.
    SpikingSpiking,
    /// (ii): artificial encoder, spiking decision.
    ArtificialSpiking,
    /// (iii): spiking encoder, artificial decision.
    SpikingArtificial,
    /// (iv): artificial encoder, artificial decision.
    ArtificialArtificial,
}

impl Row {
    /// All rows in the paper's order.
    pub const ALL: [Self; 4] = [
        Self::SpikingSpiking,
        Self::ArtificialSpiking,
        Self::SpikingArtificial,
        Self::ArtificialArtificial,
    ];

    /// Its number in the paper.
    pub fn number(self) -> &'static str {
        ["(i)", "(ii)", "(iii)", "(iv)"][self as usize]
    }

    /// What encodes and what decides.
    pub fn modules(self) -> &'static str {
        ["SNN + SNN", "ANN + SNN", "SNN + ANN", "ANN + ANN"][self as usize]
    }

    /// Its counts from those of the modules.
    pub fn counts(self, modules: &Modules<Counts>) -> Counts {
        let (mut sum, decision) = match self {
            Self::SpikingSpiking => (modules.spiking_encoder, modules.spiking_decision),
            Self::ArtificialSpiking => (modules.artificial_encoder, modules.spiking_decision),
            Self::SpikingArtificial => (modules.spiking_encoder, modules.artificial_decision),
            Self::ArtificialArtificial => (modules.artificial_encoder, modules.artificial_decision),
        };
        sum += decision;
        sum
    }
}

#[cfg(test)]
#[path = "cost_tests.rs"]
mod tests;
