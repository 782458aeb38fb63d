//! From an [`Arena`] to JSON text in our own format.

use serde::Serialize;

use super::record::{BoundsRecord, MoverRecord, ObstacleRecord, Rest};
use super::{Arena, Bounds, Obstacle};
use crate::world::geometry::Shape;
use crate::world::mover::Mover;

#[derive(Serialize)]
struct WrittenArena<'a> {
    name: &'a str,
    arena: BoundsRecord,
    obstacles: Vec<ObstacleRecord>,
    movers: Vec<MoverRecord>,
}

impl Arena {
    /// The arena as JSON text that [`Arena::from_json`] reads back. Boxes become polygons.
    pub fn to_json(&self) -> String {
        let written = WrittenArena {
            name: &self.name,
            arena: bounds_record(&self.bounds),
            obstacles: self.obstacles.iter().map(obstacle_record).collect(),
            movers: self.movers.iter().map(mover_record).collect(),
        };
        serde_json::to_string_pretty(&written).expect("records have text keys and finite numbers")
    }
}

fn bounds_record(bounds: &Bounds) -> BoundsRecord {
    BoundsRecord {
        xmin: bounds.min.x,
        xmax: bounds.max.x,
        ymin: bounds.min.y,
        ymax: bounds.max.y,
        rest: Rest::new(),
    }
}

fn obstacle_record(obstacle: &Obstacle) -> ObstacleRecord {
    let common = ObstacleRecord {
        name: obstacle.name.clone(),
        height: obstacle.height_m,
        ..ObstacleRecord::default()
    };
    match &obstacle.shape {
        Shape::Polygon(polygon) => ObstacleRecord {
            shape: "polygon".to_owned(),
            vertices: Some(polygon.vertices().iter().map(|v| [v.x, v.y]).collect()),
            ..common
        },
        Shape::Disc(disc) => ObstacleRecord {
            shape: "cylinder".to_owned(),
            x: Some(disc.centre().x),
            y: Some(disc.centre().y),
            radius: Some(disc.radius_m()),
            ..common
        },
    }
}

fn mover_record(mover: &Mover) -> MoverRecord {
    MoverRecord {
        name: Some(mover.name.clone()),
        x: mover.from().x,
        y: mover.from().y,
        to: Some([mover.to().x, mover.to().y]),
        radius: mover.radius_m(),
        height: mover.height_m,
        speed: mover.speed_m_per_s(),
        ..MoverRecord::default()
    }
}
