//! Arrays of whole numbers in NumPy's npz files.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use npyz::{DType, NpyFile, WriterBuilder};
use thiserror::Error;

use crate::files::{self, FileError};

/// Largest number of elements per array.
const ELEMENTS_MAX: u64 = 1 << 26;
/// Longest header of an array, as in NumPy.
const HEADER_BYTES_MAX: usize = 10_000;
/// Most brackets in a header: an array of numbers has two, and the reader's time is exponential in how
/// deep they nest.
const BRACKETS_MAX: usize = 6;

/// An npz file that cannot be used.
#[derive(Debug, Error)]
pub enum NpzError {
    /// Cannot be read at all.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not a zip archive of arrays.
    #[error("{file}: not a readable npz archive ({message}); save it with numpy.savez")]
    Archive {
        /// The file.
        file: String,
        /// What the reader says.
        message: String,
    },
    /// An array is not there or not usable.
    #[error("{file}: array {array}: {message}")]
    Array {
        /// The file.
        file: String,
        /// Name of the array.
        array: String,
        /// What is wrong and what is expected.
        message: String,
    },
}

/// An array of whole numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntArray {
    /// Extent of each dimension.
    pub shape: Vec<u64>,
    /// Elements, last dimension fastest.
    pub values: Vec<i64>,
}

/// An npz file in memory.
#[derive(Debug)]
pub struct Npz {
    file: String,
    archive: zip::ZipArchive<Cursor<Vec<u8>>>,
}

impl Npz {
    /// Reads the directory of an archive.
    ///
    /// Errors: not readable, not a zip archive.
    pub fn open(path: &Path) -> Result<Self, NpzError> {
        Self::from_bytes(&path.display().to_string(), files::read_bytes(path)?)
    }

    /// The same from memory; `file` is the name that errors mention.
    pub fn from_bytes(file: &str, bytes: Vec<u8>) -> Result<Self, NpzError> {
        let archive = zip::ZipArchive::new(Cursor::new(bytes))
            .map_err(|e| NpzError::Archive { file: file.to_owned(), message: e.to_string() })?;
        Ok(Self { file: file.to_owned(), archive })
    }

    /// One array of whole numbers by name.
    ///
    /// Errors: no such array, floats, Fortran order, more elements than fit, or damaged data.
    pub fn ints(&mut self, name: &str) -> Result<IntArray, NpzError> {
        let array = self.entry(name).and_then(|bytes| int_array(&bytes));
        array.map_err(|message| NpzError::Array {
            file: self.file.clone(),
            array: name.to_owned(),
            message,
        })
    }

    /// The elements of an array of one dimension.
    ///
    /// Errors: as [`Npz::ints`], or another number of dimensions.
    pub fn flat_ints(&mut self, name: &str) -> Result<Vec<i64>, NpzError> {
        let array = self.ints(name)?;
        if array.shape.len() == 1 {
            return Ok(array.values);
        }
        let message = format!("shape {:?} found, one dimension expected", array.shape);
        Err(NpzError::Array { file: self.file.clone(), array: name.to_owned(), message })
    }

    /// The unpacked bytes of an array.
    fn entry(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let mut names = self.names();
        names.truncate(12);
        let names = if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
        let mut entry = match self.archive.by_name(&format!("{name}.npy")) {
            Ok(entry) => entry,
            Err(zip::result::ZipError::FileNotFound) => {
                return Err(format!("is not there (there is: {names})"));
            }
            Err(error) => return Err(error.to_string()),
        };
        let mut bytes = Vec::new();
        let limit = ELEMENTS_MAX * 8 + HEADER_BYTES_MAX as u64;
        entry.by_ref().take(limit + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        if bytes.len() as u64 > limit {
            return Err(format!("larger than {ELEMENTS_MAX} elements (ELEMENTS_MAX); split it"));
        }
        Ok(bytes)
    }

    /// Names of the arrays, sorted.
    pub fn names(&self) -> Vec<String> {
        let arrays = self.archive.file_names().filter_map(|name| name.strip_suffix(".npy"));
        let mut names: Vec<String> = arrays.map(str::to_owned).collect();
        names.sort_unstable();
        names
    }
}

fn int_array(bytes: &[u8]) -> Result<IntArray, String> {
    check_header(bytes)?;
    let npy = NpyFile::new(bytes).map_err(|e| e.to_string())?;
    let shape = npy.shape().to_vec();
    if npy.order() != npyz::Order::C {
        return Err("is in Fortran order; save it with numpy.ascontiguousarray".to_owned());
    }
    Ok(IntArray { shape, values: ints_of(npy)? })
}

/// Refuses headers that would take the array reader much memory or stack.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    let (start, len) = match *bytes {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b, ..] => {
            (10, u16::from_le_bytes([a, b]).into())
        }
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _, a, b, c, d, ..] => {
            (12, u32::from_le_bytes([a, b, c, d]) as usize)
        }
        _ => return Err("is not a NumPy array; save it with numpy.savez".to_owned()),
    };
    if len > HEADER_BYTES_MAX {
        return Err(format!(
            "has a header of {len} bytes, limit {HEADER_BYTES_MAX} (HEADER_BYTES_MAX)"
        ));
    }
    let header = bytes.get(start..start + len).ok_or("is cut off within its header")?;
    let brackets = header.iter().filter(|byte| b"([{".contains(byte)).count();
    if brackets > BRACKETS_MAX {
        return Err(format!(
            "has {brackets} brackets in its header, limit {BRACKETS_MAX} (BRACKETS_MAX)"
        ));
    }
    match elements(&String::from_utf8_lossy(header)) {
        None => {
            Err("has a header without a shape that can be read; save it with numpy.savez"
                .to_owned())
        }
        Some(elements) if elements > bytes.len() as u64 => Err(format!(
            "has a shape of {elements} elements or more, which is larger than the data"
        )),
        Some(_) => Ok(()),
    }
}

/// Product of the extents above 0 of the one shape in a header, at most `u64::MAX`: the array
/// reader multiplies without looking.
fn elements(header: &str) -> Option<u64> {
    let (before, after) = header.split_once("shape")?;
    if before.contains('\\') || after.contains('\\') || after.contains("shape") {
        return None;
    }
    let after = after.trim_start_matches(['\'', '"']).trim_start().strip_prefix(':')?;
    let (extents, _) = after.trim_start().strip_prefix('(')?.split_once(')')?;
    let extents = extents.split(',').map(str::trim).filter(|extent| !extent.is_empty());
    extents
        .map(|extent| extent.parse::<u64>().ok())
        .try_fold(1u64, |product, extent| Some(product.saturating_mul(extent?.max(1))))
}

fn ints_of(npy: NpyFile<&[u8]>) -> Result<Vec<i64>, String> {
    let dtype = npy.dtype();
    let DType::Plain(plain) = &dtype else {
        return Err(format!("has the structured type {}", dtype.descr()));
    };
    macro_rules! widen {
        ($t:ty) => {
            npy.into_vec::<$t>().map_err(|e| e.to_string())?.into_iter().map(|v| v as i64).collect()
        };
    }
    Ok(match (plain.type_char(), plain.size_field()) {
        (npyz::TypeChar::Int, 1) => widen!(i8),
        (npyz::TypeChar::Int, 2) => widen!(i16),
        (npyz::TypeChar::Int, 4) => widen!(i32),
        (npyz::TypeChar::Int, 8) => widen!(i64),
        (npyz::TypeChar::Uint, 1) => widen!(u8),
        (npyz::TypeChar::Uint, 2) => widen!(u16),
        (npyz::TypeChar::Uint, 4) => widen!(u32),
        (npyz::TypeChar::Uint, 8) => {
            let wide = npy.into_vec::<u64>().map_err(|e| e.to_string())?;
            let narrow = |value| {
                i64::try_from(value).map_err(|_| format!("has the value {value}, too large"))
            };
            wide.into_iter().map(narrow).collect::<Result<_, _>>()?
        }
        _ => return Err(format!("has the type {}, whole numbers expected", dtype.descr())),
    })
}

/// Bytes of an npz file with the given one-dimensional arrays.
pub fn to_bytes(arrays: &[(String, Vec<i32>)]) -> std::io::Result<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    // A fixed date keeps the bytes of equal results equal.
    let options = zip::write::FileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default());
    for (name, values) in arrays {
        archive.start_file(format!("{name}.npy"), options)?;
        let mut npy = Vec::new();
        let options = npyz::WriteOptions::new().default_dtype();
        let mut writer = options.shape(&[values.len() as u64]).writer(&mut npy).begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()?;
        archive.write_all(&npy)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
#[path = "npz_tests.rs"]
mod tests;
