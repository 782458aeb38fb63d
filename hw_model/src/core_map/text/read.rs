//! Reads the text form of a core map line by line.

use super::{SIGN_MODES, sign_mode_name};
use crate::core_map::{
    AxonIn, AxonOut, CompartmentGroup, Core, CoreMapParts, HostPort, Population, PortTarget, Slice,
};
use crate::error::TextError;
use crate::id::{AxonIdx, CompartmentIdx, CoreId};
use crate::spec::ChipSpec;
use crate::synapse::{SynapseEntry, SynapseForm, SynapseList};
use crate::text_line::Line;
use crate::weight::SynapseFormat;

/// A map under way. Lines of other kinds may stand between those of the map.
#[derive(Debug, Default)]
pub(crate) struct MapReader {
    chip: Option<(usize, String)>,
    cores: Vec<Core>,
    populations: Vec<Population>,
    ports: Vec<HostPort>,
}

impl MapReader {
    /// Takes one line, which must be a fact of the map.
    pub(crate) fn line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let expected = "`chip`, `core`, `population` or `port`";
        match line.word(expected)? {
            "chip" => self.chip_line(line),
            "core" => self.core_line(line),
            "population" => self.population_line(line),
            "port" => self.port_line(line),
            other => Err(line.wrong(other, expected)),
        }
    }

    /// Line number and name of the chip, once read.
    pub(crate) fn chip(&self) -> Option<(usize, &str)> {
        self.chip.as_ref().map(|(line, name)| (*line, name.as_str()))
    }

    /// What was read, for `chip`.
    pub(crate) fn finish(self, chip: ChipSpec) -> CoreMapParts {
        let Self { cores, populations, ports, .. } = self;
        CoreMapParts { chip, cores, populations, ports }
    }

    fn chip_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let name = line.word("the name of a chip")?;
        if self.chip.is_some() {
            return Err(line.wrong(name, "one chip only"));
        }
        self.chip = Some((line.number(), name.to_owned()));
        line.end()
    }

    fn core_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let expected = "the number of a core";
        let id: usize = line.integer(expected)?;
        let what = "`label`, `group`, `format`, `list`, `axon_in` or `axon_out`";
        let fact = line.word(what)?;
        if fact == "label" {
            let next = self.cores.len();
            line.expect_index(id, next, "core")?;
            let label = line.optional_word().unwrap_or("").to_owned();
            self.cores.push(Core { label, ..Core::default() });
            return line.end();
        }
        let Some(core) = self.cores.get_mut(id) else {
            let label = "`label`, which opens a core";
            return Err(line.wrong(fact, label));
        };
        match fact {
            "group" => group_line(core, line),
            "format" => format_line(core, line),
            "list" => list_line(core, line),
            "axon_in" => axon_in_line(core, line),
            "axon_out" => axon_out_line(core, line),
            other => Err(line.wrong(other, what)),
        }
    }

    fn population_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let name = line.word("the name of a population")?;
        if line.clone().optional_word() == Some("empty") {
            line.literal("empty")?;
            self.populations.push(Population { name: name.to_owned(), slices: Vec::new() });
            return line.end();
        }
        let core = CoreId(line.field("core")?);
        let (range, step) = line.stepped_range("cx")?;
        let (first, len) = line.span(range)?;
        let slice = |first, len| Slice { core, first: CompartmentIdx(first), len };
        let slices = match step {
            None => vec![slice(first, len)],
            Some(step) => {
                (0..len).step_by(step).map(|at| slice(first.saturating_add(at), 1)).collect()
            }
        };
        match self.populations.last_mut().filter(|last| last.name == name) {
            Some(last) => last.slices.extend(slices),
            None => self.populations.push(Population { name: name.to_owned(), slices }),
        }
        line.end()
    }

    fn port_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let name = line.word("the name of a port")?;
        if line.clone().optional_word() != Some("line") {
            let lines = line.field("lines")?;
            self.ports.push(HostPort { name: name.to_owned(), lines, targets: Vec::new() });
            return line.end();
        }
        let Some(port) = self.ports.last_mut().filter(|port| port.name == name) else {
            return Err(line.wrong(name, "the port whose `lines` come before"));
        };
        line.literal("line")?;
        let number = line.integer("the number of a line")?;
        let (core, axon) = target(&mut line)?;
        port.targets.push(PortTarget { line: number, core, axon });
        line.end()
    }
}

fn group_line(core: &mut Core, mut line: Line<'_>) -> Result<(), TextError> {
    let range = line.range::<u32>("cx")?;
    line.expect_index(range.start as usize, core.compartments(), "first compartment")?;
    let (_, len) = line.span(range)?;
    let decay_current = line.field("decay_u")?;
    let decay_voltage = line.field("decay_v")?;
    let threshold_mantissa = line.field("vth")?;
    let bias = line.value("bias", "MANTISSA<<EXPONENT")?;
    let expected = "`bias=MANTISSA<<EXPONENT`";
    let Some((mantissa, exponent)) = bias.split_once("<<") else {
        return Err(line.wrong(bias, expected));
    };
    let (bias_mantissa, bias_exponent) =
        (line.parse(mantissa, expected)?, line.parse(exponent, expected)?);
    core.groups.push(CompartmentGroup {
        len,
        decay_current,
        decay_voltage,
        threshold_mantissa,
        bias_mantissa,
        bias_exponent,
        refractory_steps: line.field("refractory")?,
    });
    line.end()
}

fn format_line(core: &mut Core, mut line: Line<'_>) -> Result<(), TextError> {
    let index = line.integer("the number of a format")?;
    line.expect_index(index, core.formats.len(), "format")?;
    let mode = line.value("mode", "MODE")?;
    let Some(sign_mode) = SIGN_MODES.into_iter().find(|m| sign_mode_name(*m) == mode) else {
        return Err(line.wrong(mode, "`mixed`, `excitatory` or `inhibitory`"));
    };
    let (weight_bits, exponent) = (line.field("bits")?, line.field("exp")?);
    core.formats.push(SynapseFormat { sign_mode, weight_bits, exponent });
    line.end()
}

fn list_line(core: &mut Core, mut line: Line<'_>) -> Result<(), TextError> {
    let index: usize = line.integer("the number of a list")?;
    let what = "`entry` or `empty`";
    match line.word(what)? {
        "empty" => {
            line.expect_index(index, core.lists.len(), "list")?;
            core.lists.push(SynapseList::default());
            line.end()
        }
        "entry" => {
            let entry = entry(&mut line)?;
            if index + 1 == core.lists.len() {
                core.lists[index].entries.push(entry);
                return Ok(());
            }
            line.expect_index(index, core.lists.len(), "list")?;
            core.lists.push(SynapseList { entries: vec![entry] });
            Ok(())
        }
        other => Err(line.wrong(other, what)),
    }
}

fn entry(line: &mut Line<'_>) -> Result<SynapseEntry, TextError> {
    let format = line.field("format")?;
    let what = "`dense first=N:` or `sparse:`";
    let form = match line.word(what)? {
        "dense" => {
            let first = line.value("first", "N:")?;
            let Some(first) = first.strip_suffix(':') else {
                return Err(line.wrong(first, "a `:` behind the number"));
            };
            let first = line.parse(first, "the number of the first target")?;
            SynapseForm::Dense { first, mantissas: dense_weights(line)? }
        }
        "sparse:" => sparse_weights(line)?,
        other => return Err(line.wrong(other, what)),
    };
    Ok(SynapseEntry { format, form })
}

fn dense_weights(line: &mut Line<'_>) -> Result<Vec<i16>, TextError> {
    let mut mantissas = Vec::new();
    while let Some(word) = line.optional_word() {
        mantissas.push(line.parse(word, "a weight mantissa")?);
    }
    Ok(mantissas)
}

fn sparse_weights(line: &mut Line<'_>) -> Result<SynapseForm, TextError> {
    let expected = "`TARGET:MANTISSA`";
    let (mut targets, mut mantissas) = (Vec::new(), Vec::new());
    while let Some(word) = line.optional_word() {
        let Some((target, mantissa)) = word.split_once(':') else {
            return Err(line.wrong(word, expected));
        };
        targets.push(line.parse(target, expected)?);
        mantissas.push(line.parse(mantissa, expected)?);
    }
    Ok(SynapseForm::Sparse { targets, mantissas })
}

fn axon_in_line(core: &mut Core, mut line: Line<'_>) -> Result<(), TextError> {
    let index = line.integer("the number of an input axon")?;
    line.expect_index(index, core.axons_in.len(), "input axon")?;
    core.axons_in.push(AxonIn { list: line.field("list")?, base: line.field("base")? });
    line.end()
}

fn axon_out_line(core: &mut Core, mut line: Line<'_>) -> Result<(), TextError> {
    let compartment = CompartmentIdx(line.field("cx")?);
    let (to, axon) = target(&mut line)?;
    core.axons_out.push(AxonOut { compartment, core: to, axon });
    line.end()
}

/// `-> core NNN axon NNNN`
fn target(line: &mut Line<'_>) -> Result<(CoreId, AxonIdx), TextError> {
    line.literal("->")?;
    line.literal("core")?;
    let core = CoreId(line.integer("the number of a core")?);
    line.literal("axon")?;
    Ok((core, AxonIdx(line.integer("the number of an input axon")?)))
}
