//! Heads of result files, and those that a run can go on from, held against what is to be run.

use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// A result file that cannot be used.
#[derive(Debug, Error)]
pub enum TableError {
    /// Not JSON of the expected form.
    #[error("{file}: not a table of `spikeloop {verb}` ({message}); give another file")]
    Syntax {
        /// The file.
        file: String,
        /// The verb that writes such files.
        verb: &'static str,
        /// What the reader found, with line and column.
        message: String,
    },
    /// Written by another version of this program.
    #[error("{file}: format {found} found, {expected} expected; {verb} again")]
    Format {
        /// The file.
        file: String,
        /// The verb that writes such files.
        verb: &'static str,
        /// Format in the file.
        found: u64,
        /// Format that this program reads.
        expected: u32,
    },
    /// Made with other settings.
    #[error(
        "{file}: {name} is {found} there and {expected} here; give the same settings, or another \
         file"
    )]
    Settings {
        /// The file.
        file: String,
        /// Which setting.
        name: String,
        /// Its value in the file.
        found: String,
        /// Its value now.
        expected: String,
    },
}

/// The text of a table of `verb`; `file` is the name that errors mention.
///
/// Errors: not a table, or one of another format.
pub fn table_of<T: DeserializeOwned>(
    file: &str,
    text: &str,
    verb: &'static str,
    format: u32,
) -> Result<T, TableError> {
    of_format(text, format).map_err(|unreadable| {
        let file = file.to_owned();
        match unreadable {
            Unreadable::Syntax(message) => TableError::Syntax { file, verb, message },
            Unreadable::Format(found) => TableError::Format { file, verb, found, expected: format },
        }
    })
}

/// Text that is not what it should be.
pub(super) enum Unreadable {
    /// Not JSON of the expected form: what the reader found, with line and column.
    Syntax(String),
    /// Of this format instead.
    Format(u64),
}

/// JSON with a field `format`, which is looked at first: another one has other fields.
pub(super) fn of_format<T: DeserializeOwned>(text: &str, format: u32) -> Result<T, Unreadable> {
    #[derive(serde::Deserialize)]
    struct Head {
        format: u64,
    }
    let syntax = |e: serde_json::Error| Unreadable::Syntax(e.to_string());
    let Head { format: found } = serde_json::from_str(text).map_err(syntax)?;
    if found != u64::from(format) {
        return Err(Unreadable::Format(found));
    }
    serde_json::from_str(text).map_err(syntax)
}

/// Errs when `there`, read from `file`, differs from the settings `here`.
pub fn check_settings<S: Serialize>(file: &str, here: &S, there: &S) -> Result<(), TableError> {
    let Some((name, expected, found)) = difference(here, there) else { return Ok(()) };
    Err(TableError::Settings { file: file.to_owned(), name, found, expected })
}

/// Name of the first setting that differs, its value here and there; of a digest only where nothing else
/// differs that can be read.
fn difference<S: Serialize>(here: &S, there: &S) -> Option<(String, String, String)> {
    let [here, there] = [here, there]
        .map(|settings| serde_json::to_value(settings).expect("settings have text keys"));
    let (here, there) = (here.as_object()?, there.as_object()?);
    let differ = || here.iter().filter(|(name, value)| there.get(*name) != Some(value));
    let readable = differ().find(|(name, _)| !name.ends_with("digest"));
    let (name, value) = readable.or_else(|| differ().next())?;
    Some((name.clone(), value.to_string(), there.get(name)?.to_string()))
}
