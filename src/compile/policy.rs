//! How real weights become mantissas: named, so that every result can say which it used.

use hw_model::weight::{SignMode, SynapseFormat};

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
    /// One format for both signs (one bit less of magnitude) or one each.
    pub split_signs: bool,
    /// Rounding of weights and biases.
    pub rounding: Rounding,
    /// What sets the scale of a layer.
    pub scale: Scale,
    /// Whether a layer takes the largest weight exponent at which none of its registers can
    /// overflow, 0 if there is none or this is false. A larger exponent makes chip units finer beside
    /// the weights, so that thresholds and decays are cut less.
    pub largest_exponent: bool,
    /// Bits of a stored weight, in mixed mode with the sign: [`Policy::with_weight_bits`]. Biases
    /// are few and always have [`WEIGHT_BITS_MAX`].
    pub weight_bits: u8,
}

/// Bits of the weights of every named policy, and of all biases.
pub const WEIGHT_BITS_MAX: u8 = 8;
/// With fewer, mixed mode has no weight but zero.
const WEIGHT_BITS_MIN: u8 = 2;

/// The mantissas that a format can tell apart: multiples of `step` up to `max`, of either sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    pub(crate) step: f64,
    pub(crate) max: f64,
}

/// All policies.
pub const POLICIES: [Policy; 7] = [
    Policy {
        name: "nearest",
        about: "split signs, nearest, scale from the weights and aligned to the threshold",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "san",
        about: "SAN's published scaling: split signs, toward zero, scale 255 / max(|W|, |b|)",
        split_signs: true,
        rounding: Rounding::TowardZero,
        scale: Scale::WeightsAndBias,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "mixed",
        about: "mixed signs (even mantissas), nearest, scale from the weights, aligned to the threshold",
        split_signs: false,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "fine",
        about: "as nearest, with the largest weight exponent at which nothing can overflow, 0 if there is none",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: true,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "diffused",
        about: "as nearest, but the rounding errors of a neuron's weights cancel",
        split_signs: true,
        rounding: Rounding::Diffused,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "toward-zero",
        about: "as nearest, but every weight is rounded toward zero",
        split_signs: true,
        rounding: Rounding::TowardZero,
        scale: Scale::WeightsAlignedToThreshold,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
    },
    Policy {
        name: "san-nearest",
        about: "SAN's scale with rounding to nearest",
        split_signs: true,
        rounding: Rounding::Nearest,
        scale: Scale::WeightsAndBias,
        largest_exponent: false,
        weight_bits: WEIGHT_BITS_MAX,
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

    /// The same with weights of `bits` bits: the grid is coarser, the largest weight about the same.
    ///
    /// Errors: [`CompileError::WeightBits`] for fewer than 2 or more than 8. What widths there are
    /// is for the chip to say, when a map is made.
    pub fn with_weight_bits(self, bits: u8) -> Result<Self, CompileError> {
        if !(WEIGHT_BITS_MIN..=WEIGHT_BITS_MAX).contains(&bits) {
            let limit = (WEIGHT_BITS_MIN, WEIGHT_BITS_MAX);
            return Err(CompileError::WeightBits { bits, limit });
        }
        Ok(Self { weight_bits: bits, ..self })
    }

    /// [`Self::with_weight_bits`], where there are some.
    ///
    /// Errors: as that.
    pub fn narrowed(self, bits: Option<u8>) -> Result<Self, CompileError> {
        bits.map_or(Ok(self), |bits| self.with_weight_bits(bits))
    }

    /// Name, with the weight bits when they are not those of the named policy: `nearest-5`.
    pub fn label(&self) -> String {
        match self.weight_bits {
            WEIGHT_BITS_MAX => self.name.to_owned(),
            bits => format!("{}-{bits}", self.name),
        }
    }

    /// Mantissas of weights.
    pub(crate) fn weight_grid(&self) -> Grid {
        self.grid(self.weight_bits)
    }

    /// Mantissas of biases.
    pub(crate) fn bias_grid(&self) -> Grid {
        self.grid(WEIGHT_BITS_MAX)
    }

    fn grid(&self, weight_bits: u8) -> Grid {
        let sign_mode = if self.split_signs { SignMode::Excitatory } else { SignMode::Mixed };
        let format = SynapseFormat { sign_mode, weight_bits, exponent: 0 };
        let (step, (_, max)) = (format.mantissa_step(), format.mantissa_range());
        Grid { step: f64::from(step), max: f64::from(max) }
    }

    /// The scaled weights of one neuron on the grid of the policy.
    pub(crate) fn round_row(&self, scaled: &[f64]) -> Vec<i16> {
        let grid = self.weight_grid();
        let mut lost = 0.0;
        let diffuse = |weight: &f64| {
            let mantissa = self.round(weight + lost, grid);
            if self.rounding == Rounding::Diffused {
                lost += weight - f64::from(mantissa);
            }
            mantissa
        };
        scaled.iter().map(diffuse).collect()
    }

    /// A scaled weight or bias on its grid.
    pub(crate) fn round(&self, scaled: f64, grid: Grid) -> i16 {
        let steps = match self.rounding {
            Rounding::Nearest | Rounding::Diffused => (scaled / grid.step).round(),
            Rounding::TowardZero => (scaled / grid.step).trunc(),
        };
        (steps * grid.step).clamp(-grid.max, grid.max) as i16
    }
}
