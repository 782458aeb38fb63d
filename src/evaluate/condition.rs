//! Conditions of EEM-SAN's success table.

use core::fmt;

use crate::closed_loop::TrialConfig;

/// Whether things move, and how fast the robot may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Whether the map's movers are there.
    pub movers: bool,
    /// Fastest wheel speed.
    pub wheel_speed_m_per_s_max: f64,
}

/// The three of the paper's table of success rates (tab:2).
pub const CONDITIONS: [Condition; 3] = [
    Condition { name: "dynamic-1.0", movers: true, wheel_speed_m_per_s_max: 1.0 },
    Condition { name: "static-1.0", movers: false, wheel_speed_m_per_s_max: 1.0 },
    Condition { name: "static-0.5", movers: false, wheel_speed_m_per_s_max: 0.5 },
];

impl Condition {
    /// The condition of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        CONDITIONS.iter().find(|condition| condition.name == name)
    }

    /// `config` at the speed of this condition.
    pub fn config(&self, config: &TrialConfig) -> TrialConfig {
        let wheel_speed_m_per_s_max = self.wheel_speed_m_per_s_max;
        TrialConfig { wheel_speed_m_per_s_max, ..config.clone() }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.movers { "dynamic" } else { "static" };
        write!(f, "{kind}, {:.1} m/s", self.wheel_speed_m_per_s_max)
    }
}
