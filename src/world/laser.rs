//! The laser scanner of SAN's robot (combra-lab/spiking-ddpg-mapless-navigation, a Hokuyo in
//! Gazebo): 720 rays in 36 sectors of 20, of which a controller sees the 18 in front.

use core::f64::consts::PI;

use super::World;
use super::geometry::{Pose, RayFan};
use crate::rng::Draw;

/// Rays of a full turn.
pub const N_RAYS: usize = 720;

/// Rays of a sector.
pub const RAYS_PER_SECTOR: usize = 20;

/// Sectors of a full turn.
pub const N_SECTORS: usize = N_RAYS / RAYS_PER_SECTOR;

/// Sectors in front of the robot, half of them on either side of the heading.
pub const N_FRONT_SECTORS: usize = 18;

/// A sector's value is its reading of this rank, from 0 ascending: the upper median of 20.
pub const MEDIAN_RANK: usize = 10;

/// Shortest range that is reported.
pub const LASER_RANGE_M_MIN: f64 = 0.15;

/// Longest range that is reported; beyond it there is no hit.
pub const LASER_RANGE_M_MAX: f64 = 40.0;

/// Standard deviation of the range noise of SAN's sensor.
pub const LASER_NOISE_M: f64 = 0.01;

/// Height of the scan plane above the floor: anything lower is not seen.
pub const LASER_HEIGHT_M: f64 = 0.44;

/// Angles of the first and the last ray in the sensor's frame, which is turned by pi on the robot.
const SENSOR_RAD: (f64, f64) = (-3.124_139_070_51, 3.141_592_741_01);

/// Sectors in front: this many to the left of the heading and as many to the right.
const SECTORS_PER_SIDE: usize = N_FRONT_SECTORS / 2;

/// The scanner. Sectors count counter-clockwise from the heading; those from the ninth on face
/// backwards, and only a full scan casts them.
#[derive(Debug, Clone)]
pub struct Laser {
    noise_m: f64,
    left: RayFan,
    rear: RayFan,
    right: RayFan,
}

impl Laser {
    /// A scanner with Gaussian range noise of standard deviation `noise_m`; 0 draws nothing.
    pub fn new(noise_m: f64) -> Self {
        let rear_sectors = N_SECTORS - N_FRONT_SECTORS;
        Self {
            noise_m,
            left: fan(0, SECTORS_PER_SIDE),
            rear: fan(SECTORS_PER_SIDE, rear_sectors),
            right: fan(SECTORS_PER_SIDE + rear_sectors, SECTORS_PER_SIDE),
        }
    }

    /// The 18 sectors in front after `step` physics steps, from left to right.
    ///
    /// Takes one draw per ray: those on the left of the heading from the heading outwards, then
    /// those on the right from outside to the heading, whatever they hit.
    pub fn front_m(
        &self,
        world: &World,
        step: u64,
        pose: &Pose,
        draw: &mut Draw,
    ) -> [f64; N_FRONT_SECTORS] {
        let left = self.sectors_m(&self.left, world, step, pose, draw);
        let right = self.sectors_m(&self.right, world, step, pose, draw);
        let mut front_m = [0.0; N_FRONT_SECTORS];
        let left_to_right = left.iter().rev().chain(right.iter().rev());
        front_m.iter_mut().zip(left_to_right).for_each(|(slot, median_m)| *slot = *median_m);
        front_m
    }

    /// All 36 sectors, counter-clockwise from the heading. The front sectors draw first, so that
    /// they are those of [`Self::front_m`] for the same draws.
    pub fn full_m(
        &self,
        world: &World,
        step: u64,
        pose: &Pose,
        draw: &mut Draw,
    ) -> [f64; N_SECTORS] {
        let left = self.sectors_m(&self.left, world, step, pose, draw);
        let right = self.sectors_m(&self.right, world, step, pose, draw);
        let rear = self.sectors_m(&self.rear, world, step, pose, draw);
        let mut full_m = [0.0; N_SECTORS];
        let medians = left.iter().chain(&rear).chain(&right);
        full_m.iter_mut().zip(medians).for_each(|(slot, median_m)| *slot = *median_m);
        full_m
    }

    fn sectors_m(
        &self,
        fan: &RayFan,
        world: &World,
        step: u64,
        pose: &Pose,
        draw: &mut Draw,
    ) -> Vec<f64> {
        let mut scan = fan.scan(pose);
        world.cast(&mut scan, step);
        let mut readings_m = scan.ranges_m().to_vec();
        readings_m.iter_mut().for_each(|range_m| *range_m = self.reading_m(*range_m, draw));
        readings_m.chunks_exact_mut(RAYS_PER_SECTOR).map(upper_median).collect()
    }

    /// What the sensor reports for a true range. A miss is 0, which the median sees as very near:
    /// SAN's scan filter replaces infinite ranges so.
    fn reading_m(&self, range_m: f64, draw: &mut Draw) -> f64 {
        let noise_m = if self.noise_m == 0.0 { 0.0 } else { self.noise_m * draw.gaussian() };
        if range_m > LASER_RANGE_M_MAX {
            return 0.0;
        }
        (range_m + noise_m).clamp(LASER_RANGE_M_MIN, LASER_RANGE_M_MAX)
    }
}

/// The rays of `n` sectors from `first_sector` on.
fn fan(first_sector: usize, n: usize) -> RayFan {
    let step_rad = (SENSOR_RAD.1 - SENSOR_RAD.0) / (N_RAYS - 1) as f64;
    let zero_rad = SENSOR_RAD.0 + PI;
    RayFan::new(zero_rad, step_rad, first_sector * RAYS_PER_SECTOR, n * RAYS_PER_SECTOR)
}

fn upper_median(readings_m: &mut [f64]) -> f64 {
    *readings_m.select_nth_unstable_by(MEDIAN_RANK, f64::total_cmp).1
}

#[cfg(test)]
#[path = "laser_tests.rs"]
mod tests;
