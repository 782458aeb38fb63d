//! Errors of the chip model. Each names the place, the value, the limit and what to do.

use thiserror::Error;

/// A chip description that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ChipError {
    /// The file is not TOML of the expected form.
    #[error("chip {chip}: {message}")]
    Syntax {
        /// File or built-in name.
        chip: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// No built-in chip has this name.
    #[error("chip {chip}: no such built-in chip (there is: loihi1)")]
    Unknown {
        /// The name asked for.
        chip: String,
    },
    /// A number is outside of what the model supports.
    #[error("chip {chip}: {field} = {value}, must be {limit}; correct the chip file")]
    OutOfRange {
        /// Chip name.
        chip: String,
        /// Field path in the file.
        field: String,
        /// The value found.
        value: String,
        /// What is allowed.
        limit: String,
    },
}

/// A core map that the chip cannot hold.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MapError {
    /// A resource of the chip or of a core is used up.
    #[error("{place}: {used} {resource}, limit {limit} ({chip}.{field}); {advice}")]
    Limit {
        /// Core or chip, with the label of what lies there.
        place: String,
        /// What there is too much of.
        resource: &'static str,
        /// How much is needed.
        used: u64,
        /// How much there is.
        limit: u64,
        /// Name of the chip.
        chip: String,
        /// Field of the chip description that sets the limit.
        field: &'static str,
        /// What would make it fit.
        advice: &'static str,
    },
    /// A register cannot hold the value.
    #[error("{place}: {what} = {value}, must be {limit}; {advice}")]
    Value {
        /// Core and group, list or axon.
        place: String,
        /// Name of the value.
        what: &'static str,
        /// The value found.
        value: i64,
        /// What is allowed.
        limit: String,
        /// What to do about it.
        advice: &'static str,
    },
    /// Something refers to what is not there.
    #[error("{place}: refers to {what} {index}, but there are {count}; the map is inconsistent")]
    Dangling {
        /// Core and axon, population or port.
        place: String,
        /// What is referred to.
        what: &'static str,
        /// Its number.
        index: u64,
        /// How many there are.
        count: u64,
    },
    /// A name that the text form of a map could not hold.
    #[error(
        "{place}: {what} {name:?}, must be {limit} visible ASCII characters without ';'; rename it"
    )]
    Name {
        /// Core, population or port, by number.
        place: String,
        /// Name or label.
        what: &'static str,
        /// The name found.
        name: String,
        /// How many characters are allowed.
        limit: &'static str,
    },
    /// The parts contradict each other.
    #[error("{place}: {problem}; the map is inconsistent")]
    Inconsistent {
        /// Core, population or port.
        place: String,
        /// What is wrong.
        problem: String,
    },
}

/// A line of a text file that does not say what it should.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}:{line}: found {found}, expected {expected}")]
pub struct TextError {
    /// File or other origin of the text.
    pub place: String,
    /// Line number, the first is 1.
    pub line: usize,
    /// What stands there, quoted and shortened, or "the end of the line".
    pub found: String,
    /// What should stand there.
    pub expected: String,
}

/// A container file that cannot be read or written.
#[derive(Debug, Error)]
pub enum ContainerError {
    /// The operating system refused.
    #[error("{file}: cannot {action}: {source}")]
    Io {
        /// The file.
        file: String,
        /// Read or write.
        action: &'static str,
        /// The reason.
        source: std::io::Error,
    },
    /// The file does not start with the expected label.
    #[error("{file}: not a {expected} file (its label is {found}); {advice}")]
    Label {
        /// The file.
        file: String,
        /// Expected label.
        expected: String,
        /// The first bytes, printable.
        found: String,
        /// What to do.
        advice: &'static str,
    },
    /// Written by another version of this program.
    #[error("{file}: version {found} found, {expected} expected; {advice}")]
    Version {
        /// The file.
        file: String,
        /// Version in the file.
        found: u32,
        /// Version that this program reads.
        expected: u32,
        /// What to do.
        advice: &'static str,
    },
    /// Shorter or longer than its header says.
    #[error(
        "{file}: {found} bytes of content, the header says {expected}: the file is truncated or has been appended to; {advice}"
    )]
    Length {
        /// The file.
        file: String,
        /// Bytes present.
        found: u64,
        /// Bytes promised.
        expected: u64,
        /// What to do.
        advice: &'static str,
    },
    /// The content is not what was written.
    #[error(
        "{file}: SHA-256 of the content is {found}, the header says {expected}: the file is damaged; {advice}"
    )]
    Digest {
        /// The file.
        file: String,
        /// Digest of the bytes present.
        found: String,
        /// Digest in the header.
        expected: String,
        /// What to do.
        advice: &'static str,
    },
    /// The content does not decode.
    #[error("{file}: the content does not decode ({message}); {advice}")]
    Content {
        /// The file.
        file: String,
        /// What the decoder says.
        message: String,
        /// What to do.
        advice: &'static str,
    },
}
