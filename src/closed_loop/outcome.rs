//! How a trial ended.

use core::fmt;

use super::MoverContact;

/// The three outcomes of SAN's and EEM-SAN's success tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Reached the goal.
    Success,
    /// Touched something.
    Collision,
    /// Neither within the tick limit.
    TimeOut,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Success => "success",
            Self::Collision => "collision",
            Self::TimeOut => "time-out",
        })
    }
}

/// Why a running trial stopped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// The centre is within the goal radius.
    Goal,
    /// Contact with the obstacle or mover of this name, or with `bounds`, the arena's edge.
    Hit(String),
    /// The tick limit is used up.
    TimeOut,
}

/// A trial in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialOutcome {
    /// How it ended.
    pub outcome: Outcome,
    /// Name of the obstacle or mover that was hit, in a collision.
    pub hit: Option<String>,
    /// How it came to that, in a collision with a mover.
    pub mover_contact: Option<MoverContact>,
    /// Length of the robot's way.
    pub path_m: f64,
    /// Simulated time, in whole physics steps.
    pub time_s: f64,
    /// Control ticks begun.
    pub ticks: u64,
    /// Calls of the policy: one per control tick.
    pub decisions: u64,
    /// `path_m / time_s`, 0 for a trial that ended at once.
    pub mean_speed_m_per_s: f64,
    /// Distance from the robot's centre to the goal at the end.
    pub end_goal_distance_m: f64,
    /// `[x mm, y mm, yaw mrad]` at the beginning of every control tick and at the end.
    pub trajectory: Vec<[i32; 3]>,
}
