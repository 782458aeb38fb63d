//! A differential-drive robot: wheel fractions in, pose out.

mod actuators;
mod channel;

pub use actuators::{Actuators, ActuatorsError, DELAY_S_MAX, Lag, PRESETS, TIME_CONSTANT_S_MAX};

use super::PHYSICS_STEP_S;
use super::geometry::Pose;
use channel::Channel;

/// Radius of the robot's disc (SAN evaluation: collision below 0.18 m).
pub const ROBOT_RADIUS_M: f64 = 0.18;

/// Distance between the wheels that the action decoder assumes (SAN training code).
pub const WHEEL_BASE_M: f64 = 0.25;

/// Slowest wheel speed (SAN): the robot never stops.
pub const WHEEL_SPEED_M_PER_S_MIN: f64 = 0.05;

/// Speeds along and about the robot's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Along the heading.
    pub linear_m_per_s: f64,
    /// Counter-clockwise.
    pub angular_rad_per_s: f64,
}

impl Twist {
    /// What wheel fractions in `0..=1` command: each wheel turns at
    /// `fraction * (wheel_speed_m_per_s_max - 0.05) + 0.05` m/s (SAN's decoder).
    pub fn of_wheels(left: f64, right: f64, wheel_speed_m_per_s_max: f64) -> Self {
        let span = wheel_speed_m_per_s_max - WHEEL_SPEED_M_PER_S_MIN;
        let left = left * span + WHEEL_SPEED_M_PER_S_MIN;
        let right = right * span + WHEEL_SPEED_M_PER_S_MIN;
        Self {
            linear_m_per_s: 0.5 * (left + right),
            angular_rad_per_s: (right - left) / WHEEL_BASE_M,
        }
    }
}

/// The moving robot.
#[derive(Debug, Clone)]
pub struct Robot {
    pose: Pose,
    path_m: f64,
    linear: Channel,
    angular: Channel,
}

impl Robot {
    /// At rest at `pose`.
    pub fn new(pose: Pose, actuators: Actuators) -> Self {
        Self {
            pose,
            path_m: 0.0,
            linear: Channel::new(actuators.linear),
            angular: Channel::new(actuators.angular),
        }
    }

    /// Moves on by one physics step of 10 ms under `command`.
    ///
    /// The lag is integrated exactly; the pose follows the arc of the step's mean speeds.
    pub fn step(&mut self, command: Twist) {
        let distance_m = self.linear.step(command.linear_m_per_s) * PHYSICS_STEP_S;
        let turn_rad = self.angular.step(command.angular_rad_per_s) * PHYSICS_STEP_S;
        self.pose = self.pose.after_arc(distance_m, turn_rad);
        self.path_m += distance_m.abs();
    }

    /// Where it is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Length of the way so far.
    pub fn path_m(&self) -> f64 {
        self.path_m
    }

    /// Actual speeds, not the commanded ones.
    pub fn twist(&self) -> Twist {
        Twist { linear_m_per_s: self.linear.value(), angular_rad_per_s: self.angular.value() }
    }
}

#[cfg(test)]
#[path = "robot_tests.rs"]
mod tests;
