//! The JSON text of start/goal pairs: the shape in which SAN's evaluation positions are passed on.

use std::path::Path;

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::{PAIRS_MAX, Pair, PairsError};
use crate::world::bounded_file::{self, Refused};
use crate::world::geometry::Pose;

/// Entries may hold more numbers than needed: SAN's list has three with left-over values. Other
/// keys of the file (source, units) are notes.
#[derive(Deserialize, Serialize)]
struct PairsRecord {
    starts: Vec<Vec<f64>>,
    goals: Vec<Vec<f64>>,
}

/// Reads a file of pairs.
///
/// Errors: [`PairsError`]. Whether they fit an arena is for [`super::check_pairs`].
pub fn read_pairs(path: &Path) -> Result<Vec<Pair>, PairsError> {
    let file = path.display().to_string();
    match bounded_file::read(path) {
        Ok(bytes) => pairs_from_json(&bytes, &file),
        Err(Refused::Io(source)) => Err(PairsError::Io { file, source }),
        Err(Refused::TooLarge) => Err(PairsError::TooLarge { file }),
    }
}

/// Reads JSON text `{"starts": [[x, y, yaw], ..], "goals": [[x, y], ..]}`; `file` is for messages.
///
/// Errors: [`PairsError`].
pub fn pairs_from_json(bytes: &[u8], file: &str) -> Result<Vec<Pair>, PairsError> {
    let record: PairsRecord = serde_json::from_slice(bytes)
        .map_err(|source| PairsError::Syntax { file: file.to_owned(), source })?;
    let (n_starts, n_goals) = (record.starts.len(), record.goals.len());
    if n_starts != n_goals || n_starts == 0 {
        return Err(PairsError::Counts { file: file.to_owned(), n_starts, n_goals });
    }
    if n_starts > PAIRS_MAX {
        return Err(PairsError::Many { file: file.to_owned(), n: n_starts });
    }
    let entries = record.starts.iter().zip(&record.goals).enumerate();
    entries.map(|(trial, (start, goal))| pair(start, goal, file, trial)).collect()
}

/// The pairs as JSON text that [`pairs_from_json`] reads back.
pub fn pairs_to_json(pairs: &[Pair]) -> String {
    let start =
        |pair: &Pair| vec![pair.start.position.x, pair.start.position.y, pair.start.yaw_rad];
    let record = PairsRecord {
        starts: pairs.iter().map(start).collect(),
        goals: pairs.iter().map(|pair| vec![pair.goal.x, pair.goal.y]).collect(),
    };
    serde_json::to_string(&record).expect("records have text keys and finite numbers")
}

fn pair(start: &[f64], goal: &[f64], file: &str, trial: usize) -> Result<Pair, PairsError> {
    let short = |end, n, needed| PairsError::Short { file: file.to_owned(), trial, end, n, needed };
    let [x_m, y_m, yaw_rad, ..] = *start else {
        return Err(short("start", start.len(), 3));
    };
    let [goal_x_m, goal_y_m, ..] = *goal else {
        return Err(short("goal", goal.len(), 2));
    };
    Ok(Pair { start: Pose::new(x_m, y_m, yaw_rad), goal: Point2::new(goal_x_m, goal_y_m) })
}
