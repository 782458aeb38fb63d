//! The chip as data: limits, mesh, arithmetic, packing, cost tables.
//!
//! Read from `chips/*.toml`, where each number has its source beside it. A user's own file goes
//! through the same checks as the built-in ones.

use serde::{Deserialize, Serialize};

use crate::cost::CostTable;
use crate::error::ChipError;
use crate::fixed::Overflow;

/// Description of a chip. Once constructed it has passed [`ChipSpec::parse`]'s checks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChipSpec {
    /// Name, printed in every error and report.
    pub name: String,
    /// How much there is of everything.
    pub limits: Limits,
    /// Where the cores lie on the network-on-chip.
    pub mesh: Mesh,
    /// Register widths and overflow rules.
    pub arithmetic: Arithmetic,
    /// How synapse memory is accounted.
    pub packing: Packing,
    /// Leakage, kept apart from every cost table.
    pub static_power: StaticPower,
    /// Named tables of energy and time per operation.
    pub cost_tables: Vec<CostTable>,
}

/// Resources of the chip and of each core.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the names say it; sources are in the chip file
pub struct Limits {
    pub cores: u32,
    pub compartments_per_core: u32,
    pub input_axons_per_core: u32,
    pub output_axons_per_core: u32,
    pub synapse_words_per_core: u32,
    pub synapse_formats_per_core: u32,
    pub compartment_configs_per_core: u32,
    pub threshold_configs_per_core: u32,
}

/// Tiles of the network-on-chip; core ids run tile by tile, down each column of tiles.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Mesh {
    pub tiles_x: u16,
    pub tiles_y: u16,
    pub cores_per_tile: u16,
}

impl Mesh {
    /// Tile of a core as (x, y): `x = id / 16`, `y = (id % 16) / 4` on Loihi 1.
    pub fn tile(&self, core: u16) -> (u16, u16) {
        let tile = core / self.cores_per_tile;
        (tile / self.tiles_y, tile % self.tiles_y)
    }

    /// Tiles that the first `cores` cores lie in.
    pub fn tiles_of(&self, cores: usize) -> u32 {
        cores.div_ceil(usize::from(self.cores_per_tile)) as u32
    }
}

/// Register widths (magnitude bits, the sign is extra) and what happens beyond them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Arithmetic {
    pub accumulator_bits: u8,
    pub accumulator_overflow: Overflow,
    pub current_bits: u8,
    pub current_overflow: Overflow,
    pub current_plus_bias_overflow: Overflow,
    pub voltage_bits: u8,
    pub threshold_mantissa_bits: u8,
    pub threshold_shift: u8,
    pub bias_mantissa_bits: u8,
    pub bias_exponent_max: u8,
    pub refractory_steps_max: u8,
    pub weight_shift: u8,
    pub weight_exponent_min: i8,
    pub weight_exponent_max: i8,
    pub weight_bits: Vec<u8>,
}

impl Arithmetic {
    /// Largest threshold mantissa: the register holds it, and voltages reach beyond it.
    pub fn threshold_mantissa_max(&self) -> u32 {
        let voltage_bits = self.voltage_bits.saturating_sub(self.threshold_shift);
        (1 << self.threshold_mantissa_bits.min(voltage_bits)) - 1
    }

    /// Largest magnitude of a bias mantissa.
    pub fn bias_mantissa_max(&self) -> i32 {
        (1 << self.bias_mantissa_bits) - 1
    }
}

/// Rule by which synapses are packed into memory words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PackingRule {
    /// NxTF `data_structures.py`: at most 60 synapses per entry, an extra word near the end of a word.
    Nxtf,
    /// nengo-loihi `block.py:527-549`: at most 64 synapses per entry, entries rounded up to 64 bit.
    Nengo,
}

/// How synapse memory is accounted.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Packing {
    pub rule: PackingRule,
    pub delay_bits: u8,
    pub tag_bits: u8,
}

/// Leakage of the chip: reported as a line of its own, never inside an energy per operation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaticPower {
    /// Whole chip.
    pub chip_mw: f64,
    /// Where the number comes from and what it does not say.
    pub source: String,
}

impl StaticPower {
    /// Energy of the whole chip over `time_ps`.
    pub fn energy_fj(&self, time_ps: u64) -> u64 {
        // mW x ps = 1e-15 J = fJ
        (self.chip_mw * time_ps as f64).round() as u64
    }
}

const LOIHI1: &str = include_str!("../chips/loihi1.toml");

impl ChipSpec {
    /// The built-in Loihi 1 description.
    pub fn loihi1() -> Self {
        Self::parse("loihi1", LOIHI1).expect("the built-in chip passes its own checks")
    }

    /// A built-in chip by name.
    ///
    /// Errors: [`ChipError::Unknown`].
    pub fn named(name: &str) -> Result<Self, ChipError> {
        match name {
            "loihi1" => Ok(Self::loihi1()),
            _ => Err(ChipError::Unknown { chip: name.to_owned() }),
        }
    }

    /// Reads a chip description; `place` is the file or name that errors mention.
    ///
    /// Errors: unknown or missing keys, and numbers outside of what the model can compute with.
    pub fn parse(place: &str, text: &str) -> Result<Self, ChipError> {
        let spec: Self = toml::from_str(text)
            .map_err(|e| ChipError::Syntax { chip: place.to_owned(), message: e.to_string() })?;
        spec.check()?;
        Ok(spec)
    }

    /// The same chip with other widths of current and voltage, sign included (Loihi: 24 and 24). A
    /// threshold is compared with voltages, so its register is no wider than theirs.
    ///
    /// Errors: widths that the model cannot compute with, or too few for any threshold.
    pub fn with_state_bits(&self, current_bits: u8, voltage_bits: u8) -> Result<Self, ChipError> {
        let mut chip = self.clone();
        let a = &mut chip.arithmetic;
        a.current_bits = current_bits.saturating_sub(1);
        a.voltage_bits = voltage_bits.saturating_sub(1);
        let threshold_bits = a.voltage_bits.saturating_sub(a.threshold_shift);
        a.threshold_mantissa_bits = a.threshold_mantissa_bits.min(threshold_bits);
        if chip != *self {
            chip.name = format!("{}/u{current_bits}/v{voltage_bits}", self.name);
        }
        chip.check()?;
        Ok(chip)
    }

    /// Cost table by name.
    pub fn cost_table(&self, name: &str) -> Option<&CostTable> {
        self.cost_tables.iter().find(|table| table.name == name)
    }

    /// Repeats the checks of [`ChipSpec::parse`], for a description that came from elsewhere.
    pub fn check(&self) -> Result<(), ChipError> {
        let a = &self.arithmetic;
        let l = &self.limits;
        let mesh_cores = u64::from(self.mesh.tiles_x)
            * u64::from(self.mesh.tiles_y)
            * u64::from(self.mesh.cores_per_tile);
        if u64::from(l.cores) > mesh_cores {
            let limit = format!("1..={mesh_cores} (mesh: tiles_x * tiles_y * cores_per_tile)");
            return Err(self.out_of_range("limits.cores", l.cores.to_string(), limit));
        }
        self.within("limits.cores", l.cores.into(), 1, 16_384)?;
        self.within("limits.compartments_per_core", l.compartments_per_core.into(), 1, 16_384)?;
        self.within("limits.input_axons_per_core", l.input_axons_per_core.into(), 1, 65_535)?;
        self.within("limits.output_axons_per_core", l.output_axons_per_core.into(), 1, 1 << 24)?;
        self.within("limits.synapse_words_per_core", l.synapse_words_per_core.into(), 1, 1 << 28)?;
        self.within("limits.synapse_formats_per_core", l.synapse_formats_per_core.into(), 1, 255)?;
        self.within("arithmetic.accumulator_bits", a.accumulator_bits.into(), 1, 30)?;
        self.within("arithmetic.current_bits", a.current_bits.into(), 1, 30)?;
        self.within("arithmetic.voltage_bits", a.voltage_bits.into(), 1, 30)?;
        self.within("arithmetic.threshold_mantissa_bits", a.threshold_mantissa_bits.into(), 1, 24)?;
        self.within("arithmetic.threshold_shift", a.threshold_shift.into(), 0, 6)?;
        self.within("arithmetic.bias_mantissa_bits", a.bias_mantissa_bits.into(), 1, 15)?;
        self.within("arithmetic.bias_exponent_max", a.bias_exponent_max.into(), 0, 8)?;
        self.within("arithmetic.refractory_steps_max", a.refractory_steps_max.into(), 1, 255)?;
        self.within("arithmetic.weight_shift", a.weight_shift.into(), 6, 6)?;
        self.within("arithmetic.weight_exponent_max", a.weight_exponent_max.max(0) as u64, 0, 7)?;
        self.within(
            "-arithmetic.weight_exponent_min",
            u64::from(a.weight_exponent_min.min(0).unsigned_abs()),
            0,
            8,
        )?;
        for bits in &a.weight_bits {
            self.within("arithmetic.weight_bits", (*bits).into(), 1, 8)?;
        }
        self.within("packing.delay_bits", self.packing.delay_bits.into(), 0, 6)?;
        self.within("packing.tag_bits", self.packing.tag_bits.into(), 0, 9)?;
        self.finite("static_power.chip_mw", self.static_power.chip_mw)?;
        for (index, table) in self.cost_tables.iter().enumerate() {
            if self.cost_tables[..index].iter().any(|other| other.name == table.name) {
                let field = format!("cost_tables[{index}].name");
                return Err(self.out_of_range(
                    &field,
                    table.name.clone(),
                    "a name that no other cost table has".to_owned(),
                ));
            }
            for (field, value) in table.numbers() {
                self.finite(&format!("cost_tables.{}.{field}", table.name), value)?;
            }
            let points = &table.barrier_ns_by_tiles;
            if points.is_empty() || !points.is_sorted_by(|a, b| a.0 < b.0) {
                let field = format!("cost_tables.{}.barrier_ns_by_tiles", table.name);
                let limit = "one point or more, by increasing number of tiles".to_owned();
                return Err(self.out_of_range(&field, format!("{points:?}"), limit));
            }
        }
        Ok(())
    }

    fn within(&self, field: &str, value: u64, low: u64, high: u64) -> Result<(), ChipError> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(self.out_of_range(field, value.to_string(), format!("{low}..={high}")))
    }

    fn finite(&self, field: &str, value: f64) -> Result<(), ChipError> {
        if (0.0..=1e9).contains(&value) {
            return Ok(());
        }
        Err(self.out_of_range(field, value.to_string(), "a number in 0..=1e9".to_owned()))
    }

    fn out_of_range(&self, field: &str, value: String, limit: String) -> ChipError {
        ChipError::OutOfRange { chip: self.name.clone(), field: field.to_owned(), value, limit }
    }
}

#[cfg(test)]
#[path = "spec_tests.rs"]
mod tests;
