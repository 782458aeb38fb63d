//! Everything that goes into a report: results of several verbs, each checked, in one form.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use thiserror::Error;

use crate::report::agreement::AgreementResult;
use crate::report::chip_plan::ChipPlan;
use crate::report::replay::{Replay, ReplayError};
use crate::report::reproduction::Reproduction;
use crate::report::results::{DriveResult, ResultError};
use crate::report::study::{StudyError, StudyTable};
use crate::report::success::{SuccessError, SuccessTable};
use crate::report::table5::Table5Result;
use crate::report::thresholds::ThresholdsResult;

/// Version of the JSON form.
pub const REPORT_FORMAT: u32 = 1;

/// What the page shows, for programs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// [`REPORT_FORMAT`].
    pub format: u32,
    /// Revision of the program that put it together.
    pub revision: String,
    /// The results, in the order given.
    pub items: Vec<Item>,
}

/// One result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Item {
    /// The file it was read from.
    pub file: String,
    /// What it is.
    #[serde(flatten)]
    pub content: Content,
}

/// A result of any verb.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", content = "content", rename_all = "snake_case")]
pub enum Content {
    /// `drive --json`.
    Drive(DriveResult),
    /// `drive --replay`.
    Replay(Box<Replay>),
    /// `evaluate --json`.
    Success(SuccessTable),
    /// `table5 --json`.
    Table5(Box<Table5Result>),
    /// `agree --json`.
    Agreement(AgreementResult),
    /// `inspect --json`.
    Chip(ChipPlan),
    /// `thresholds --json`.
    Thresholds(ThresholdsResult),
    /// `study --json`.
    Study(Box<StudyTable>),
    /// `reproduction.json` of `reproduce`.
    Reproduction(Box<Reproduction>),
}

/// Kinds of files by fields that only they have, for [`Content::of`].
const KINDS: [(&[&str], &str); 10] = [
    (&["reproduced", "costs"], "reproduce"),
    (&["points", "axes"], "study --json"),
    (&["episodes"], "drive --replay"),
    (&["drivers", "pairs_mm"], "drive --json"),
    (&["cells"], "evaluate --json"),
    (&["rows", "rates"], "table5 --json"),
    (&["agreement"], "agree --json"),
    (&["utilization"], "inspect --json"),
    (&["thresholds"], "thresholds --json"),
    (&["items"], "report --json"),
];

/// A file that a report cannot take.
#[derive(Debug, Error)]
pub enum ReportError {
    /// Not JSON.
    #[error("{file}: not JSON ({message}); give what a verb wrote with --json or --replay")]
    Json {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// JSON of something else.
    #[error(
        "{file}: fields {fields}; not a result that a report can take: give what one of these \
         wrote: {known}"
    )]
    Unknown {
        /// The file.
        file: String,
        /// Fields of the file.
        fields: String,
        /// The verbs.
        known: String,
    },
    /// Almost of a known kind.
    #[error("{file}: not a result of `spikeloop {verb}` ({message}); write it again")]
    Form {
        /// The file.
        file: String,
        /// The verb that writes this kind.
        verb: &'static str,
        /// What is wrong.
        message: String,
    },
    /// A report of another version.
    #[error("{file}: format {found} found, {REPORT_FORMAT} expected; report again")]
    Format {
        /// The file.
        file: String,
        /// Format in the file.
        found: String,
    },
    /// A damaged result of `drive`.
    #[error(transparent)]
    Drive(#[from] ResultError),
    /// A damaged replay.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A damaged table of `evaluate`.
    #[error(transparent)]
    Success(#[from] SuccessError),
    /// A damaged table of `study`.
    #[error(transparent)]
    Study(#[from] StudyError),
}

impl Report {
    /// A report without results yet.
    pub fn new(revision: &str) -> Self {
        Self { format: REPORT_FORMAT, revision: revision.to_owned(), items: Vec::new() }
    }

    /// Adds what is in the text of a file: one result, or all of another report.
    ///
    /// Errors: no result of a known kind, or one that is damaged.
    pub fn add(&mut self, file: &str, text: &str) -> Result<(), ReportError> {
        let fields: Value = serde_json::from_str(text)
            .map_err(|e| ReportError::Json { file: file.to_owned(), message: e.to_string() })?;
        let verb = kind_of(file, &fields)?;
        if verb == "report --json" {
            return self.add_report(file, &fields);
        }
        let content = Content::of(file, verb, text, fields)?;
        self.items.push(Item { file: file.to_owned(), content });
        Ok(())
    }

    /// Adds a result that is at hand, under the name of a file.
    pub fn push(&mut self, file: &str, content: Content) {
        self.items.push(Item { file: file.to_owned(), content });
    }

    /// Adds all items of a report.
    fn add_report(&mut self, file: &str, report: &Value) -> Result<(), ReportError> {
        if report["format"] != REPORT_FORMAT {
            let (file, found) = (file.to_owned(), report["format"].to_string());
            return Err(ReportError::Format { file, found });
        }
        let form = |message: &str| ReportError::Form {
            file: file.to_owned(),
            verb: "report --json",
            message: message.to_owned(),
        };
        let items = report["items"].as_array().ok_or_else(|| form("items is no list"))?;
        for item in items {
            let name = item["file"].as_str().ok_or_else(|| form("an item without a file"))?;
            if item["content"].get("items").is_some() {
                return Err(form("a report within a report"));
            }
            let place = format!("{file}: {name}");
            self.add(&place, &item["content"].to_string())?;
            self.items.last_mut().expect("one was added").file = name.to_owned();
        }
        Ok(())
    }

    /// Replays among the results, with their numbers.
    pub fn replays(&self) -> impl Iterator<Item = (usize, &Replay)> {
        self.items.iter().enumerate().filter_map(|(index, item)| match &item.content {
            Content::Replay(replay) => Some((index, replay.as_ref())),
            _ => None,
        })
    }

    /// Name and digest of every core map, each once.
    pub fn maps(&self) -> Vec<(String, String)> {
        let mut maps = Vec::new();
        for item in &self.items {
            match &item.content {
                Content::Drive(result) => maps.extend(
                    result
                        .drivers
                        .iter()
                        .filter_map(|d| Some((d.label.clone(), d.map_digest.clone()?))),
                ),
                Content::Replay(replay) => maps.extend(
                    replay.chip.as_ref().map(|c| (replay.driver.clone(), c.map_digest.clone())),
                ),
                Content::Chip(plan) => maps.push((plan.network.clone(), plan.map_digest.clone())),
                Content::Agreement(result) => {
                    maps.push((result.network.clone(), result.map_digest.clone()));
                }
                Content::Success(success) => maps.extend(success.cells.iter().filter_map(|cell| {
                    Some((cell.network.clone(), cell.core_map_digest.clone()?))
                })),
                // A study has many: they are in its table of digests.
                Content::Study(_)
                | Content::Table5(_)
                | Content::Thresholds(_)
                | Content::Reproduction(_) => {}
            }
        }
        maps.sort_unstable();
        maps.dedup();
        maps
    }
}

impl Content {
    /// The result in a file that `verb` wrote.
    fn of(file: &str, verb: &'static str, text: &str, fields: Value) -> Result<Self, ReportError> {
        Ok(match verb {
            "drive --replay" => Self::Replay(Box::new(Replay::from_json(file, text)?)),
            "drive --json" => Self::Drive(DriveResult::from_json(file, text)?),
            "evaluate --json" => Self::Success(SuccessTable::from_json(file, text)?),
            "study --json" => Self::Study(Box::new(StudyTable::read(file, text)?)),
            "table5 --json" => Self::Table5(Box::new(typed(file, verb, fields)?)),
            "agree --json" => Self::Agreement(typed(file, verb, fields)?),
            "inspect --json" => {
                let plan: ChipPlan = typed(file, verb, fields)?;
                plan.check().map_err(|message| form(file, verb, message))?;
                Self::Chip(plan)
            }
            "reproduce" => {
                let reproduction: Reproduction = typed(file, verb, fields)?;
                reproduction.check().map_err(|message| form(file, verb, message))?;
                Self::Reproduction(Box::new(reproduction))
            }
            _ => Self::Thresholds(typed(file, verb, fields)?),
        })
    }

    /// The verb that writes it.
    pub fn verb(&self) -> &'static str {
        match self {
            Self::Drive(_) => "drive --json",
            Self::Replay(_) => "drive --replay",
            Self::Success(_) => "evaluate --json",
            Self::Table5(_) => "table5 --json",
            Self::Agreement(_) => "agree --json",
            Self::Chip(_) => "inspect --json",
            Self::Thresholds(_) => "thresholds --json",
            Self::Study(_) => "study --json",
            Self::Reproduction(_) => "reproduce",
        }
    }
}

fn form(file: &str, verb: &'static str, message: String) -> ReportError {
    ReportError::Form { file: file.to_owned(), verb, message }
}

fn typed<T: for<'de> Deserialize<'de>>(
    file: &str,
    verb: &'static str,
    fields: Value,
) -> Result<T, ReportError> {
    serde_json::from_value(fields).map_err(|e| form(file, verb, e.to_string()))
}

/// The verb that writes files with these fields.
fn kind_of(file: &str, fields: &Value) -> Result<&'static str, ReportError> {
    let none = Map::new();
    let fields = fields.as_object().unwrap_or(&none);
    let has = |wanted: &&[&str]| wanted.iter().all(|name| fields.contains_key(*name));
    match KINDS.iter().find(|(wanted, _)| has(wanted)) {
        Some((_, verb)) => Ok(verb),
        None => {
            let names: Vec<&str> = fields.keys().map(String::as_str).take(12).collect();
            let fields = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let known = KINDS.map(|(_, verb)| verb).join(", ");
            Err(ReportError::Unknown { file: file.to_owned(), fields, known })
        }
    }
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
