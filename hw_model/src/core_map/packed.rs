//! A core map as it lies in a file: what there is many of, in columns of fixed width.
//!
//! Use with `#[serde(with = "hw_model::core_map::packed")]` on a [`CoreMapParts`]. Reading is a
//! matter of copying; each distinct synapse list is stored once for the whole chip, as cores of a
//! convolution have the same ones. The digest of a map does not depend on this form.

mod column;
mod pool;

use std::sync::Arc;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{
    AxonIn, AxonOut, CompartmentGroup, Core, CoreMapParts, HostPort, Population, PortTarget, Slice,
};
use crate::id::{AxonIdx, CompartmentIdx, CoreId};
use crate::spec::ChipSpec;
use crate::synapse::{SynapseList, SynapseLists};
use crate::weight::SynapseFormat;
use column::{Column, Reader};
use pool::Pool;

/// Writes `parts` in columns.
///
/// Errors: those of the serializer.
pub fn serialize<S: Serializer>(parts: &CoreMapParts, serializer: S) -> Result<S::Ok, S::Error> {
    Packed::of(parts).serialize(serializer)
}

/// Reads what [`serialize`] wrote; the parts are unchecked.
///
/// Errors: those of the deserializer, and columns that do not go together.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<CoreMapParts, D::Error> {
    Packed::deserialize(deserializer)?.parts().map_err(D::Error::custom)
}

#[derive(Debug, Serialize, Deserialize)]
struct Packed {
    chip: ChipSpec,
    cores: Vec<PackedCore>,
    pool: Pool,
    /// Which list of the pool each list of each core is.
    lists: Column<u32>,
    axons_in: AxonsIn,
    axons_out: Triples,
    populations: Vec<Named>,
    slices: Triples,
    ports: Vec<PackedPort>,
    lines: Column<u32>,
    targets: Targets,
}

/// A core without what it has many of.
#[derive(Debug, Serialize, Deserialize)]
struct PackedCore {
    label: String,
    groups: Vec<CompartmentGroup>,
    formats: Vec<SynapseFormat>,
    lists: u32,
    axons_in: u32,
    axons_out: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct AxonsIn {
    lists: Column<u32>,
    bases: Column<u16>,
}

/// Output axons (compartment, core, axon), or slices (core, first compartment, length).
#[derive(Debug, Default, Serialize, Deserialize)]
struct Triples([Column<u16>; 3]);

/// Cores and axons that lines of ports reach.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Targets([Column<u16>; 2]);

/// A name and how many things there are under it.
#[derive(Debug, Serialize, Deserialize)]
struct Named {
    name: String,
    len: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct PackedPort {
    name: String,
    lines: u32,
    targets: u32,
}

impl Triples {
    fn of(triples: impl Iterator<Item = [u16; 3]>) -> Self {
        let mut columns = Self::default();
        for triple in triples {
            columns.0.iter_mut().zip(triple).for_each(|(column, number)| column.0.push(number));
        }
        columns
    }

    fn readers(&self, what: &'static str) -> [Reader<'_, u16>; 3] {
        self.0.each_ref().map(|column| Reader::new(what, column))
    }
}

/// The next `n` triples.
fn triples<'a>(
    readers: &mut [Reader<'a, u16>; 3],
    n: u32,
) -> Result<impl Iterator<Item = [u16; 3]> + use<'a>, String> {
    let [a, b, c] = readers;
    let (a, b, c) = (a.take(n as usize)?, b.take(n as usize)?, c.take(n as usize)?);
    Ok(a.iter().zip(b).zip(c).map(|((a, b), c)| [*a, *b, *c]))
}

impl Packed {
    fn of(parts: &CoreMapParts) -> Self {
        let (pool, lists) = Pool::of(&parts.cores);
        let axons_in = || parts.cores.iter().flat_map(|core| &core.axons_in);
        let axons_out = parts.cores.iter().flat_map(|core| &core.axons_out);
        let slices = parts.populations.iter().flat_map(|population| &population.slices);
        let targets = || parts.ports.iter().flat_map(|port| &port.targets);
        Self {
            chip: parts.chip.clone(),
            cores: parts.cores.iter().map(PackedCore::of).collect(),
            pool,
            lists,
            axons_in: AxonsIn {
                lists: Column(axons_in().map(|axon| axon.list).collect()),
                bases: Column(axons_in().map(|axon| axon.base).collect()),
            },
            axons_out: Triples::of(axons_out.map(|a| [a.compartment.0, a.core.0, a.axon.0])),
            populations: parts.populations.iter().map(Named::of).collect(),
            slices: Triples::of(slices.map(|slice| [slice.core.0, slice.first.0, slice.len])),
            ports: parts.ports.iter().map(PackedPort::of).collect(),
            lines: Column(targets().map(|target| target.line).collect()),
            targets: Targets([
                Column(targets().map(|target| target.core.0).collect()),
                Column(targets().map(|target| target.axon.0).collect()),
            ]),
        }
    }

    fn parts(self) -> Result<CoreMapParts, String> {
        let cores = self.cores()?;
        let populations = self.populations()?;
        let ports = self.ports()?;
        Ok(CoreMapParts { chip: self.chip, cores, populations, ports })
    }

    fn cores(&self) -> Result<Vec<Core>, String> {
        let pool = self.pool.lists()?;
        let mut lists = Reader::new("synapse lists of cores", &self.lists);
        let mut listed = Reader::new("input axons", &self.axons_in.lists);
        let mut bases = Reader::new("input axons", &self.axons_in.bases);
        let mut axons_out = self.axons_out.readers("output axons");
        let mut cores = Vec::with_capacity(self.cores.len());
        for core in &self.cores {
            let axons_in = core.axons_in as usize;
            let axons_in = listed.take(axons_in)?.iter().zip(bases.take(axons_in)?);
            let axon_out = |[compartment, core, axon]: [u16; 3]| AxonOut {
                compartment: CompartmentIdx(compartment),
                core: CoreId(core),
                axon: AxonIdx(axon),
            };
            cores.push(Core {
                label: core.label.clone(),
                groups: core.groups.clone(),
                formats: core.formats.clone(),
                lists: shared(&pool, lists.take(core.lists as usize)?)?,
                axons_in: axons_in
                    .map(|(list, base)| AxonIn { list: *list, base: *base })
                    .collect(),
                axons_out: triples(&mut axons_out, core.axons_out)?.map(axon_out).collect(),
            });
        }
        lists.end().and(listed.end()).and(bases.end())?;
        axons_out.iter().try_for_each(Reader::end)?;
        Ok(cores)
    }

    fn populations(&self) -> Result<Vec<Population>, String> {
        let mut slices = self.slices.readers("slices of populations");
        let slice = |[core, first, len]: [u16; 3]| Slice {
            core: CoreId(core),
            first: CompartmentIdx(first),
            len,
        };
        let mut populations = Vec::with_capacity(self.populations.len());
        for Named { name, len } in &self.populations {
            let slices = triples(&mut slices, *len)?.map(slice).collect();
            populations.push(Population { name: name.clone(), slices });
        }
        slices.iter().try_for_each(Reader::end)?;
        Ok(populations)
    }

    fn ports(&self) -> Result<Vec<HostPort>, String> {
        let mut lines = Reader::new("targets of ports", &self.lines);
        let [mut cores, mut axons] =
            self.targets.0.each_ref().map(|column| Reader::new("targets of ports", column));
        let mut ports = Vec::with_capacity(self.ports.len());
        for port in &self.ports {
            let n = port.targets as usize;
            let targets = lines.take(n)?.iter().zip(cores.take(n)?).zip(axons.take(n)?);
            let target = |((line, core), axon): ((&u32, &u16), &u16)| PortTarget {
                line: *line,
                core: CoreId(*core),
                axon: AxonIdx(*axon),
            };
            ports.push(HostPort {
                name: port.name.clone(),
                lines: port.lines,
                targets: targets.map(target).collect(),
            });
        }
        lines.end().and(cores.end()).and(axons.end())?;
        Ok(ports)
    }
}

/// Lists of a core by their numbers in the pool.
fn shared(pool: &[Arc<SynapseList>], numbers: &[u32]) -> Result<SynapseLists, String> {
    let list = |number: &u32| match pool.get(*number as usize) {
        Some(list) => Ok(Arc::clone(list)),
        None => Err(format!("synapse list {number} of {} stored", pool.len())),
    };
    numbers.iter().map(list).collect::<Result<_, _>>().map(SynapseLists::of_shared)
}

impl PackedCore {
    fn of(core: &Core) -> Self {
        Self {
            label: core.label.clone(),
            groups: core.groups.clone(),
            formats: core.formats.clone(),
            lists: core.lists.len() as u32,
            axons_in: core.axons_in.len() as u32,
            axons_out: core.axons_out.len() as u32,
        }
    }
}

impl Named {
    fn of(population: &Population) -> Self {
        Self { name: population.name.clone(), len: population.slices.len() as u32 }
    }
}

impl PackedPort {
    fn of(port: &HostPort) -> Self {
        Self { name: port.name.clone(), lines: port.lines, targets: port.targets.len() as u32 }
    }
}

#[cfg(test)]
#[path = "packed_tests.rs"]
mod tests;
