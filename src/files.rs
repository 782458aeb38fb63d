//! Reading and writing files without surprises.

use std::io::Read;
use std::path::Path;

use thiserror::Error;

pub use hw_model::container::write_atomically;

/// Largest text or weights file that is read.
pub const FILE_BYTES_MAX: u64 = 1 << 30;

/// A file that cannot be read.
#[derive(Debug, Error)]
pub enum FileError {
    /// The operating system refused.
    #[error("{file}: cannot read: {source}")]
    Io {
        /// The file.
        file: String,
        /// The reason.
        source: std::io::Error,
    },
    /// Larger than anything this program handles.
    #[error("{file}: more than {limit} bytes; this program reads files up to that size")]
    TooLarge {
        /// The file.
        file: String,
        /// The limit in bytes.
        limit: u64,
    },
    /// Not text.
    #[error("{file}: not UTF-8 text (byte {at}); is this the right file?")]
    NotText {
        /// The file.
        file: String,
        /// Position of the first bad byte.
        at: usize,
    },
}

/// All bytes of a file.
///
/// Errors: what the operating system says, or more than [`FILE_BYTES_MAX`] bytes.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let file = || path.display().to_string();
    let io = |source| FileError::Io { file: file(), source };
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(path).map_err(io)?;
    opened.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > FILE_BYTES_MAX {
        return Err(FileError::TooLarge { file: file(), limit: FILE_BYTES_MAX });
    }
    Ok(bytes)
}

/// All text of a file.
///
/// Errors: as [`read_bytes`], or not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read_bytes(path)?).map_err(|e| FileError::NotText {
        file: path.display().to_string(),
        at: e.utf8_error().valid_up_to(),
    })
}
