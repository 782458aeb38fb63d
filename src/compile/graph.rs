//! An integer network, not yet placed: what both kinds of input become.

use hw_model::weight::{SignMode, SynapseFormat};

use crate::compile::error::CompileError;
use crate::net::conv2d::Shape;
use crate::net::integer::IntegerNet;

pub use crate::net::integer::Mantissas;

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
    /// Sign mode and exponent.
    pub signs: Signs,
    /// Power of two that multiplies every mantissa.
    pub exponent: i8,
}

/// How the weights of a projection are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signs {
    /// One entry per axon in 8-bit mixed mode; dense or sparse, whichever is smaller.
    Mixed,
    /// An excitatory and an inhibitory entry per axon, 8 bit each; zero weights are not stored.
    Split,
}

impl Signs {
    /// The synapse formats that the storage needs.
    pub fn formats(self, exponent: i8) -> Vec<SynapseFormat> {
        let format = |sign_mode| SynapseFormat { sign_mode, weight_bits: 8, exponent };
        match self {
            Signs::Mixed => vec![format(SignMode::Mixed)],
            Signs::Split => vec![format(SignMode::Excitatory), format(SignMode::Inhibitory)],
        }
    }
}

impl IntegerGraph {
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

    /// Shape of each population: that of the convolutions onto it, or one pixel of as many
    /// channels as it has neurons.
    ///
    /// Errors: parts of the graph that do not go together, with the place and both sizes.
    pub fn shapes(&self) -> Result<Vec<Shape>, CompileError> {
        let mut shapes: Vec<Option<Shape>> = vec![None; self.populations.len()];
        for (index, projection) in self.projections.iter().enumerate() {
            let wrong = |problem: String| CompileError::Graph {
                place: format!("projection {index}"),
                problem,
            };
            let rows = self.check_projection(projection).map_err(wrong)?;
            self.check_sources(projection, rows).map_err(wrong)?;
            if let Mantissas::Conv(conv, _) = &projection.mantissas {
                let shape = shapes[projection.target].get_or_insert(conv.output());
                if *shape != conv.output() {
                    return Err(wrong(format!("gives {}, another gives {shape}", conv.output())));
                }
            }
        }
        for population in &self.populations {
            population.check()?;
        }
        let flat = |(shape, about): (Option<Shape>, &GraphPopulation)| {
            shape.unwrap_or_else(|| Shape::flat(about.neurons))
        };
        Ok(shapes.into_iter().zip(&self.populations).map(flat).collect())
    }

    /// Units that a projection takes from each of its sources.
    fn check_projection(&self, projection: &Projection) -> Result<usize, String> {
        let Some(target) = self.populations.get(projection.target) else {
            let (target, there) = (projection.target, self.populations.len());
            return Err(format!("onto population {target}, there are {there}"));
        };
        let stored = projection.mantissas.values().len();
        match &projection.mantissas {
            Mantissas::Dense(_) if target.neurons == 0 || stored % target.neurons != 0 => {
                Err(format!("{stored} weights are no rows for {} neurons", target.neurons))
            }
            Mantissas::Dense(_) => Ok(stored / target.neurons),
            Mantissas::Conv(conv, _) if stored != conv.n_weights() => {
                Err(format!("{stored} weights, the kernel has {:?}", conv.weights_shape()))
            }
            Mantissas::Conv(conv, _) if conv.output().neurons() != target.neurons => {
                let (output, neurons) = (conv.output(), target.neurons);
                Err(format!("gives {output}, but {} has {neurons} neurons", target.name))
            }
            Mantissas::Conv(conv, _) => Ok(conv.input().neurons()),
        }
    }

    fn check_sources(&self, projection: &Projection, rows: usize) -> Result<(), String> {
        for source in &projection.sources {
            let units = match source {
                Source::Port(port) => self.ports.get(*port).map(|port| port.1),
                Source::Population(from) => self.populations.get(*from).map(|p| p.neurons),
            };
            let end = projection.first_source.saturating_add(rows);
            match units {
                None => return Err(format!("from {source:?}, which is not there")),
                Some(units) if units < end => {
                    return Err(format!("takes units up to {end} of {source:?}, it has {units}"));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }
}

impl GraphPopulation {
    fn check(&self) -> Result<(), CompileError> {
        let (neurons, biases) = (self.neurons, self.bias.mantissas.len());
        let problem = if neurons == 0 {
            "has no neurons".to_owned()
        } else if biases > 0 && !neurons.is_multiple_of(biases) {
            format!("{biases} biases for {neurons} neurons; give 1, one per channel or per neuron")
        } else {
            return Ok(());
        };
        Err(CompileError::Graph { place: format!("population {}", self.name), problem })
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
                exponent: 0,
            });
        }
        graph
    }
}
