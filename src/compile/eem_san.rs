//! An EEM-SAN as an integer graph: convolutions, both branches of the fuse module, decision module.
//!
//! ```text
//! pixels --conv--> encoder.1 --conv--> ... encoder.4        (voltages go to the host)
//! laser ---------> fuse.laser --+
//! dvs -----------> fuse.dvs ----+--> decision.1 --> decision.2 --> ...
//! bias: one line onto each population, in this order
//! ```
//! The element-wise addition of the fuse module needs no arithmetic: both branches project onto the
//! first layer of the decision module through the same weights. Without a fuse module both ports
//! project onto it, each through weights of its own.

use hw_model::ChipSpec;

use crate::compile::error::CompileError;
use crate::compile::graph::{GraphPopulation, IntegerGraph, Mantissas, Projection, Signs, Source};
use crate::compile::policy::{Policy, WEIGHT_BITS_MAX};
use crate::compile::quantize::{BIAS_PORT, QuantizedLayer, population, quantize_layer, transposed};
use crate::net::Layer;
use crate::net::conv2d::{Conv2d, Shape};
use crate::net::eem_san::{ConvLayer, EemSan, EventEncoder, KERNEL};
use crate::policy::FRAME_PIXELS;

/// Name of the port that takes event frames, one line for each pixel, row by row.
pub const PIXEL_PORT: &str = "pixels";
/// Name of the port that takes the population code of robot and laser state.
pub const LASER_PORT: &str = "laser";
/// Name of the port that takes the population code of the DVS state.
pub const DVS_PORT: &str = "dvs";

/// Stride of the convolutions, and the zeros around a picture (Table 1).
const STRIDE: usize = 2;
const PAD: usize = 1;

/// An EEM-SAN in integers, with the scales that were used.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantizedEemSan {
    /// Populations and synapses. The populations are the layers, in the order of `layers`.
    pub graph: IntegerGraph,
    /// Name and numbers of each layer: encoder, branches (laser first), decision module. A
    /// convolution's weights are `[outputs, inputs, 4, 4]`, its biases one for each channel.
    pub layers: Vec<(String, QuantizedLayer)>,
    /// How many of `layers` are the encoder's.
    pub encoder_layers: usize,
    /// How many follow that are branches of the fuse module, none with naive fusion.
    pub branches: usize,
}

/// Quantizes every layer by `policy` and lays out the ports.
///
/// Errors: as [`quantize_layer`]; thresholds that move; an artificial encoder.
pub fn quantize_eem_san(
    network: &EemSan,
    policy: &Policy,
    chip: &ChipSpec,
) -> Result<QuantizedEemSan, CompileError> {
    if network.dynamic.is_some() {
        return Err(CompileError::DynamicThresholds {
            network: network.name.clone(),
            neurons: network.dense_layers().map(|layer| layer.neurons).sum(),
            limit: chip.limits.threshold_configs_per_core,
            chip: chip.name.clone(),
        });
    }
    if let Some(encoder) = network.encoder.as_ref().filter(|encoder| !encoder.kind.spikes()) {
        let first = encoder.layers.first();
        return Err(CompileError::ArtificialEncoder {
            network: network.name.clone(),
            layer: first.map_or_else(String::new, |layer| layer.name.clone()),
            neurons: first.map_or(0, ConvLayer::neurons),
            chip: chip.name.clone(),
        });
    }
    let signs = if policy.split_signs { Signs::Split } else { Signs::Mixed };
    let mut builder = Builder { policy, chip, signs, layers: Vec::new(), graph: ports(network) };
    let encoder_layers = match &network.encoder {
        Some(encoder) => builder.encoder(encoder)?,
        None => 0,
    };
    let ports = [LASER_PORT, DVS_PORT];
    let mut fused = Vec::new();
    for (branch, port) in network.branches().zip(ports) {
        if let Some(layer) = &branch.layer {
            let port = builder.port(port);
            fused.push(builder.dense(layer, vec![(vec![port], layer.inputs)])?);
        }
    }
    let branches = fused.len();
    for (index, layer) in network.decision.iter().enumerate() {
        let inputs = match branches {
            0 if index == 0 => {
                let codes = network.branches().zip(ports);
                codes.map(|(b, port)| (vec![builder.port(port)], b.code.lines())).collect()
            }
            _ => vec![(fused, layer.inputs)],
        };
        fused = vec![builder.dense(layer, inputs)?];
    }
    Ok(QuantizedEemSan { graph: builder.graph, layers: builder.layers, encoder_layers, branches })
}

/// The graph with its ports and nothing else.
fn ports(network: &EemSan) -> IntegerGraph {
    let encoder_layers = network.encoder.as_ref().map_or(0, |encoder| encoder.layers.len());
    let n_layers = encoder_layers + network.dense_layers().count();
    let mut ports = Vec::new();
    if network.encoder.is_some() {
        ports.push((PIXEL_PORT.to_owned(), FRAME_PIXELS));
    }
    let codes = network.branches().zip([LASER_PORT, DVS_PORT]);
    ports.extend(codes.map(|(branch, port)| (port.to_owned(), branch.code.lines())));
    ports.push((BIAS_PORT.to_owned(), n_layers));
    let name = network.name.clone();
    IntegerGraph { name, ports, populations: Vec::new(), projections: Vec::new() }
}

struct Builder<'a> {
    policy: &'a Policy,
    chip: &'a ChipSpec,
    signs: Signs,
    layers: Vec<(String, QuantizedLayer)>,
    graph: IntegerGraph,
}

impl Builder<'_> {
    fn port(&self, name: &str) -> Source {
        let port = self.graph.ports.iter().position(|(port, _)| port == name);
        Source::Port(port.expect("made by `ports`"))
    }

    fn encoder(&mut self, encoder: &EventEncoder) -> Result<usize, CompileError> {
        let mut source = self.port(PIXEL_PORT);
        for layer in &encoder.layers {
            let window = window(layer, encoder);
            let quantized = quantize_layer(&window, self.policy, self.chip)?;
            let input = Shape { channels: layer.inputs, height: layer.side, width: layer.side };
            let conv = Conv2d::new(input, layer.outputs, [KERNEL; 2], STRIDE, PAD)
                .expect("the layer was checked when it was read");
            let mantissas = Mantissas::Conv(conv, quantized.weights.clone());
            let area = conv.output().height * conv.output().width;
            source = self.add(&window, quantized, vec![(vec![source], mantissas)], area);
        }
        Ok(encoder.layers.len())
    }

    /// `inputs` are groups of sources; the sources of a group share weights, so many columns.
    fn dense(
        &mut self,
        layer: &Layer,
        inputs: Vec<(Vec<Source>, usize)>,
    ) -> Result<Source, CompileError> {
        let quantized = quantize_layer(layer, self.policy, self.chip)?;
        // By input: the columns of a group are one after the other.
        let mut mantissas = transposed(&quantized.weights, layer.neurons, layer.inputs);
        let mut weights = Vec::new();
        for (sources, columns) in inputs {
            let rest = mantissas.split_off(columns * layer.neurons);
            weights.push((sources, Mantissas::Dense(std::mem::replace(&mut mantissas, rest))));
        }
        Ok(self.add(layer, quantized, weights, 1))
    }

    /// Adds a layer of `area` neurons for each row of `layer`, and its bias line. Groups of sources
    /// have weights of their own.
    fn add(
        &mut self,
        layer: &Layer,
        quantized: QuantizedLayer,
        weights: Vec<(Vec<Source>, Mantissas)>,
        area: usize,
    ) -> Source {
        let target = self.graph.populations.len();
        let about = population(layer, &quantized);
        self.graph.populations.push(GraphPopulation { neurons: layer.neurons * area, ..about });
        let weights = weights.into_iter().map(|(sources, mantissas)| Projection {
            sources,
            first_source: 0,
            target,
            mantissas,
            signs: self.signs,
            weight_bits: self.policy.weight_bits,
            exponent: quantized.exponent,
        });
        self.graph.projections.extend(weights);
        let of_neurons = quantized.bias.iter().flat_map(|m| std::iter::repeat_n(*m, area));
        let bias = Projection {
            sources: vec![self.port(BIAS_PORT)],
            first_source: target,
            target,
            mantissas: Mantissas::Dense(of_neurons.collect()),
            signs: self.signs,
            weight_bits: WEIGHT_BITS_MAX,
            exponent: quantized.bias_exponent,
        };
        self.graph.projections.push(bias);
        self.layers.push((layer.name.clone(), quantized));
        Source::Population(target)
    }
}

/// What one output pixel of a convolution computes, as a fully connected layer: its channels from
/// all taps of all input channels.
fn window(layer: &ConvLayer, encoder: &EventEncoder) -> Layer {
    Layer {
        name: layer.name.clone(),
        inputs: layer.inputs * KERNEL * KERNEL,
        neurons: layer.outputs,
        weights: layer.weights.clone(),
        bias: layer.bias.clone(),
        keep_current: encoder.keep_current,
        keep_voltage: encoder.keep_voltage,
        threshold: encoder.threshold,
    }
}
