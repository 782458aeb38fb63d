//! One core: the neurons of a tile and every synapse that reaches them.

use std::collections::BTreeMap;

use hw_model::ChipSpec;
use hw_model::core_map::{AxonIn, CompartmentGroup, Core};
use hw_model::spec::Packing;
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::SynapseFormat;

use super::tile::Tile;
use crate::compile::graph::{IntegerGraph, Mantissas, Projection, Signs, Source};
use crate::net::conv2d::{Conv2d, Shape, Taps};

/// Bases of input axons stay below this: nengo-loihi `hardware/builder.py` asserts at most 256
/// ("limited by hardware"). A kernel that is needed farther up is stored again for each stretch
/// of this many compartments, as in nengo-loihi `conv.py`.
const BASES: usize = 256;

/// A core under way.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) tile: Tile,
    pub(super) core: Core,
    /// Who spikes onto which input axon: source, unit, axon.
    pub(super) edges: Vec<(Source, usize, usize)>,
}

/// Consecutive compartments with their weights.
type Run = (usize, Vec<i16>);

/// What the inputs that share a stored kernel have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Pattern {
    channel: usize,
    /// First tap and number of outputs, rows and columns.
    rows: (usize, usize),
    columns: (usize, usize),
    /// Stretches of [`BASES`] compartments before the first output.
    stretch: usize,
}

impl Part {
    /// The neurons `tile` of population number `population`, with all synapses onto them.
    pub(super) fn new(
        graph: &IntegerGraph,
        chip: &ChipSpec,
        population: usize,
        shape: Shape,
        tile: Tile,
    ) -> Self {
        let about = &graph.populations[population];
        let neurons = tile.neurons(shape);
        let biases = neurons.iter().map(|neuron| about.bias.of(*neuron, about.neurons));
        let biases: Vec<_> = biases.collect();
        let group = |equal: &[(i16, u8)]| CompartmentGroup {
            len: equal.len() as u16,
            decay_current: about.decay_current,
            decay_voltage: about.decay_voltage,
            threshold_mantissa: about.threshold_mantissa,
            bias_mantissa: equal[0].0,
            bias_exponent: equal[0].1,
            refractory_steps: 1,
        };
        let groups = biases.chunk_by(|a, b| a == b).map(group).collect();
        let label = tile.label(&about.name, shape);
        let core = Core { label, groups, ..Core::default() };
        let mut part = Self { tile, core, edges: Vec::new() };
        for projection in graph.projections.iter().filter(|p| p.target == population) {
            match &projection.mantissas {
                Mantissas::Dense(rows) => {
                    part.add_dense(projection, rows.chunks(about.neurons), &neurons, chip);
                }
                Mantissas::Conv(conv, kernel) => {
                    part.add_convolution(projection, conv, kernel, chip);
                }
            }
        }
        part
    }

    /// One input axon with a list of its own for each source that reaches these neurons.
    fn add_dense<'a>(
        &mut self,
        projection: &Projection,
        rows: impl Iterator<Item = &'a [i16]>,
        neurons: &[usize],
        chip: &ChipSpec,
    ) {
        for (unit, row) in rows.enumerate() {
            let mantissas: Vec<i16> = neurons.iter().map(|neuron| row[*neuron]).collect();
            if let Some(list) = self.add_list(projection, vec![(0, mantissas)], &chip.packing) {
                self.add_axon(projection, unit, AxonIn { list, base: 0 });
            }
        }
    }

    /// One input axon for each input pixel and channel that the tile sees. Axons of one pattern
    /// share a stored list; where an input meets only part of the kernel, at the border of the
    /// picture or of the tile, the pattern holds that part alone.
    fn add_convolution(
        &mut self,
        projection: &Projection,
        conv: &Conv2d,
        kernel: &[i16],
        chip: &ChipSpec,
    ) {
        let (rows, columns) = (self.tile.rows.clone(), self.tile.columns.clone());
        let mut lists: BTreeMap<Pattern, Option<u32>> = BTreeMap::new();
        for y in conv.input_rows(&rows) {
            let Some(row_taps) = conv.row_taps(y, &rows) else { continue };
            for x in conv.input_columns(&columns) {
                let Some(column_taps) = conv.column_taps(x, &columns) else { continue };
                let first = self.tile.pixel(row_taps.first, column_taps.first);
                let base = (first % BASES) as u16;
                for channel in 0..conv.input().channels {
                    let pattern = Pattern {
                        channel,
                        rows: (row_taps.first_tap, row_taps.len),
                        columns: (column_taps.first_tap, column_taps.len),
                        stretch: first / BASES,
                    };
                    let list = lists.get(&pattern).copied().unwrap_or_else(|| {
                        let taps = [row_taps, column_taps];
                        let at = first - usize::from(base);
                        let runs = self.kernel_runs(conv, kernel, channel, taps, at);
                        self.add_list(projection, runs, &chip.packing)
                    });
                    lists.insert(pattern, list);
                    if let Some(list) = list {
                        let unit = conv.input().neuron(channel, y, x);
                        self.add_axon(projection, unit, AxonIn { list, base });
                    }
                }
            }
        }
    }

    /// The part of the kernel that an input meets, as runs of compartments from `at` on: one run
    /// for each output row.
    fn kernel_runs(
        &self,
        conv: &Conv2d,
        kernel: &[i16],
        input: usize,
        [rows, columns]: [Taps; 2],
        at: usize,
    ) -> Vec<Run> {
        let pitch = self.tile.columns.len() * self.tile.channels.len();
        let run = |row: usize| {
            let ky = rows.first_tap - row * conv.stride();
            let taps = (0..columns.len).map(|i| columns.first_tap - i * conv.stride());
            let weights = taps.flat_map(|kx| {
                let weight = move |output| kernel[conv.weight(output, input, ky, kx)];
                self.tile.channels.clone().map(weight)
            });
            (at + row * pitch, weights.collect())
        };
        (0..rows.len).map(run).collect()
    }

    fn add_axon(&mut self, projection: &Projection, unit: usize, axon: AxonIn) {
        let number = self.core.axons_in.len();
        self.core.axons_in.push(axon);
        let unit = projection.first_source + unit;
        self.edges.extend(projection.sources.iter().map(|source| (*source, unit, number)));
    }

    /// Stores a list; `None` when all weights are zero.
    fn add_list(
        &mut self,
        projection: &Projection,
        runs: Vec<Run>,
        packing: &Packing,
    ) -> Option<u32> {
        if runs.iter().flat_map(|(_, mantissas)| mantissas).all(|mantissa| *mantissa == 0) {
            return None;
        }
        let entries = self.entries(projection, joined(runs), packing);
        self.core.lists.push(SynapseList { entries });
        Some(self.core.lists.len() as u32 - 1)
    }

    fn entries(
        &mut self,
        projection: &Projection,
        runs: Vec<Run>,
        packing: &Packing,
    ) -> Vec<SynapseEntry> {
        let formats = projection.signs.formats(projection.weight_bits, projection.exponent);
        let ids: Vec<u8> = formats.into_iter().map(|format| self.format_id(format)).collect();
        match projection.signs {
            Signs::Mixed => {
                let sparse = SynapseList {
                    entries: vec![sparse_entry(ids[0], &runs, |mantissa| mantissa != 0)],
                };
                let dense = |(first, mantissas)| SynapseEntry {
                    format: ids[0],
                    form: SynapseForm::Dense { first: first as u16, mantissas },
                };
                let dense =
                    SynapseList { entries: runs.into_iter().map(dense).collect::<Vec<_>>() };
                let words =
                    |list: &SynapseList| list.words(&self.core.formats, packing, self.tile.len());
                if words(&sparse) < words(&dense) { sparse.entries } else { dense.entries }
            }
            Signs::Split => [
                sparse_entry(ids[0], &runs, |mantissa| mantissa > 0),
                sparse_entry(ids[1], &runs, |mantissa| mantissa < 0),
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
}

/// Runs that touch become one.
fn joined(runs: Vec<Run>) -> Vec<Run> {
    let mut joined: Vec<Run> = Vec::with_capacity(runs.len());
    for (first, mantissas) in runs {
        match joined.last_mut().filter(|(before, there)| before + there.len() == first) {
            Some((_, there)) => there.extend(mantissas),
            None => joined.push((first, mantissas)),
        }
    }
    joined
}

fn sparse_entry(format: u8, runs: &[Run], keep: impl Fn(i16) -> bool) -> SynapseEntry {
    let all = runs.iter().flat_map(|(first, mantissas)| (*first..).zip(mantissas));
    let kept = all.filter(|(_, mantissa)| keep(**mantissa));
    let (targets, mantissas) = kept.map(|(target, mantissa)| (target as u16, *mantissa)).unzip();
    SynapseEntry { format, form: SynapseForm::Sparse { targets, mantissas } }
}
