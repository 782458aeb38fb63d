//! Float layers to mantissas, layer by layer.
//!
//! In Algorithm 1 of the paper the bias enters the *current*; the chip's bias register enters the
//! *voltage*. So the bias becomes a synapse from an always-on line, one for each layer, which the
//! host keeps spiking while that layer's window is open.

use hw_model::ChipSpec;
use hw_model::fixed::DECAY_UNIT;

use crate::compile::error::CompileError;
use crate::compile::graph::{
    BiasRegisters, GraphPopulation, IntegerGraph, Mantissas, Projection, Signs, Source,
};
use crate::compile::policy::{Policy, Scale, WEIGHT_BITS_MAX};
use crate::net::network::RELAY_NAMES;
use crate::net::{Layer, Network};

/// Name of the port that takes the encoder's spikes.
pub const INPUT_PORT: &str = "in";
/// Name of the port with one always-on line for each layer.
pub const BIAS_PORT: &str = "bias";
/// Relay neurons spike on every input: 120 > 100, as in SAN's `loihi_network`.
const RELAY_WEIGHT: i16 = 120;
const RELAY_THRESHOLD: u32 = 100;
/// Largest power of two by which a bias mantissa stands for more than a weight's: a larger bias
/// lowers the layer's scale.
const BIAS_SHIFT_MAX: u32 = 7;

/// A layer in integers.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantizedLayer {
    /// Mantissas per unit of the float weights.
    pub scale: f64,
    /// Power of two that multiplies the weight mantissas.
    pub exponent: i8,
    /// Threshold in units of 64.
    pub threshold_mantissa: u32,
    /// Weights, row-major like [`Layer::weights`].
    pub weights: Vec<i16>,
    /// Biases.
    pub bias: Vec<i16>,
    /// Power of two that multiplies the bias mantissas.
    pub bias_exponent: i8,
}

/// Quantizes one layer.
///
/// Errors: nothing but zeros, or a threshold that its register cannot hold.
pub fn quantize_layer(
    layer: &Layer,
    policy: &Policy,
    chip: &ChipSpec,
) -> Result<QuantizedLayer, CompileError> {
    if max_magnitude(&layer.weights).max(max_magnitude(&layer.bias)) == 0.0 {
        return Err(CompileError::NoScale { layer: layer.name.clone() });
    }
    let mut best = with_exponent(layer, policy, chip, 0)?;
    let top = if policy.largest_exponent { chip.arithmetic.weight_exponent_max } else { 0 };
    for exponent in 1..=top {
        match with_exponent(layer, policy, chip, exponent) {
            Ok(finer) if finer.bias_exponent <= top && !finer.can_overflow(layer, chip) => {
                best = finer
            }
            _ => break,
        }
    }
    Ok(best)
}

/// The layer with a given weight exponent.
fn with_exponent(
    layer: &Layer,
    policy: &Policy,
    chip: &ChipSpec,
    exponent: i8,
) -> Result<QuantizedLayer, CompileError> {
    let unit = f64::from(1u32 << exponent);
    let (scale, bias_shift) = match policy.scale {
        Scale::WeightsAndBias => {
            let largest = max_magnitude(&layer.weights).max(max_magnitude(&layer.bias));
            (policy.weight_grid().max / largest, 0)
        }
        Scale::WeightsAlignedToThreshold => aligned_scale(layer, policy, unit),
    };
    let bias_scale = scale / f64::from(1u32 << bias_shift);
    Ok(QuantizedLayer {
        scale,
        exponent,
        threshold_mantissa: threshold_mantissa(layer, scale * unit, chip)?,
        weights: layer
            .weights
            .chunks(layer.inputs)
            .flat_map(|row| policy.round_row(&scaled(row, scale)))
            .collect(),
        bias: scaled(&layer.bias, bias_scale)
            .iter()
            .map(|b| policy.round(*b, policy.bias_grid()))
            .collect(),
        bias_exponent: exponent + bias_shift as i8,
    })
}

/// The threshold in units of 64.
fn threshold_mantissa(layer: &Layer, scale: f64, chip: &ChipSpec) -> Result<u32, CompileError> {
    // SAN truncates; an aligned threshold is whole but for the last bit of the product.
    let mantissa = (layer.threshold * scale + 1e-9).floor() as i64;
    let limit = chip.arithmetic.threshold_mantissa_max();
    let fits = u32::try_from(mantissa).ok().filter(|m| (1..=limit).contains(m));
    fits.ok_or_else(|| {
        let (layer, threshold) = (layer.name.clone(), layer.threshold);
        let advice = if mantissa < 1 {
            "the threshold is too small beside the weights: train it to stay above 0, or prune the largest weights"
        } else {
            "it is too large beside the weights for the chip's registers of thresholds and voltages: take a chip with wider ones, or train a lower threshold"
        };
        CompileError::Threshold { layer, threshold, mantissa, limit, advice }
    })
}

impl QuantizedLayer {
    /// Chip units of current and voltage for 1 of the float network's.
    pub fn voltage_unit(&self) -> f64 {
        64.0 * self.scale * f64::from(1u32 << self.exponent)
    }

    /// Whether any register can overflow in the worst case: all inputs of one sign of a neuron
    /// spike in every step.
    fn can_overflow(&self, layer: &Layer, chip: &ChipSpec) -> bool {
        let a = &chip.arithmetic;
        let step = 64.0 * f64::from(1u32 << self.exponent);
        let bias_step = 64.0 * f64::from(1u32 << self.bias_exponent);
        let rows = self.weights.chunks(layer.inputs).zip(&self.bias);
        let worst = rows
            .map(|(row, bias)| {
                let bias = f64::from(*bias) * bias_step;
                let sum = |sign: f64| -> f64 {
                    let signed = row.iter().map(|w| (f64::from(*w) * step * sign).max(0.0));
                    signed.sum::<f64>() + (bias * sign).max(0.0)
                };
                sum(1.0).max(sum(-1.0))
            })
            .fold(0.0, f64::max);
        let settled = |keep: f64| if keep < 1.0 { 1.0 / (1.0 - keep) } else { f64::INFINITY };
        let current = worst * settled(layer.keep_current);
        worst >= f64::from(1u32 << a.accumulator_bits)
            || current >= f64::from(1u32 << a.current_bits)
            || current * settled(layer.keep_voltage) >= f64::from(1u32 << a.voltage_bits)
    }
}

/// Products in 32 bit, as SAN's `loihi_network` makes them: in 64 bit its largest bias of layer 2
/// would become 255 and not the published 254. Weights so small that the scale is no 32-bit number
/// are multiplied in 64 bit.
fn scaled(values: &[f32], scale: f64) -> Vec<f64> {
    let single = scale as f32;
    if single.is_normal() {
        return values.iter().map(|value| f64::from(value * single)).collect();
    }
    values.iter().map(|value| f64::from(*value) * scale).collect()
}

/// Largest scale at which the weights fit and the threshold is whole in steps of 1 / `unit`, and
/// the shift that lets the bias fit beside the weights.
fn aligned_scale(layer: &Layer, policy: &Policy, unit: f64) -> (f64, u32) {
    let (weight_max, bias_max) = (max_magnitude(&layer.weights), max_magnitude(&layer.bias));
    // A layer without weights is scaled by its bias.
    let (weights, biases) = (policy.weight_grid().max, policy.bias_grid().max);
    let largest = if weight_max > 0.0 { weights / weight_max } else { biases / bias_max };
    let bias_limit = |shift: u32| biases * f64::from(1u32 << shift);
    let largest = largest.min(bias_limit(BIAS_SHIFT_MAX) / bias_max);
    let whole = (layer.threshold * largest * unit).floor();
    let scale = if whole >= 1.0 { whole / unit / layer.threshold } else { largest };
    let fits = |shift: &u32| bias_max * scale <= bias_limit(*shift);
    (scale, (0..BIAS_SHIFT_MAX).find(fits).unwrap_or(BIAS_SHIFT_MAX))
}

fn max_magnitude(values: &[f32]) -> f64 {
    values.iter().fold(0.0, |max, value| f64::from(value.abs()).max(max))
}

/// A network in integers, with the scales that were used.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantized {
    /// Populations and synapses.
    pub graph: IntegerGraph,
    /// The layers, in the order of the network.
    pub layers: Vec<QuantizedLayer>,
}

/// Quantizes a network and lays out its ports: inputs and biases come from the host, directly or
/// through relay neurons.
///
/// Errors: as [`quantize_layer`].
pub fn quantize(
    network: &Network,
    policy: &Policy,
    chip: &ChipSpec,
) -> Result<Quantized, CompileError> {
    let layers: Vec<_> = network
        .layers
        .iter()
        .map(|layer| quantize_layer(layer, policy, chip))
        .collect::<Result<_, _>>()?;
    let mut graph = IntegerGraph {
        name: network.name.clone(),
        ports: vec![
            (INPUT_PORT.to_owned(), network.inputs()),
            (BIAS_PORT.to_owned(), network.layers.len()),
        ],
        populations: Vec::new(),
        projections: Vec::new(),
    };
    let (mut source, bias_source) = if network.relay {
        let [inputs, biases] = RELAY_NAMES;
        (add_relay(&mut graph, 0, inputs), add_relay(&mut graph, 1, biases))
    } else {
        (Source::Port(0), Source::Port(1))
    };
    let signs = if policy.split_signs { Signs::Split } else { Signs::Mixed };
    for (index, (layer, quantized)) in network.layers.iter().zip(&layers).enumerate() {
        let target = graph.populations.len();
        graph.populations.push(population(layer, quantized));
        graph.projections.push(Projection {
            sources: vec![source],
            first_source: 0,
            target,
            mantissas: Mantissas::Dense(transposed(
                &quantized.weights,
                layer.neurons,
                layer.inputs,
            )),
            signs,
            weight_bits: policy.weight_bits,
            exponent: quantized.exponent,
        });
        graph.projections.push(Projection {
            sources: vec![bias_source],
            first_source: index,
            target,
            mantissas: Mantissas::Dense(quantized.bias.clone()),
            signs,
            weight_bits: WEIGHT_BITS_MAX,
            exponent: quantized.bias_exponent,
        });
        source = Source::Population(target);
    }
    Ok(Quantized { graph, layers })
}

pub(super) fn population(layer: &Layer, quantized: &QuantizedLayer) -> GraphPopulation {
    let decay = |keep: f64| ((1.0 - keep) * f64::from(DECAY_UNIT)).round() as u16;
    GraphPopulation {
        name: layer.name.clone(),
        neurons: layer.neurons,
        decay_current: decay(layer.keep_current),
        decay_voltage: decay(layer.keep_voltage),
        threshold_mantissa: quantized.threshold_mantissa,
        bias: BiasRegisters::default(),
    }
}

/// Neurons that repeat the lines of `port` one step later, and nothing else.
fn add_relay(graph: &mut IntegerGraph, port: usize, name: &str) -> Source {
    let neurons = graph.ports[port].1;
    let target = graph.populations.len();
    graph.populations.push(GraphPopulation {
        name: name.to_owned(),
        neurons,
        decay_current: DECAY_UNIT as u16,
        decay_voltage: DECAY_UNIT as u16,
        threshold_mantissa: RELAY_THRESHOLD,
        bias: BiasRegisters::default(),
    });
    let mut mantissas = vec![0; neurons * neurons];
    (0..neurons).for_each(|i| mantissas[i * neurons + i] = RELAY_WEIGHT);
    graph.projections.push(Projection {
        sources: vec![Source::Port(port)],
        first_source: 0,
        target,
        mantissas: Mantissas::Dense(mantissas),
        signs: Signs::Split,
        weight_bits: WEIGHT_BITS_MAX,
        exponent: 0,
    });
    Source::Population(target)
}

pub(super) fn transposed(weights: &[i16], rows: usize, columns: usize) -> Vec<i16> {
    (0..columns).flat_map(|c| (0..rows).map(move |r| weights[r * columns + c])).collect()
}

#[cfg(test)]
#[path = "quantize_tests.rs"]
mod tests;
