//! Rooms to train in, drawn at random: no two rounds of training see the same one, and none is an
//! evaluation map.

use core::f64::consts::{PI, TAU};

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::closed_loop::planner::Terrain;
use crate::rng::{Draw, Streams, stream};
use crate::train::on_each;
use crate::world::World;
use crate::world::arena::{Arena, Bounds, Obstacle};
use crate::world::geometry::{ConvexPolygon, Disc, Shape, direction};
use crate::world::mover::Mover;

/// Radius and height of a mover, as in the evaluation maps.
const MOVER_RADIUS_M: f64 = 0.25;
const MOVER_HEIGHT_M: f64 = 0.5;

/// Places tried for each thing before it is left out.
const TRIES: usize = 60;

/// How hard rooms are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomRules {
    /// Side of the square room, least and most.
    pub side_m: [f64; 2],
    /// Static obstacles per 100 square metres, least and most.
    pub obstacles_per_100_m2: [f64; 2],
    /// Moving obstacles per 100 square metres, least and most.
    pub movers_per_100_m2: [f64; 2],
    /// Speed of a mover, least and most.
    pub mover_speed_m_per_s: [f64; 2],
    /// Narrowest passage between static obstacles.
    pub gap_m: f64,
    /// Least distance of start and goal.
    pub distance_m_min: f64,
}

impl Default for RoomRules {
    /// About as dense as the evaluation maps, which have 10 obstacles and 2.75 movers per 100 m^2.
    fn default() -> Self {
        Self {
            side_m: [12.0, 18.0],
            obstacles_per_100_m2: [6.0, 11.0],
            movers_per_100_m2: [2.0, 4.5],
            mover_speed_m_per_s: [1.0, 1.9],
            gap_m: 0.8,
            distance_m_min: 5.0,
        }
    }
}

/// Room number `number` of a run.
pub fn room(rules: &RoomRules, streams: &Streams, number: u64) -> Arena {
    drawn_room(rules, streams.at(stream::TRAIN_ROOMS, number), format!("room-{number}"))
}

/// The room of a stream.
pub(super) fn drawn_room(rules: &RoomRules, mut draw: Draw, name: String) -> Arena {
    let side_m = between(&mut draw, rules.side_m);
    let half = 0.5 * side_m;
    let mut obstacles = walls(half);
    let share = side_m * side_m / 100.0;
    let n_obstacles = (share * between(&mut draw, rules.obstacles_per_100_m2)) as usize;
    for number in 1..=n_obstacles {
        let place = (0..TRIES).find_map(|_| free_shape(&mut draw, half, &obstacles, rules.gap_m));
        if let Some(shape) = place {
            let height_m = draw.uniform_in(0.5, 2.4);
            obstacles.push(Obstacle { name: format!("thing-{number}"), shape, height_m });
        }
    }
    let n_movers = (share * between(&mut draw, rules.movers_per_100_m2)) as usize;
    let mut movers: Vec<Mover> = Vec::new();
    for number in 1..=n_movers {
        let name = format!("mover-{number}");
        let mover = (0..TRIES).find_map(|_| free_mover(&mut draw, half, &obstacles, rules, &name));
        movers.extend(mover);
    }
    let bounds = Bounds { min: Point2::new(-half, -half), max: Point2::new(half, half) };
    let arena = Arena::new(name, bounds, obstacles, movers);
    arena.expect("what was placed was checked")
}

/// `n` rooms from number `first` on, made ready to fly in.
pub(super) fn places(
    rules: &RoomRules,
    streams: &Streams,
    first: u64,
    n: u64,
    threads: usize,
) -> Vec<(World, Terrain)> {
    let mut places: Vec<(u64, Option<(World, Terrain)>)> =
        (first..first + n).map(|number| (number, None)).collect();
    on_each(&mut places, threads, |(number, place)| {
        let world = World::new(room(rules, streams, *number));
        let terrain = Terrain::new(&world);
        *place = Some((world, terrain));
    });
    places.into_iter().filter_map(|(_, place)| place).collect()
}

fn walls(half: f64) -> Vec<Obstacle> {
    let wall = |name: &str, x: f64, y: f64, width: f64, depth: f64| {
        let centre = Point2::new(x, y);
        let shape =
            ConvexPolygon::rectangle(centre, 0.0, Vector2::new(width, depth)).expect("a wall");
        Obstacle { name: name.to_owned(), shape: Shape::Polygon(shape), height_m: 1.0 }
    };
    let (far, long) = (half + 0.5, 2.0 * half);
    vec![
        wall("wall-east", far, 0.0, 1.0, long + 2.0),
        wall("wall-west", -far, 0.0, 1.0, long + 2.0),
        wall("wall-north", 0.0, far, long, 1.0),
        wall("wall-south", 0.0, -far, long, 1.0),
    ]
}

/// A box or a cylinder that leaves passages open; some touch the wall.
fn free_shape(draw: &mut Draw, half: f64, obstacles: &[Obstacle], gap_m: f64) -> Option<Shape> {
    let centre = Point2::new(draw.uniform_in(-half, half), draw.uniform_in(-half, half));
    let shape = if draw.bernoulli(0.2) {
        Shape::Disc(Disc::new(centre, draw.uniform_in(0.25, 0.7)).ok()?)
    } else {
        let yaw_rad = if draw.bernoulli(0.6) { 0.0 } else { draw.uniform_in(0.0, PI) };
        let long_m = draw.uniform_in(0.5, 3.2);
        let short_m = draw.uniform_in(0.4, 1.4);
        let size = Vector2::new(long_m, short_m);
        let size = if draw.bernoulli(0.5) { size } else { size.yx() };
        Shape::Polygon(ConvexPolygon::rectangle(centre, yaw_rad, size).ok()?)
    };
    let outline = outline(&shape);
    let inside = outline.iter().all(|point| point.x.abs() < half && point.y.abs() < half);
    let clear = |other: &Obstacle| {
        let own = self::outline(&other.shape);
        outline.iter().all(|point| other.shape.distance_m(*point) >= gap_m)
            && own.iter().all(|point| shape.distance_m(*point) >= gap_m)
    };
    (inside && obstacles.iter().all(clear)).then_some(shape)
}

/// Points on the outline, close enough to tell whether two shapes leave a passage.
fn outline(shape: &Shape) -> Vec<Point2<f64>> {
    match shape {
        Shape::Disc(disc) => (0..12)
            .map(|n| {
                let angle = TAU * f64::from(n) / 12.0;
                disc.centre() + direction(angle) * disc.radius_m()
            })
            .collect(),
        Shape::Polygon(polygon) => {
            let corners = polygon.vertices();
            let mut points = Vec::new();
            for (index, from) in corners.iter().enumerate() {
                let to = corners[(index + 1) % corners.len()];
                points.extend((0..5).map(|n| from + (to - from) * (f64::from(n) / 5.0)));
            }
            points
        }
    }
}

fn free_mover(
    draw: &mut Draw,
    half: f64,
    obstacles: &[Obstacle],
    rules: &RoomRules,
    name: &str,
) -> Option<Mover> {
    let from = Point2::new(draw.uniform_in(-half, half), draw.uniform_in(-half, half));
    let eighths = if draw.bernoulli(0.7) { 2 * draw.below(4) } else { draw.below(8) };
    let angle = f64::from(eighths as u32) * PI / 4.0;
    let way: Vector2<f64> = direction(angle);
    let to = from + way * draw.uniform_in(2.5, 7.0);
    let speed = between(draw, rules.mover_speed_m_per_s);
    let clear_m = MOVER_RADIUS_M + draw.uniform_in(0.05, 0.5);
    let inside = to.x.abs() < half && to.y.abs() < half;
    let clear = |obstacle: &Obstacle| obstacle.shape.distance_to_segment_m(from, to) > clear_m;
    if !inside || !obstacles.iter().all(clear) {
        return None;
    }
    let start = Disc::new(from, MOVER_RADIUS_M).ok()?;
    Mover::new(name.to_owned(), start, to, speed, MOVER_HEIGHT_M).ok()
}

fn between(draw: &mut Draw, [least, most]: [f64; 2]) -> f64 {
    draw.uniform_in(least, most)
}

#[cfg(test)]
#[path = "rooms_tests.rs"]
mod tests;
