//! Core maps as text: one fact per line, the core on every line, so that it can be searched,
//! compared and written by hand.
//!
//! ```text
//! chip loihi1
//! core 000 label fc1[0..128]
//! core 000 group cx=0000..0128 decay_u=2048 decay_v=1024 vth=233 bias=0<<0 refractory=1
//! core 000 format 0 mode=mixed bits=8 exp=0
//! core 000 list 0 entry format=0 dense first=0: -12 4 6
//! core 000 list 0 entry format=0 sparse: 3:-12 17:4
//! core 000 list 1 empty
//! core 000 axon_in 0005 list=0 base=0
//! core 000 axon_out cx=0001 -> core 003 axon 0017
//! population fc1 core=000 cx=0000..0128
//! population conv1 core=001 cx=0000..0097/16
//! port in lines=24
//! port in line 3 -> core 000 axon 0003
//! ```
//! Ranges leave out their end; `0..97/16` is every 16th of them: 0, 16, ..., 96. A `;` starts a comment. A core is opened by its `label` line (the
//! label may be left out), a port by its `lines`. What is numbered stands in order.

use std::fmt::Write;

use super::{Core, CoreMap, CoreMapParts, HostPort, Population, Slice};
use crate::error::TextError;
use crate::spec::ChipSpec;
use crate::synapse::{SynapseEntry, SynapseForm};
use crate::text_line::Line;
use crate::weight::SignMode;

mod read;

pub(crate) use read::MapReader;

impl CoreMap {
    /// The map as text, one fact per line. [`CoreMapParts::from_text`] reads it back exactly.
    pub fn to_text(&self) -> String {
        let mut text = format!("chip {}\n", self.chip().name);
        write_map(&mut text, self).expect("a String takes everything");
        text
    }
}

impl CoreMapParts {
    /// Reads the text form of a map for `chip`. `place` is the file that errors mention.
    ///
    /// Errors: the first line that is not a fact, that names a thing out of order, or that is for
    /// another chip. Limits are checked by [`CoreMap::new`].
    pub fn from_text(place: &str, text: &str, chip: ChipSpec) -> Result<Self, TextError> {
        let mut reader = MapReader::default();
        let mut number = 0;
        for (index, line) in text.lines().enumerate() {
            number = index + 1;
            if let Some(line) = Line::new(place, number, line) {
                reader.line(line)?;
            }
        }
        match reader.chip() {
            Some((_, name)) if name == chip.name => Ok(reader.finish(chip)),
            found => Err(TextError {
                place: place.to_owned(),
                line: found.map_or(number.max(1), |(line, _)| line),
                found: found.map_or("no chip".to_owned(), |(_, name)| format!("`chip {name}`")),
                expected: format!("`chip {}`", chip.name),
            }),
        }
    }
}

fn write_map(text: &mut String, map: &CoreMap) -> std::fmt::Result {
    for (id, core) in map.cores().iter().enumerate() {
        write_core(text, id, core)?;
    }
    for population in map.populations() {
        write_population(text, population)?;
    }
    map.ports().iter().try_for_each(|port| write_port(text, port))
}

fn write_core(text: &mut String, id: usize, core: &Core) -> std::fmt::Result {
    writeln!(text, "{}", format!("core {id:03} label {}", core.label).trim_end())?;
    write_groups(text, id, core)?;
    for (index, format) in core.formats.iter().enumerate() {
        let mode = sign_mode_name(format.sign_mode);
        let (bits, exponent) = (format.weight_bits, format.exponent);
        writeln!(text, "core {id:03} format {index} mode={mode} bits={bits} exp={exponent}")?;
    }
    for (index, list) in core.lists.iter().enumerate() {
        if list.entries.is_empty() {
            writeln!(text, "core {id:03} list {index} empty")?;
        }
        for entry in &list.entries {
            write!(text, "core {id:03} list {index} entry format={} ", entry.format)?;
            write_entry(text, entry)?;
        }
    }
    for (index, axon) in core.axons_in.iter().enumerate() {
        let (list, base) = (axon.list, axon.base);
        writeln!(text, "core {id:03} axon_in {index:04} list={list} base={base}")?;
    }
    for axon in &core.axons_out {
        let (from, to, at) = (axon.compartment.0, axon.core.0, axon.axon.0);
        writeln!(text, "core {id:03} axon_out cx={from:04} -> core {to:03} axon {at:04}")?;
    }
    Ok(())
}

fn write_groups(text: &mut String, id: usize, core: &Core) -> std::fmt::Result {
    let mut first = 0;
    for group in &core.groups {
        let end = first + u32::from(group.len);
        write!(text, "core {id:03} group cx={first:04}..{end:04}")?;
        write!(text, " decay_u={} decay_v={}", group.decay_current, group.decay_voltage)?;
        write!(text, " vth={}", group.threshold_mantissa)?;
        write!(text, " bias={}<<{}", group.bias_mantissa, group.bias_exponent)?;
        writeln!(text, " refractory={}", group.refractory_steps)?;
        first = end;
    }
    Ok(())
}

fn write_entry(text: &mut String, entry: &SynapseEntry) -> std::fmt::Result {
    match &entry.form {
        SynapseForm::Dense { first, mantissas } => {
            write!(text, "dense first={first}:")?;
            mantissas.iter().try_for_each(|mantissa| write!(text, " {mantissa}"))?;
        }
        SynapseForm::Sparse { targets, mantissas } => {
            write!(text, "sparse:")?;
            let mut synapses = targets.iter().zip(mantissas);
            synapses.try_for_each(|(target, mantissa)| write!(text, " {target}:{mantissa}"))?;
        }
    }
    writeln!(text)
}

fn write_population(text: &mut String, population: &Population) -> std::fmt::Result {
    let name = &population.name;
    if population.slices.is_empty() {
        writeln!(text, "population {name} empty")?;
    }
    let mut rest = &population.slices[..];
    while let Some(slice) = rest.first() {
        let (core, first) = (slice.core.0, u32::from(slice.first.0));
        let (n, step) = even_steps(rest);
        let end = first + (n as u32 - 1) * step + u32::from(slice.len);
        write!(text, "population {name} core={core:03} cx={first:04}..{end:04}")?;
        if n > 1 {
            write!(text, "/{step}")?;
        }
        writeln!(text)?;
        rest = &rest[n..];
    }
    Ok(())
}

/// Fewest single compartments in a row that are written as one range with a step.
const STEPS_MIN: usize = 3;

/// How many of the first slices are single compartments of one core at equal distances of 2 or
/// more, and that distance; 1 where too few are.
fn even_steps(slices: &[Slice]) -> (usize, u32) {
    let [a, b, ..] = slices else { return (1, 1) };
    let Some(step) = b.first.0.checked_sub(a.first.0).filter(|step| *step > 1) else {
        return (1, 1);
    };
    let follows = |pair: &&[Slice]| {
        let (a, b) = (pair[0], pair[1]);
        a.core == b.core
            && a.len == 1
            && b.len == 1
            && a.first.0.checked_add(step) == Some(b.first.0)
    };
    let n = 1 + slices.windows(2).take_while(follows).count();
    if n < STEPS_MIN { (1, 1) } else { (n, u32::from(step)) }
}

fn write_port(text: &mut String, port: &HostPort) -> std::fmt::Result {
    let name = &port.name;
    writeln!(text, "port {name} lines={}", port.lines)?;
    port.targets.iter().try_for_each(|target| {
        let (line, core, axon) = (target.line, target.core.0, target.axon.0);
        writeln!(text, "port {name} line {line} -> core {core:03} axon {axon:04}")
    })
}

const SIGN_MODES: [SignMode; 3] = [SignMode::Mixed, SignMode::Excitatory, SignMode::Inhibitory];

fn sign_mode_name(mode: SignMode) -> &'static str {
    match mode {
        SignMode::Mixed => "mixed",
        SignMode::Excitatory => "excitatory",
        SignMode::Inhibitory => "inhibitory",
    }
}
