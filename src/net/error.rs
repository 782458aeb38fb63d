//! What can be wrong with a network.

use thiserror::Error;

use crate::files::FileError;
use crate::npz::NpzError;

/// A description or weights file that cannot be used.
#[derive(Debug, Error)]
pub enum NetError {
    /// Cannot be read at all.
    #[error(transparent)]
    File(#[from] FileError),
    /// The npz file with the weights or spikes cannot be used.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// Not of the expected form.
    #[error("{file}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// A core map where a network is expected.
    #[error("{file}: is a compiled core map; give the network that it was made from")]
    CoreMap {
        /// The file.
        file: String,
    },
    /// A checkpoint where weights are expected. Its actor is the last one; what is saved as weights
    /// may be an average.
    #[error(
        "{file}: is the checkpoint of a training, to go on from; give the weights that the training \
         wrote beside it"
    )]
    Checkpoint {
        /// The file.
        file: String,
    },
    /// Weights of something else where an EEM-SAN is expected.
    #[error(
        "{file}: holds no tensor of an EEM-SAN's actor (actor.*); weights of a network of your own go \
         with a description (.toml) that names them"
    )]
    NotEemSan {
        /// The file.
        file: String,
    },
    /// An EEM-SAN where a network with a description is expected.
    #[error(
        "{name}: is an EEM-SAN, and a network with a description is expected here; \
         `compile`, `drive`, `evaluate` and `thresholds` take one"
    )]
    EemSan {
        /// Built-in name or file.
        name: String,
    },
    /// An integer network where one with encoder and decoder is expected.
    #[error(
        "{file}: an integer network without encoder and decoder cannot drive; compile it and use \
         `spikeloop run`"
    )]
    Integers {
        /// The file.
        file: String,
    },
    /// Weights for a network that comes with its own.
    #[error("{weights}: {name} comes with its weights; leave --weights out")]
    Weights {
        /// Built-in name or file of the network.
        name: String,
        /// The weights file.
        weights: String,
    },
    /// No built-in network has this name.
    #[error("{name}: neither a file nor a built-in network ({known})")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that may be meant, or all there are.
        known: String,
    },
    /// The description names no weights file and none was given.
    #[error(
        "{file}: names no weights file; give one with --weights FILE where there is that option, or, in \
         a description of your own, by a line `weights = \"FILE.safetensors\"` above its first [table]"
    )]
    NoWeights {
        /// The description.
        file: String,
    },
    /// A number in the description is outside of its range.
    #[error("{file}: {place}: {what} = {value}, must be {limit}")]
    Value {
        /// The file.
        file: String,
        /// Layer or section.
        place: String,
        /// Name of the value.
        what: &'static str,
        /// The value found.
        value: String,
        /// What is allowed.
        limit: String,
    },
    /// A tensor is missing or has another shape or type.
    #[error("{file}: layer {layer}: tensor {tensor}: {found} found, {expected} expected")]
    Tensor {
        /// The weights file.
        file: String,
        /// Layer that needs the tensor.
        layer: String,
        /// Name of the tensor.
        tensor: String,
        /// Shape and type found, or "nothing".
        found: String,
        /// Shape and type needed.
        expected: String,
    },
    /// A weight is not a number.
    #[error(
        "{file}: layer {layer}: tensor {tensor}: element {index} is {value}, must be finite; train or export again"
    )]
    NotFinite {
        /// The weights file.
        file: String,
        /// Layer of the weight.
        layer: String,
        /// Name of the tensor.
        tensor: String,
        /// Position in the tensor.
        index: usize,
        /// The value.
        value: f32,
    },
}
