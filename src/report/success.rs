//! The success table: networks, maps, conditions and seeds, as data and as text.

use core::fmt;

use comfy_table::Table;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::closed_loop::TrialConfig;
use crate::evaluate::{CONDITIONS, Condition, DEGRADATIONS};
use crate::report::bars::{Bar, bars};
use crate::report::contacts::contact_table;
use crate::report::results::{CameraSettings, Summary};
use crate::report::table_file::{TableError, check_settings, table_of};
use crate::report::tables::plain;
use crate::world::dvs::CameraConfig;

/// Version of the JSON form.
pub const SUCCESS_FORMAT: u32 = 1;

/// Success rates that the paper gives (tab:2): name, then condition as in [`CONDITIONS`], then map
/// 1 and map 2. Its maps are not published.
pub const PAPER: [(&str, [[f64; 2]; 3]); 4] = [
    ("SAN, paper", [[0.580, 0.577], [0.645, 0.560], [0.978, 0.966]]),
    ("PopSAN, paper", [[0.598, 0.618], [0.805, 0.718], [0.983, 0.973]]),
    ("BDETT, paper", [[0.657, 0.625], [0.735, 0.728], [0.975, 0.923]]),
    ("EEM-SAN, paper", [[0.765, 0.743], [0.870, 0.848], [1.000, 0.985]]),
];

/// Maps that stand where the paper's map 1 and map 2 do.
const PAPER_MAPS: [&str; 2] = ["map1", "map2"];

/// What `evaluate` found, finished or not: its result and its state file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuccessTable {
    /// [`SUCCESS_FORMAT`].
    pub format: u32,
    /// Settings of all trials.
    pub settings: SuccessSettings,
    /// What is flown.
    pub cells: Vec<Cell>,
}

/// Settings that all cells share; the fastest wheel speed is the condition's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuccessSettings {
    /// Start/goal pairs per map, one trial each.
    pub trials: usize,
    /// Seed of the pairs.
    pub pairs_seed: u64,
    /// Control ticks per second.
    pub control_hz: u32,
    /// Actuator model by name.
    pub actuators: String,
    /// Control ticks before a trial is out of time.
    pub ticks_max: u64,
    /// Standard deviation of the laser noise.
    pub laser_noise_m: f64,
    /// Whether the action was mixed with 1 % noise.
    pub action_noise: bool,
    /// The event camera of the networks that need one.
    pub camera: CameraSettings,
}

/// One network on one map under one condition with one seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// The network as it was typed.
    pub network: String,
    /// SHA-256 of the network, or of the core map and what the host adds to it; `None` for a driver without
    /// one.
    pub network_digest: Option<String>,
    /// SHA-256 of the core map that flew; `None` when no chip drove.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core_map_digest: Option<String>,
    /// The map as it was typed.
    pub map: String,
    /// SHA-256 of the map's arena.
    #[serde(alias = "map_digest")]
    pub arena_digest: String,
    /// Name of the condition.
    pub condition: String,
    /// Name of what was degraded; `None` when nothing was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degraded: Option<String>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Revision of the program that flew it.
    pub revision: String,
    /// Whether it flew with an event camera.
    pub camera: bool,
    /// Totals and means of its trials.
    pub summary: Summary,
}

/// A table that cannot be used.
#[derive(Debug, Error)]
pub enum SuccessError {
    /// Not a table, or one of another format or other settings.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Flown with other weights or in another map.
    #[error(
        "{file}: {what} {name} has digest {found} there and {expected} here: it has changed; give \
         another file"
    )]
    Changed {
        /// The file.
        file: String,
        /// `network` or `map`.
        what: &'static str,
        /// Its name.
        name: String,
        /// Digest in the file.
        found: String,
        /// Digest now.
        expected: String,
    },
    /// Outcomes do not add up to the trials.
    #[error(
        "{file}: cell {cell}: {found} outcomes, {trials} expected (settings.trials); the file is \
         damaged, give another one"
    )]
    Count {
        /// The file.
        file: String,
        /// Number of the cell, from 0.
        cell: usize,
        /// Outcomes of the cell.
        found: usize,
        /// Trials of every cell.
        trials: usize,
    },
    /// Contacts do not add up to the trials that ended so.
    #[error(
        "{file}: cell {cell}: contacts do not add up, {collision} expected (collision) and each \
         mover on one side and in one view; the file is damaged, give another one"
    )]
    Contacts {
        /// The file.
        file: String,
        /// Number of the cell, from 0.
        cell: usize,
        /// Trials of the cell that ended in contact.
        collision: usize,
    },
}

/// What a cell is of: network, map, condition, what is degraded, seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellKey<'a> {
    /// The network as it was typed.
    pub network: &'a str,
    /// The map as it was typed.
    pub map: &'a str,
    /// Name of the condition.
    pub condition: &'a str,
    /// Name of what is degraded, if anything is.
    pub degraded: Option<&'a str>,
    /// Seed of the random streams.
    pub seed: u64,
}

impl SuccessSettings {
    /// Settings of an evaluation whose trials share `config` but for the speed; `camera` is what
    /// flies where one is needed.
    pub fn new(
        trials: usize,
        pairs_seed: u64,
        config: &TrialConfig,
        camera: &CameraConfig,
    ) -> Self {
        Self {
            trials,
            pairs_seed,
            control_hz: config.control_hz,
            actuators: config.actuators.to_string(),
            ticks_max: config.ticks_max,
            laser_noise_m: config.laser_noise_m,
            action_noise: config.action_noise,
            camera: CameraSettings::new(camera),
        }
    }
}

impl Cell {
    /// What it is of.
    pub fn key(&self) -> CellKey<'_> {
        CellKey {
            network: &self.network,
            map: &self.map,
            condition: &self.condition,
            degraded: self.degraded.as_deref(),
            seed: self.seed,
        }
    }

    /// Share of the trials.
    fn share(&self, trials: usize) -> f64 {
        trials as f64 / self.summary.trials.max(1) as f64
    }
}

impl SuccessTable {
    /// A table with nothing flown yet.
    pub fn new(settings: SuccessSettings) -> Self {
        Self { format: SUCCESS_FORMAT, settings, cells: Vec::new() }
    }

    /// Reads the text of a table; `file` is the name that errors mention.
    ///
    /// Errors: not a table, one of another format, or one whose counts do not add up.
    pub fn from_json(file: &str, text: &str) -> Result<Self, SuccessError> {
        let table: Self = table_of(file, text, "evaluate", SUCCESS_FORMAT)?;
        let trials = table.settings.trials;
        for (cell, flown) in table.cells.iter().enumerate() {
            let s = &flown.summary;
            let ended = s.success.saturating_add(s.collision).saturating_add(s.time_out);
            if let Some(found) = [s.trials, ended].into_iter().find(|found| *found != trials) {
                return Err(SuccessError::Count { file: file.to_owned(), cell, found, trials });
            }
            let collision = s.collision;
            if s.contacts.is_some_and(|contacts| !contacts.add_up_to(collision as u64)) {
                return Err(SuccessError::Contacts { file: file.to_owned(), cell, collision });
            }
        }
        Ok(table)
    }

    /// Errs when the table, read from `file`, has other settings than `settings`.
    pub fn check_settings(
        &self,
        file: &str,
        settings: &SuccessSettings,
    ) -> Result<(), SuccessError> {
        Ok(check_settings(file, settings, &self.settings)?)
    }

    /// Errs when a cell of the table, read from `file`, was flown with another network or map than
    /// the one of that name here.
    pub fn check_digests(
        &self,
        file: &str,
        network: (&str, Option<&str>),
        map: (&str, &str),
    ) -> Result<(), SuccessError> {
        let changed = |what, name: &str, found: Option<&str>, expected: Option<&str>| {
            let [found, expected] = [found, expected].map(|d| d.unwrap_or("none").to_owned());
            let (file, name) = (file.to_owned(), name.to_owned());
            SuccessError::Changed { file, what, name, found, expected }
        };
        for cell in &self.cells {
            let found = cell.network_digest.as_deref();
            if cell.network == network.0 && found != network.1 {
                return Err(changed("network", network.0, found, network.1));
            }
            if cell.map == map.0 && cell.arena_digest != map.1 {
                return Err(changed("map", map.0, Some(&cell.arena_digest), Some(map.1)));
            }
        }
        Ok(())
    }

    /// The cell of `key`.
    pub fn find(&self, key: CellKey) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.key() == key)
    }

    /// Puts a cell in the place of the one with the same key, or at the end.
    pub fn put(&mut self, cell: Cell) {
        match self.cells.iter_mut().find(|other| other.key() == cell.key()) {
            Some(place) => *place = cell,
            None => self.cells.push(cell),
        }
    }

    /// Adds the cells of another table that are not here.
    pub fn add_missing(&mut self, other: Self) {
        for cell in other.cells {
            if self.find(cell.key()).is_none() {
                self.cells.push(cell);
            }
        }
    }

    /// Contacts of each network under each condition, all maps and seeds together; `None` where
    /// some of it was flown before contacts were looked into. See [`crate::report::contacts::CONTACT_NOTE`].
    pub fn contact_table(&self) -> Option<Table> {
        let mut rows = Vec::new();
        for under in all_under(self) {
            for network in in_order(&self.cells, |cell| &cell.network) {
                let of_row = |cell: &&Cell| cell.network == network && under.is_of(cell);
                let cells: Vec<&Cell> = self.cells.iter().filter(of_row).collect();
                let contacts = cells.iter().map(|cell| cell.summary.contacts);
                let sum = contacts.reduce(|a, b| {
                    let (mut a, b) = (a?, b?);
                    a += b;
                    Some(a)
                });
                rows.extend(sum.map(|sum| (vec![under.to_string(), network.to_owned()], sum)));
            }
        }
        contact_table(&["condition", "network"], &rows)
    }

    /// What came of one network in a map; `None` where nothing was flown.
    fn rates(&self, network: &str, map: &str, under: &Under) -> Option<Rates> {
        let same = |cell: &&Cell| cell.network == network && cell.map == map && under.is_of(cell);
        let cells: Vec<&Cell> = self.cells.iter().filter(same).collect();
        let mean = |shares: &[f64]| shares.iter().sum::<f64>() / shares.len() as f64;
        let seeds: Vec<f64> = cells.iter().map(|cell| cell.share(cell.summary.success)).collect();
        let collision: Vec<f64> =
            cells.iter().map(|cell| cell.share(cell.summary.collision)).collect();
        let rates = Rates { success: mean(&seeds), collision: mean(&collision), seeds };
        (!cells.is_empty()).then_some(rates)
    }
}

/// Shares of the trials of all seeds; what is missing to 1 ran out of time.
#[derive(Debug)]
struct Rates {
    /// Reached the goal, mean of all seeds.
    success: f64,
    /// Hit something, mean of all seeds.
    collision: f64,
    /// Reached the goal, each seed.
    seeds: Vec<f64>,
}

/// A condition, and what is degraded in it.
#[derive(Debug, Clone, Copy)]
struct Under<'a> {
    /// Place in [`CONDITIONS`].
    index: usize,
    degraded: Option<&'a str>,
}

impl Under<'_> {
    fn condition(&self) -> &'static Condition {
        &CONDITIONS[self.index]
    }

    fn is_of(&self, cell: &Cell) -> bool {
        cell.condition == self.condition().name && cell.degraded.as_deref() == self.degraded
    }
}

impl fmt::Display for Under<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.degraded {
            None => write!(f, "{}", self.condition()),
            Some(name) => write!(f, "{}, {name}", self.condition()),
        }
    }
}

/// What the cells of a table were flown under, in the order of the conditions, whole first.
fn all_under(table: &SuccessTable) -> Vec<Under<'_>> {
    let mut all = Vec::new();
    for (index, condition) in CONDITIONS.iter().enumerate() {
        let mut names: Vec<Option<&str>> = Vec::new();
        for cell in table.cells.iter().filter(|cell| cell.condition == condition.name) {
            if !names.contains(&cell.degraded.as_deref()) {
                names.push(cell.degraded.as_deref());
            }
        }
        names.sort_by_key(|name| DEGRADATIONS.iter().position(|known| Some(known.name) == *name));
        all.extend(names.into_iter().map(|degraded| Under { index, degraded }));
    }
    all
}

/// Cells of all seeds together, in the order of [`success_table`]: condition, network and map, and
/// their summaries.
pub(super) fn grouped(table: &SuccessTable) -> Vec<(Vec<String>, Vec<&Summary>)> {
    let networks = in_order(&table.cells, |cell| &cell.network);
    let maps = in_order(&table.cells, |cell| &cell.map);
    let mut groups = Vec::new();
    for under in all_under(table) {
        for network in &networks {
            for map in &maps {
                let same = |cell: &&Cell| {
                    cell.network == *network && cell.map == *map && under.is_of(cell)
                };
                let of: Vec<&Summary> =
                    table.cells.iter().filter(same).map(|cell| &cell.summary).collect();
                if !of.is_empty() {
                    let names = [under.to_string(), (*network).to_owned(), (*map).to_owned()];
                    groups.push((names.to_vec(), of));
                }
            }
        }
    }
    groups
}

/// Success rates: a row for each condition and network, the paper's below; for each map the mean
/// of all seeds, the share that hit something, and every seed's success.
pub fn success_table(table: &SuccessTable) -> Table {
    let networks = in_order(&table.cells, |cell| &cell.network);
    let maps = in_order(&table.cells, |cell| &cell.map);
    let of_map =
        |map: &&str| [(*map).to_owned(), format!("{map}, collision"), format!("{map}, each seed")];
    let columns: Vec<[String; 3]> = maps.iter().map(of_map).collect();
    let columns = columns.iter().flatten().map(String::as_str);
    let header: Vec<&str> = ["condition", "network"].into_iter().chain(columns).collect();
    let mut text = plain(&header);
    for under in all_under(table) {
        for network in &networks {
            let ours = maps.iter().flat_map(|map| ours(table, network, map, &under));
            text.add_row([under.to_string(), (*network).to_owned()].into_iter().chain(ours));
        }
        if !has_paper_rows_under(table, &under) {
            continue;
        }
        for (network, rates) in &PAPER {
            let theirs = maps.iter().flat_map(|map| theirs(&rates[under.index], map));
            let name = [under.to_string(), (*network).to_owned()];
            text.add_row(name.into_iter().chain(theirs));
        }
    }
    text
}

/// Whether the paper's rows stand in [`success_table`].
pub fn has_paper_rows(table: &SuccessTable) -> bool {
    all_under(table).iter().any(|under| has_paper_rows_under(table, under))
}

fn has_paper_rows_under(table: &SuccessTable, under: &Under) -> bool {
    let in_paper = |cell: &Cell| PAPER_MAPS.contains(&cell.map.as_str());
    under.degraded.is_none() && table.cells.iter().any(in_paper)
}

/// Mean success of every network, map and condition as bars, each seed as a dot; the paper's
/// EEM-SAN where it has the map.
pub fn success_bars(table: &SuccessTable) -> String {
    let mut rows = Vec::new();
    let label = |network: &str, map: &str, under: &Under| match under.degraded {
        None => format!("{network}, {map}, {}", under.condition().name),
        Some(degraded) => format!("{network}, {map}, {}, {degraded}", under.condition().name),
    };
    for under in all_under(table) {
        for map in in_order(&table.cells, |cell| &cell.map) {
            let before = rows.len();
            for network in in_order(&table.cells, |cell| &cell.network) {
                let Some(rates) = table.rates(network, map, &under) else {
                    continue;
                };
                rows.push(Bar {
                    label: label(network, map, &under),
                    values: vec![rates.success],
                    said: format!("{:.3}", rates.success),
                    dots: rates.seeds,
                });
            }
            let place = PAPER_MAPS.iter().position(|known| *known == map);
            let place = place.filter(|_| under.degraded.is_none());
            if let (Some(place), true) = (place, rows.len() > before) {
                let (network, rates) = PAPER[PAPER.len() - 1];
                let rate = rates[under.index][place];
                let label = label(network, map, &under);
                let (values, said) = (vec![0.0, rate], format!("{rate:.3}"));
                rows.push(Bar { label, values, said, ..Bar::default() });
            }
        }
    }
    bars(
        "Share of trials that reached the goal (dots: seeds)",
        &["here", "paper"],
        &rows,
        Some(1.0),
    )
}

/// Mean, collisions and each seed of one network and map under one condition.
fn ours(table: &SuccessTable, network: &str, map: &str, under: &Under) -> [String; 3] {
    let Some(rates) = table.rates(network, map, under) else {
        return ["-", "-", "-"].map(str::to_owned);
    };
    let seeds: Vec<String> = rates.seeds.iter().map(|rate| format!("{rate:.3}")).collect();
    [format!("{:.3}", rates.success), format!("{:.3}", rates.collision), seeds.join(" ")]
}

/// The same from the paper, which has the mean alone.
fn theirs(rates: &[f64; 2], map: &str) -> [String; 3] {
    let place = PAPER_MAPS.iter().position(|known| *known == map);
    let mean = place.map_or_else(|| "-".to_owned(), |place| format!("{:.3}", rates[place]));
    [mean, "-".to_owned(), "-".to_owned()]
}

/// Values of a column, each once, in the order of their first cell.
fn in_order(cells: &[Cell], column: fn(&Cell) -> &String) -> Vec<&str> {
    let mut values: Vec<&str> = Vec::new();
    for value in cells.iter().map(column) {
        if !values.contains(&value.as_str()) {
            values.push(value);
        }
    }
    values
}
