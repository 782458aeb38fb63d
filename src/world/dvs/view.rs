//! What the camera sees: the arena drawn from the robot, column by column.
//!
//! The picture plane is upright and looks along the heading, so a vertical edge stays vertical and
//! a column of pixels is one vertical plane through the lens. Along that plane the floor ends at
//! the first thing; behind it only the parts of taller or farther things that rise above show.

mod background;
mod column;
mod floor;
mod projection;
mod surface;

use super::{COLUMNS, CameraConfig, PIXELS};
use crate::world::World;
use crate::world::geometry::Pose;
use background::Background;
use column::{Column, draw_column};
use floor::Floor;
use projection::{Projection, Standpoint};
use surface::{Pillar, Wall, walls_of};

/// Draws the arena from any pose.
#[derive(Debug, Clone)]
pub(super) struct View<'w> {
    world: &'w World,
    projection: Projection,
    walls: Vec<Wall>,
    pillars: Vec<Pillar>,
    movers: Vec<Pillar>,
    floor: Floor,
    background: Background,
    columns: Vec<Column>,
    shades: Vec<u8>,
}

impl<'w> View<'w> {
    /// Paints the arena; `config` is checked.
    pub(super) fn new(world: &'w World, config: &CameraConfig) -> Self {
        let arena = world.arena();
        let paint = surface::Painter::new(arena.name(), config);
        let projection = Projection::new(config);
        Self {
            world,
            walls: arena.obstacles().iter().flat_map(|o| walls_of(o, &paint)).collect(),
            pillars: arena.obstacles().iter().filter_map(|o| Pillar::of(o, &paint)).collect(),
            movers: arena.movers().iter().map(|mover| Pillar::of_mover(mover, &paint)).collect(),
            floor: Floor::new(&projection, paint.paint(&["floor"])),
            background: Background::new(&projection, paint.paint(&["background"])),
            columns: vec![Column::default(); COLUMNS],
            shades: vec![0; PIXELS],
            projection,
        }
    }

    /// The picture at `pose`, `share` (0..=1) of the way from physics step `step` to the next.
    /// Row by row from the top left, shades of `texture::ln_intensity`.
    pub(super) fn draw(&mut self, pose: &Pose, step: u64, share: f64) -> &[u8] {
        let at = Standpoint::new(pose);
        self.columns.iter_mut().for_each(Column::clear);
        for wall in &self.walls {
            wall.cast(&at, &self.projection, &mut self.columns);
        }
        for (pillar, mover) in self.movers.iter_mut().zip(self.world.arena().movers()) {
            let (here, next) = (mover.position(step), mover.position(step + 1));
            pillar.centre = here + (next - here) * share;
        }
        for pillar in self.pillars.iter().chain(&self.movers) {
            pillar.cast(&at, &self.projection, &mut self.columns);
        }
        let mut floor_from = [0; COLUMNS];
        for (x, column) in self.columns.iter_mut().enumerate() {
            let rows = draw_column(column, &self.projection, x, &mut self.shades);
            floor_from[x] = rows.end as u8;
            self.background.draw(&at, x, rows.start, &mut self.shades);
        }
        self.floor.draw(&at, &floor_from, &mut self.shades);
        &self.shades
    }

    /// The picture drawn last.
    pub(super) fn shades(&self) -> &[u8] {
        &self.shades
    }

    /// Largest way in pixels that a picture point may have moved between two poses: by turning, by
    /// driving past the nearest thing in view, and by movers in view.
    pub(super) fn displacement_px(&self, from: &Pose, to: &Pose, step_s: f64) -> f64 {
        let turn_rad = crate::world::geometry::wrap_angle(to.yaw_rad - from.yaw_rad).abs();
        let drive_m = (to.position - from.position).norm();
        let nearest = |pillar_only: bool| {
            let hits = self.columns.iter().flat_map(|column| column.hits());
            let depths = hits.filter(|hit| hit.moves || !pillar_only).map(|hit| hit.depth_m);
            depths.fold(f64::INFINITY, f64::min)
        };
        let speeds = self.world.arena().movers().iter().map(|mover| mover.speed_m_per_s());
        let mover_m = drive_m + step_s * speeds.fold(0.0, f64::max);
        let focal_px = self.projection.focal_px();
        focal_px * (turn_rad + (drive_m / nearest(false)).max(mover_m / nearest(true)))
    }
}

#[cfg(test)]
#[path = "view_tests.rs"]
mod tests;
