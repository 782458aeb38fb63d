//! What a camera could show of movers, in numbers: what a network is told that has the simulator in
//! place of an encoder of events, to find out what a faultless encoder would be worth.

use super::Trial;
use super::sighted::{CAMERA_M, Sighted, in_view};
use crate::policy::TOLD;
use crate::world::dvs::CAMERA_DEG;

/// Parts of the field of view, from left to right.
pub const SECTORS: usize = 16;

/// Numbers in all: for each sector how near the mover there is, the reach over its distance, how fast
/// it closes and how fast it goes to the left. As many as HSVAE's DVS state has.
pub const NUMBERS: usize = 4 * SECTORS;

const _: () = assert!(NUMBERS == TOLD);

/// A mover nearer than this is as near as can be, in the second number of its sectors.
const REACH_M: f64 = 0.6;

/// A speed that is as large as can be.
const FULL_M_PER_S: f64 = 1.5;

/// Speeds of far movers count for less, but never for less than this.
const SPEED_WEIGHT_MIN: f32 = 0.3;

/// What a mover covers on either side beyond its outline.
const MARGIN_RAD: f64 = 0.03;

/// Largest number: population codes of DVS states reach to 3.
const LARGEST: f32 = 2.5;

/// The numbers of the movers in view now, 0 where there is none; the nearest where there are several.
pub fn mover_map(trial: &Trial<'_>) -> Vec<f32> {
    map_of(in_view(trial))
}

fn map_of(movers: impl Iterator<Item = Sighted>) -> Vec<f32> {
    let mut map = vec![0.0f32; NUMBERS];
    let half = 0.5 * f64::from(CAMERA_DEG).to_radians();
    let reach = half / SECTORS as f64;
    for mover in movers {
        let numbers = numbers(&mover);
        let [ahead, left] = mover.way_m;
        let bearing = libm::atan2(left, ahead);
        let outline = libm::asin((mover.radius_m / mover.distance_m).min(1.0)) + MARGIN_RAD;
        for sector in 0..SECTORS {
            let middle = half - (sector as f64 + 0.5) * 2.0 * half / SECTORS as f64;
            let covered = (middle - bearing).abs() <= outline + reach;
            if covered && numbers[0] > map[sector] {
                for (kind, number) in numbers.iter().enumerate() {
                    map[kind * SECTORS + sector] = *number;
                }
            }
        }
    }
    map.iter_mut().for_each(|number| *number *= LARGEST);
    map
}

/// Each within -1 to 1.
fn numbers(mover: &Sighted) -> [f32; 4] {
    let distance = mover.distance_m;
    let near = (1.0 - distance / CAMERA_M) as f32;
    let over = (REACH_M / distance).min(1.0) as f32;
    let [ahead, left] = mover.way_m;
    let [to_ahead, to_left] = mover.velocity_m_per_s;
    let share = |speed: f64| (speed / distance / FULL_M_PER_S).clamp(-1.0, 1.0) as f32;
    let closing = share(-(to_ahead * ahead + to_left * left));
    let leftward = share(-to_ahead * left + to_left * ahead);
    let weight = near.max(SPEED_WEIGHT_MIN);
    [near, over, weight * closing, weight * leftward]
}

#[cfg(test)]
#[path = "mover_map_tests.rs"]
mod tests;
