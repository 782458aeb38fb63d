//! The networks that are compared: EEM-SAN, its peers and its ablations, as rows of one table.

use std::fmt;

use crate::nn::state::StateReader;

/// How robot and laser state become spikes. The DVS state always has a population code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// Gaussian receptive fields (eq. 6), as PopSAN and EEM-SAN have them.
    Population,
    /// SAN's: each number is a probability, those with a sign are split by it.
    Rate,
}

/// Where robot and laser state and DVS state meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fusion {
    /// A spiking layer for each, whose spikes are added (MF).
    Middle,
    /// The first layer of the decision module takes both codes: its currents are the sum.
    Naive,
}

/// What decides when a neuron fires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thresholds {
    /// A threshold `tanh(r)` for each layer, which learns (eq. 9, 10).
    Learned,
    /// The same threshold for all layers, which stays.
    Fixed,
    /// BDETT: one for each neuron and step, see [`crate::nn::Bdett`].
    Dynamic,
}

/// What tells the networks apart, events aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Form {
    /// Code of robot and laser state.
    pub code: Code,
    /// Fusion.
    pub fusion: Fusion,
    /// Thresholds.
    pub thresholds: Thresholds,
}

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// Name.
    pub name: &'static str,
    /// What it is made of.
    pub form: Form,
    /// Whether it takes the DVS state of an encoder.
    pub events: bool,
}

const fn row(
    name: &'static str,
    code: Code,
    fusion: Fusion,
    thresholds: Thresholds,
    events: bool,
) -> Variant {
    Variant { name, form: Form { code, fusion, thresholds }, events }
}

/// All of them. `san`, `popsan`, `bdett` and `eem-san` are the rows of the paper's success table;
/// `popsan`, `naive` and `eem-san` those of its ablation (a), (c) and (d); `fixed` is MFDM without
/// learned thresholds (fig:5), `laser-only` EEM-SAN without events.
pub const VARIANTS: [Variant; 7] = [
    row("san", Code::Rate, Fusion::Naive, Thresholds::Fixed, false),
    row("popsan", Code::Population, Fusion::Naive, Thresholds::Fixed, false),
    row("bdett", Code::Rate, Fusion::Naive, Thresholds::Dynamic, false),
    row("laser-only", Code::Population, Fusion::Middle, Thresholds::Learned, false),
    row("naive", Code::Population, Fusion::Naive, Thresholds::Fixed, true),
    row("fixed", Code::Population, Fusion::Middle, Thresholds::Fixed, true),
    row("eem-san", Code::Population, Fusion::Middle, Thresholds::Learned, true),
];

impl Variant {
    /// The row of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        VARIANTS.iter().find(|variant| variant.name == name)
    }
}

impl Form {
    /// EEM-SAN's, with or without events.
    pub const EEM_SAN: Self =
        Self { code: Code::Population, fusion: Fusion::Middle, thresholds: Thresholds::Learned };

    /// The form of the actor in a weights file, `prefix` before its names; `None` when there is no
    /// decision module.
    pub fn of(weights: &StateReader, prefix: &str) -> Option<Self> {
        let has = |name: &str| weights.has(&format!("{prefix}{name}"));
        let thresholds = match has("bdett") {
            true => Thresholds::Dynamic,
            false if has("decision.1.threshold") => Thresholds::Fixed,
            false => Thresholds::Learned,
        };
        let fusion = if has("fuse.laser.weight") { Fusion::Middle } else { Fusion::Naive };
        let code = if has("population.laser.mean") { Code::Population } else { Code::Rate };
        has("decision.1.weight").then_some(Self { code, fusion, thresholds })
    }
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let code = match self.code {
            Code::Population => "population",
            Code::Rate => "rate",
        };
        let fusion = match self.fusion {
            Fusion::Middle => "middle",
            Fusion::Naive => "naive",
        };
        let thresholds = match self.thresholds {
            Thresholds::Learned => "learned",
            Thresholds::Fixed => "fixed",
            Thresholds::Dynamic => "dynamic",
        };
        write!(f, "{code} code, {fusion} fusion, {thresholds} thresholds")
    }
}
