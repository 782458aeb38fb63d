//! Reading and writing files without surprises.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use hw_model::container::{self, PARTIAL};
use hw_model::error::ContainerError;
use thiserror::Error;

/// Largest text or weights file that is read.
pub const FILE_BYTES_MAX: u64 = 1 << 30;

/// Longest name in a file, bytes.
pub const NAME_LEN_MAX: usize = 256;

/// Whether a table can show `name`: 1..=[`NAME_LEN_MAX`] characters on one line.
pub fn fits_a_line(name: &str) -> bool {
    (1..=NAME_LEN_MAX).contains(&name.len()) && !name.chars().any(char::is_control)
}

/// Whether `name` can stand unquoted among other words, as names of what lies on cores do: 1..=[`NAME_LEN_MAX`]
/// visible ASCII characters, no blank and no `;`.
pub fn fits_a_word(name: &str) -> bool {
    (1..=NAME_LEN_MAX).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_graphic() && byte != b';')
}

/// The folder that a file lies in, or would.
pub fn folder_of(file: &Path) -> &Path {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// A file that cannot be read.
#[derive(Debug, Error)]
pub enum FileError {
    /// The operating system refused.
    #[error("{file}: cannot read: {source}")]
    Io {
        /// The file.
        file: String,
        /// The reason.
        source: io::Error,
    },
    /// Another process writes there.
    #[error("{folder}: another run writes there; wait for its end, or give another folder")]
    Taken {
        /// The folder.
        folder: String,
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
    let opened = File::open(path).map_err(io)?;
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
    text_of(path, read_bytes(path)?)
}

/// Bytes of the file at `path` as text.
///
/// Errors: not UTF-8.
pub fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String, FileError> {
    String::from_utf8(bytes).map_err(|e| FileError::NotText {
        file: path.display().to_string(),
        at: e.utf8_error().valid_up_to(),
    })
}

/// Writes a file in one piece: either all of it is there afterwards or the old one is untouched.
/// A link stays a link; what is no regular file (a pipe, `/dev/null`) is written to, not replaced.
///
/// Errors: a write-protected file, and what the operating system says; no partial file is left behind.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ContainerError> {
    let io = |source| write_error(path, source);
    match target(path).map_err(io)? {
        Target::File(file) => container::write_atomically(&file, bytes),
        Target::Stream => OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|mut stream| stream.write_all(bytes))
            .map_err(io),
    }
}

/// Does `work`, which reads and writes the file at `path` anew, while no other process does so with a file
/// of the same folder; what killed ones left of writing it is removed. Where the system cannot lock
/// folders, nothing is locked or removed.
pub fn in_turn<T>(path: &Path, work: impl FnOnce() -> T) -> T {
    let file = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let lock = File::open(folder_of(&file));
    let locked = lock.as_ref().is_ok_and(|lock| lock.lock().is_ok());
    if locked {
        remove_partials(&file);
    }
    let done = work();
    if locked && let Ok(lock) = lock {
        // It ends with the file at the latest.
        let _ = lock.unlock();
    }
    done
}

/// Removes what killed processes left of [`write_atomically`] to `file`, when nobody else writes it now.
fn remove_partials(file: &Path) {
    let of_process = |path: &Path, process: &str| {
        let number = process.parse::<u32>();
        number.is_ok_and(|number| path == container::beside_of(file, number, PARTIAL))
    };
    let Ok(entries) = fs::read_dir(folder_of(file)) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let process = name.strip_suffix(&format!(".{PARTIAL}")).and_then(|n| n.rsplit('.').next());
        if process.is_some_and(|process| of_process(&path, process)) {
            // What cannot be removed stays.
            let _ = fs::remove_file(&path);
        }
    }
}

/// Empty file that is locked for as long as a folder is somebody's own, and left there. Not the folder
/// itself: [`in_turn`] locks that, and must not wait for so long.
const LOCK_FILE: &str = ".lock";

/// A folder that no other process can have until this is dropped.
#[derive(Debug)]
pub struct OwnFolder {
    lock: Option<File>,
}

impl OwnFolder {
    /// Takes the folder at `path`. Where the system cannot lock files, nothing is locked.
    ///
    /// Errors: another process has it.
    pub fn take(path: &Path) -> Result<Self, FileError> {
        let file = path.join(LOCK_FILE);
        let lock = OpenOptions::new().write(true).create(true).truncate(false).open(file);
        let Ok(lock) = lock else { return Ok(Self { lock: None }) };
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => {
                Err(FileError::Taken { folder: path.display().to_string() })
            }
            Ok(()) => Ok(Self { lock: Some(lock) }),
            Err(TryLockError::Error(_)) => Ok(Self { lock: None }),
        }
    }

    /// Removes what killed processes left of writing these files of it.
    pub fn remove_partials(&self, files: &[PathBuf]) {
        if self.lock.is_some() {
            files.iter().for_each(|file| remove_partials(file));
        }
    }
}

/// Finds out before a long run whether [`write_atomically`] could write there after it.
///
/// Errors: what the operating system says.
pub fn check_writable(path: &Path) -> Result<(), ContainerError> {
    let io = |source| write_error(path, source);
    let Target::File(file) = target(path).map_err(io)? else { return Ok(()) };
    let probe = container::beside(&file, "probe.tmp");
    File::create(&probe).and_then(|_| fs::remove_file(&probe)).map_err(io)
}

enum Target {
    /// A regular file, there or not, behind all links.
    File(PathBuf),
    /// A device or pipe.
    Stream,
}

fn target(path: &Path) -> io::Result<Target> {
    match fs::metadata(path) {
        Ok(about) if about.is_dir() => {
            Err(io::Error::new(ErrorKind::IsADirectory, "it is a folder; give the name of a file"))
        }
        Ok(about) if about.is_file() && about.permissions().readonly() => Err(io::Error::new(
            ErrorKind::PermissionDenied,
            "it is write-protected; take that off, or give another name",
        )),
        Ok(about) if about.is_file() => fs::canonicalize(path).map(Target::File),
        Ok(_) => Ok(Target::Stream),
        Err(_) if path.file_name().is_none() => {
            Err(io::Error::new(ErrorKind::InvalidInput, "give the name of a file"))
        }
        Err(_) if path.is_symlink() => Err(io::Error::new(
            ErrorKind::NotFound,
            "it is a link that leads nowhere; mend the link, or give another name",
        )),
        Err(_) => Ok(Target::File(path.to_path_buf())),
    }
}

fn write_error(path: &Path, source: io::Error) -> ContainerError {
    ContainerError::Io { file: path.display().to_string(), action: "write", source }
}

#[cfg(test)]
#[path = "files_tests.rs"]
mod tests;
