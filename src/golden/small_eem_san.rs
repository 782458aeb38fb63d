//! Traces of a small random EEM-SAN: every chip step of some control ticks, holds included.

use std::sync::{Arc, Mutex};

use hw_model::engine::{Engine, SpikeRecord, Stimulus};
use hw_model::id::{CompartmentIdx, CoreId};
use hw_model::trace::{Detail, Observer, engines, total_lines};
use hw_model::{CoreMap, Faults, OpCounts, compartment::CompartmentState};

use crate::golden::GoldenError;
use crate::golden::head::Head;
use crate::golden::network_loop::{Run, action_text};
use crate::host::{Deployment, EemSanChipPolicy};
use crate::net::eem_san::{FRAMES_PER_TICK, KERNEL, ROBOT_STATE};
use crate::net::{
    Branch, ConvLayer, EemSan, EncoderKind, EventEncoder, Layer, PopulationCode, Readout, StateCode,
};
use crate::policy::{EventFrame, FRAME_COLUMNS, Observation, Policy as _};
use crate::rng::{Draw, Streams, stream};

/// Name of the network in traces.
pub(super) const NAME: &str = "small-eem-san";

/// Channels of the encoder, from the event frame on.
const CHANNELS: [usize; 4] = [1, 1, 2, 1];
/// Numbers of the DVS state, neurons per dimension of the codes, neurons of the layers.
const LATENT: usize = 4;
const CODE: usize = 3;
const FUSED: usize = 5;
const HIDDEN: usize = 7;
/// T.
const STEPS: u32 = 5;
/// Events per frame.
const EVENTS: usize = 400;

/// The trace through every engine, the dense reference first.
pub(super) fn run_all(head: &Head) -> Result<Vec<Run>, GoldenError> {
    let policy = head.quantization()?;
    let network = network(&mut Streams::new(head.seed, 0).at(stream::STIMULUS, 0));
    let schedule = head.schedule.unwrap_or_default();
    let (chip, split) = (&head.chip, head.split);
    let deployment = Deployment::compile_eem_san(&network, &policy, chip, split, schedule)
        .map_err(|error| head.compile_error(error))?;
    let run = |(name, engine): (&str, Box<dyn Engine>)| {
        (name.to_owned(), run_ticks(head, &deployment, engine))
    };
    Ok(engines(&deployment.map).into_iter().map(run).collect())
}

/// Control ticks of two episodes, half of them each: a line for each step and core, and the action.
fn run_ticks(head: &Head, deployment: &Deployment, engine: Box<dyn Engine>) -> Vec<String> {
    let lines = Arc::new(Mutex::new(vec![format!("map {}", deployment.map.digest())]));
    let push = |line: String| lines.lock().expect("no panic while held").push(line);
    let observer = Observer::new(engine.as_ref(), Detail::Step);
    let observed = Observed { engine, observer, lines: Arc::clone(&lines) };
    let mut policy = EemSanChipPolicy::new(deployment, Box::new(observed)).expect("an EEM-SAN");
    for tick in 0..head.count {
        if tick == 0 || tick == head.count.div_ceil(2) {
            policy.start_trial(Streams::new(head.seed, tick));
        }
        let mut draw = Streams::new(head.seed, 1).at(stream::STIMULUS, tick);
        let frames = (0..FRAMES_PER_TICK).map(|_| EventFrame::random(&mut draw, EVENTS));
        let frames = frames.collect();
        let action = policy.act(&Observation::random(&mut draw, frames), tick);
        push(format!("tick={tick:04} {}", action_text(action, STEPS)));
    }
    let totals = total_lines(policy.engine());
    drop(policy);
    let mut lines = Arc::into_inner(lines).expect("the engine is gone").into_inner().expect("same");
    lines.extend(totals);
    lines
}

/// Writes down every step of an engine.
struct Observed {
    engine: Box<dyn Engine>,
    observer: Observer,
    lines: Arc<Mutex<Vec<String>>>,
}

impl Engine for Observed {
    fn map(&self) -> &CoreMap {
        self.engine.map()
    }

    fn now(&self) -> u64 {
        self.engine.now()
    }

    fn run(&mut self, stimulus: &Stimulus, record: &mut SpikeRecord) {
        let lines = self.observer.step_recorded(self.engine.as_mut(), stimulus, record);
        self.lines.lock().expect("no panic while held").extend(lines);
    }

    fn state(&self, core: CoreId, compartment: CompartmentIdx) -> CompartmentState {
        self.engine.state(core, compartment)
    }

    fn core_counts(&self) -> Vec<OpCounts> {
        self.engine.core_counts()
    }

    fn total_counts(&self) -> OpCounts {
        self.engine.total_counts()
    }

    fn chip_time_ps(&self) -> &[u64] {
        self.engine.chip_time_ps()
    }

    fn slowest_ps(&self) -> &[u64] {
        self.engine.slowest_ps()
    }

    fn reset(&mut self) {
        self.engine.reset();
    }

    fn reset_cores(&mut self, cores: &[CoreId], spikes: bool) {
        self.engine.reset_cores(cores, spikes);
    }

    fn set_held(&mut self, cores: &[CoreId], held: bool) {
        self.engine.set_held(cores, held);
    }

    fn set_faults(&mut self, faults: Faults) {
        self.engine.set_faults(faults);
    }

    fn count_host_reads(&mut self, n: u64) {
        self.engine.count_host_reads(n);
    }
}

/// Weights at which every layer spikes now and then.
fn network(draw: &mut Draw) -> EemSan {
    let (mut layers, mut side) = (Vec::new(), FRAME_COLUMNS);
    for (index, channels) in CHANNELS.windows(2).enumerate() {
        let (inputs, outputs) = (channels[0], channels[1]);
        layers.push(ConvLayer {
            name: format!("encoder.{}", index + 1),
            inputs,
            outputs,
            side,
            weights: uniform(draw, outputs * inputs * KERNEL * KERNEL, -0.05, 0.08),
            bias: uniform(draw, outputs, -0.01, 0.01),
        });
        side /= 2;
    }
    let inputs = side * side * CHANNELS[CHANNELS.len() - 1];
    let bias = vec![0.0; LATENT];
    let readout = Readout { weights: uniform(draw, LATENT * inputs, -0.5, 0.5), bias };
    let (kind, threshold) = (EncoderKind::Hsvae, 0.1);
    let (keep_current, keep_voltage) = (0.5, 0.75);
    let encoder = EventEncoder { kind, layers, threshold, keep_current, keep_voltage, readout };
    let laser = branch(draw, "fuse.laser", ROBOT_STATE);
    let dvs = branch(draw, "fuse.dvs", LATENT);
    let decision = vec![
        dense(draw, "decision.1", FUSED, HIDDEN, [-0.2, 0.3]),
        dense(draw, "decision.2", HIDDEN, 2, [-0.2, 0.3]),
    ];
    let (name, encoder, dvs) = (NAME.to_owned(), Some(encoder), Some(dvs));
    EemSan { name, steps: STEPS, encoder, told: false, laser, dvs, decision, dynamic: None }
}

fn branch(draw: &mut Draw, name: &str, dimensions: usize) -> Branch {
    let code = PopulationCode {
        neurons: CODE,
        mean: uniform(draw, dimensions * CODE, -1.0, 1.0),
        deviation: uniform(draw, dimensions * CODE, 0.2, 0.6),
    };
    let layer = dense(draw, name, dimensions * CODE, FUSED, [-0.1, 0.15]);
    Branch { code: StateCode::Population(code), layer: Some(layer) }
}

fn dense(draw: &mut Draw, name: &str, inputs: usize, neurons: usize, range: [f64; 2]) -> Layer {
    Layer {
        name: name.to_owned(),
        inputs,
        neurons,
        weights: uniform(draw, inputs * neurons, range[0], range[1]),
        bias: uniform(draw, neurons, -0.05, 0.05),
        keep_current: 0.5,
        keep_voltage: 0.75,
        threshold: 0.3,
    }
}

fn uniform(draw: &mut Draw, n: usize, low: f64, high: f64) -> Vec<f32> {
    (0..n).map(|_| draw.uniform_in(low, high) as f32).collect()
}
