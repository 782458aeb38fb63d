//! Where the movers will be, as far as somebody knows.

use nalgebra::{Point2, Vector2};

use super::{PHYSICS_STEPS, STEP_S, STEPS};
use crate::closed_loop::Trial;
use crate::closed_loop::sighted::Sighted;
use crate::world::mover::Mover;

/// What a planner knows of the movers; it always knows the static obstacles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Knowledge {
    /// Where all of them will be.
    #[default]
    Everything,
    /// What a perfect reader of an event camera and the laser would: place and velocity of those
    /// within the camera's field of view and 6 m, the place of those that only the laser sees. Of
    /// the others nothing.
    Camera {
        /// Field of view.
        field_of_view_deg: u16,
    },
    /// What a scan of the laser shows: the place of those in front, as if they stood.
    Laser,
}

/// Step by step, centre and radius of what is known.
pub(super) type Forecast = Vec<Vec<(Point2<f64>, f64)>>;

/// The next [`STEPS`] steps.
pub(super) fn forecast(trial: &Trial<'_>, knowledge: Knowledge) -> Forecast {
    let (movers, now) = (trial.world().arena().movers(), trial.steps());
    if knowledge == Knowledge::Everything {
        let at = |mover: &Mover, step| mover.position(now + step * PHYSICS_STEPS);
        let all = |step| movers.iter().map(|mover| (at(mover, step), mover.radius_m())).collect();
        return (1..=STEPS as u64).map(all).collect();
    }
    let known: Vec<_> = movers
        .iter()
        .filter_map(|mover| {
            let velocity = velocity_seen(trial, mover, knowledge)?;
            Some((mover.position(now), velocity, mover.radius_m()))
        })
        .collect();
    let after = |time_s: f64| {
        known.iter().map(move |(place, velocity, radius_m)| (place + velocity * time_s, *radius_m))
    };
    (1..=STEPS).map(|step| after(step as f64 * STEP_S).collect()).collect()
}

/// Velocity that the sensors give a mover, m/s; `None` for one that they do not see.
fn velocity_seen(trial: &Trial<'_>, mover: &Mover, knowledge: Knowledge) -> Option<Vector2<f64>> {
    let (pose, now) = (trial.robot().pose(), trial.steps());
    let sighted = Sighted::of(trial.world(), &pose, mover, now)?;
    match knowledge {
        Knowledge::Camera { field_of_view_deg } if sighted.by_camera(field_of_view_deg) => {
            Some(mover.velocity_m_per_s(now))
        }
        _ => Some(Vector2::zeros()),
    }
}

#[cfg(test)]
#[path = "forecast_tests.rs"]
mod tests;
