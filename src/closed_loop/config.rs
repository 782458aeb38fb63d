//! Settings of a trial.

use crate::world::PHYSICS_HZ;
use crate::world::dvs::{CameraConfig, CameraError};
use crate::world::laser::LASER_NOISE_M;
use crate::world::laser_fault::LaserFault;
use crate::world::robot::{Actuators, ROBOT_RADIUS_M, WHEEL_SPEED_M_PER_S_MIN};
use crate::world::shown::shown;

/// What all trials of an evaluation have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialConfig {
    /// Control ticks per second; divides the physics rate of 100 Hz.
    pub control_hz: u32,
    /// Fastest wheel speed (`v_max`).
    pub wheel_speed_m_per_s_max: f64,
    /// How speeds follow commands.
    pub actuators: Actuators,
    /// Control ticks after which the trial is out of time.
    pub ticks_max: u64,
    /// The goal is reached when the robot's centre is nearer than this.
    pub goal_radius_m: f64,
    /// A thing nearer to the robot's centre than this is hit.
    pub robot_radius_m: f64,
    /// Standard deviation of the range noise of each laser ray.
    pub laser_noise_m: f64,
    /// What is wrong with the laser besides; `None` when it works.
    pub laser_fault: Option<LaserFault>,
    /// Whether `0.99 a + 0.01 N(0, 1)` drives the wheels in place of the action `a`.
    pub action_noise: bool,
    /// The event camera on the robot; `None` flies without one.
    pub camera: Option<CameraConfig>,
    /// Whether the simulator tells the driver of movers ([`crate::closed_loop::mover_map`]).
    pub told: bool,
}

/// A number that a trial is told, and its limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// What it is, with its unit.
    pub name: &'static str,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// The option of the command line that sets it.
    pub option: Option<&'static str>,
}

impl Setting {
    pub(super) fn new(name: &'static str, min: f64, max: f64) -> Self {
        Self { name, min, max, option: None }
    }

    fn with_option(self, option: &'static str) -> Self {
        Self { option: Some(option), ..self }
    }

    /// Errs unless `value` is within the limits.
    pub(super) fn check(self, value: f64) -> Result<(), ConfigError> {
        if (self.min..=self.max).contains(&value) {
            Ok(())
        } else {
            Err(ConfigError::Range { setting: self, value })
        }
    }

    fn by_option(&self) -> String {
        self.option.map_or(String::new(), |option| format!(" with {option}"))
    }
}

/// A setting outside of its limits.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// The control rate does not divide the physics rate.
    #[error(
        "control rate {control_hz} Hz must divide the physics rate of {limit} Hz (PHYSICS_HZ); \
         SAN uses 10, EEM-SAN 20 (--control-hz)",
        limit = PHYSICS_HZ
    )]
    ControlRate {
        /// The rate.
        control_hz: u32,
    },
    /// A number outside of its range.
    #[error("trial: {} is {}, must be {}..={}; change it{}", .setting.name, shown(*value), .setting.min, .setting.max, .setting.by_option())]
    Range {
        /// Which setting.
        setting: Setting,
        /// Its value.
        value: f64,
    },
    /// A setting of the event camera is.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

impl TrialConfig {
    /// SAN's own evaluation: 10 Hz, 0.5 m/s, action noise (rand_eval_gpu.py of
    /// combra-lab/spiking-ddpg-mapless-navigation), with ideal actuators.
    pub fn san() -> Self {
        Self {
            control_hz: 10,
            wheel_speed_m_per_s_max: 0.5,
            actuators: Actuators::IDEAL,
            ticks_max: 1000,
            goal_radius_m: 0.5,
            robot_radius_m: ROBOT_RADIUS_M,
            laser_noise_m: LASER_NOISE_M,
            laser_fault: None,
            action_noise: true,
            camera: None,
            told: false,
        }
    }

    /// EEM-SAN: the laser's 20 Hz are the control rate, no action noise, ideal actuators.
    pub fn eem_san(wheel_speed_m_per_s_max: f64) -> Self {
        Self { control_hz: 20, wheel_speed_m_per_s_max, action_noise: false, ..Self::san() }
    }

    /// Physics steps per control tick, of a checked configuration.
    pub fn steps_per_tick(&self) -> u64 {
        u64::from(PHYSICS_HZ / self.control_hz)
    }

    /// Errs for the first setting outside of its limits.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.control_hz == 0 || !PHYSICS_HZ.is_multiple_of(self.control_hz) {
            return Err(ConfigError::ControlRate { control_hz: self.control_hz });
        }
        let speed = Setting::new("wheel speed (m/s)", WHEEL_SPEED_M_PER_S_MIN, 10.0);
        speed.with_option("--v-max").check(self.wheel_speed_m_per_s_max)?;
        let ticks = Setting::new("tick limit", 1.0, 1e6).with_option("--ticks-max");
        ticks.check(self.ticks_max as f64)?;
        Setting::new("goal radius (m)", 0.01, 100.0).check(self.goal_radius_m)?;
        Setting::new("robot radius (m)", 0.01, 10.0).check(self.robot_radius_m)?;
        Setting::new("laser noise (m)", 0.0, 10.0).check(self.laser_noise_m)?;
        Ok(self.camera.as_ref().map_or(Ok(()), CameraConfig::check)?)
    }
}
