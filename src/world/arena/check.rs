//! Checks of a whole arena, the same for files and for arenas made in code.

use std::collections::BTreeSet;

use super::{
    Arena, ArenaError, HEIGHT_M_MAX, HEIGHT_M_MIN, MOVERS_MAX, OBSTACLES_MAX, Obstacle,
    ObstacleError, TRACK_OVERLAP_M_MAX,
};
use crate::files::fits_a_line;
use crate::world::geometry::COORDINATE_M_MAX;
use crate::world::mover::Mover;

/// Errs for the first thing that is wrong; `file` names the source in the message.
pub(super) fn arena(arena: &Arena, file: &str) -> Result<(), ArenaError> {
    let bounds = arena.bounds;
    axis(file, "x", bounds.min.x, bounds.max.x)?;
    axis(file, "y", bounds.min.y, bounds.max.y)?;
    counts(file, arena.obstacles.len(), arena.movers.len())?;
    names(arena, file)?;
    heights(arena, file)?;
    arena.movers.iter().try_for_each(|mover| {
        track(arena, mover).map_err(|problem| ArenaError::Obstacle {
            file: file.to_owned(),
            name: mover.name.clone(),
            problem,
        })
    })
}

/// Errs when there are more things than the limits allow.
pub(super) fn counts(file: &str, obstacles: usize, movers: usize) -> Result<(), ArenaError> {
    let file = file.to_owned();
    if obstacles > OBSTACLES_MAX {
        return Err(ArenaError::ManyObstacles { file, n: obstacles });
    }
    if movers > MOVERS_MAX {
        return Err(ArenaError::ManyMovers { file, n: movers });
    }
    Ok(())
}

fn axis(file: &str, axis: &'static str, min: f64, max: f64) -> Result<(), ArenaError> {
    let within = |value: f64| value.abs() <= COORDINATE_M_MAX;
    if within(min) && within(max) && max - min >= 1.0 {
        return Ok(());
    }
    Err(ArenaError::Bounds { file: file.to_owned(), axis, min, max })
}

fn names(arena: &Arena, file: &str) -> Result<(), ArenaError> {
    shown("arena", &arena.name, file)?;
    arena.obstacles.iter().try_for_each(|obstacle| shown("obstacle", &obstacle.name, file))?;
    arena.movers.iter().try_for_each(|mover| shown("mover", &mover.name, file))?;
    let obstacles = arena.obstacles.iter().map(|obstacle| &obstacle.name);
    let mut seen = BTreeSet::new();
    for name in obstacles.chain(arena.movers.iter().map(|mover| &mover.name)) {
        if !seen.insert(name) {
            return Err(ArenaError::SameName { file: file.to_owned(), name: name.clone() });
        }
    }
    Ok(())
}

/// A name is a cell of a table and a part of a line.
fn shown(what: &'static str, name: &str, file: &str) -> Result<(), ArenaError> {
    if fits_a_line(name) {
        return Ok(());
    }
    Err(ArenaError::Name { file: file.to_owned(), what, name: name.to_owned() })
}

fn heights(arena: &Arena, file: &str) -> Result<(), ArenaError> {
    let obstacles = arena.obstacles.iter().map(|obstacle| (&obstacle.name, obstacle.height_m));
    let movers = arena.movers.iter().map(|mover| (&mover.name, mover.height_m));
    for (name, height_m) in obstacles.chain(movers) {
        if !(HEIGHT_M_MIN..=HEIGHT_M_MAX).contains(&height_m) {
            return Err(ArenaError::Obstacle {
                file: file.to_owned(),
                name: name.clone(),
                problem: ObstacleError::Height { height_m },
            });
        }
    }
    Ok(())
}

fn track(arena: &Arena, mover: &Mover) -> Result<(), ObstacleError> {
    for end in [mover.from(), mover.to()] {
        if !arena.bounds.contains(end) {
            return Err(ObstacleError::TrackLeaves { x_m: end.x, y_m: end.y });
        }
    }
    arena.obstacles.iter().try_for_each(|obstacle| clear_of(mover, obstacle))
}

fn clear_of(mover: &Mover, obstacle: &Obstacle) -> Result<(), ObstacleError> {
    let distance_m = obstacle.shape.distance_to_segment_m(mover.from(), mover.to());
    let radius_m = mover.radius_m();
    if distance_m + TRACK_OVERLAP_M_MAX >= radius_m {
        return Ok(());
    }
    Err(ObstacleError::TrackBlocked { obstacle: obstacle.name.clone(), distance_m, radius_m })
}
