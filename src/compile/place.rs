//! Partition and placement: populations onto cores, synapses onto axons.
//!
//! Each population gets cores of its own, as few as its resources allow, filled evenly. Result
//! and cost of a run do not depend on which core is which, but for the hops of messages.

use std::collections::BTreeMap;

use hw_model::core_map::{
    AxonIn, AxonOut, CompartmentGroup, Core, HostPort, Population, PortTarget, Slice,
};
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::SynapseFormat;
use hw_model::{ChipSpec, CoreMap, CoreMapParts};

use crate::compile::error::CompileError;
use crate::compile::graph::{IntegerGraph, Projection, Signs, Source};

/// Places a graph on a chip.
///
/// `neurons_per_core_max` narrows how many neurons of a population share a core (SAN's published
/// mapping has 128).
///
/// Errors: a neuron that no core can hold, or more cores than the chip has, with what sets the
/// number and what would make it fit.
pub fn place(
    graph: &IntegerGraph,
    chip: &ChipSpec,
    neurons_per_core_max: Option<usize>,
) -> Result<CoreMap, CompileError> {
    let mut placer = Placer {
        graph,
        chip,
        neurons_per_core_max,
        parts: vec![Vec::new(); graph.populations.len()],
    };
    // Targets first: how far a source's axons fan out depends on how often its target was split.
    for population in (0..graph.populations.len()).rev() {
        placer.parts[population] = placer.partition(population)?;
    }
    placer.check_cores()?;
    Ok(CoreMap::new(placer.build())?)
}

struct Placer<'a> {
    graph: &'a IntegerGraph,
    chip: &'a ChipSpec,
    neurons_per_core_max: Option<usize>,
    /// Cores of each population: ranges of its neurons.
    parts: Vec<Vec<Part>>,
}

/// Neurons `first..first + len` of a population, on one core.
#[derive(Debug, Clone)]
struct Part {
    first: usize,
    len: usize,
    core: Core,
    /// Source of each input axon.
    sources: Vec<(Source, usize)>,
}

impl Placer<'_> {
    /// The smallest number of equal parts that fit.
    fn partition(&self, population: usize) -> Result<Vec<Part>, CompileError> {
        let neurons = self.graph.populations[population].neurons;
        let per_core = self.neurons_per_core_max.unwrap_or(neurons).max(1);
        let per_core = per_core.min(self.chip.limits.compartments_per_core as usize);
        let mut n_parts = neurons.div_ceil(per_core);
        loop {
            if n_parts > self.chip.limits.cores as usize {
                return Err(self.too_many_parts(population));
            }
            let len = neurons.div_ceil(n_parts);
            let parts: Vec<Part> = (0..neurons)
                .step_by(len)
                .map(|first| self.part(population, first, len.min(neurons - first)))
                .collect();
            let Some(excess) = parts.iter().find_map(|part| self.excess(population, part)) else {
                return Ok(parts);
            };
            if len == 1 {
                return Err(self.too_large(population, excess));
            }
            // At least one more part, or as many as the excess suggests.
            let wanted = (n_parts as u64 * excess.1).div_ceil(excess.2) as usize;
            n_parts = wanted.clamp(n_parts + 1, neurons);
        }
    }

    /// What the part needs too much of: resource, used, limit.
    fn excess(&self, population: usize, part: &Part) -> Option<(&'static str, u64, u64)> {
        let limits = &self.chip.limits;
        let core = &part.core;
        let words: u64 = core
            .lists
            .iter()
            .map(|list| list.words(&core.formats, &self.chip.packing, part.len))
            .sum();
        let needs = [
            ("input axons", core.axons_in.len() as u64, limits.input_axons_per_core),
            ("output axons", self.axons_out(population, part), limits.output_axons_per_core),
            ("synapse memory words", words, limits.synapse_words_per_core),
        ];
        needs
            .into_iter()
            .map(|(resource, used, limit)| (resource, used, u64::from(limit)))
            .find(|(_, used, limit)| used > limit)
    }

    /// Output axons that the neurons of a part need, given the parts of their targets.
    fn axons_out(&self, population: usize, part: &Part) -> u64 {
        let ours = |source: &&(Source, usize)| {
            source.0 == Source::Population(population)
                && (part.first..part.first + part.len).contains(&source.1)
        };
        let targets = self.parts.iter().flatten();
        targets.map(|target| target.sources.iter().filter(ours).count() as u64).sum()
    }

    /// More parts than cores: because one neuron is too large already, or there are too many.
    fn too_many_parts(&self, population: usize) -> CompileError {
        if let Some(excess) = self.excess(population, &self.part(population, 0, 1)) {
            return self.too_large(population, excess);
        }
        let about = &self.graph.populations[population];
        CompileError::LayerTooLarge {
            layer: about.name.clone(),
            neurons: about.neurons,
            limit: self.chip.limits.cores,
            chip: self.chip.name.clone(),
            advice: "make the layer smaller, allow more neurons per core, or use a chip with more or larger cores",
        }
    }

    fn too_large(&self, population: usize, excess: (&'static str, u64, u64)) -> CompileError {
        let (resource, used, limit) = excess;
        CompileError::NeuronTooLarge {
            layer: self.graph.populations[population].name.clone(),
            resource,
            used,
            limit,
            advice: match resource {
                "input axons" => "reduce the fan-in of the layer or prune whole inputs",
                "output axons" => "shrink the next layer so that it takes fewer cores",
                _ => "reduce the fan-in of the layer, prune, or use fewer weight bits",
            },
        }
    }

    /// A core with the neurons of a part and every synapse that reaches them.
    fn part(&self, population: usize, first: usize, len: usize) -> Part {
        let about = &self.graph.populations[population];
        let label = if len == about.neurons {
            about.name.clone()
        } else {
            format!("{}[{first}..{}]", about.name, first + len)
        };
        let group = CompartmentGroup {
            len: len as u16,
            decay_current: about.decay_current,
            decay_voltage: about.decay_voltage,
            threshold_mantissa: about.threshold_mantissa,
            bias_mantissa: 0,
            bias_exponent: 0,
            refractory_steps: 1,
        };
        let core = Core { label, groups: vec![group], ..Core::default() };
        let mut part = Part { first, len, core, sources: Vec::new() };
        for projection in self.graph.projections.iter().filter(|p| p.target == population) {
            part.add_projection(self.graph, self.chip, projection);
        }
        part
    }

    fn check_cores(&self) -> Result<(), CompileError> {
        let needed = self.parts.iter().map(Vec::len).sum();
        let limit = self.chip.limits.cores;
        if needed <= limit as usize {
            return Ok(());
        }
        let by_layer = self.graph.populations.iter().zip(&self.parts);
        let breakdown: Vec<String> = by_layer
            .map(|(population, parts)| {
                format!("{} {} ({} neurons)", population.name, parts.len(), population.neurons)
            })
            .collect();
        let largest =
            self.graph.populations.iter().zip(&self.parts).max_by_key(|(_, parts)| parts.len());
        let advice = largest.map_or_else(String::new, |(population, _)| {
            format!(
                "make {} smaller, which takes most, allow more neurons per core, or use a chip with more or larger cores",
                population.name
            )
        });
        let (chip, breakdown) = (self.chip.name.clone(), breakdown.join(", "));
        Err(CompileError::Cores { needed, limit, chip, breakdown, advice })
    }

    /// All parts on consecutive cores, joined by axons.
    fn build(self) -> CoreMapParts {
        let first_cores: Vec<usize> = self
            .parts
            .iter()
            .scan(0, |next, parts| {
                let first = *next;
                *next += parts.len();
                Some(first)
            })
            .collect();
        let mut edges: BTreeMap<Source, Vec<(usize, CoreId, AxonIdx)>> = BTreeMap::new();
        for (population, parts) in self.parts.iter().enumerate() {
            for (index, part) in parts.iter().enumerate() {
                let core = CoreId((first_cores[population] + index) as u16);
                for (axon, (source, unit)) in part.sources.iter().enumerate() {
                    edges.entry(*source).or_default().push((*unit, core, AxonIdx(axon as u16)));
                }
            }
        }
        let ports = self.ports(&edges);
        let populations = self.populations(&first_cores);
        let mut cores = Vec::new();
        for (population, parts) in self.parts.into_iter().enumerate() {
            let edges = edges.get(&Source::Population(population)).map_or(&[][..], Vec::as_slice);
            cores.extend(parts.into_iter().map(|part| part.into_core(edges)));
        }
        CoreMapParts { chip: self.chip.clone(), cores, populations, ports }
    }

    fn ports(&self, edges: &BTreeMap<Source, Vec<(usize, CoreId, AxonIdx)>>) -> Vec<HostPort> {
        let port = |(index, (name, lines)): (usize, &(String, usize))| {
            let edges = edges.get(&Source::Port(index)).map_or(&[][..], Vec::as_slice);
            let target = |(line, core, axon): &(usize, CoreId, AxonIdx)| PortTarget {
                line: *line as u32,
                core: *core,
                axon: *axon,
            };
            let mut targets: Vec<_> = edges.iter().map(target).collect();
            targets.sort_unstable();
            HostPort { name: name.clone(), lines: *lines as u32, targets }
        };
        self.graph.ports.iter().enumerate().map(port).collect()
    }

    fn populations(&self, first_cores: &[usize]) -> Vec<Population> {
        let slice = |first_core: usize, (index, part): (usize, &Part)| Slice {
            core: CoreId((first_core + index) as u16),
            first: CompartmentIdx(0),
            len: part.len as u16,
        };
        let about = self.graph.populations.iter().zip(&self.parts).zip(first_cores);
        about
            .map(|((population, parts), first_core)| Population {
                name: population.name.clone(),
                slices: parts.iter().enumerate().map(|part| slice(*first_core, part)).collect(),
            })
            .collect()
    }
}

impl Part {
    /// One input axon with a list of its own for each source that reaches these neurons.
    fn add_projection(&mut self, graph: &IntegerGraph, chip: &ChipSpec, projection: &Projection) {
        let targets = graph.populations[projection.target].neurons;
        for (row, mantissas) in projection.mantissas.chunks(targets).enumerate() {
            let mantissas = &mantissas[self.first..self.first + self.len];
            if mantissas.iter().all(|mantissa| *mantissa == 0) {
                continue;
            }
            let entries = self.entries(projection, mantissas, chip);
            let list = self.core.lists.len() as u32;
            self.core.lists.push(SynapseList { entries });
            self.core.axons_in.push(AxonIn { list, base: 0 });
            self.sources.push((projection.source, projection.first_source + row));
        }
    }

    fn entries(
        &mut self,
        projection: &Projection,
        mantissas: &[i16],
        chip: &ChipSpec,
    ) -> Vec<SynapseEntry> {
        let formats = projection.signs.formats(projection.exponent);
        let ids: Vec<u8> = formats.into_iter().map(|format| self.format_id(format)).collect();
        match projection.signs {
            Signs::Mixed => {
                let first = 0;
                let dense = SynapseForm::Dense { first, mantissas: mantissas.to_vec() };
                let dense = SynapseEntry { format: ids[0], form: dense };
                let sparse = sparse_entry(ids[0], mantissas, |mantissa| mantissa != 0);
                let words = |entry: &SynapseEntry| {
                    let list = SynapseList { entries: vec![entry.clone()] };
                    list.words(&self.core.formats, &chip.packing, self.len)
                };
                vec![if words(&sparse) < words(&dense) { sparse } else { dense }]
            }
            Signs::Split => [
                sparse_entry(ids[0], mantissas, |mantissa| mantissa > 0),
                sparse_entry(ids[1], mantissas, |mantissa| mantissa < 0),
            ]
            .into_iter()
            .filter(|entry| !entry.is_empty())
            .collect(),
        }
    }

    fn format_id(&mut self, format: SynapseFormat) -> u8 {
        let formats = &mut self.core.formats;
        let known = formats.iter().position(|there| *there == format);
        known.unwrap_or_else(|| {
            formats.push(format);
            formats.len() - 1
        }) as u8
    }

    fn into_core(mut self, edges: &[(usize, CoreId, AxonIdx)]) -> Core {
        let ours =
            edges.iter().filter(|edge| (self.first..self.first + self.len).contains(&edge.0));
        let axon = |(unit, core, axon): &(usize, CoreId, AxonIdx)| AxonOut {
            compartment: CompartmentIdx((unit - self.first) as u16),
            core: *core,
            axon: *axon,
        };
        self.core.axons_out = ours.map(axon).collect();
        self.core.axons_out.sort_unstable();
        self.core
    }
}

fn sparse_entry(format: u8, mantissas: &[i16], keep: impl Fn(i16) -> bool) -> SynapseEntry {
    let kept = mantissas.iter().enumerate().filter(|(_, mantissa)| keep(**mantissa));
    let (targets, mantissas) = kept.map(|(target, mantissa)| (target as u16, *mantissa)).unzip();
    SynapseEntry { format, form: SynapseForm::Sparse { targets, mantissas } }
}
