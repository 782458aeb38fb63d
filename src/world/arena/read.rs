//! From JSON text to a checked [`Arena`].

use std::path::Path;

use nalgebra::{Point2, Vector2};

use super::record::{ArenaRecord, BoundsRecord, MoverRecord, ObstacleRecord, Rest};
use super::{Arena, ArenaError, Bounds, Obstacle, ObstacleError, check};
use crate::world::bounded_file::{self, Refused};
use crate::world::geometry::{ConvexPolygon, Disc, Shape, check_point};
use crate::world::mover::Mover;

/// Largest distance between the corners of a box and vertices given beside it.
const BOX_GAP_M_MAX: f64 = 1e-3;

impl Arena {
    /// The built-in arena or the file that `text` names. `FILE#2` is the second room of a file
    /// with several (SAN's training world has four).
    ///
    /// Errors: [`ArenaError`].
    pub fn open(text: &str) -> Result<Self, ArenaError> {
        if let Some(arena) = Self::named(text) {
            return Ok(arena);
        }
        // A file may be called like a room of another one.
        let (file, room) = if Path::new(text).is_file() { (text, None) } else { split_room(text) };
        let bytes = bounded_file::read(Path::new(file)).map_err(|refused| {
            let file = file.to_owned();
            match refused {
                Refused::Io(source) => ArenaError::Io { file, source },
                Refused::TooLarge => ArenaError::TooLarge { file },
            }
        })?;
        Self::from_json(&bytes, file, room)
    }

    /// Reads JSON text. `file` is for messages and gives the arena its name (without folder and
    /// ending) when the text does not; `room` counts from 1.
    ///
    /// Errors: [`ArenaError`].
    pub fn from_json(bytes: &[u8], file: &str, room: Option<usize>) -> Result<Self, ArenaError> {
        let record: ArenaRecord = serde_json::from_slice(bytes)
            .map_err(|source| ArenaError::Syntax { file: file.to_owned(), source })?;
        no_unknown_key(file, "the file", &record.rest, ArenaRecord::NOTES)?;
        let stem = Path::new(file).file_stem().map_or(file.into(), |stem| stem.to_string_lossy());
        let n_rooms = record.environments.len();
        match (n_rooms, room) {
            (0, None) => arena(record, file, &stem),
            (_, None) => Err(ArenaError::ChooseRoom { file: file.to_owned(), n_rooms }),
            (_, Some(room)) => {
                let chosen = record.environments.into_iter().nth(room.wrapping_sub(1));
                let no_such = || ArenaError::NoSuchRoom { file: file.to_owned(), room, n_rooms };
                arena(chosen.ok_or_else(no_such)?, file, &format!("{stem}#{room}"))
            }
        }
    }
}

/// `FILE#2` as file and room; a `#` before anything but a number belongs to the file's name.
pub fn split_room(text: &str) -> (&str, Option<usize>) {
    match text.rsplit_once('#').map(|(file, room)| (file, room.parse())) {
        Some((file, Ok(room))) => (file, Some(room)),
        _ => (text, None),
    }
}

fn arena(record: ArenaRecord, file: &str, name: &str) -> Result<Arena, ArenaError> {
    no_unknown_key(file, name, &record.rest, ArenaRecord::NOTES)?;
    if !record.environments.is_empty() {
        let (file, place) = (file.to_owned(), name.to_owned());
        return Err(ArenaError::UnknownKey { file, place, key: "environments".to_owned() });
    }
    check::counts(file, record.walls.len() + record.obstacles.len(), record.movers.len())?;
    let bounds = record.arena.ok_or_else(|| ArenaError::NoBounds { file: file.to_owned() })?;
    let arena = Arena {
        name: record.name.unwrap_or_else(|| name.to_owned()),
        bounds: read_bounds(bounds, file)?,
        obstacles: (record.walls.into_iter().chain(record.obstacles))
            .map(|record| read_obstacle(record, file))
            .collect::<Result<_, _>>()?,
        movers: (record.movers.into_iter())
            .map(|record| read_mover(record, file))
            .collect::<Result<_, _>>()?,
    };
    check::arena(&arena, file)?;
    Ok(arena)
}

fn read_bounds(record: BoundsRecord, file: &str) -> Result<Bounds, ArenaError> {
    no_unknown_key(file, "arena", &record.rest, BoundsRecord::NOTES)?;
    Ok(Bounds {
        min: Point2::new(record.xmin, record.ymin),
        max: Point2::new(record.xmax, record.ymax),
    })
}

fn read_obstacle(record: ObstacleRecord, file: &str) -> Result<Obstacle, ArenaError> {
    no_unknown_key(file, &record.name, &record.rest, ObstacleRecord::NOTES)?;
    match shape(&record) {
        Ok(shape) => Ok(Obstacle { shape, height_m: record.height, name: record.name }),
        Err(problem) => {
            Err(ArenaError::Obstacle { file: file.to_owned(), name: record.name, problem })
        }
    }
}

fn shape(record: &ObstacleRecord) -> Result<Shape, ObstacleError> {
    match record.shape.as_str() {
        "box" => read_box(record).map(Shape::Polygon),
        "polygon" => {
            let vertices = need(record.vertices.as_ref(), "vertices", "polygon")?;
            Ok(Shape::Polygon(polygon(vertices)?))
        }
        "cylinder" => {
            let radius_m = need(record.radius, "radius", "cylinder")?;
            Ok(Shape::Disc(Disc::new(centre(record, "cylinder")?, radius_m)?))
        }
        other => Err(ObstacleError::UnknownShape { shape: other.to_owned() }),
    }
}

/// Vertices, when given, are the box: they carry no rounding of the yaw. A size beside them must
/// agree.
fn read_box(record: &ObstacleRecord) -> Result<ConvexPolygon, ObstacleError> {
    let posed = match (record.size, &record.vertices) {
        (None, Some(_)) => None,
        _ => Some(posed_box(record)?),
    };
    let Some(vertices) = &record.vertices else {
        return posed.ok_or(ObstacleError::Missing { key: "size", shape: "box" });
    };
    let drawn = polygon(vertices)?;
    match posed.map(|posed| gap_m(&drawn, &posed)) {
        Some(gap_m) if gap_m > BOX_GAP_M_MAX => Err(ObstacleError::BoxDisagrees { gap_m }),
        _ => Ok(drawn),
    }
}

fn posed_box(record: &ObstacleRecord) -> Result<ConvexPolygon, ObstacleError> {
    let [x_m, y_m] = need(record.size, "size", "box")?;
    if !(x_m > 0.0 && y_m > 0.0) {
        return Err(ObstacleError::BoxSize { x_m, y_m });
    }
    let yaw_rad = need(record.yaw, "yaw", "box")?;
    let size_m = Vector2::new(x_m, y_m);
    Ok(ConvexPolygon::rectangle(centre(record, "box")?, yaw_rad, size_m)?)
}

/// Largest distance of a corner of one polygon to the nearest corner of the other.
fn gap_m(a: &ConvexPolygon, b: &ConvexPolygon) -> f64 {
    let nearest_m = |p: &Point2<f64>, others: &[Point2<f64>]| {
        others.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min)
    };
    let one_way_m = |from: &[Point2<f64>], to: &[Point2<f64>]| {
        from.iter().map(|p| nearest_m(p, to)).fold(0.0, f64::max)
    };
    one_way_m(a.vertices(), b.vertices()).max(one_way_m(b.vertices(), a.vertices()))
}

fn read_mover(record: MoverRecord, file: &str) -> Result<Mover, ArenaError> {
    let name = match (&record.name, record.id) {
        (Some(name), _) => name.clone(),
        (None, Some(id)) => format!("mover{id}"),
        (None, None) => "mover without name".to_owned(),
    };
    no_unknown_key(file, &name, &record.rest, MoverRecord::NOTES)?;
    mover(&record, name.clone()).map_err(|problem| ArenaError::Obstacle {
        file: file.to_owned(),
        name,
        problem,
    })
}

fn mover(record: &MoverRecord, name: String) -> Result<Mover, ObstacleError> {
    if let Some(shape) = record.shape.as_ref().filter(|shape| *shape != "cylinder") {
        return Err(ObstacleError::UnknownShape { shape: shape.clone() });
    }
    let start = Disc::new(Point2::new(record.x, record.y), record.radius)?;
    let to = track_end(record, start.centre())?;
    check_point(to)?;
    Ok(Mover::new(name, start, to, record.speed, record.height)?)
}

fn track_end(record: &MoverRecord, from: Point2<f64>) -> Result<Point2<f64>, ObstacleError> {
    if let Some(to) = record.to {
        return Ok(Point2::from(to));
    }
    let [x, y] = need(record.bdett_v_out, "to", "mover")?;
    let way_m = need(record.free_run_forward_m, "free_run_forward_m", "mover with bdett_v_out")?;
    let direction = Vector2::new(x, y);
    let length = direction.norm();
    if !(length > 0.0 && length.is_finite()) {
        return Err(ObstacleError::Direction { x, y });
    }
    Ok(from + direction * (way_m / length))
}

fn centre(record: &ObstacleRecord, shape: &'static str) -> Result<Point2<f64>, ObstacleError> {
    Ok(Point2::new(need(record.x, "x", shape)?, need(record.y, "y", shape)?))
}

fn polygon(vertices: &[[f64; 2]]) -> Result<ConvexPolygon, ObstacleError> {
    let points = vertices.iter().map(|vertex| Point2::from(*vertex)).collect();
    Ok(ConvexPolygon::new(points)?)
}

fn need<T>(value: Option<T>, key: &'static str, shape: &'static str) -> Result<T, ObstacleError> {
    value.ok_or(ObstacleError::Missing { key, shape })
}

fn no_unknown_key(file: &str, place: &str, rest: &Rest, notes: &[&str]) -> Result<(), ArenaError> {
    match rest.keys().find(|key| !notes.contains(&key.as_str())) {
        None => Ok(()),
        Some(key) => Err(ArenaError::UnknownKey {
            file: file.to_owned(),
            place: place.to_owned(),
            key: key.clone(),
        }),
    }
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
