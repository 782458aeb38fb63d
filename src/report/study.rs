//! What `study` found: every variant of the chip on the same trials, as data and as text.

use comfy_table::Table;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::closed_loop::Outcome;
use crate::evaluate::Flown;
use crate::report::interval::{sign_test, wilson_95};
use crate::report::results::Summary;
use crate::report::success::SuccessSettings;
use crate::report::table_file::{TableError, check_settings, table_of};
use crate::report::tables::{micro, overflow_line, plain, synaptic_ops};
use crate::study::Variant;

/// Version of the JSON form.
pub const STUDY_FORMAT: u32 = 1;

/// Cost tables with columns of their own.
pub(super) const COST_TABLES: [&str; 2] = ["davies2018", "sanafe"];

/// What `study` found, finished or not: its result and its state file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyTable {
    /// [`STUDY_FORMAT`].
    pub format: u32,
    /// What was flown, where, and how.
    pub settings: StudySettings,
    /// The float network.
    pub float: Option<Tried>,
    /// Variants, each once, in the order in which they were tried.
    pub points: Vec<Point>,
    /// Axes of the study; a state file has none.
    #[serde(default)]
    pub axes: Vec<AxisRows>,
}

/// Settings that all points share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudySettings {
    /// The network as it was typed.
    pub network: String,
    /// SHA-256 of the network.
    pub network_digest: String,
    /// The map as it was typed.
    pub map: String,
    /// SHA-256 of the map's arena.
    #[serde(alias = "map_digest")]
    pub arena_digest: String,
    /// Name of the condition.
    pub condition: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Of every trial.
    #[serde(flatten)]
    pub flight: SuccessSettings,
}

/// Values of one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisRows {
    /// Name.
    pub name: String,
    /// What is varied.
    pub about: String,
    /// Label of each value and the variant that it makes.
    pub rows: Vec<(String, Variant)>,
}

/// One variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The variant.
    pub variant: Variant,
    /// What became of it.
    pub result: PointResult,
}

/// What became of a variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointResult {
    /// The network does not go onto this chip, and why.
    Refused(String),
    /// It flew.
    Flown(Box<OnChip>),
}

/// A network on a chip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OnChip {
    /// SHA-256 of the core map and what the host adds to it, before any damage.
    pub digest: String,
    /// SHA-256 of the core map alone; empty in files of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub core_map_digest: String,
    /// Cores in use.
    pub cores: u64,
    /// Synapse memory in use, in words of 64 bit.
    pub synapse_words: u64,
    /// The trials.
    #[serde(flatten)]
    pub tried: Tried,
}

/// All trials of one driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Revision of the program that flew them.
    pub revision: String,
    /// How each trial ended: `s`uccess, `c`ollision, `t`ime-out.
    pub outcomes: String,
    /// Totals and means.
    pub summary: Summary,
}

/// A study file that cannot be used.
#[derive(Debug, Error)]
pub enum StudyError {
    /// Not a study, or one of another format or other settings.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Outcomes do not add up to the trials.
    #[error(
        "{file}: {point}: outcomes {outcomes:?} do not go with {trials} trials, {success} \
         successes and the contacts; the file is damaged, give another one"
    )]
    Outcomes {
        /// The file.
        file: String,
        /// `float`, or the number of the point.
        point: String,
        /// Outcomes in the file.
        outcomes: String,
        /// Trials of the settings.
        trials: usize,
        /// Successes of the summary.
        success: usize,
    },
}

impl Tried {
    /// What `flown` came to.
    pub fn new(revision: &str, flown: &[Flown], summary: Summary) -> Self {
        let letter = |flown: &Flown| match flown.outcome.outcome {
            Outcome::Success => SUCCESS,
            Outcome::Collision => 'c',
            Outcome::TimeOut => 't',
        };
        let outcomes = flown.iter().map(letter).collect();
        Self { revision: revision.to_owned(), outcomes, summary }
    }

    /// Share of successes.
    pub fn rate(&self) -> f64 {
        self.summary.success as f64 / self.summary.trials.max(1) as f64
    }

    /// 95 % interval of the share of successes.
    pub fn interval(&self) -> (f64, f64) {
        wilson_95(self.summary.success, self.summary.trials)
    }

    /// Trials that succeed here and not there, and the other way round.
    fn against(&self, other: &Self) -> (usize, usize) {
        let pairs = || self.outcomes.chars().zip(other.outcomes.chars());
        let only = |here: bool| {
            pairs().filter(|(a, b)| (*a == SUCCESS, *b == SUCCESS) == (here, !here)).count()
        };
        (only(true), only(false))
    }

    fn is_sound(&self, trials: usize) -> bool {
        let s = &self.summary;
        let count = |letter| self.outcomes.chars().filter(|c| *c == letter).count();
        self.outcomes.len() == trials
            && s.trials == trials
            && [count(SUCCESS), count('c'), count('t')] == [s.success, s.collision, s.time_out]
            && s.contacts.is_none_or(|contacts| contacts.add_up_to(s.collision as u64))
    }
}

const SUCCESS: char = 's';

impl StudyTable {
    /// A study with nothing flown yet.
    pub fn new(settings: StudySettings) -> Self {
        Self { format: STUDY_FORMAT, settings, float: None, points: Vec::new(), axes: Vec::new() }
    }

    /// Reads the text of a study to go on with; `file` is the name that errors mention.
    ///
    /// Errors: as [`StudyTable::read`], and other settings than `settings`.
    pub fn from_json(file: &str, text: &str, settings: &StudySettings) -> Result<Self, StudyError> {
        let table = Self::read(file, text)?;
        check_settings(file, settings, &table.settings)?;
        Ok(table)
    }

    /// Reads the text of a study; `file` is the name that errors mention.
    ///
    /// Errors: not a study, one of another format, or one whose outcomes do not add up.
    pub fn read(file: &str, text: &str) -> Result<Self, StudyError> {
        let table: Self = table_of(file, text, "study", STUDY_FORMAT)?;
        let float = table.float.iter().map(|tried| ("float".to_owned(), tried));
        let flown =
            table.points.iter().enumerate().filter_map(|(index, point)| {
                Some((format!("point {index}"), &point.flown()?.tried))
            });
        let trials = table.settings.flight.trials;
        match float.chain(flown).find(|(_, tried)| !tried.is_sound(trials)) {
            None => Ok(table),
            Some((point, tried)) => Err(StudyError::Outcomes {
                file: file.to_owned(),
                point,
                outcomes: tried.outcomes.clone(),
                trials,
                success: tried.summary.success,
            }),
        }
    }

    /// What became of `variant`, if it was tried.
    pub fn find(&self, variant: &Variant) -> Option<&Point> {
        self.points.iter().find(|point| point.variant == *variant)
    }

    /// Adds what another table of the same settings has and this one has not.
    pub fn add_missing(&mut self, other: Self) {
        self.float = self.float.take().or(other.float);
        for point in other.points {
            if self.find(&point.variant).is_none() {
                self.points.push(point);
            }
        }
    }
}

impl OnChip {
    /// SHA-256 of the core map; in files of earlier versions with what the host adds to it.
    pub fn map_digest(&self) -> &str {
        if self.core_map_digest.is_empty() { &self.digest } else { &self.core_map_digest }
    }
}

impl Point {
    /// What it did, if it flew.
    pub fn flown(&self) -> Option<&OnChip> {
        match &self.result {
            PointResult::Flown(flown) => Some(flown),
            PointResult::Refused(_) => None,
        }
    }
}

/// The rows of a study, and below what there is to say of some.
pub fn study_text(table: &StudyTable) -> String {
    let remarks: String = remarks(table).iter().map(|remark| format!("\n{remark}")).collect();
    format!("{}{remarks}", study_table(table))
}

/// Variants that did not fly, and why; those whose registers overflowed.
pub fn remarks(table: &StudyTable) -> Vec<String> {
    let rows = table.axes.iter().flat_map(|axis| axis.rows.iter().map(|row| (&axis.name, row)));
    let remarks = rows.filter_map(|(axis, (value, variant))| match &table.find(variant)?.result {
        PointResult::Refused(why) => Some(format!("{axis} {value} does not fly: {why}")),
        PointResult::Flown(flown) => {
            let overflow = flown.tried.summary.chip.as_ref().and_then(overflow_line)?;
            Some(format!("{axis} {value}: registers overflowed: {overflow}"))
        }
    });
    remarks.collect()
}

/// A row for each value of every axis, the float network first.
pub fn study_table(table: &StudyTable) -> Table {
    let energies = COST_TABLES.map(|name| format!("{name} (uJ)"));
    let times = COST_TABLES.map(|name| format!("{name} (us)"));
    let header = ["what", "value", "success", "95 %", "against float", "p", "syn. ops"];
    let header = header.into_iter().chain(energies.iter().chain(&times).map(String::as_str));
    let header: Vec<&str> = header.chain(["cores", "memory (KiB)"]).collect();
    let mut text = plain(&header);
    if let Some(float) = &table.float {
        let mut row = vec!["float network".to_owned(), String::new()];
        row.extend(success_cells(float, None));
        row.resize(header.len(), "-".to_owned());
        text.add_row(row);
    }
    for axis in &table.axes {
        for (value, variant) in &axis.rows {
            let Some(point) = table.find(variant) else { continue };
            let mut row = vec![axis.name.clone(), value.clone()];
            match &point.result {
                PointResult::Flown(flown) => row.extend(cells(flown, table.float.as_ref())),
                PointResult::Refused(_) => row.resize(header.len(), "-".to_owned()),
            }
            text.add_row(row);
        }
    }
    text
}

fn cells(flown: &OnChip, float: Option<&Tried>) -> Vec<String> {
    let mut cells = success_cells(&flown.tried, float);
    let (summary, n) = (&flown.tried.summary, flown.tried.summary.decisions.max(1) as f64);
    let chip = summary.chip.as_ref();
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    cells.push(or_none(chip.map(|chip| format!("{:.0}", synaptic_ops(&chip.counters) as f64 / n))));
    let cost = |name: &str| chip.and_then(|chip| chip.costs.get(name));
    cells.extend(COST_TABLES.map(|name| or_none(cost(name).map(|c| micro(c.dynamic_fj, n)))));
    let time = |name| cost(name).map(|c| format!("{:.1}", c.time_ps as f64 / n / 1e6));
    cells.extend(COST_TABLES.map(|name| or_none(time(name))));
    cells.extend([flown.cores.to_string(), format!("{:.1}", flown.synapse_words as f64 / 128.0)]);
    cells
}

/// Successes, their interval, and what was gained and lost against the float network.
fn success_cells(tried: &Tried, float: Option<&Tried>) -> Vec<String> {
    let (low, high) = tried.interval();
    let mut cells = vec![
        format!("{}/{}", tried.summary.success, tried.summary.trials),
        format!("{low:.2} to {high:.2}"),
    ];
    if let Some(float) = float {
        let (gained, lost) = tried.against(float);
        let p = sign_test(gained, lost);
        let p = if p < 0.01 { "< 0.01".to_owned() } else { format!("{p:.2}") };
        cells.extend([format!("+{gained} -{lost}"), p]);
    }
    cells
}
