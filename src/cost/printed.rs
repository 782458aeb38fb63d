//! What the paper prints, and what it implies.

use crate::cost::{ConvShape, Shape};

/// A row of the paper's Table 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// Additions, three digits.
    pub additions: f64,
    /// Multiplications, two or three digits.
    pub multiplications: f64,
}

/// Table 5 of the paper, rows (i) to (iv).
pub const PRINTED: [Printed; 4] = [
    Printed { additions: 1.33e7, multiplications: 0.52e7 },
    Printed { additions: 5.87e7, multiplications: 5.78e7 },
    Printed { additions: 1.63e7, multiplications: 0.85e7 },
    Printed { additions: 6.16e7, multiplications: 6.11e7 },
];

/// Row (iv) over row (i), additions and multiplications (text on Table 5).
pub const RATIOS: (f64, f64) = (4.63, 11.66);

/// Additions of the spiking decision module: between 342,480, or row (ii) would print less, and
/// 379,090, or (i) and (iii) would not be 0.30e7 apart.
const DECISION_ADDITIONS: f64 = 0.355e6;

/// Additions of the spiking encoder: between 12.971e6, or row (iii) would print less, and 13.008e6,
/// or row (i) would print more.
const ENCODER_ADDITIONS: f64 = 12.98e6;

/// Spikes per neuron and step of the encoder's layers, taken as equal, that give the paper's
/// additions.
pub fn implied_encoder_rate(shape: &Shape) -> f64 {
    let frames = shape.frames as f64;
    let first = shape.encoder.first().map_or(0, ConvShape::products_with_border);
    let fixed = frames * (first + shape.encoder_neurons()) as f64;
    let pairs = shape.encoder.iter().zip(shape.encoder.iter().skip(1));
    let full: u64 = pairs.map(|(from, to)| from.neurons() * to.fan_out()).sum();
    (ENCODER_ADDITIONS - fixed) / (frames * full as f64)
}

/// The same for the decision module and its inputs.
pub fn implied_decision_rate(shape: &Shape) -> f64 {
    let fused: u64 = shape.branches.iter().map(|branch| branch.outputs).sum();
    let first = shape.decision.first().map_or(0, |layer| fused * layer.outputs);
    let branches: u64 = shape.branches.iter().map(|branch| branch.products()).sum();
    let rest: u64 = shape.decision.iter().skip(1).map(|layer| layer.products()).sum();
    let steps = shape.steps as f64;
    let full = steps * (branches + first + rest) as f64;
    (DECISION_ADDITIONS - steps * shape.decision_neurons() as f64) / full
}
