//! Files of this project: label, version, length, SHA-256, then bincode content.
//!
//! The one place that knows bincode (2.0.1, unmaintained, RUSTSEC-2025-0141), so that it can be
//! replaced: raise the version of every label when that happens.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::error::ContainerError;

/// Largest content that is read: an upper bound for hostile headers.
const CONTENT_BYTES_MAX: usize = 1 << 30;
const HEADER_BYTES: usize = 8 + 4 + 8 + 32;
/// Of a file's name in that of a file beside it: at most 160 of the 255 bytes that are allowed.
const BESIDE_CHARS: usize = 40;

/// What identifies a kind of file.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// First eight bytes of the file.
    pub label: [u8; 8],
    /// Version of the content.
    pub version: u32,
    /// How to get a good file: the end of every error message.
    pub advice: &'static str,
}

/// SHA-256 as lower-case hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Content of `value` with its header, as [`read`] expects it.
pub fn to_bytes<T: Serialize>(kind: Kind, value: &T) -> Vec<u8> {
    let content = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .expect("plain data always encodes");
    let mut bytes = Vec::with_capacity(HEADER_BYTES + content.len());
    bytes.extend_from_slice(&kind.label);
    bytes.extend_from_slice(&kind.version.to_le_bytes());
    bytes.extend_from_slice(&(content.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&Sha256::digest(&content));
    bytes.extend_from_slice(&content);
    bytes
}

/// Digest of the content of `value`: the same that its file carries.
pub fn digest<T: Serialize>(value: &T) -> String {
    let content = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .expect("plain data always encodes");
    sha256_hex(&content)
}

/// Decodes what [`to_bytes`] made. `file` is the name that errors mention.
///
/// Errors: wrong label, version, length or digest, or content that does not decode.
pub fn from_bytes<T: DeserializeOwned>(
    kind: Kind,
    file: &str,
    bytes: &[u8],
) -> Result<T, ContainerError> {
    let file = || file.to_owned();
    let advice = kind.advice;
    let label = bytes.get(..8).unwrap_or(bytes);
    if label != kind.label {
        let expected = printable(&kind.label);
        return Err(ContainerError::Label {
            file: file(),
            expected,
            found: printable(label),
            advice,
        });
    }
    let Some(header) = bytes.get(..HEADER_BYTES) else {
        let (found, expected) = (bytes.len() as u64, HEADER_BYTES as u64);
        return Err(ContainerError::Length { file: file(), found, expected, advice });
    };
    let version = u32::from_le_bytes(header[8..12].try_into().expect("four bytes"));
    if version != kind.version {
        let expected = kind.version;
        return Err(ContainerError::Version { file: file(), found: version, expected, advice });
    }
    let content = &bytes[HEADER_BYTES..];
    let expected = u64::from_le_bytes(header[12..20].try_into().expect("eight bytes"));
    if content.len() as u64 != expected {
        let found = content.len() as u64;
        return Err(ContainerError::Length { file: file(), found, expected, advice });
    }
    let found = Sha256::digest(content);
    if found[..] != header[20..52] {
        let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02x}")).collect::<String>();
        let (found, expected) = (hex(&found), hex(&header[20..52]));
        return Err(ContainerError::Digest { file: file(), found, expected, advice });
    }
    let config = bincode::config::standard().with_limit::<CONTENT_BYTES_MAX>();
    let content_error = |message| ContainerError::Content { file: file(), message, advice };
    let (value, used) = bincode::serde::decode_from_slice(content, config)
        .map_err(|e| content_error(e.to_string()))?;
    if used != content.len() {
        return Err(content_error(format!("{} bytes are left over", content.len() - used)));
    }
    Ok(value)
}

/// Reads and decodes a file.
///
/// Errors: as [`from_bytes`], and what the operating system says.
pub fn read<T: DeserializeOwned>(kind: Kind, path: &Path) -> Result<T, ContainerError> {
    let file = path.display().to_string();
    let io = |source| ContainerError::Io { file: file.clone(), action: "read", source };
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .map_err(io)?
        .take((HEADER_BYTES + CONTENT_BYTES_MAX) as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    from_bytes(kind, &file, &bytes)
}

/// Writes a file in one piece: either all of it is there afterwards or the old one is untouched.
/// What is replaced passes its permissions on.
///
/// Errors: what the operating system says; no partial file is left behind.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ContainerError> {
    let io =
        |source| ContainerError::Io { file: path.display().to_string(), action: "write", source };
    let partial = beside(path, PARTIAL);
    let fill = |mut file: std::fs::File| {
        if let Ok(old) = std::fs::metadata(path) {
            file.set_permissions(old.permissions())?;
        }
        file.write_all(bytes)?;
        file.sync_all()
    };
    let written = std::fs::File::create(&partial)
        .and_then(fill)
        .and_then(|()| std::fs::rename(&partial, path));
    written.map_err(|source| {
        // Nothing to do if the partial file was never made.
        let _ = std::fs::remove_file(&partial);
        io(source)
    })
}

/// Ending of a file that is not whole yet, see [`beside`].
pub const PARTIAL: &str = "tmp";

/// Name of a file of this process beside `path`, hidden and no longer than file systems allow.
pub fn beside(path: &Path, ending: &str) -> PathBuf {
    beside_of(path, std::process::id(), ending)
}

/// The same of the process of this number.
pub fn beside_of(path: &Path, process: u32, ending: &str) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let start: String = name.chars().take(BESIDE_CHARS).collect();
    path.with_file_name(format!(".{start}.{process}.{ending}"))
}

fn printable(bytes: &[u8]) -> String {
    bytes.escape_ascii().to_string()
}

#[cfg(test)]
#[path = "container_tests.rs"]
mod tests;
