//! Running network and loop traces: the lines of their expectations.

use std::sync::Arc;

use hw_model::engine::Engine;
use hw_model::trace::{Detail, Observer, engines, total_lines};

use crate::closed_loop::{Trial, TrialConfig};
use crate::coding::InputSpikes;
use crate::golden::GoldenError;
use crate::golden::eem_san;
use crate::golden::head::{Head, Kind, LoopDriver};
use crate::golden::small_eem_san;
use crate::host::{ChipPolicy, DecisionProgram, Deployment};
use crate::net::{Controller, Network, builtin};
use crate::policy::{Action, Observation, Policy};
use crate::reference::FloatPolicy;
use crate::rng::{Streams, stream};
use crate::world::World;
use crate::world::arena::Arena;
use crate::world::pairs::{PairRules, generate_pairs};

/// Rate of the random input of network traces.
const INPUT_RATE: f64 = 0.3;

/// Name of an engine and the lines it gives.
pub(super) type Run = (String, Vec<String>);

/// The trace through every engine, the dense reference first.
pub(super) fn run_all(head: &Head) -> Result<Vec<Run>, GoldenError> {
    if (head.kind, head.network.as_str()) == (Kind::Network, small_eem_san::NAME) {
        return small_eem_san::run_all(head);
    }
    let network_error =
        |source| GoldenError::Network { file: head.file.clone(), source: Box::new(source) };
    let network = match builtin::open(&head.network, None).map_err(network_error)? {
        Controller::EemSan(network) => return eem_san::run_all(head, &network),
        Controller::Described(network) => network,
    };
    if head.schedule.is_some() {
        let message =
            format!("{}: schedule is for an EEM-SAN, and this is none; leave it out", head.network);
        return Err(GoldenError::Setting { file: head.file.clone(), message });
    }
    if head.kind == Kind::Loop && head.driver == LoopDriver::Float {
        let mut policy = FloatPolicy::new(&network);
        let lines = run_loop(head, &TrialConfig::san(), &mut Silent(&mut policy), network.steps)?;
        return Ok(vec![("float".to_owned(), lines)]);
    }
    let deployment = compile(head, &network)?;
    let program = deployment.program.clone().expect("a float network has a program");
    let mut runs = Vec::new();
    for (name, mut engine) in engines(&deployment.map) {
        let lines = match head.kind {
            Kind::Network => run_decisions(head, &program, engine.as_mut()),
            Kind::Loop => {
                let policy = ChipPolicy::new(&deployment, engine);
                let mut policy = policy.expect("it has a program");
                run_loop(head, &TrialConfig::san(), &mut Silent(&mut policy), network.steps)?
            }
        };
        runs.push((name.to_owned(), lines));
    }
    Ok(runs)
}

fn compile(head: &Head, network: &Network) -> Result<Deployment, GoldenError> {
    let policy = head.quantization()?;
    Deployment::compile(network, &policy, &head.chip, head.split)
        .map_err(|error| head.compile_error(error))
}

/// Decisions on random input, a line for each step and core.
fn run_decisions(head: &Head, program: &DecisionProgram, engine: &mut dyn Engine) -> Vec<String> {
    let map = Arc::new(engine.map().clone());
    let mut lines = vec![format!("map {}", map.digest())];
    let mut observer = Observer::new(engine, Detail::Step);
    for decision in 0..head.count {
        let input = random_input(head, program, &map, decision);
        engine.reset();
        for step in 0..program.chip_steps {
            let stimulus = program.stimulus(&map, &input, step);
            lines.extend(observer.step(engine, &stimulus));
        }
    }
    lines.extend(total_lines(engine));
    lines
}

fn random_input(
    head: &Head,
    program: &DecisionProgram,
    map: &hw_model::CoreMap,
    decision: u64,
) -> InputSpikes {
    let n_lines = map.ports()[program.input_port as usize].lines;
    let mut draw = Streams::new(head.seed, 0).at(stream::STIMULUS, decision);
    let mut step = || (0..n_lines).map(|_| draw.bernoulli(INPUT_RATE)).collect();
    (0..program.steps).map(|_| step()).collect()
}

/// Who drives in a loop.
pub(super) trait Pilot {
    fn start_trial(&mut self, streams: Streams);

    /// The action, and what there is to say about the tick beside it.
    fn act(&mut self, observation: &Observation, tick: u64) -> (Action, Vec<String>);
}

/// A driver with nothing to say.
struct Silent<'a>(&'a mut dyn Policy);

impl Pilot for Silent<'_> {
    fn start_trial(&mut self, streams: Streams) {
        self.0.start_trial(streams);
    }

    fn act(&mut self, observation: &Observation, tick: u64) -> (Action, Vec<String>) {
        (self.0.act(observation, tick), Vec::new())
    }
}

/// Control ticks of one trial: a line each with pose, speeds, nearest range and action, then what
/// the pilot says. Speed and actuators of `config` are the head's.
pub(super) fn run_loop(
    head: &Head,
    config: &TrialConfig,
    pilot: &mut dyn Pilot,
    steps: u32,
) -> Result<Vec<String>, GoldenError> {
    let file = || head.file.clone();
    let setting = |message: String| GoldenError::Setting { file: file(), message };
    let arena = Arena::open(&head.arena)
        .map_err(|source| GoldenError::Arena { file: file(), source: Box::new(source) })?;
    let world = World::new(arena);
    let n = head.trial as usize + 1;
    let pairs = generate_pairs(&world, n, PairRules::default(), Streams::new(head.seed, 0))
        .map_err(|e| setting(e.to_string()))?;
    let pair = pairs[head.trial as usize];
    let config = TrialConfig {
        wheel_speed_m_per_s_max: head.v_max_mm_per_s as f64 / 1000.0,
        actuators: head.actuators,
        ..config.clone()
    };
    let streams = Streams::new(head.seed, head.trial);
    let mut trial = Trial::new(&world, pair.start, pair.goal, &config, streams)
        .map_err(|e| setting(e.to_string()))?;
    pilot.start_trial(streams);
    let mut lines = Vec::new();
    for tick in 0..head.count {
        if trial.end().is_some() {
            break;
        }
        let observation = trial.observe();
        let (action, said) = pilot.act(&observation, tick);
        lines.push(tick_line(tick, &trial, &observation, action, steps));
        lines.extend(said);
        trial.drive(action);
    }
    lines.push(format!("end {:?}", trial.end()));
    Ok(lines)
}

fn tick_line(tick: u64, trial: &Trial<'_>, o: &Observation, action: Action, steps: u32) -> String {
    let [x, y, yaw] = trial.robot().pose().rounded_mm_mrad();
    let milli = |value: f64| libm::round(value * 1000.0) as i64;
    let nearest = o.laser_m.iter().copied().fold(f64::INFINITY, f64::min);
    format!(
        "tick={tick:04} x_mm={x:+06} y_mm={y:+06} yaw_mrad={yaw:+05} v_mm_s={:+05} w_mrad_s={:+05} \
         goal_mm={:05} near_mm={:05} {}",
        milli(o.linear_m_per_s),
        milli(o.angular_rad_per_s),
        milli(o.goal_distance_m),
        milli(nearest),
        action_text(action, steps)
    )
}

/// An action as spikes of T = `steps`.
pub(super) fn action_text(action: Action, steps: u32) -> String {
    let spikes = |rate: f64| libm::round(rate * f64::from(steps)) as i64;
    format!("left={:02} right={:02}", spikes(action.left), spikes(action.right))
}
