//! A trial in flight.

use nalgebra::Point2;

use super::config::Setting;
use super::mover_map::mover_map;
use super::{ConfigError, End, MoverContact, Outcome, TrialConfig, TrialOutcome};
use crate::policy::{Action, EventFrame, Observation, Policy};
use crate::rng::{Streams, stream};
use crate::world::dvs::EventCamera;
use crate::world::geometry::{COORDINATE_M_MAX, Pose};
use crate::world::laser::Laser;
use crate::world::robot::{Robot, Twist};
use crate::world::{PHYSICS_STEP_S, World};

/// Share of noise in a noisy action (SAN evaluation).
const ACTION_NOISE_SHARE: f64 = 0.01;

/// Robot, clock and end of one trial.
#[derive(Debug, Clone)]
pub struct Trial<'w> {
    world: &'w World,
    config: TrialConfig,
    streams: Streams,
    laser: Laser,
    robot: Robot,
    goal: Point2<f64>,
    ticks: u64,
    steps: u64,
    decisions: u64,
    end: Option<End>,
    trajectory: Vec<[i32; 3]>,
    camera: Option<EventCamera<'w>>,
    frames: Vec<EventFrame>,
}

impl<'w> Trial<'w> {
    /// The robot at rest at `start`. A trial that starts at its goal or in contact has ended.
    ///
    /// Errors: [`ConfigError`] for a setting, a start or a goal outside of its limits.
    pub fn new(
        world: &'w World,
        start: Pose,
        goal: Point2<f64>,
        config: &TrialConfig,
        streams: Streams,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        check_ends(&start, goal)?;
        let camera = |camera| EventCamera::new(world, camera, streams, &start);
        let camera = config.camera.as_ref().map(camera).transpose()?;
        let blank = if camera.is_some() { config.steps_per_tick() as usize } else { 0 };
        let mut trial = Self {
            world,
            config: config.clone(),
            streams,
            laser: Laser::new(config.laser_noise_m),
            robot: Robot::new(start, config.actuators),
            goal,
            ticks: 0,
            steps: 0,
            decisions: 0,
            end: None,
            trajectory: vec![start.rounded_mm_mrad()],
            camera,
            frames: vec![EventFrame::default(); blank],
        };
        trial.end = trial.at_goal().or_else(|| trial.in_contact());
        Ok(trial)
    }

    /// One control tick: sensors, policy, wheels, physics. Does nothing after the end.
    pub fn tick(&mut self, policy: &mut dyn Policy) {
        self.tick_with(policy, |_, _| {});
    }

    /// As [`Self::tick`], and `observe` sees every physics step as in [`Self::drive_with`].
    pub fn tick_with(&mut self, policy: &mut dyn Policy, observe: impl FnMut(u64, &Pose)) {
        if self.end.is_some() {
            return;
        }
        let observation = self.observe();
        let action = policy.act(&observation, self.ticks);
        self.decisions += 1;
        self.drive_with(action, observe);
    }

    /// What the robot senses now. The same for any number of calls within a tick.
    pub fn observe(&self) -> Observation {
        let pose = self.robot.pose();
        let twist = self.robot.twist();
        let mut noise = self.streams.at(stream::LASER_NOISE, self.ticks);
        let mut laser_m = self.laser.front_m(self.world, self.steps, &pose, &mut noise);
        if let Some(fault) = self.config.laser_fault {
            fault.apply(&mut laser_m, &mut self.streams.at(stream::LASER_FAULT, self.ticks));
        }
        Observation {
            goal_direction_rad: pose.bearing_rad(self.goal),
            goal_distance_m: self.goal_distance_m(),
            linear_m_per_s: twist.linear_m_per_s.abs(),
            angular_rad_per_s: twist.angular_rad_per_s,
            laser_m,
            wheel_speed_m_per_s_max: self.config.wheel_speed_m_per_s_max,
            frames: self.frames.clone(),
            told: if self.config.told { mover_map(self) } else { Vec::new() },
        }
    }

    /// Lets `action` drive the wheels for one control tick, then looks for the end.
    ///
    /// Panics when a component of the action is not a number.
    pub fn drive(&mut self, action: Action) {
        self.drive_with(action, |_, _| {});
    }

    /// As [`Self::drive`], and after every physics step `observe` is called with the number of
    /// steps done and the robot's pose: sensors that are faster than the control tick, such as an
    /// event camera, look there.
    pub fn drive_with(&mut self, action: Action, mut observe: impl FnMut(u64, &Pose)) {
        let Action { left, right } = self.noisy(action);
        let command = Twist::of_wheels(left, right, self.config.wheel_speed_m_per_s_max);
        let steps_per_tick = self.config.steps_per_tick();
        self.frames.clear();
        for step in 1..=steps_per_tick {
            self.robot.step(command);
            self.steps += 1;
            if let Some(camera) = &mut self.camera {
                self.frames.push(camera.advance(&self.robot.pose()));
            }
            observe(self.steps, &self.robot.pose());
            let goal = if step == steps_per_tick { self.at_goal() } else { None };
            self.end = goal.or_else(|| self.in_contact());
            if self.end.is_some() {
                break;
            }
        }
        self.ticks += 1;
        self.trajectory.push(self.robot.pose().rounded_mm_mrad());
        if self.end.is_none() && self.ticks == self.config.ticks_max {
            self.end = Some(End::TimeOut);
        }
    }

    /// Why the trial stopped; `None` while it runs.
    pub fn end(&self) -> Option<&End> {
        self.end.as_ref()
    }

    /// Where it takes place.
    pub fn world(&self) -> &'w World {
        self.world
    }

    /// Its settings.
    pub fn config(&self) -> &TrialConfig {
        &self.config
    }

    /// Centre of the goal.
    pub fn goal(&self) -> Point2<f64> {
        self.goal
    }

    /// The robot.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Physics steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Control ticks done.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// `[x mm, y mm, yaw mrad]` at the beginning of every control tick and after the last.
    pub fn trajectory(&self) -> &[[i32; 3]] {
        &self.trajectory
    }

    /// Distance from the robot's centre to the goal.
    pub fn goal_distance_m(&self) -> f64 {
        (self.goal - self.robot.pose().position).norm()
    }

    /// The trial in numbers; one that still runs counts as out of time.
    pub fn into_outcome(self) -> TrialOutcome {
        let time_s = self.steps as f64 * PHYSICS_STEP_S;
        let path_m = self.robot.path_m();
        let end_goal_distance_m = self.goal_distance_m();
        let mover_contact = MoverContact::of(&self);
        let (outcome, hit) = match self.end {
            Some(End::Goal) => (Outcome::Success, None),
            Some(End::Hit(name)) => (Outcome::Collision, Some(name)),
            Some(End::TimeOut) | None => (Outcome::TimeOut, None),
        };
        TrialOutcome {
            outcome,
            hit,
            mover_contact,
            path_m,
            time_s,
            ticks: self.ticks,
            decisions: self.decisions,
            mean_speed_m_per_s: if time_s > 0.0 { path_m / time_s } else { 0.0 },
            end_goal_distance_m,
            trajectory: self.trajectory,
        }
    }

    /// The action that drives the wheels: mixed with noise if the trial is so, then clipped.
    fn noisy(&self, action: Action) -> Action {
        assert!(
            action.left.is_finite() && action.right.is_finite(),
            "policy returned {action:?} at tick {}",
            self.ticks
        );
        let mut draw = self.streams.at(stream::ACTION_NOISE, self.ticks);
        let mut mixed = |component: f64| {
            if !self.config.action_noise {
                return component.clamp(0.0, 1.0);
            }
            let noise = draw.gaussian();
            let kept = (1.0 - ACTION_NOISE_SHARE) * component;
            (kept + ACTION_NOISE_SHARE * noise).clamp(0.0, 1.0)
        };
        Action { left: mixed(action.left), right: mixed(action.right) }
    }

    fn at_goal(&self) -> Option<End> {
        (self.goal_distance_m() < self.config.goal_radius_m).then_some(End::Goal)
    }

    fn in_contact(&self) -> Option<End> {
        let nearest = self.world.nearest(self.robot.pose().position, self.steps)?;
        (nearest.distance_m < self.config.robot_radius_m).then(|| End::Hit(nearest.name.to_owned()))
    }
}

/// Errs when a coordinate of the start or the goal is not a number or too large.
fn check_ends(start: &Pose, goal: Point2<f64>) -> Result<(), ConfigError> {
    let coordinate =
        |name, value| Setting::new(name, -COORDINATE_M_MAX, COORDINATE_M_MAX).check(value);
    coordinate("start x (m)", start.position.x)?;
    coordinate("start y (m)", start.position.y)?;
    Setting::new("start yaw (rad)", -4.0, 4.0).check(start.yaw_rad)?;
    coordinate("goal x (m)", goal.x)?;
    coordinate("goal y (m)", goal.y)
}
