//! A baseline that looks at the goal only.

use crate::policy::{Action, Observation, Policy};
use crate::rng::Streams;

/// Turn per radian of goal direction: above half a radian only one wheel drives.
const TURN_PER_RAD: f64 = 2.0;

/// Drives straight at the goal, blind to obstacles: what a trial set gives away for free.
#[derive(Debug, Clone, Copy, Default)]
pub struct StraightToGoal;

impl Policy for StraightToGoal {
    fn start_trial(&mut self, _streams: Streams) {}

    fn act(&mut self, observation: &Observation, _tick: u64) -> Action {
        let turn = (TURN_PER_RAD * observation.goal_direction_rad).clamp(-1.0, 1.0);
        Action { left: 1.0 - turn.max(0.0), right: 1.0 + turn.min(0.0) }
    }
}
