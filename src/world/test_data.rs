//! Data of other projects that lies beside this one, and small things that tests share.

use std::path::PathBuf;

use nalgebra::Point2;

use super::arena::{Arena, Bounds, Obstacle};
use super::geometry::{ConvexPolygon, Disc, Shape};
use super::mover::Mover;
use super::{World, geometry};

/// Path of a file of `shared/data/san`; `None`, with a note, where it is not laid out.
pub(crate) fn san(file: &str) -> Option<PathBuf> {
    let shared = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared"));
    if !shared.exists() {
        println!("skipped: needs ../shared");
        return None;
    }
    Some(shared.join("data/san").join(file))
}

/// The SAN file as a world.
pub(crate) fn san_world(file: &str) -> Option<World> {
    let path = san(file)?;
    Some(World::new(Arena::open(path.to_str().unwrap()).unwrap()))
}

pub(crate) fn rectangle(name: &str, low: [f64; 2], high: [f64; 2]) -> Obstacle {
    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]].map(Point2::from);
    let polygon = ConvexPolygon::new(corners.to_vec()).unwrap();
    Obstacle { name: name.to_owned(), shape: Shape::Polygon(polygon), height_m: 1.0 }
}

pub(crate) fn cylinder(name: &str, centre: [f64; 2], radius_m: f64) -> Obstacle {
    let disc = Disc::new(Point2::from(centre), radius_m).unwrap();
    Obstacle { name: name.to_owned(), shape: Shape::Disc(disc), height_m: 1.0 }
}

pub(crate) fn mover(name: &str, from: [f64; 2], to: [f64; 2], speed_m_per_s: f64) -> Mover {
    let start = Disc::new(Point2::from(from), 0.25).unwrap();
    Mover::new(name.to_owned(), start, Point2::from(to), speed_m_per_s, 1.0).unwrap()
}

/// Bounds of 20 x 20 m around the origin, without walls.
pub(crate) const BOUNDS: Bounds =
    Bounds { min: Point2::new(-10.0, -10.0), max: Point2::new(10.0, 10.0) };

/// A world of 20 x 20 m without walls that holds the given things.
pub(crate) fn field(obstacles: Vec<Obstacle>, movers: Vec<Mover>) -> World {
    World::new(Arena::new("field".to_owned(), BOUNDS, obstacles, movers).unwrap())
}

/// A shape that proptest can shrink: corners on an ellipse, or a disc.
pub(crate) fn any_shape() -> impl proptest::strategy::Strategy<Value = Shape> {
    use proptest::prelude::*;
    let polygon = (point(), 3_usize..9, 0.2..3.0_f64, 0.2..3.0_f64, 0.0..6.0_f64).prop_map(
        |(centre, n, a_m, b_m, turn_rad)| {
            let corner = |i: usize| {
                let on_circle = geometry::direction(turn_rad + 6.25 * i as f64 / n as f64);
                Point2::new(centre.x + a_m * on_circle.x, centre.y + b_m * on_circle.y)
            };
            Shape::Polygon(ConvexPolygon::new((0..n).map(corner).collect()).unwrap())
        },
    );
    let disc = (point(), 0.05..2.0_f64)
        .prop_map(|(centre, radius_m)| Shape::Disc(Disc::new(centre, radius_m).unwrap()));
    prop_oneof![polygon, disc]
}

/// A point within 10 m of the origin along each axis.
pub(crate) fn point() -> impl proptest::strategy::Strategy<Value = Point2<f64>> {
    use proptest::prelude::*;
    (-10.0..10.0_f64, -10.0..10.0_f64).prop_map(|(x, y)| Point2::new(x, y))
}
