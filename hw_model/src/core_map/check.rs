//! The one place where a map is held against its chip.

use super::{Core, CoreMapParts};
use crate::error::MapError;
use crate::fixed::DECAY_UNIT;
use crate::spec::ChipSpec;
use crate::synapse::{SynapseEntry, SynapseForm};

/// Largest sum of messages x entries per core and step for which a 32-bit accumulator of 16-bit
/// weights cannot overflow, whatever spikes: 2^16 x (2^15 - 1) < 2^31.
const DELIVERIES_MAX: u64 = 1 << 16;

pub(super) fn check(parts: &CoreMapParts) -> Result<(), MapError> {
    parts.chip.check().map_err(|e| inconsistent("chip", e.to_string()))?;
    check_names(parts)?;
    let limit = parts.chip.limits.cores;
    within(&parts.chip, "chip", "cores", parts.cores.len() as u64, limit, "cores", CORES_ADVICE)?;
    for (index, core) in parts.cores.iter().enumerate() {
        CoreCheck { parts, core, place: place_of(parts, index) }.run()?;
    }
    check_fan_in(parts)?;
    check_populations(parts)?;
    check_ports(parts)
}

/// Longest name or label, in characters.
const NAME_LEN_MAX: usize = 256;

/// Names stand unquoted in the text form, where blanks separate and `;` starts a comment.
fn check_names(parts: &CoreMapParts) -> Result<(), MapError> {
    let fits = |name: &str| {
        name.len() <= NAME_LEN_MAX && name.bytes().all(|b| b.is_ascii_graphic() && b != b';')
    };
    let bad = |place: String, what, name: &str, limit| {
        Err(MapError::Name { place, what, name: name.to_owned(), limit })
    };
    for (index, core) in parts.cores.iter().enumerate() {
        if !fits(&core.label) {
            return bad(format!("core {index}"), "label", &core.label, "at most 256");
        }
    }
    let chip = std::iter::once(("chip".to_owned(), &parts.chip.name));
    let populations = parts.populations.iter().map(|p| &p.name).enumerate();
    let ports = parts.ports.iter().map(|p| &p.name).enumerate();
    let named = chip
        .chain(populations.map(|(index, name)| (format!("population {index}"), name)))
        .chain(ports.map(|(index, name)| (format!("port {index}"), name)));
    for (place, name) in named {
        if name.is_empty() || !fits(name) {
            return bad(place, "name", name, "1 to 256");
        }
    }
    Ok(())
}

const CORES_ADVICE: &str =
    "use a chip with more cores, fewer neurons, or more compartments per core";

fn place_of(parts: &CoreMapParts, core: usize) -> String {
    format!("core {core} ({})", parts.cores[core].label)
}

struct CoreCheck<'a> {
    parts: &'a CoreMapParts,
    core: &'a Core,
    place: String,
}

impl CoreCheck<'_> {
    fn run(&self) -> Result<(), MapError> {
        self.check_limits()?;
        self.check_groups()?;
        self.check_formats()?;
        self.check_lists()?;
        self.check_memory()?;
        self.check_axons_in()?;
        self.check_axons_out()
    }

    fn check_limits(&self) -> Result<(), MapError> {
        let limits = &self.parts.chip.limits;
        let smaller = "put fewer neurons on a core";
        self.limit(
            "compartments",
            self.core.compartments(),
            limits.compartments_per_core,
            "compartments_per_core",
            smaller,
        )?;
        self.limit(
            "input axons",
            self.core.axons_in.len(),
            limits.input_axons_per_core,
            "input_axons_per_core",
            "split the target layer over more cores or reduce its fan-in",
        )?;
        self.limit(
            "output axons",
            self.core.axons_out.len(),
            limits.output_axons_per_core,
            "output_axons_per_core",
            "put fewer neurons on this core or more on each target core",
        )?;
        self.limit(
            "synapse formats",
            self.core.formats.len(),
            limits.synapse_formats_per_core,
            "synapse_formats_per_core",
            "use fewer exponents or sign modes on this core",
        )?;
        let mut configs: Vec<_> = self
            .core
            .groups
            .iter()
            // Biases lie in registers of each compartment's own (NxSDK `cxCfg`), not in these.
            .map(|g| (g.decay_current, g.decay_voltage, g.refractory_steps))
            .collect();
        self.limit(
            "compartment configurations",
            count_distinct(&mut configs),
            limits.compartment_configs_per_core,
            "compartment_configs_per_core",
            "place layers with different parameters on different cores",
        )?;
        let mut thresholds: Vec<_> =
            self.core.groups.iter().map(|g| g.threshold_mantissa).collect();
        self.limit(
            "thresholds",
            count_distinct(&mut thresholds),
            limits.threshold_configs_per_core,
            "threshold_configs_per_core",
            "place layers with different thresholds on different cores",
        )
    }

    fn limit(
        &self,
        resource: &'static str,
        used: usize,
        limit: u32,
        field: &'static str,
        advice: &'static str,
    ) -> Result<(), MapError> {
        within(&self.parts.chip, &self.place, resource, used as u64, limit, field, advice)
    }

    fn check_groups(&self) -> Result<(), MapError> {
        let a = &self.parts.chip.arithmetic;
        for (index, group) in self.core.groups.iter().enumerate() {
            let value = |what, value: i64, low: i64, high: i64, advice| {
                self.value(format!("group {index}"), what, value, low, high, advice)
            };
            let decay_max = i64::from(DECAY_UNIT);
            let decay = "decays are 4096ths lost per step";
            value("decay_current", group.decay_current.into(), 0, decay_max, decay)?;
            value("decay_voltage", group.decay_voltage.into(), 0, decay_max, decay)?;
            let threshold_max = i64::from(a.threshold_mantissa_max());
            let advice = "scale the layer's weights and threshold";
            value("threshold mantissa", group.threshold_mantissa.into(), 1, threshold_max, advice)?;
            let bias_max = i64::from(a.bias_mantissa_max());
            let advice = "raise the bias exponent";
            value("bias mantissa", group.bias_mantissa.into(), -bias_max, bias_max, advice)?;
            let exponent_max = i64::from(a.bias_exponent_max);
            value("bias exponent", group.bias_exponent.into(), 0, exponent_max, "use a bias axon")?;
            let refractory_max = i64::from(a.refractory_steps_max);
            let advice = "1 means no refractory step";
            value("refractory steps", group.refractory_steps.into(), 1, refractory_max, advice)?;
        }
        Ok(())
    }

    fn check_formats(&self) -> Result<(), MapError> {
        let a = &self.parts.chip.arithmetic;
        for (index, format) in self.core.formats.iter().enumerate() {
            let place = || format!("synapse format {index}");
            let (low, high) = (a.weight_exponent_min.into(), a.weight_exponent_max.into());
            let exponent = i64::from(format.exponent);
            self.value(place(), "weight exponent", exponent, low, high, "rescale the layer")?;
            if !a.weight_bits.contains(&format.weight_bits) {
                return Err(MapError::Value {
                    place: format!("{}, {}", self.place, place()),
                    what: "weight bits",
                    value: format.weight_bits.into(),
                    limit: format!("one of {:?}", a.weight_bits),
                    advice: "choose a width that the chip has",
                });
            }
        }
        Ok(())
    }

    fn check_lists(&self) -> Result<(), MapError> {
        for (index, list) in self.core.lists.iter().enumerate() {
            for entry in &list.entries {
                self.check_entry(index, entry)?;
            }
        }
        Ok(())
    }

    fn check_entry(&self, list: usize, entry: &SynapseEntry) -> Result<(), MapError> {
        let place = || format!("{}, synapse list {list}", self.place);
        let Some(format) = self.core.formats.get(usize::from(entry.format)) else {
            return Err(dangling(
                place(),
                "synapse format",
                entry.format.into(),
                self.core.formats.len(),
            ));
        };
        if let SynapseForm::Sparse { targets, mantissas } = &entry.form {
            if targets.len() != mantissas.len() {
                let (t, m) = (targets.len(), mantissas.len());
                return Err(inconsistent(&place(), format!("{t} targets but {m} weights")));
            }
            if !rise(targets) {
                return Err(inconsistent(&place(), "targets do not increase strictly".to_owned()));
            }
        }
        if format.holds_all(entry.mantissas()) {
            return Ok(());
        }
        match entry.mantissas().iter().find(|m| !format.holds(i32::from(**m))) {
            None => Ok(()),
            Some(bad) => {
                let (low, high) = format.mantissa_range();
                let (mode, step) = (format.sign_mode, format.mantissa_step());
                Err(MapError::Value {
                    place: place(),
                    what: "weight mantissa",
                    value: i64::from(*bad),
                    limit: format!(
                        "{low}..={high} in steps of {step} ({mode:?}, {} bit)",
                        format.weight_bits
                    ),
                    advice: "round it by a named policy first",
                })
            }
        }
    }

    fn check_memory(&self) -> Result<(), MapError> {
        self.limit(
            "synapse memory words",
            usize::try_from(super::utilization::synapse_words(&self.parts.chip, self.core))
                .unwrap_or(usize::MAX),
            self.parts.chip.limits.synapse_words_per_core,
            "synapse_words_per_core",
            "put fewer neurons on a core, use fewer weight bits, or prune",
        )
    }

    fn check_axons_in(&self) -> Result<(), MapError> {
        let compartments = self.core.compartments();
        let ends: Vec<usize> = self
            .core
            .lists
            .iter()
            .map(|list| list.entries.iter().map(SynapseEntry::target_end).max().unwrap_or(0))
            .collect();
        for (index, axon) in self.core.axons_in.iter().enumerate() {
            let place = || format!("{}, input axon {index}", self.place);
            let Some(end) = ends.get(axon.list as usize) else {
                return Err(dangling(place(), "synapse list", axon.list.into(), ends.len()));
            };
            let last = usize::from(axon.base) + end;
            if last > compartments {
                return Err(dangling(place(), "compartment", last as u64 - 1, compartments));
            }
        }
        Ok(())
    }

    fn check_axons_out(&self) -> Result<(), MapError> {
        let place = || format!("{}, output axons", self.place);
        if !self.core.axons_out.is_sorted_by(|a, b| a < b) {
            return Err(inconsistent(
                &place(),
                "not sorted by compartment and target, or repeated".to_owned(),
            ));
        }
        let compartments = self.core.compartments();
        for axon in &self.core.axons_out {
            if axon.compartment.index() >= compartments {
                return Err(dangling(
                    place(),
                    "compartment",
                    axon.compartment.0.into(),
                    compartments,
                ));
            }
            check_target(self.parts, &place, axon.core.index(), axon.axon.index())?;
        }
        Ok(())
    }

    fn value(
        &self,
        part: String,
        what: &'static str,
        value: i64,
        low: i64,
        high: i64,
        advice: &'static str,
    ) -> Result<(), MapError> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let place = format!("{}, {part}", self.place);
        Err(MapError::Value { place, what, value, limit: format!("{low}..={high}"), advice })
    }
}

/// Whether each is larger than the one before: all of them looked at, so that vectors can be used.
fn rise(targets: &[u16]) -> bool {
    let pairs = targets.iter().zip(targets.iter().skip(1));
    pairs.fold(true, |rise, (a, b)| rise & (a < b))
}

fn check_target(
    parts: &CoreMapParts,
    place: &dyn Fn() -> String,
    core: usize,
    axon: usize,
) -> Result<(), MapError> {
    let Some(target) = parts.cores.get(core) else {
        return Err(dangling(place(), "core", core as u64, parts.cores.len()));
    };
    if axon >= target.axons_in.len() {
        let what = "input axon of the target core";
        return Err(dangling(place(), what, axon as u64, target.axons_in.len()));
    }
    Ok(())
}

/// A core's accumulators are 32 bit inside the engines: refuse a fan-in that could overflow them.
fn check_fan_in(parts: &CoreMapParts) -> Result<(), MapError> {
    let mut messages = vec![0u64; parts.cores.len()];
    let targets = parts.cores.iter().flat_map(|core| core.axons_out.iter().map(|a| a.core));
    let from_host = parts.ports.iter().flat_map(|port| port.targets.iter().map(|t| t.core));
    for core in targets.chain(from_host) {
        if let Some(count) = messages.get_mut(core.index()) {
            *count += 1;
        }
    }
    for (index, core) in parts.cores.iter().enumerate() {
        let entries = core.lists.iter().map(|list| list.entries.len()).max().unwrap_or(0);
        let used = messages[index] * entries as u64;
        if used > DELIVERIES_MAX {
            return Err(inconsistent(
                &place_of(parts, index),
                format!(
                    "{used} possible additions per compartment and step, limit {DELIVERIES_MAX}"
                ),
            ));
        }
    }
    Ok(())
}

fn check_populations(parts: &CoreMapParts) -> Result<(), MapError> {
    let mut owner: Vec<Vec<bool>> =
        parts.cores.iter().map(|core| vec![false; core.compartments()]).collect();
    for population in &parts.populations {
        let place = || format!("population {}", population.name);
        if parts.populations.iter().filter(|p| p.name == population.name).count() > 1 {
            return Err(inconsistent(&place(), "there are two of this name".to_owned()));
        }
        for slice in &population.slices {
            let Some(owned) = owner.get_mut(slice.core.index()) else {
                return Err(dangling(place(), "core", slice.core.0.into(), parts.cores.len()));
            };
            let (first, len, count) = (slice.first.index(), usize::from(slice.len), owned.len());
            let Some(range) = owned.get_mut(first..first + len) else {
                return Err(dangling(place(), "compartment", (first + len) as u64 - 1, count));
            };
            if range.iter().any(|taken| *taken) {
                let problem = format!("shares compartments of core {} with another", slice.core);
                return Err(inconsistent(&place(), problem));
            }
            range.fill(true);
        }
    }
    Ok(())
}

fn check_ports(parts: &CoreMapParts) -> Result<(), MapError> {
    for port in &parts.ports {
        let place = || format!("port {}", port.name);
        if parts.ports.iter().filter(|p| p.name == port.name).count() > 1 {
            return Err(inconsistent(&place(), "there are two of this name".to_owned()));
        }
        if port.lines > 1 << 24 {
            return Err(inconsistent(&place(), format!("{} lines, limit {}", port.lines, 1 << 24)));
        }
        if !port.targets.is_sorted_by(|a, b| a < b) {
            return Err(inconsistent(&place(), "targets not sorted, or repeated".to_owned()));
        }
        for target in &port.targets {
            if target.line >= port.lines {
                return Err(dangling(place(), "line", target.line.into(), port.lines as usize));
            }
            check_target(parts, &place, target.core.index(), target.axon.index())?;
        }
    }
    Ok(())
}

fn within(
    chip: &ChipSpec,
    place: &str,
    resource: &'static str,
    used: u64,
    limit: u32,
    field: &'static str,
    advice: &'static str,
) -> Result<(), MapError> {
    if used <= u64::from(limit) {
        return Ok(());
    }
    let (place, chip) = (place.to_owned(), chip.name.clone());
    Err(MapError::Limit { place, resource, used, limit: limit.into(), chip, field, advice })
}

fn count_distinct<T: Ord>(values: &mut Vec<T>) -> usize {
    values.sort_unstable();
    values.dedup();
    values.len()
}

fn dangling(place: String, what: &'static str, index: u64, count: usize) -> MapError {
    MapError::Dangling { place, what, index, count: count as u64 }
}

fn inconsistent(place: &str, problem: String) -> MapError {
    MapError::Inconsistent { place: place.to_owned(), problem }
}
