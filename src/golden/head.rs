//! Settings of a network or loop trace: `key value` lines.

use core::ops::RangeInclusive;
use std::collections::BTreeMap;

use hw_model::ChipSpec;

use crate::compile::{CompileError, Policy, Split, open_chip};
use crate::golden::GoldenError;
use crate::host::Schedule;
use crate::world::pairs::PAIRS_MAX;
use crate::world::robot::{Actuators, ActuatorsError};

/// Most decisions or control ticks of a trace.
const COUNT_MAX: u64 = 10_000;

/// What is traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Decisions on random input.
    Network,
    /// Control ticks of a trial.
    Loop,
}

/// Who decides in a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LoopDriver {
    Chip,
    Float,
}

#[derive(Debug, Clone)]
pub(super) struct Head {
    pub(super) file: String,
    pub(super) kind: Kind,
    pub(super) network: String,
    pub(super) policy: String,
    /// Bits of a weight, where the trace names them.
    pub(super) weight_bits: Option<u8>,
    /// Of an EEM-SAN, where the trace names one.
    pub(super) schedule: Option<Schedule>,
    /// What it is compiled for.
    pub(super) chip: ChipSpec,
    pub(super) split: Split,
    pub(super) seed: u64,
    /// Decisions of a network trace, ticks of a loop trace.
    pub(super) count: u64,
    pub(super) driver: LoopDriver,
    pub(super) arena: String,
    pub(super) trial: u64,
    pub(super) v_max_mm_per_s: u64,
    pub(super) actuators: Actuators,
}

/// Keys of both kinds of traces.
const KEYS: [&str; 9] = [
    "network",
    "loop",
    "policy",
    "weight_bits",
    "schedule",
    "on_chip",
    "neurons_per_core",
    "cores",
    "seed",
];

/// Those of network traces alone.
const NETWORK_KEYS: [&str; 1] = ["decisions"];

/// Those of loop traces alone.
const LOOP_KEYS: [&str; 6] = ["driver", "arena", "trial", "ticks", "v_max_mm_per_s", "actuators"];

impl Head {
    pub(super) fn parse(file: &str, head: &str) -> Result<Self, GoldenError> {
        let mut lines: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
        for (index, line) in head.lines().enumerate() {
            let said = line.split(';').next().unwrap_or("").trim();
            if said.is_empty() {
                continue;
            }
            let error = || GoldenError::Line {
                file: file.to_owned(),
                line: index + 1,
                found: line.trim().to_owned(),
                expected: format!(
                    "a line KEY VALUE with one of the keys {}, each at most once",
                    known()
                ),
            };
            let (key, value) = said.split_once(' ').ok_or_else(error)?;
            let there = keys().any(|known| known == key);
            if !there || lines.insert(key, (index + 1, value.trim())).is_some() {
                return Err(error());
            }
        }
        Lines { file, lines }.head()
    }

    /// The quantization policy.
    ///
    /// Errors: there is none of that name, or it has no such number of bits.
    pub(super) fn quantization(&self) -> Result<Policy, GoldenError> {
        let policy = Policy::named(&self.policy);
        let narrowed = policy.and_then(|policy| policy.narrowed(self.weight_bits));
        narrowed.map_err(|source| self.compile_error(source))
    }

    pub(super) fn compile_error(&self, source: CompileError) -> GoldenError {
        GoldenError::Compile { file: self.file.clone(), source: Box::new(source) }
    }
}

fn keys() -> impl Iterator<Item = &'static str> {
    KEYS.into_iter().chain(NETWORK_KEYS).chain(LOOP_KEYS)
}

/// All keys, in words.
fn known() -> String {
    keys().collect::<Vec<_>>().join(", ")
}

struct Lines<'a> {
    file: &'a str,
    lines: BTreeMap<&'a str, (usize, &'a str)>,
}

impl Lines<'_> {
    fn head(&self) -> Result<Head, GoldenError> {
        let (kind, network, counted) = match (self.get("network"), self.get("loop")) {
            (Some((_, name)), None) => (Kind::Network, name, "decisions"),
            (None, Some((_, name))) => (Kind::Loop, name, "ticks"),
            (Some(_), Some(_)) => {
                return Err(self.error("loop", "no such line, as this trace has `network NAME`"));
            }
            (None, None) => {
                return Err(GoldenError::NoKind { file: self.file.to_owned() });
            }
        };
        let (others, of) = match kind {
            Kind::Network => (&LOOP_KEYS[..], "no such line, which is of loop traces"),
            Kind::Loop => (&NETWORK_KEYS[..], "no such line, which is of network traces"),
        };
        if let Some(key) = others.iter().find(|key| self.get(key).is_some()) {
            return Err(self.error(key, of));
        }
        let driver = match self.get("driver").map_or("chip", |(_, value)| value) {
            "chip" => LoopDriver::Chip,
            "float" => LoopDriver::Float,
            _ => return Err(self.error("driver", "chip or float")),
        };
        let compiled =
            ["policy", "weight_bits", "schedule", "on_chip", "neurons_per_core", "cores"];
        if let Some(key) = compiled.into_iter().find(|key| self.get(key).is_some())
            && driver == LoopDriver::Float
        {
            return Err(self.error(key, "no such line, as nothing is compiled with `driver float`"));
        }
        let schedule = match self.get("schedule").map(|(_, value)| value) {
            None => None,
            Some("held") => Some(Schedule::Held),
            Some("streaming") => Some(Schedule::Streaming),
            Some(_) => return Err(self.error("schedule", "held or streaming")),
        };
        let actuators = self.get("actuators").map_or("ideal", |(_, value)| value);
        let text =
            |key: &str, default: &str| self.get(key).map_or(default, |(_, value)| value).to_owned();
        Ok(Head {
            file: self.file.to_owned(),
            kind,
            network: network.to_owned(),
            policy: text("policy", "nearest"),
            weight_bits: self.bits()?,
            schedule,
            chip: self.chip()?,
            split: self.split()?,
            seed: self.number("seed", 1, 0..=u64::MAX)?,
            count: self.number(counted, 1, 1..=COUNT_MAX)?,
            driver,
            arena: text("arena", "courtyard"),
            trial: self.number("trial", 0, 0..=PAIRS_MAX as u64 - 1)?,
            v_max_mm_per_s: self.number("v_max_mm_per_s", 500, 1..=10_000)?,
            actuators: actuators.parse().map_err(|error: ActuatorsError| {
                self.error("actuators", &format!("actuators that go ({error})"))
            })?,
        })
    }

    fn get(&self, key: &str) -> Option<(usize, &str)> {
        self.lines.get(key).copied()
    }

    fn chip(&self) -> Result<ChipSpec, GoldenError> {
        let Some((_, name)) = self.get("on_chip") else { return Ok(ChipSpec::loihi1()) };
        open_chip(name).map_err(|source| GoldenError::ChipFile {
            file: self.file.to_owned(),
            source: Box::new(source),
        })
    }

    fn split(&self) -> Result<Split, GoldenError> {
        let given = |key| self.optional(key, 1..=u64::from(u32::MAX));
        let (most, cores) = (given("neurons_per_core")?, given("cores")?);
        if most.is_some() && cores.is_some() {
            return Err(self.error("cores", "no such line beside neurons_per_core"));
        }
        let [most, cores] = [most, cores].map(|number| number.map(|number| number as usize));
        Ok(Split::asked(cores, most))
    }

    fn bits(&self) -> Result<Option<u8>, GoldenError> {
        let bits = self.optional("weight_bits", 0..=u64::from(u8::MAX))?;
        Ok(bits.map(|bits| bits as u8))
    }

    /// A number without a default.
    fn optional(
        &self,
        key: &'static str,
        limits: RangeInclusive<u64>,
    ) -> Result<Option<u64>, GoldenError> {
        self.get(key).map(|_| self.number(key, 0, limits)).transpose()
    }

    fn number(
        &self,
        key: &'static str,
        default: u64,
        limits: RangeInclusive<u64>,
    ) -> Result<u64, GoldenError> {
        let Some((_, value)) = self.get(key) else { return Ok(default) };
        let number = value.parse().ok().filter(|number| limits.contains(number));
        let (low, high) = (limits.start(), limits.end());
        number.ok_or_else(|| self.error(key, &format!("a whole number of {low} to {high}")))
    }

    fn error(&self, key: &str, expected: &str) -> GoldenError {
        let (line, value) = self.get(key).unwrap_or((1, "nothing"));
        GoldenError::Line {
            file: self.file.to_owned(),
            line,
            found: format!("{key} {value}"),
            expected: expected.to_owned(),
        }
    }
}
