//! The chip to compile for.

use std::path::Path;

use hw_model::ChipSpec;
use hw_model::error::ChipError;
use thiserror::Error;

use crate::files::{self, FileError};

/// A chip that cannot be had.
#[derive(Debug, Error)]
pub enum ChipOpenError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is no chip; the error has its name.
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// A number of the file is out of range; the error has the chip's name alone.
    #[error("{file}: {source}")]
    Number {
        /// The file.
        file: String,
        /// The reason.
        source: ChipError,
    },
    /// Neither a built-in chip nor a file.
    #[error("{0}; or give the path of a .toml file")]
    Unknown(ChipError),
}

/// A built-in chip by its name, or one from a file.
///
/// Errors: neither of both; a file that cannot be read or is no chip.
pub fn open_chip(name: &str) -> Result<ChipSpec, ChipOpenError> {
    let named = ChipSpec::named(name);
    let path = Path::new(name);
    if named.is_ok() || (path.extension().is_none() && !path.exists()) {
        return named.map_err(ChipOpenError::Unknown);
    }
    let mut chip =
        ChipSpec::parse(name, &files::read_text(path)?).map_err(|error| match error {
            source @ ChipError::OutOfRange { .. } => {
                ChipOpenError::Number { file: name.to_owned(), source }
            }
            error => error.into(),
        })?;
    // What is not the built-in chip is not called so, whatever its file says.
    if ChipSpec::named(&chip.name).is_ok_and(|known| known != chip) {
        chip.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    Ok(chip)
}
