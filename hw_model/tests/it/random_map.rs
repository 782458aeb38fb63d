//! Random core maps that are valid by construction, and random inputs for them.
//!
//! A recipe is plain numbers, taken modulo what the map has room for, so that every recipe makes
//! a valid map and a failing one shrinks to a small one.

use hw_model::core_map::{
    AxonIn, AxonOut, CompartmentGroup, Core, HostPort, Population, PortTarget, Slice,
};
use hw_model::engine::Stimulus;
use hw_model::fixed::Overflow;
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::spec::Mesh;
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::{SignMode, SynapseFormat};
use hw_model::{ChipSpec, CoreMap, CoreMapParts};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// `cases` cases, the same ones in every run unless `PROPTEST_RNG_SEED` is set.
pub(crate) fn config(cases: u32) -> ProptestConfig {
    let mut config = ProptestConfig { cases, failure_persistence: None, ..Default::default() };
    if std::env::var_os("PROPTEST_RNG_SEED").is_none() {
        config.rng_seed = RngSeed::Fixed(20_180_101);
    }
    config
}

/// What a map is made from.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    cores: Vec<CoreRecipe>,
    ports: Vec<PortRecipe>,
    chip: ChipRecipe,
}

/// Where the chip differs from Loihi 1: tiles of one core, registers that clip.
#[derive(Debug, Clone)]
struct ChipRecipe {
    small_tiles: bool,
    clip: [bool; 3],
}

#[derive(Debug, Clone)]
struct CoreRecipe {
    groups: Vec<CompartmentGroup>,
    formats: Vec<SynapseFormat>,
    lists: Vec<Vec<EntryRecipe>>,
    axons_in: Vec<(u32, u16)>,
    /// Sender, target core, target axon.
    axons_out: Vec<(u16, u16, u16)>,
    split: u16,
}

#[derive(Debug, Clone)]
struct EntryRecipe {
    format: u8,
    dense: bool,
    first: u16,
    /// Target offset and weight.
    synapses: Vec<(u16, u16)>,
}

#[derive(Debug, Clone)]
struct PortRecipe {
    lines: u32,
    /// Line, target core, target axon.
    targets: Vec<(u32, u16, u16)>,
}

/// Maps of 1 to 6 cores.
pub(crate) fn recipe() -> impl Strategy<Value = Recipe> {
    let chip = (any::<bool>(), prop::array::uniform3(prop::bool::weighted(0.2)))
        .prop_map(|(small_tiles, clip)| ChipRecipe { small_tiles, clip });
    let cores = prop::collection::vec(core(), 1..=6);
    (cores, prop::collection::vec(port(), 0..=3), chip).prop_map(|(cores, ports, chip)| Recipe {
        cores,
        ports,
        chip,
    })
}

fn core() -> impl Strategy<Value = CoreRecipe> {
    let lists = prop::collection::vec(prop::collection::vec(entry(), 0..=3), 0..=6);
    let axons_in = prop::collection::vec((any::<u32>(), any::<u16>()), 0..=12);
    let axons_out = prop::collection::vec(any::<(u16, u16, u16)>(), 0..=60);
    let groups = prop::collection::vec(group(), 0..=4);
    let formats = prop::collection::vec(format(), 1..=4);
    (groups, formats, lists, axons_in, axons_out, any::<u16>()).prop_map(
        |(groups, formats, lists, axons_in, axons_out, split)| CoreRecipe {
            groups,
            formats,
            lists,
            axons_in,
            axons_out,
            split,
        },
    )
}

fn group() -> impl Strategy<Value = CompartmentGroup> {
    let decay = || prop::sample::select(vec![0u16, 1, 128, 1024, 2048, 3000, 4095, 4096]);
    let bias = (prop::sample::select(vec![0i16, 0, 0, 37, -90, 4095, -4095]), 0..=7u8);
    let threshold = prop_oneof![4 => 1..300u32, 1 => 300..=131_071u32];
    let len = prop_oneof![3 => 0..=70u16, 1 => 64..=200u16];
    let refractory = prop_oneof![1 => Just(1u8), 1 => 1..=6u8];
    (len, decay(), decay(), threshold, bias, refractory).prop_map(
        |(len, decay_current, decay_voltage, threshold_mantissa, bias, refractory_steps)| {
            CompartmentGroup {
                len,
                decay_current,
                decay_voltage,
                threshold_mantissa,
                bias_mantissa: bias.0,
                bias_exponent: bias.1,
                refractory_steps,
            }
        },
    )
}

fn format() -> impl Strategy<Value = SynapseFormat> {
    let modes = vec![SignMode::Mixed, SignMode::Excitatory, SignMode::Inhibitory];
    let bits = prop::sample::select(vec![1u8, 2, 3, 4, 5, 6, 8, 8, 8]);
    let exponent = prop_oneof![3 => -1..=3i8, 1 => -8..=7i8, 1 => Just(7i8)];
    (prop::sample::select(modes), bits, exponent).prop_map(|(sign_mode, weight_bits, exponent)| {
        SynapseFormat { sign_mode, weight_bits, exponent }
    })
}

fn entry() -> impl Strategy<Value = EntryRecipe> {
    let synapses = prop::collection::vec(any::<(u16, u16)>(), 0..=80);
    (any::<u8>(), any::<bool>(), any::<u16>(), synapses)
        .prop_map(|(format, dense, first, synapses)| EntryRecipe { format, dense, first, synapses })
}

fn port() -> impl Strategy<Value = PortRecipe> {
    let targets = prop::collection::vec(any::<(u32, u16, u16)>(), 0..=40);
    (0..=70u32, targets).prop_map(|(lines, targets)| PortRecipe { lines, targets })
}

/// Input of up to `steps` steps as raw (step, port, line), see [`stimulus`].
pub(crate) fn spikes(steps: usize) -> impl Strategy<Value = Vec<(u64, u32, u32)>> {
    prop::collection::vec((0..steps as u64, any::<u32>(), any::<u32>()), 0..=20 * steps)
}

/// Raw spikes brought into the ports of `map`.
pub(crate) fn stimulus(map: &CoreMap, steps: usize, raw: &[(u64, u32, u32)]) -> Stimulus {
    let ports = map.ports();
    let spikes = raw.iter().filter_map(|(step, port, line)| {
        let port = port.checked_rem(ports.len() as u32)?;
        Some((*step, port, line.checked_rem(ports[port as usize].lines)?))
    });
    Stimulus::new(map, steps, spikes).expect("ports and lines are within the map")
}

impl Recipe {
    /// The map.
    pub(crate) fn build(&self) -> CoreMap {
        CoreMap::new(self.parts()).expect("a recipe makes a valid map")
    }

    /// The map as plain data.
    pub(crate) fn parts(&self) -> CoreMapParts {
        let mut cores: Vec<Core> =
            self.cores.iter().enumerate().map(|(id, core)| core.build(id)).collect();
        let axons: Vec<u16> = cores.iter().map(|core| core.axons_in.len() as u16).collect();
        for (core, recipe) in cores.iter_mut().zip(&self.cores) {
            core.axons_out = recipe.axons_out(core.compartments(), &axons);
        }
        let ports = self.ports.iter().enumerate();
        CoreMapParts {
            chip: self.chip.build(),
            populations: self.populations(&cores),
            ports: ports.map(|(index, port)| port.build(index, &axons)).collect(),
            cores,
        }
    }

    /// The upper part of each core together with the lower part of the next one.
    fn populations(&self, cores: &[Core]) -> Vec<Population> {
        let splits: Vec<u16> = cores
            .iter()
            .zip(&self.cores)
            .map(|(core, recipe)| recipe.split % (core.compartments() as u16 + 1))
            .collect();
        let slice = |core: usize, first: u16, end: u16| Slice {
            core: CoreId(core as u16),
            first: CompartmentIdx(first),
            len: end - first,
        };
        (0..cores.len())
            .map(|id| {
                let next = (id + 1) % cores.len();
                let upper = slice(id, splits[id], cores[id].compartments() as u16);
                let slices = vec![upper, slice(next, 0, splits[next])];
                Population { name: format!("p{id}"), slices }
            })
            .collect()
    }
}

impl ChipRecipe {
    fn build(&self) -> ChipSpec {
        let mut chip = ChipSpec::loihi1();
        if self.small_tiles {
            chip.mesh = Mesh { tiles_x: 64, tiles_y: 2, cores_per_tile: 1 };
        }
        let rule = |clip| if clip { Overflow::Clip } else { Overflow::Wrap };
        let [accumulator, current, sum] = self.clip.map(rule);
        chip.arithmetic.accumulator_overflow = accumulator;
        chip.arithmetic.current_overflow = current;
        chip.arithmetic.current_plus_bias_overflow = sum;
        chip
    }
}

impl CoreRecipe {
    fn build(&self, id: usize) -> Core {
        let mut core = Core {
            label: if id == 3 { String::new() } else { format!("c{id}[0..9]") },
            groups: self.groups.clone(),
            formats: self.formats.clone(),
            ..Core::default()
        };
        let compartments = core.compartments() as u16;
        core.lists = self
            .lists
            .iter()
            .map(|entries| SynapseList {
                entries: entries.iter().map(|e| e.build(&self.formats, compartments)).collect(),
            })
            .collect();
        let axons_in = self.axons_in.iter().filter_map(|(list, base)| {
            let list = list.checked_rem(core.lists.len() as u32)?;
            let entries = &core.lists[list as usize].entries;
            let end = entries.iter().map(SynapseEntry::target_end).max().unwrap_or(0) as u16;
            Some(AxonIn { list, base: base % (compartments - end + 1) })
        });
        core.axons_in = axons_in.collect();
        core
    }

    fn axons_out(&self, compartments: usize, axons: &[u16]) -> Vec<AxonOut> {
        let axon_out = |(from, core, axon): &(u16, u16, u16)| {
            let core = core % axons.len() as u16;
            Some(AxonOut {
                compartment: CompartmentIdx(from.checked_rem(compartments as u16)?),
                core: CoreId(core),
                axon: AxonIdx(axon.checked_rem(axons[usize::from(core)])?),
            })
        };
        sorted(self.axons_out.iter().filter_map(axon_out).collect())
    }
}

impl EntryRecipe {
    fn build(&self, formats: &[SynapseFormat], compartments: u16) -> SynapseEntry {
        let format = self.format % formats.len() as u8;
        let chosen = &formats[usize::from(format)];
        let (low, high) = chosen.mantissa_range();
        let step = chosen.mantissa_step();
        let mantissa = |raw: u16| {
            let choices = (high - low) / step + 1;
            (low + i32::from(raw) % choices * step) as i16
        };
        let form = if self.dense {
            let first = self.first.checked_rem(compartments + 1).unwrap_or(0);
            let room = usize::from(compartments - first);
            let mantissas = self.synapses.iter().take(room).map(|(_, raw)| mantissa(*raw));
            SynapseForm::Dense { first, mantissas: mantissas.collect() }
        } else {
            let target =
                |(to, raw): &(u16, u16)| Some((to.checked_rem(compartments)?, mantissa(*raw)));
            let mut synapses: Vec<_> = self.synapses.iter().filter_map(target).collect();
            synapses.sort_unstable();
            synapses.dedup_by_key(|(to, _)| *to);
            let (targets, mantissas) = synapses.into_iter().unzip();
            SynapseForm::Sparse { targets, mantissas }
        };
        SynapseEntry { format, form }
    }
}

impl PortRecipe {
    fn build(&self, index: usize, axons: &[u16]) -> HostPort {
        let target = |(line, core, axon): &(u32, u16, u16)| {
            let core = core % axons.len() as u16;
            Some(PortTarget {
                line: line.checked_rem(self.lines)?,
                core: CoreId(core),
                axon: AxonIdx(axon.checked_rem(axons[usize::from(core)])?),
            })
        };
        let targets = sorted(self.targets.iter().filter_map(target).collect());
        HostPort { name: format!("in{index}"), lines: self.lines, targets }
    }
}

/// Sorted, none twice.
pub(crate) fn sorted<T: Ord>(mut values: Vec<T>) -> Vec<T> {
    values.sort_unstable();
    values.dedup();
    values
}
