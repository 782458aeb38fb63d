//! Why start/goal pairs were refused or could not be drawn.

use super::{PAIRS_MAX, TRIES_MAX};
use crate::world::bounded_file::FILE_BYTES_MAX;
use crate::world::shown::shown;

/// Pairs that cannot be read, do not fit the arena, or cannot be drawn. Trials count from 0.
#[derive(Debug, thiserror::Error)]
pub enum PairsError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Io {
        /// File.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{file}: larger than {limit} bytes (FILE_BYTES_MAX); not a pairs file?", limit = FILE_BYTES_MAX)]
    TooLarge {
        /// File.
        file: String,
    },
    /// Not JSON, or not two lists of lists of numbers.
    #[error(
        "{file}: {source}; expected {{\"starts\": [[x, y, yaw], ..], \"goals\": [[x, y], ..]}}"
    )]
    Syntax {
        /// File.
        file: String,
        /// What and where.
        source: serde_json::Error,
    },
    /// Lists of different length, or empty.
    #[error("{file}: {n_starts} starts and {n_goals} goals, must be as many and at least 1")]
    Counts {
        /// File.
        file: String,
        /// Starts there are.
        n_starts: usize,
        /// Goals there are.
        n_goals: usize,
    },
    /// Too many pairs.
    #[error("{file}: {n} pairs, limit {limit} (PAIRS_MAX); split them", limit = PAIRS_MAX)]
    Many {
        /// File, or name of the arena.
        file: String,
        /// Pairs there are.
        n: usize,
    },
    /// An entry with too few numbers.
    #[error("{file}: trial {trial}: {end} has {n} numbers, needs {needed}")]
    Short {
        /// File.
        file: String,
        /// Trial.
        trial: usize,
        /// `start` or `goal`.
        end: &'static str,
        /// Numbers there are.
        n: usize,
        /// Numbers needed.
        needed: usize,
    },
    /// Not inside the arena.
    #[error(
        "{file}: trial {trial}: {end} ({x_m}, {y_m}) is outside of arena {arena}; another arena's file?"
    )]
    Outside {
        /// File.
        file: String,
        /// Trial.
        trial: usize,
        /// `start` or `goal`.
        end: &'static str,
        /// x of the point.
        x_m: f64,
        /// y of the point.
        y_m: f64,
        /// Name of the arena.
        arena: String,
    },
    /// Within a robot radius of an obstacle.
    #[error(
        "{file}: trial {trial}: {end} ({x_m}, {y_m}) is {distance_m} m from {obstacle}, at least \
         {radius_m} m (robot radius); move it, or use another arena"
    )]
    Blocked {
        /// File.
        file: String,
        /// Trial.
        trial: usize,
        /// `start` or `goal`.
        end: &'static str,
        /// x of the point.
        x_m: f64,
        /// y of the point.
        y_m: f64,
        /// Distance to the obstacle.
        distance_m: f64,
        /// Name of the obstacle.
        obstacle: String,
        /// Radius of the robot.
        radius_m: f64,
    },
    /// Rules that cannot be followed.
    #[error("pair rules: {name} is {} m, must be 0..=1000 m", shown(*value))]
    Rule {
        /// Which rule.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// No point was clear of obstacles.
    #[error(
        "arena {arena} has no free start: {limit} tries (TRIES_MAX), none {clearance_m} m clear of \
         everything; take obstacles out of it, or fly pairs of your own (`drive --pairs`)",
        limit = TRIES_MAX
    )]
    NoFreeStart {
        /// Name of the arena.
        arena: String,
        /// Clearance asked for.
        clearance_m: f64,
    },
    /// No goal was far enough from a start.
    #[error(
        "arena {arena}: {limit} tries (TRIES_MAX) for pair {trial}, no goal {distance_m_min} m or \
         more from a start and {clearance_m} m clear; make the arena larger or emptier, or fly pairs of \
         your own (`drive --pairs`)",
        limit = TRIES_MAX
    )]
    NoPair {
        /// Name of the arena.
        arena: String,
        /// Number of the pair.
        trial: usize,
        /// Distance asked for.
        distance_m_min: f64,
        /// Clearance asked for.
        clearance_m: f64,
    },
}
