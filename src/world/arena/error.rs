//! Why an arena was refused.

use super::{HEIGHT_M_MAX, HEIGHT_M_MIN, MOVERS_MAX, OBSTACLES_MAX, TRACK_OVERLAP_M_MAX};
use crate::files::NAME_LEN_MAX;
use crate::world::bounded_file::FILE_BYTES_MAX;
use crate::world::geometry::{COORDINATE_M_MAX, ShapeError};
use crate::world::mover::MoverError;

/// An arena that cannot be read or makes no sense. `file` is the file's path, or the arena's name
/// when there is no file.
#[derive(Debug, thiserror::Error)]
pub enum ArenaError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}; built-in arenas are {}", super::list_named().join(", "))]
    Io {
        /// File.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{file}: larger than {limit} bytes (FILE_BYTES_MAX); not an arena?", limit = FILE_BYTES_MAX)]
    TooLarge {
        /// File.
        file: String,
    },
    /// Not JSON, or not of an arena's shape.
    #[error("{file}: {source}; see the built-in arenas for the format")]
    Syntax {
        /// File.
        file: String,
        /// What and where.
        source: serde_json::Error,
    },
    /// A key that no arena has.
    #[error("{file}: {place}: unknown key {key:?}; correct or remove it")]
    UnknownKey {
        /// File.
        file: String,
        /// Object that has the key.
        place: String,
        /// The key.
        key: String,
    },
    /// Neither `arena` nor `environments`.
    #[error("{file}: no \"arena\" with xmin, xmax, ymin, ymax")]
    NoBounds {
        /// File.
        file: String,
    },
    /// Several rooms and none chosen.
    #[error("{file}: has {n_rooms} rooms; choose one with {file}#1 to {file}#{n_rooms}")]
    ChooseRoom {
        /// File.
        file: String,
        /// Rooms there are.
        n_rooms: usize,
    },
    /// A room that is not there.
    #[error("{file}: room #{room} asked for, has {n_rooms} (0: a single arena, take it without #)")]
    NoSuchRoom {
        /// File.
        file: String,
        /// Room asked for.
        room: usize,
        /// Rooms there are.
        n_rooms: usize,
    },
    /// Bounds that hold no area, or too large.
    #[error(
        "{file}: bounds {axis} {min}..{max} m, must rise by 1 m or more within +-{limit} m \
         (COORDINATE_M_MAX)",
        limit = COORDINATE_M_MAX
    )]
    Bounds {
        /// File.
        file: String,
        /// x or y.
        axis: &'static str,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// Too many obstacles.
    #[error(
        "{file}: {n} obstacles, limit {limit} (OBSTACLES_MAX); join or drop some",
        limit = OBSTACLES_MAX
    )]
    ManyObstacles {
        /// File.
        file: String,
        /// Obstacles there are.
        n: usize,
    },
    /// Too many movers.
    #[error("{file}: {n} movers, limit {limit} (MOVERS_MAX); drop some", limit = MOVERS_MAX)]
    ManyMovers {
        /// File.
        file: String,
        /// Movers there are.
        n: usize,
    },
    /// A name that no table can show.
    #[error(
        "{file}: {what}: name {name:?}, must be 1..={limit} characters on one line; rename it",
        limit = NAME_LEN_MAX
    )]
    Name {
        /// File.
        file: String,
        /// What has the name.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// Two things of the same name.
    #[error("{file}: two things are called {name:?}; rename one")]
    SameName {
        /// File.
        file: String,
        /// The name.
        name: String,
    },
    /// Something is wrong with one obstacle or mover.
    #[error("{file}: {name}: {problem}")]
    Obstacle {
        /// File.
        file: String,
        /// Name of the obstacle or mover.
        name: String,
        /// What is wrong.
        problem: ObstacleError,
    },
}

/// What is wrong with one obstacle or mover.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ObstacleError {
    /// The outline.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The mover's track or speed.
    #[error(transparent)]
    Mover(#[from] MoverError),
    /// The word in `shape`.
    #[error("shape {shape:?} unknown; use box, polygon or cylinder (a mover: cylinder)")]
    UnknownShape {
        /// The word.
        shape: String,
    },
    /// A number that the shape needs.
    #[error("{key:?} is missing; a {shape} needs it")]
    Missing {
        /// Key.
        key: &'static str,
        /// Shape or kind of thing.
        shape: &'static str,
    },
    /// A box whose size is not positive.
    #[error("box size {x_m} x {y_m} m, both must be above 0")]
    BoxSize {
        /// First side.
        x_m: f64,
        /// Second side.
        y_m: f64,
    },
    /// A box whose pose and vertices differ.
    #[error(
        "vertices are {gap_m} m off the box given by x, y, yaw and size, at most 0.001 m; \
         give one of both"
    )]
    BoxDisagrees {
        /// Largest distance of a vertex to the nearest corner.
        gap_m: f64,
    },
    /// Not of a height that laser and camera can see.
    #[error(
        "height {height_m} m, must be {min}..={max} m (the laser scans at {min} m)",
        min = HEIGHT_M_MIN,
        max = HEIGHT_M_MAX
    )]
    Height {
        /// The height.
        height_m: f64,
    },
    /// The direction of a mover has no length.
    #[error("direction ({x}, {y}) of bdett_v_out has no length")]
    Direction {
        /// x part.
        x: f64,
        /// y part.
        y: f64,
    },
    /// A track that leaves the arena.
    #[error("track end ({x_m}, {y_m}) is outside of the arena; shorten the track")]
    TrackLeaves {
        /// x of the end.
        x_m: f64,
        /// y of the end.
        y_m: f64,
    },
    /// A track that runs into a static obstacle.
    #[error(
        "track comes within {distance_m} m of {obstacle}, the mover's radius is {radius_m} m \
         (overlap at most {limit} m, TRACK_OVERLAP_M_MAX); shorten or move the track",
        limit = TRACK_OVERLAP_M_MAX
    )]
    TrackBlocked {
        /// Name of the obstacle.
        obstacle: String,
        /// Distance of the track to it.
        distance_m: f64,
        /// Radius of the mover.
        radius_m: f64,
    },
}
