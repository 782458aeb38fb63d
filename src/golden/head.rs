//! Settings of a network or loop trace: `key value` lines.

use std::collections::BTreeMap;

use hw_model::ChipSpec;

use crate::compile::{Split, open_chip};
use crate::golden::GoldenError;
use crate::host::Schedule;
use crate::world::robot::Actuators;

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

const KEYS: &str = "network or loop NAME, policy NAME, schedule held|streaming, on_chip NAME, neurons_per_core N, seed N, decisions or ticks N, driver chip|float, \
                    arena NAME, trial N, v_max_mm_per_s N, actuators PRESET, each at most once";

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
                expected: KEYS,
            };
            let (key, value) = said.split_once(' ').ok_or_else(error)?;
            let known = [
                "network",
                "loop",
                "policy",
                "schedule",
                "on_chip",
                "neurons_per_core",
                "seed",
                "decisions",
                "ticks",
                "driver",
                "arena",
                "trial",
                "v_max_mm_per_s",
                "actuators",
            ];
            if !known.contains(&key) || lines.insert(key, (index + 1, value.trim())).is_some() {
                return Err(error());
            }
        }
        Lines { file, lines }.head()
    }
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
            _ => return Err(self.error("network", "one of `network NAME` and `loop NAME`")),
        };
        let driver = match self.get("driver").map_or("chip", |(_, value)| value) {
            "chip" => LoopDriver::Chip,
            "float" => LoopDriver::Float,
            _ => return Err(self.error("driver", "chip or float")),
        };
        let compiled = ["policy", "schedule", "on_chip", "neurons_per_core"];
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
            schedule,
            chip: self.chip()?,
            split: self.split()?,
            seed: self.number("seed", 1, u64::MAX)?,
            count: self.count(counted)?,
            driver,
            arena: text("arena", "courtyard"),
            trial: self.number("trial", 0, 1 << 32)?,
            v_max_mm_per_s: self.number("v_max_mm_per_s", 500, 10_000)?,
            actuators: actuators
                .parse()
                .map_err(|_| self.error("actuators", "an actuator preset"))?,
        })
    }

    fn get(&self, key: &str) -> Option<(usize, &str)> {
        self.lines.get(key).copied()
    }

    /// How many decisions or ticks: none would check nothing.
    fn count(&self, key: &'static str) -> Result<u64, GoldenError> {
        match self.number(key, 1, COUNT_MAX)? {
            0 => Err(self.error(key, "1 or more")),
            count => Ok(count),
        }
    }

    fn chip(&self) -> Result<ChipSpec, GoldenError> {
        let Some((_, name)) = self.get("on_chip") else { return Ok(ChipSpec::loihi1()) };
        open_chip(name).map_err(|source| GoldenError::ChipFile {
            file: self.file.to_owned(),
            source: Box::new(source),
        })
    }

    fn split(&self) -> Result<Split, GoldenError> {
        const KEY: &str = "neurons_per_core";
        match self.number(KEY, 0, u64::from(u32::MAX))? {
            0 if self.get(KEY).is_some() => Err(self.error(KEY, "1 or more")),
            0 => Ok(Split::Fewest),
            n => Ok(Split::NeuronsPerCore(n as usize)),
        }
    }

    fn number(&self, key: &'static str, default: u64, max: u64) -> Result<u64, GoldenError> {
        let Some((_, value)) = self.get(key) else { return Ok(default) };
        let number = value.parse().ok().filter(|number| *number <= max);
        number
            .ok_or_else(|| self.error(key, "a whole number within the limits of traces/README.md"))
    }

    fn error(&self, key: &str, expected: &'static str) -> GoldenError {
        let (line, value) = self.get(key).unwrap_or((1, "nothing"));
        GoldenError::Line {
            file: self.file.to_owned(),
            line,
            found: format!("{key} {value}"),
            expected,
        }
    }
}
