//! How speeds follow commands: presets and their text form.

use core::fmt;
use core::str::FromStr;

use crate::world::PHYSICS_HZ;

/// Longest command delay.
pub const DELAY_S_MAX: f64 = 2.0;

/// Longest time constant.
pub const TIME_CONSTANT_S_MAX: f64 = 10.0;

/// Dead time followed by a first-order lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    delay_steps: u32,
    time_constant_s: f64,
}

/// Lags of both speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuators {
    /// Of the speed along the heading.
    pub linear: Lag,
    /// Of the turning speed.
    pub angular: Lag,
}

/// Why an actuator text was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActuatorsError {
    /// Neither a preset nor of the form `v:DELAY+TAU,w:DELAY+TAU`.
    #[error(
        "actuators {text:?}: not understood; use {names} or v:0.2+0.15,w:0.1+0.35 \
         (delay+time constant in s of the linear and the angular speed)",
        names = preset_names()
    )]
    Text {
        /// What was given.
        text: String,
    },
    /// A delay outside of its limits or not on the physics grid.
    #[error(
        "command delay {delay_s} s, must be 0..={limit} s (DELAY_S_MAX) in steps of 0.01 s",
        limit = DELAY_S_MAX
    )]
    Delay {
        /// The delay.
        delay_s: f64,
    },
    /// A time constant outside of its limits.
    #[error(
        "time constant {time_constant_s} s, must be 0 or 0.001..={limit} s (TIME_CONSTANT_S_MAX)",
        limit = TIME_CONSTANT_S_MAX
    )]
    TimeConstant {
        /// The time constant.
        time_constant_s: f64,
    },
}

const fn lag(delay_steps: u32, time_constant_s: f64) -> Lag {
    Lag { delay_steps, time_constant_s }
}

const fn both(lag: Lag) -> Actuators {
    Actuators { linear: lag, angular: lag }
}

/// Presets by name. `ideal` applies a command at once. The others bracket the response that was
/// measured on the recorded routes of SAN's Gazebo robot (delay about 0.1 to 0.3 s, time constant
/// about 0.15 to 0.4 s).
pub const PRESETS: [(&str, Actuators); 5] = [
    ("ideal", both(lag(0, 0.0))),
    ("lag", both(lag(10, 0.3))),
    ("lag-0.4", both(lag(10, 0.4))),
    ("lag-split-a", Actuators { linear: lag(20, 0.15), angular: lag(10, 0.35) }),
    ("lag-split-b", Actuators { linear: lag(30, 0.15), angular: lag(20, 0.3) }),
];

impl Lag {
    /// Errs unless the delay is a whole number of physics steps and both are within their limits.
    pub fn new(delay_s: f64, time_constant_s: f64) -> Result<Self, ActuatorsError> {
        let steps = delay_s * f64::from(PHYSICS_HZ);
        let on_grid = (steps - libm::round(steps)).abs() < 1e-6;
        if !((0.0..=DELAY_S_MAX).contains(&delay_s) && on_grid) {
            return Err(ActuatorsError::Delay { delay_s });
        }
        if !(time_constant_s == 0.0 || (0.001..=TIME_CONSTANT_S_MAX).contains(&time_constant_s)) {
            return Err(ActuatorsError::TimeConstant { time_constant_s });
        }
        Ok(lag(libm::round(steps) as u32, time_constant_s))
    }

    /// Dead time in physics steps.
    pub fn delay_steps(&self) -> u32 {
        self.delay_steps
    }

    /// Dead time.
    pub fn delay_s(&self) -> f64 {
        f64::from(self.delay_steps) / f64::from(PHYSICS_HZ)
    }

    /// Time constant of the first-order lag; 0 for none.
    pub fn time_constant_s(&self) -> f64 {
        self.time_constant_s
    }
}

impl Actuators {
    /// Commands apply at once.
    pub const IDEAL: Self = PRESETS[0].1;
}

impl fmt::Display for Lag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}+{}", self.delay_s(), self.time_constant_s)
    }
}

impl fmt::Display for Actuators {
    /// The preset's name, or text that parses back.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match PRESETS.iter().find(|(_, preset)| preset == self) {
            Some((name, _)) => f.pad(name),
            None => write!(f, "v:{},w:{}", self.linear, self.angular),
        }
    }
}

impl FromStr for Actuators {
    type Err = ActuatorsError;

    fn from_str(text: &str) -> Result<Self, ActuatorsError> {
        if let Some((_, preset)) = PRESETS.iter().find(|(name, _)| *name == text) {
            return Ok(*preset);
        }
        let not_understood = || ActuatorsError::Text { text: text.to_owned() };
        let [linear, angular] = parse_pairs(text).ok_or_else(not_understood)?;
        Ok(Self { linear: Lag::new(linear.0, linear.1)?, angular: Lag::new(angular.0, angular.1)? })
    }
}

/// `v:A+B,w:C+D` as numbers.
fn parse_pairs(text: &str) -> Option<[(f64, f64); 2]> {
    let (linear, angular) = text.split_once(',')?;
    Some([parse_pair(linear.strip_prefix("v:")?)?, parse_pair(angular.strip_prefix("w:")?)?])
}

fn parse_pair(text: &str) -> Option<(f64, f64)> {
    let (delay, time_constant) = text.split_once('+')?;
    Some((delay.parse().ok()?, time_constant.parse().ok()?))
}

fn preset_names() -> String {
    PRESETS.map(|(name, _)| name).join(", ")
}

#[cfg(test)]
#[path = "actuators_tests.rs"]
mod tests;
