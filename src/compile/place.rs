//! Partition and placement: populations onto cores, synapses onto axons.
//!
//! Each population gets cores of its own, as few as its resources allow or more of them ([`spread`]),
//! filled evenly: a picture (a population with a convolution onto it) in tiles, others in ranges. Result and cost of a run
//! do not depend on which core is which, but for the hops of messages.

use std::collections::BTreeMap;

use hw_model::core_map::{AxonOut, Core, HostPort, Population, PortTarget, Slice};
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::{ChipSpec, CoreMap, CoreMapParts};

use crate::compile::error::CompileError;
use crate::compile::graph::{IntegerGraph, Mantissas, Projection, Source};
use crate::net::conv2d::Shape;
use part::Part;
use split::{Cut, Load, barriers_ps, share_out, useful};
use tile::{Tile, Tiling, tilings};

mod part;
mod split;
mod tile;

pub use split::{LayerWork, Split, Work};

/// Places a graph on a chip.
///
/// `neurons_per_core_max` narrows how many neurons of a population share a core.
///
/// Errors: parts of the graph that do not go together, a neuron that no core can hold, or more
/// cores than the chip has, with what sets the number and what would make it fit.
pub fn place(
    graph: &IntegerGraph,
    chip: &ChipSpec,
    neurons_per_core_max: Option<usize>,
) -> Result<CoreMap, CompileError> {
    let placer = Placer::new(graph, chip, neurons_per_core_max.unwrap_or(usize::MAX))?;
    Ok(CoreMap::new(placer.build())?)
}

/// Places a graph on at most `cores` cores of a chip in place of as few as can be: as many as make steps
/// shorter, shared out so that the busiest has the least to do. `work` runs the map with the fewest and
/// says what each population did.
///
/// Errors: as [`place`]; fewer cores than the fewest, or more than the chip has.
pub fn spread(
    graph: &IntegerGraph,
    chip: &ChipSpec,
    cores: usize,
    work: impl FnOnce(CoreMap) -> Work,
) -> Result<CoreMap, CompileError> {
    let fewest = Placer::new(graph, chip, usize::MAX)?;
    fewest.check_asked(cores)?;
    let map = CoreMap::new(fewest.clone().build())?;
    if map.cores().len() == cores {
        return Ok(map);
    }
    match fewest.spread(cores, &work(map.clone())) {
        Some(placer) => Ok(CoreMap::new(placer.build())?),
        None => Ok(map),
    }
}

/// Times that populations are cut anew where later ones project to earlier ones.
const PASSES: usize = 8;

/// Adds the output axons of `population` onto `parts`, neuron by neuron.
fn add_axons<'p>(fan_out: &mut [u64], population: usize, parts: impl Iterator<Item = &'p Part>) {
    for (source, unit, _) in parts.flat_map(|part| &part.edges) {
        if let (true, Some(axons)) =
            (*source == Source::Population(population), fan_out.get_mut(*unit))
        {
            *axons += 1;
        }
    }
}

#[derive(Clone)]
struct Placer<'a> {
    graph: &'a IntegerGraph,
    chip: &'a ChipSpec,
    /// Shape of each population.
    shapes: Vec<Shape>,
    /// Of each population.
    neurons_per_core_max: Vec<usize>,
    /// Cores of each population.
    parts: Vec<Vec<Part>>,
}

/// What a part needs too much of: resource, used, limit.
type Excess = (&'static str, u64, u64);

impl<'a> Placer<'a> {
    /// All populations in parts.
    fn new(
        graph: &'a IntegerGraph,
        chip: &'a ChipSpec,
        neurons_per_core_max: usize,
    ) -> Result<Self, CompileError> {
        let mut placer = Self {
            graph,
            chip,
            shapes: graph.shapes()?,
            neurons_per_core_max: vec![neurons_per_core_max.max(1); graph.populations.len()],
            parts: Vec::new(),
        };
        placer.partition_all()?;
        placer.check_cores()?;
        Ok(placer)
    }

    /// Cores of each population within the limits that are set.
    fn partition_all(&mut self) -> Result<(), CompileError> {
        self.parts = vec![Vec::new(); self.graph.populations.len()];
        // Targets first: how far a source's axons fan out depends on how often its target was split. Where
        // a target comes before its source, its split is known in the next pass.
        for _ in 0..PASSES {
            let before: Vec<usize> = self.parts.iter().map(Vec::len).collect();
            for population in (0..self.parts.len()).rev() {
                self.parts[population] = self.partition(population)?;
            }
            let same = self.parts.iter().map(Vec::len).eq(before);
            if same || !self.feeds_back() {
                break;
            }
        }
        Ok(())
    }

    /// Whether a population projects to one before it.
    fn feeds_back(&self) -> bool {
        let back = |source: &Source, target: usize| match source {
            Source::Population(source) => *source > target,
            Source::Port(_) => false,
        };
        let projections = &self.graph.projections;
        projections.iter().any(|p| p.sources.iter().any(|source| back(source, p.target)))
    }

    /// Whether so many cores can be taken.
    fn check_asked(&self, cores: usize) -> Result<(), CompileError> {
        let limit = self.chip.limits.cores;
        if cores > limit as usize {
            return Err(CompileError::CoresOfChip { cores, limit, chip: self.chip.name.clone() });
        }
        let needed = self.parts.iter().map(Vec::len).sum();
        if cores < needed {
            return Err(CompileError::FewCores { cores, needed, breakdown: self.breakdown() });
        }
        Ok(())
    }

    /// What lies on as few cores as can be, split over more of them, `cores` at most; `None` where that
    /// cannot be.
    fn spread(&self, cores: usize, work: &Work) -> Option<Self> {
        let fewest: Vec<usize> = self.parts.iter().map(Vec::len).collect();
        let needed = fewest.iter().sum();
        let loads = Load::measured(self.graph, self.chip, &work.layers, &fewest);
        let barriers = |cores: usize| barriers_ps(self.chip, work.steps, cores);
        let layers = self.shapes.iter().zip(&fewest).enumerate();
        let cuts: Vec<Vec<Cut>> = layers.map(|(p, (shape, n))| self.cuts(p, *shape, *n)).collect();
        let mut placer = self.clone();
        let mut budget = cores;
        while budget > needed {
            placer.neurons_per_core_max = share_out(&loads, &cuts, budget, &barriers);
            let placed = placer.partition_all();
            let taken: usize = placer.parts.iter().map(Vec::len).sum();
            match placed {
                Ok(()) if taken <= cores => return Some(placer),
                // More parts of a layer than its share: its axons fan out to too many cores, or there
                // are no tiles of that size.
                Ok(()) => budget = budget.saturating_sub(taken - cores),
                Err(_) => budget -= 1,
            }
        }
        None
    }

    /// Ways to cut a population over at least `fewest` cores, as far as its neurons go.
    fn cuts(&self, population: usize, shape: Shape, fewest: usize) -> Vec<Cut> {
        let (neurons, limit) = (shape.neurons(), self.chip.limits.cores as usize);
        if !self.graph.is_picture(population) {
            let cut = |cores: usize| Cut { most: neurons.div_ceil(cores), cores };
            return useful((fewest.max(1)..=neurons.clamp(fewest.max(1), limit)).map(cut));
        }
        let tilings = tilings(shape, self.len_max(population), limit, |_| 0);
        let cut =
            |tiling: &Tiling| Cut { most: tiling.size.iter().product(), cores: tiling.n_tiles };
        useful(tilings.iter().map(cut).filter(|cut| cut.cores >= fewest))
    }

    fn partition(&self, population: usize) -> Result<Vec<Part>, CompileError> {
        if self.graph.is_picture(population) {
            self.partition_picture(population)
        } else {
            self.partition_range(population)
        }
    }

    fn len_max(&self, population: usize) -> usize {
        let most = self.neurons_per_core_max[population];
        most.min(self.chip.limits.compartments_per_core as usize)
    }

    /// The smallest number of equal parts that fit.
    fn partition_range(&self, population: usize) -> Result<Vec<Part>, CompileError> {
        let neurons = self.graph.populations[population].neurons;
        let mut n_parts = neurons.div_ceil(self.len_max(population));
        let mut known = None;
        loop {
            if n_parts > self.chip.limits.cores as usize {
                return Err(self.too_many_parts(population));
            }
            let fan_out = known.get_or_insert_with(|| self.fan_out(population, neurons));
            let len = neurons.div_ceil(n_parts);
            let tile = |first: usize| Tile::flat(first..neurons.min(first + len));
            let parts: Vec<Part> =
                (0..neurons).step_by(len).map(|first| self.part(population, tile(first))).collect();
            let fan_out = &self.with_own(population, fan_out, &parts);
            let excess = parts.iter().find_map(|part| self.excess(population, part, fan_out));
            let Some(excess) = excess else {
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

    /// The smallest number of equal tiles that fit; of equally many, those that see the fewest
    /// inputs, as each takes an axon and a message.
    fn partition_picture(&self, population: usize) -> Result<Vec<Part>, CompileError> {
        let shape = self.shapes[population];
        let fan_out = self.fan_out(population, shape.neurons());
        let seen = |size: &[usize; 3]| self.inputs_seen(population, size);
        let n_tiles_max = self.chip.limits.cores as usize;
        for tiling in tilings(shape, self.len_max(population), n_tiles_max, seen) {
            let mut parts = Vec::with_capacity(tiling.n_tiles);
            for tile in tiling.tiles(shape) {
                let part = self.part(population, tile);
                if self.excess(population, &part, &fan_out).is_some() {
                    break;
                }
                parts.push(part);
            }
            if parts.len() == tiling.n_tiles && self.fits_itself(population, &fan_out, &parts) {
                return Ok(parts);
            }
        }
        Err(self.too_many_parts(population))
    }

    /// Inputs that a tile of this size sees in the middle of the picture.
    fn inputs_seen(&self, population: usize, [_, rows, columns]: &[usize; 3]) -> usize {
        let onto = self.graph.projections.iter().filter(|p| p.target == population);
        let seen = onto.map(|projection| match &projection.mantissas {
            Mantissas::Dense(_) => 0,
            Mantissas::Conv(conv, _) => {
                let [_, channels, height, width] = conv.weights_shape();
                let along = |n: usize, kernel: usize| (n - 1) * conv.stride() + kernel;
                channels * along(*rows, height) * along(*columns, width)
            }
        });
        seen.sum()
    }

    fn excess(&self, population: usize, part: &Part, fan_out: &[u64]) -> Option<Excess> {
        let limits = &self.chip.limits;
        let core = &part.core;
        let words: u64 = core
            .lists
            .iter()
            .map(|list| list.words(&core.formats, &self.chip.packing, part.tile.len()))
            .sum();
        let neurons = part.tile.neurons(self.shapes[population]);
        let axons_out = neurons.iter().map(|neuron| fan_out[*neuron]).sum();
        let needs = [
            ("input axons", core.axons_in.len() as u64, limits.input_axons_per_core),
            ("output axons", axons_out, limits.output_axons_per_core),
            ("synapse memory words", words, limits.synapse_words_per_core),
        ];
        needs
            .into_iter()
            .map(|(resource, used, limit)| (resource, used, u64::from(limit)))
            .find(|(_, used, limit)| used > limit)
    }

    /// Output axons that each of the first `n` neurons of a population needs, given the parts of
    /// its targets but itself.
    fn fan_out(&self, population: usize, n: usize) -> Vec<u64> {
        let mut fan_out = vec![0; n];
        let others = self.parts.iter().enumerate().filter(|(target, _)| *target != population);
        add_axons(&mut fan_out, population, others.flat_map(|(_, parts)| parts));
        fan_out
    }

    /// The same with the axons of a recurrent population onto `parts` of itself.
    fn with_own(&self, population: usize, fan_out: &[u64], parts: &[Part]) -> Vec<u64> {
        let mut fan_out = fan_out.to_vec();
        if self.is_recurrent(population) {
            add_axons(&mut fan_out, population, parts.iter());
        }
        fan_out
    }

    /// Whether `parts`, each of which fits with the axons onto others, fit with those onto themselves.
    fn fits_itself(&self, population: usize, fan_out: &[u64], parts: &[Part]) -> bool {
        if !self.is_recurrent(population) {
            return true;
        }
        let fan_out = self.with_own(population, fan_out, parts);
        parts.iter().all(|part| self.excess(population, part, &fan_out).is_none())
    }

    fn is_recurrent(&self, population: usize) -> bool {
        let own = Source::Population(population);
        let onto_itself = |p: &Projection| p.target == population && p.sources.contains(&own);
        self.graph.projections.iter().any(onto_itself)
    }

    /// More parts than cores: because one neuron is too large already, or there are too many.
    fn too_many_parts(&self, population: usize) -> CompileError {
        // Of a picture one in the middle, where nothing is cut off its inputs.
        let shape = self.shapes[population];
        let (y, x) = (shape.height / 2, shape.width / 2);
        let one = Tile { channels: 0..1, rows: y..y + 1, columns: x..x + 1 };
        let fan_out = self.fan_out(population, shape.neuron(0, y, x) + 1);
        if let Some(excess) = self.excess(population, &self.part(population, one), &fan_out) {
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

    fn part(&self, population: usize, tile: Tile) -> Part {
        Part::new(self.graph, self.chip, population, self.shapes[population], tile)
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
                _ => {
                    "reduce the fan-in of the layer, prune, or use fewer weight bits (--weight-bits)"
                }
            },
        }
    }

    fn check_cores(&self) -> Result<(), CompileError> {
        let needed = self.parts.iter().map(Vec::len).sum();
        let limit = self.chip.limits.cores;
        if needed <= limit as usize {
            return Ok(());
        }
        let largest =
            self.graph.populations.iter().zip(&self.parts).max_by_key(|(_, parts)| parts.len());
        let shrink = largest.filter(|(_, parts)| parts.len() > 1).map(|(population, _)| {
            format!(
                "make {} smaller, which takes most, allow more neurons per core, or ",
                population.name
            )
        });
        let shrink = shrink.unwrap_or_default();
        let advice = format!("{shrink}use a chip with more or larger cores");
        let (chip, breakdown) = (self.chip.name.clone(), self.breakdown());
        Err(CompileError::Cores { needed, limit, chip, breakdown, advice })
    }

    /// Cores by layer.
    fn breakdown(&self) -> String {
        let by_layer = self.graph.populations.iter().zip(&self.parts);
        let of_layer = by_layer.map(|(population, parts)| {
            format!("{} {} ({} neurons)", population.name, parts.len(), population.neurons)
        });
        of_layer.collect::<Vec<_>>().join(", ")
    }

    /// All parts on consecutive cores, joined by axons.
    fn build(mut self) -> CoreMapParts {
        let first_cores: Vec<usize> = self
            .parts
            .iter()
            .scan(0, |next, parts| {
                let first = *next;
                *next += parts.len();
                Some(first)
            })
            .collect();
        let mut edges: BTreeMap<Source, Vec<Edge>> = BTreeMap::new();
        for (population, parts) in self.parts.iter().enumerate() {
            for (index, part) in parts.iter().enumerate() {
                let core = CoreId((first_cores[population] + index) as u16);
                for (source, unit, axon) in &part.edges {
                    edges.entry(*source).or_default().push((*unit, core, AxonIdx(*axon as u16)));
                }
            }
        }
        let edges_of = |source| edges.get(&source).map_or(&[][..], Vec::as_slice);
        let ports = self.graph.ports.iter().enumerate();
        let ports = ports.map(|(index, (name, lines))| {
            // Too many lines are refused with the map.
            let lines = u32::try_from(*lines).unwrap_or(u32::MAX);
            host_port(name, lines, edges_of(Source::Port(index)))
        });
        let ports = ports.collect();
        let mut populations = Vec::new();
        let mut cores: Vec<Core> = Vec::new();
        for (population, parts) in std::mem::take(&mut self.parts).into_iter().enumerate() {
            let first_core = first_cores[population];
            let sites = self.sites(population, first_core, &parts);
            let name = self.graph.populations[population].name.clone();
            populations.push(Population { name, slices: slices(&sites) });
            cores.extend(parts.into_iter().map(|part| part.core));
            for (unit, core, axon) in edges_of(Source::Population(population)) {
                let (from, compartment) = sites[*unit];
                let axon = AxonOut { compartment, core: *core, axon: *axon };
                cores[from.index()].axons_out.push(axon);
            }
        }
        cores.iter_mut().for_each(|core| core.axons_out.sort_unstable());
        CoreMapParts { chip: self.chip.clone(), cores, populations, ports }
    }

    /// Core and compartment of each neuron of a population.
    fn sites(&self, population: usize, first_core: usize, parts: &[Part]) -> Vec<Site> {
        let mut sites =
            vec![(CoreId(0), CompartmentIdx(0)); self.graph.populations[population].neurons];
        for (index, part) in parts.iter().enumerate() {
            let core = CoreId((first_core + index) as u16);
            let neurons = part.tile.neurons(self.shapes[population]);
            for (compartment, neuron) in neurons.into_iter().enumerate() {
                sites[neuron] = (core, CompartmentIdx(compartment as u16));
            }
        }
        sites
    }
}

/// Where a neuron lies.
type Site = (CoreId, CompartmentIdx);
/// Unit of a source, core and input axon that its spikes go to.
type Edge = (usize, CoreId, AxonIdx);

fn host_port(name: &str, lines: u32, edges: &[Edge]) -> HostPort {
    let target =
        |(line, core, axon): &Edge| PortTarget { line: *line as u32, core: *core, axon: *axon };
    let mut targets: Vec<_> = edges.iter().map(target).collect();
    targets.sort_unstable();
    HostPort { name: name.to_owned(), lines, targets }
}

/// Neighbouring compartments of one core as one slice.
fn slices(sites: &[Site]) -> Vec<Slice> {
    let mut slices: Vec<Slice> = Vec::new();
    for (core, compartment) in sites {
        let end = |slice: &Slice| slice.first.0 + slice.len;
        match slices.last_mut().filter(|s| s.core == *core && end(s) == compartment.0) {
            Some(slice) => slice.len += 1,
            None => slices.push(Slice { core: *core, first: *compartment, len: 1 }),
        }
    }
    slices
}
