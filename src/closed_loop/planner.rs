//! A driver that knows all static obstacles, and of the movers everything or what sensors show.
//!
//! It marks what is possible in an arena, and it teaches: for each of 36 actions it gives a cost,
//! that of the best of some continuations over the next seconds. A network that sees only its
//! sensors can be trained against these costs.

mod forecast;
mod terrain;

pub use forecast::Knowledge;
pub use terrain::{Terrain, Ways};

use nalgebra::Point2;

use self::forecast::{Forecast, forecast};
use super::Trial;
use crate::policy::Action;
use crate::world::geometry::{Pose, direction};
use crate::world::robot::Twist;

/// Levels of each action component: 0, 0.2, ... 1, those of a spike count over T = 5.
pub const LEVELS: usize = 6;

/// Actions that get a cost: left level times [`LEVELS`] plus right level.
pub const ACTIONS: usize = LEVELS * LEVELS;

/// Length of a simulated step.
const STEP_S: f64 = 0.1;

/// Steps that an action is held before the continuation.
const HELD_STEPS: usize = 2;

/// Steps looked ahead.
const STEPS: usize = 20;

/// Physics steps in a simulated step.
const PHYSICS_STEPS: u64 = 10;

/// Wheel levels.
type Levels = (f64, f64);

const STRAIGHT: Levels = (1.0, 1.0);
const STAND: Levels = (0.0, 0.0);
const LEFT: Levels = (0.0, 1.0);
const RIGHT: Levels = (1.0, 0.0);
const BEND_LEFT: Levels = (0.6, 1.0);
const BEND_RIGHT: Levels = (1.0, 0.6);

/// What may follow the held action: levels, for how many steps, and levels after that. A plan that
/// ends standing is open: its time counts until it stands, and the rest only shows whether the
/// place is safe.
const CONTINUATIONS: [(Levels, usize, Levels); 16] = [
    (STRAIGHT, STEPS, STRAIGHT),
    (STRAIGHT, 6, STAND),
    (STRAIGHT, 1, STAND),
    (LEFT, 1, STAND),
    (RIGHT, 1, STAND),
    (LEFT, 4, STAND),
    (RIGHT, 4, STAND),
    (LEFT, 2, STRAIGHT),
    (RIGHT, 2, STRAIGHT),
    (LEFT, 4, STRAIGHT),
    (RIGHT, 4, STRAIGHT),
    (BEND_LEFT, STEPS, STRAIGHT),
    (BEND_RIGHT, STEPS, STRAIGHT),
    (STAND, 6, STRAIGHT),
    (STAND, 12, STRAIGHT),
    (STAND, STEPS, STRAIGHT),
];

/// Beyond this distance to a thing there is no need for care.
const CARE_M: (f64, f64) = (0.30, 0.60);

/// Price of a second right at a static thing, and right at a mover.
const CARE_PRICE: (f64, f64) = (1.5, 3.0);

/// Contact is assumed this much too early.
const MARGIN_M: f64 = 0.04;

/// Cost of contact now; half of it at the end of the time looked ahead.
const CONTACT_COST: f64 = 30.0;

/// Time to the goal from outside of the arena.
const OUTSIDE_S: f64 = 1e3;

/// Plans for one trial.
#[derive(Debug, Clone)]
pub struct Planner<'t> {
    terrain: &'t Terrain,
    ways: Ways,
    goal: Point2<f64>,
    knowledge: Knowledge,
}

impl<'t> Planner<'t> {
    /// Looks for the ways to `goal`.
    pub fn new(
        terrain: &'t Terrain,
        goal: Point2<f64>,
        speed_m_per_s: f64,
        knowledge: Knowledge,
    ) -> Self {
        Self { terrain, ways: terrain.ways_to(goal, speed_m_per_s), goal, knowledge }
    }

    /// The cheapest action, and the cost of every action, in seconds.
    pub fn plan(&self, trial: &Trial<'_>) -> (Action, [f32; ACTIONS]) {
        let forecast = forecast(trial, self.knowledge);
        let mut costs = [0.0f32; ACTIONS];
        for (index, cost) in costs.iter_mut().enumerate() {
            *cost = self.cost(trial, action_of(index), &forecast) as f32;
        }
        let best = (0..ACTIONS).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        (action_of(best), costs)
    }

    fn cost(&self, trial: &Trial<'_>, action: Action, forecast: &Forecast) -> f64 {
        let held = (action.left, action.right);
        let costs = CONTINUATIONS.map(|next| self.roll_out(trial, held, next, forecast));
        costs.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Cost of holding one action for a moment and another one after it.
    fn roll_out(
        &self,
        trial: &Trial<'_>,
        held: Levels,
        (next, next_steps, last): (Levels, usize, Levels),
        forecast: &Forecast,
    ) -> f64 {
        let config = trial.config();
        let mut body = Body::of(trial);
        // Whoever is nearer than the margin already may go away from there.
        let still_m = self.terrain.clearance_m(body.pose.position) - config.robot_radius_m;
        let reach_m = config.robot_radius_m + MARGIN_M.min(still_m - 0.01).max(0.0);
        let end = if last == STAND { HELD_STEPS + next_steps } else { STEPS };
        let (mut care_s, mut end_s) = (0.0, 0.0);
        for (step, there) in forecast.iter().enumerate() {
            let (left, right) = match step {
                _ if step < HELD_STEPS => held,
                _ if step < HELD_STEPS + next_steps => next,
                _ => last,
            };
            body.step(Twist::of_wheels(left, right, config.wheel_speed_m_per_s_max));
            let place = body.pose.position;
            let elapsed_s = (step + 1) as f64 * STEP_S;
            if (place - self.goal).norm() < config.goal_radius_m {
                return care_s + elapsed_s;
            }
            let still_m = self.terrain.clearance_m(place) - reach_m;
            let moving_m = nearest(there, place) - reach_m;
            if still_m.min(moving_m) < 0.0 {
                let late = (step + 1) as f64 / STEPS as f64;
                return care_s + self.time_from(&body.pose) + CONTACT_COST * (1.0 - 0.5 * late);
            }
            care_s += STEP_S * CARE_PRICE.0 * lack(still_m, CARE_M.0);
            care_s += STEP_S * CARE_PRICE.1 * lack(moving_m, CARE_M.1);
            if step + 1 == end {
                end_s = elapsed_s + self.time_from(&body.pose);
            }
        }
        care_s + end_s
    }

    /// Time to the goal at full speed, past static obstacles alone, s.
    pub fn time_from(&self, pose: &Pose) -> f64 {
        self.terrain.time_s(&self.ways, pose).unwrap_or(OUTSIDE_S)
    }
}

/// The action of number `index`.
pub fn action_of(index: usize) -> Action {
    let level = |level: usize| level as f64 / (LEVELS - 1) as f64;
    Action { left: level(index / LEVELS), right: level(index % LEVELS) }
}

/// 0 at `enough_m` and above, 1 at contact, square between.
fn lack(distance_m: f64, enough_m: f64) -> f64 {
    let lack = (1.0 - distance_m / enough_m).clamp(0.0, 1.0);
    lack * lack
}

fn nearest(movers: &[(Point2<f64>, f64)], place: Point2<f64>) -> f64 {
    let distances = movers.iter().map(|(centre, radius_m)| (centre - place).norm() - radius_m);
    distances.fold(f64::INFINITY, f64::min)
}

/// The robot as the planner thinks it moves: first-order lags, no delays.
struct Body {
    pose: Pose,
    twist: Twist,
    share: (f64, f64),
}

impl Body {
    fn of(trial: &Trial<'_>) -> Self {
        let share = |time_constant_s: f64| STEP_S / (STEP_S + time_constant_s);
        let actuators = trial.config().actuators;
        Self {
            pose: trial.robot().pose(),
            twist: trial.robot().twist(),
            share: (
                share(actuators.linear.time_constant_s()),
                share(actuators.angular.time_constant_s()),
            ),
        }
    }

    fn step(&mut self, command: Twist) {
        let (linear, angular) = self.share;
        self.twist.linear_m_per_s += linear * (command.linear_m_per_s - self.twist.linear_m_per_s);
        self.twist.angular_rad_per_s +=
            angular * (command.angular_rad_per_s - self.twist.angular_rad_per_s);
        let half_rad = 0.5 * STEP_S * self.twist.angular_rad_per_s;
        let chord_m = STEP_S * self.twist.linear_m_per_s * (1.0 - half_rad * half_rad / 6.0);
        self.pose.position += direction(self.pose.yaw_rad + half_rad) * chord_m;
        self.pose.yaw_rad += 2.0 * half_rad;
    }
}

#[cfg(test)]
#[path = "planner_tests.rs"]
mod tests;
