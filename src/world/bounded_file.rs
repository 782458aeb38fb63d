//! Reading a file of limited size.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest arena or pairs file that is read.
pub(crate) const FILE_BYTES_MAX: u64 = 4 * 1024 * 1024;

/// Why a file was not read; the reader's error type gives it the file's name.
#[derive(Debug)]
pub(crate) enum Refused {
    Io(std::io::Error),
    TooLarge,
}

/// The bytes of a file of at most [`FILE_BYTES_MAX`]; never takes more memory than that.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Refused> {
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(Refused::Io)?;
    file.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(Refused::Io)?;
    if bytes.len() as u64 > FILE_BYTES_MAX { Err(Refused::TooLarge) } else { Ok(bytes) }
}
