//! How real weights become mantissas: named, so that every result can say which it used.

use crate::compile::error::CompileError;

/// Rounding of a scaled weight to the grid of its format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest grid value, ties away from zero.
    Nearest,
    /// Toward zero.
    TowardZero,
    /// To the nearest grid value after adding what the neuron's weights before have lost: the
    /// errors of all weights of a neuron sum to less than one step.
    Diffused,
}

/// What the largest mantissa of a layer stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The largest weight *or bias* of the layer; threshold truncated.
    WeightsAndBias,
    /// The largest weight; the bias gets an exponent of its own. The scale is then lowered until
    /// the threshold falls on a whole mantissa.
    WeightsAlignedToThreshold,
}

/// A quantization policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// One format for both signs (7 bits of magnitude) or one each (8 bits).
    pub split_signs: bool,
    /// Rounding of weights and biases.
    pub rounding: Rounding,
    /// What sets the scale of a layer.
    pub scale: Scale,
    /// Whether a layer takes the largest weight exponent at which none of its registers can
    /// overflow; 0 otherwise. A larger exponent makes chip units finer beside the weights, so that
    /// thresholds and decays are cut less.
    pub largest_exponent: bool,
}

/// All policies.
pub const POLICIES: [Policy; 6] = [
    Policy {
        name: "nearest",
        about: "split signs, nearest, scale from the weights and aligned to the threshold",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
    },
    Policy {
        name: "san",
        about: "SAN's published scaling: split signs, toward zero, scale 255 / max(|W|, |b|)",
        split_signs: true,
        rounding: Rounding::TowardZero,
        scale: Scale::WeightsAndBias,
        largest_exponent: false,
    },
    Policy {
        name: "mixed",
        about: "mixed signs (even mantissas), nearest, scale from the weights, aligned to the threshold",
        split_signs: false,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
    },
    Policy {
        name: "fine",
        about: "as nearest, with the largest weight exponent at which nothing can overflow",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: true,
    },
    Policy {
        name: "diffused",
        about: "as nearest, but the rounding errors of a neuron's weights cancel",
        split_signs: true,
        rounding: Rounding::Diffused,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
    },
    Policy {
        name: "san-nearest",
        about: "SAN's scale with rounding to nearest",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAndBias,
        largest_exponent: false,
    },
];

impl Policy {
    /// The policy called `name`.
    ///
    /// Errors: [`CompileError::UnknownPolicy`] with the names there are.
    pub fn named(name: &str) -> Result<Self, CompileError> {
        POLICIES.into_iter().find(|policy| policy.name == name).ok_or_else(|| {
            let known: Vec<&str> = POLICIES.iter().map(|policy| policy.name).collect();
            CompileError::UnknownPolicy { name: name.to_owned(), known: known.join(", ") }
        })
    }

    /// Distance between mantissas.
    pub(crate) fn step(&self) -> f64 {
        if self.split_signs { 1.0 } else { 2.0 }
    }

    /// Largest magnitude of a mantissa.
    pub(crate) fn mantissa_max(&self) -> f64 {
        if self.split_signs { 255.0 } else { 254.0 }
    }

    /// The scaled weights of one neuron on the grid of the policy.
    pub(crate) fn round_row(&self, scaled: &[f64]) -> Vec<i16> {
        let mut lost = 0.0;
        let diffuse = |weight: &f64| {
            let mantissa = self.round(weight + lost);
            if self.rounding == Rounding::Diffused {
                lost += weight - f64::from(mantissa);
            }
            mantissa
        };
        scaled.iter().map(diffuse).collect()
    }

    /// A scaled weight on the grid of the policy.
    pub(crate) fn round(&self, scaled: f64) -> i16 {
        let steps = match self.rounding {
            Rounding::Nearest | Rounding::Diffused => (scaled / self.step()).round(),
            Rounding::TowardZero => (scaled / self.step()).trunc(),
        };
        (steps * self.step()).clamp(-self.mantissa_max(), self.mantissa_max()) as i16
    }
}
