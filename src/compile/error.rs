//! Why a network cannot be compiled.

use hw_model::MapError;
use thiserror::Error;

/// A network that the chip cannot hold or express.
#[derive(Debug, Error)]
pub enum CompileError {
    /// No policy has this name.
    #[error("policy {name}: no such policy (there is: {known})")]
    UnknownPolicy {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Weights of a width that no format has.
    #[error("weight bits = {bits}, must be {}..={}; choose a width between", limit.0, limit.1)]
    WeightBits {
        /// The width asked for.
        bits: u8,
        /// Smallest and largest.
        limit: (u8, u8),
    },
    /// A threshold has no register value.
    #[error(
        "layer {layer}: threshold {threshold} -> mantissa {mantissa}, must be 1..={limit}; {advice}"
    )]
    Threshold {
        /// Layer.
        layer: String,
        /// Threshold of the float network.
        threshold: f64,
        /// What it becomes.
        mantissa: i64,
        /// Largest mantissa.
        limit: u32,
        /// What to do.
        advice: &'static str,
    },
    /// Thresholds that move with the voltages.
    #[error(
        "{network}: dynamic thresholds (BDETT): each of {neurons} neurons needs a threshold of its own \
         in every step, limit {limit} per core and set from outside \
         ({chip}.threshold_configs_per_core), and no compartment computes what it is made of, \
         exponentials of voltages and mean, minimum and maximum of a layer; fly it in floats, or \
         compile a network with fixed or learned thresholds (`spikeloop train actor --variant san`)"
    )]
    DynamicThresholds {
        /// Network.
        network: String,
        /// Its neurons with such thresholds.
        neurons: usize,
        /// Thresholds that a core has.
        limit: u32,
        /// Name of the chip.
        chip: String,
    },
    /// An encoder of artificial neurons (AVAE).
    #[error(
        "{network}: layer {layer}: {neurons} artificial neurons (ReLU, AVAE), and {chip} has \
         compartments that spike and none whose output is a number; fly it in floats, or compile a \
         network whose encoder spikes (`spikeloop train hsvae --kind hsvae` or `fsvae`)"
    )]
    ArtificialEncoder {
        /// Network.
        network: String,
        /// First layer of the encoder.
        layer: String,
        /// Its neurons.
        neurons: usize,
        /// Name of the chip.
        chip: String,
    },
    /// A network that the simulator tells of movers.
    #[error(
        "{network}: the simulator tells it where movers are, as nothing on a robot can; compile a \
         network with an encoder, or laser-only"
    )]
    Told {
        /// The network.
        network: String,
    },
    /// A network without an encoder and the schedule `streaming`.
    #[error(
        "{network}, schedule streaming: there is no encoder of event frames to keep pace with; leave \
         --schedule out"
    )]
    NothingToStream {
        /// The network.
        network: String,
    },
    /// An encoder that is put to rest at each control tick (FSVAE) and the schedule `streaming`.
    #[error(
        "{network}, schedule streaming: the encoder is at rest at the start of each control tick \
         (FSVAE), and {layers} layers that work at the same time, each on a frame of its own, have \
         no such start in common; compile it with --schedule held"
    )]
    ResetStreaming {
        /// Network.
        network: String,
        /// Layers of its encoder.
        layers: usize,
    },
    /// All weights and biases of a layer are zero.
    #[error(
        "layer {layer}: all weights and biases are zero, so there is no scale; train or prune the layer away"
    )]
    NoScale {
        /// Layer.
        layer: String,
    },
    /// Parts of an integer network that do not go together.
    #[error("{place}: {problem}; correct the network")]
    Graph {
        /// Population or projection.
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// Even one neuron needs more than a core has.
    #[error("layer {layer}: one neuron needs {used} {resource}, limit {limit} per core; {advice}")]
    NeuronTooLarge {
        /// Layer.
        layer: String,
        /// What there is too much of.
        resource: &'static str,
        /// How much one neuron needs.
        used: u64,
        /// How much a core has.
        limit: u64,
        /// What to do.
        advice: &'static str,
    },
    /// One layer alone needs more cores than the chip has.
    #[error(
        "layer {layer}: its {neurons} neurons need more cores than the limit of {limit} ({chip}.cores); {advice}"
    )]
    LayerTooLarge {
        /// Layer.
        layer: String,
        /// Its neurons.
        neurons: usize,
        /// Cores there are.
        limit: u32,
        /// Name of the chip.
        chip: String,
        /// What would make it fit.
        advice: &'static str,
    },
    /// The cores of the chip do not suffice.
    #[error("{needed} cores needed, limit {limit} ({chip}.cores): {breakdown}; {advice}")]
    Cores {
        /// Cores needed.
        needed: usize,
        /// Cores there are.
        limit: u32,
        /// Name of the chip.
        chip: String,
        /// Cores by layer, with what sets their number.
        breakdown: String,
        /// What would make it fit.
        advice: String,
    },
    /// More cores are to be used than the chip has.
    #[error(
        "{cores} cores are more than the limit of {limit} ({chip}.cores); ask for at most that"
    )]
    CoresOfChip {
        /// Cores asked for.
        cores: usize,
        /// Cores there are.
        limit: u32,
        /// Name of the chip.
        chip: String,
    },
    /// Fewer cores are to be used than it takes.
    #[error("{needed} cores needed, {cores} asked for: {breakdown}; ask for {needed} or more")]
    FewCores {
        /// Cores asked for.
        cores: usize,
        /// Cores needed.
        needed: usize,
        /// Cores by layer.
        breakdown: String,
    },
    /// The finished map does not pass the chip's checks.
    #[error(transparent)]
    Map(#[from] MapError),
}
