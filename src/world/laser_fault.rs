//! Degraded laser readings, as in BDETT's published evaluation (Zyunduo/dynamic-threshold): three
//! beams that are stuck, or noise on all of them.

use crate::policy::LASER_SECTORS;
use crate::rng::Draw;

/// Sectors that are stuck, from 0 on the left.
const STUCK_SECTORS: [usize; 3] = [2, 8, 14];

/// Shortest and longest range that a degraded sector reports.
const RANGE_M: [f64; 2] = [0.2, 6.0];

/// What is wrong with the laser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LaserFault {
    /// Sectors 2, 8 and 14 report 0.2 m, whatever is there.
    Near,
    /// The same sectors report 6 m.
    Far,
    /// Every sector has Gaussian noise of 1 m, and is clipped to 0.2 to 6 m.
    Noise,
}

impl LaserFault {
    /// Changes what the sectors in front report. Takes a draw for each sector if it is noise.
    pub fn apply(self, laser_m: &mut [f64; LASER_SECTORS], draw: &mut Draw) {
        let stuck = match self {
            Self::Near => RANGE_M[0],
            Self::Far => RANGE_M[1],
            Self::Noise => {
                let noisy = |range_m: &mut f64| {
                    *range_m = (*range_m + draw.gaussian()).clamp(RANGE_M[0], RANGE_M[1]);
                };
                return laser_m.iter_mut().for_each(noisy);
            }
        };
        STUCK_SECTORS.iter().for_each(|sector| laser_m[*sector] = stuck);
    }
}

#[cfg(test)]
#[path = "laser_fault_tests.rs"]
mod tests;
