//! An integer network, not yet placed: what both kinds of input become.

use hw_model::weight::{SignMode, SynapseFormat};

use crate::compile::policy::WEIGHT_BITS_MAX;
use crate::net::integer::IntegerNet;

pub use crate::net::integer::Mantissas;

mod check;

/// Populations, host ports and the synapses between them, all integer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerGraph {
    /// Name.
    pub name: String,
    /// Inputs from the host: name and number of lines.
    pub ports: Vec<(String, usize)>,
    /// LIF populations in placement order.
    pub populations: Vec<GraphPopulation>,
    /// Synapses.
    pub projections: Vec<Projection>,
}

/// LIF neurons with equal parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraphPopulation {
    /// Name.
    pub name: String,
    /// Number of neurons.
    pub neurons: usize,
    /// Effective decay of the current per 4096.
    pub decay_current: u16,
    /// Effective decay of the voltage per 4096.
    pub decay_voltage: u16,
    /// Threshold in units of 64.
    pub threshold_mantissa: u32,
    /// Bias registers, added to the *voltage* in each step.
    pub bias: BiasRegisters,
}

/// Bias registers of a population.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BiasRegisters {
    /// Each for the next `neurons / len` neurons: none, one for all, one for each channel, or one
    /// for each neuron.
    pub mantissas: Vec<i16>,
    /// Power of two that multiplies every mantissa.
    pub exponent: u8,
}

impl BiasRegisters {
    /// Mantissa and exponent of neuron `neuron` of `neurons`.
    pub fn of(&self, neuron: usize, neurons: usize) -> (i16, u8) {
        match self.mantissas.len() {
            0 => (0, 0),
            len => (self.mantissas[neuron / (neurons / len)], self.exponent),
        }
    }
}

/// Where a projection starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// A host port, by index.
    Port(usize),
    /// A population, by index.
    Population(usize),
}

/// Synapses onto a population. A population may have any number of them, of either kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Projection {
    /// Where spikes come from. Several sources share the synapses: unit `i` of each goes through
    /// the same weights, which are stored once.
    pub sources: Vec<Source>,
    /// Line or neuron of each source that the first row of `mantissas` (of a convolution: the
    /// first pixel) belongs to.
    pub first_source: usize,
    /// Index of the target population.
    pub target: usize,
    /// The weights. A dense row `i` is that of unit `first_source + i`; a population with a
    /// convolution onto it is a picture, and is placed in tiles.
    pub mantissas: Mantissas,
    /// Sign mode.
    pub signs: Signs,
    /// Bits of a stored weight, in mixed mode with the sign.
    pub weight_bits: u8,
    /// Power of two that multiplies every mantissa.
    pub exponent: i8,
}

/// How the weights of a projection are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signs {
    /// One entry per axon in mixed mode; dense or sparse, whichever is smaller.
    Mixed,
    /// An excitatory and an inhibitory entry per axon; zero weights are not stored.
    Split,
}

impl Signs {
    /// The synapse formats that the storage needs.
    pub fn formats(self, weight_bits: u8, exponent: i8) -> Vec<SynapseFormat> {
        let format = |sign_mode| SynapseFormat { sign_mode, weight_bits, exponent };
        match self {
            Signs::Mixed => vec![format(SignMode::Mixed)],
            Signs::Split => vec![format(SignMode::Excitatory), format(SignMode::Inhibitory)],
        }
    }
}

impl IntegerGraph {
    /// Whether a population is a picture: there is a convolution onto it.
    pub fn is_picture(&self, population: usize) -> bool {
        let mut onto = self.projections.iter().filter(|p| p.target == population);
        onto.any(|p| matches!(p.mantissas, Mantissas::Conv(..)))
    }

    /// Number of lines or neurons of a source.
    pub fn source_len(&self, source: Source) -> usize {
        match source {
            Source::Port(port) => self.ports[port].1,
            Source::Population(population) => self.populations[population].neurons,
        }
    }

    /// Excitatory and inhibitory synapses of the projections into population `target` from
    /// `source`.
    pub fn synapse_signs(&self, source: Source, target: usize) -> (usize, usize) {
        let between = |p: &&Projection| p.sources.contains(&source) && p.target == target;
        let all = || self.projections.iter().filter(between).flat_map(|p| p.mantissas.values());
        (all().filter(|m| **m > 0).count(), all().filter(|m| **m < 0).count())
    }
}

impl From<IntegerNet> for IntegerGraph {
    fn from(net: IntegerNet) -> Self {
        let mut graph =
            Self { name: net.name, ports: vec![], populations: vec![], projections: vec![] };
        let mut sources = Vec::with_capacity(net.populations.len());
        for population in net.populations {
            match population.threshold_mantissa {
                None => {
                    sources.push(Source::Port(graph.ports.len()));
                    graph.ports.push((population.name, population.neurons));
                }
                Some(threshold_mantissa) => {
                    sources.push(Source::Population(graph.populations.len()));
                    graph.populations.push(GraphPopulation {
                        name: population.name,
                        neurons: population.neurons,
                        decay_current: net.decay_current,
                        decay_voltage: net.decay_voltage,
                        threshold_mantissa,
                        bias: BiasRegisters::default(),
                    });
                }
            }
        }
        for projection in net.projections {
            let Source::Population(target) = sources[projection.target] else {
                unreachable!("the reader refuses synapses onto inputs");
            };
            graph.projections.push(Projection {
                sources: projection.sources.iter().map(|source| sources[*source]).collect(),
                first_source: 0,
                target,
                mantissas: projection.weights,
                signs: Signs::Mixed,
                weight_bits: WEIGHT_BITS_MAX,
                exponent: 0,
            });
        }
        graph
    }
}

#[cfg(test)]
#[path = "graph_tests.rs"]
mod tests;
