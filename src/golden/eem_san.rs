//! Traces of a trained EEM-SAN: what its layers did in each control tick, in the loop or on random
//! observations.

use hw_model::container::sha256_hex;
use hw_model::trace::{engines, total_lines};

use crate::closed_loop::TrialConfig;
use crate::coding::LayerSpikes;
use crate::golden::GoldenError;
use crate::golden::head::{Head, Kind, LoopDriver};
use crate::golden::network_loop::{Pilot, Run, action_text, run_loop};
use crate::host::{Deployment, EemSanChipPolicy};
use crate::net::EemSan;
use crate::net::eem_san::FRAMES_PER_TICK;
use crate::policy::{Action, EventFrame, Observation, Policy as _};
use crate::reference::EemSanPolicy;
use crate::rng::{Streams, stream};
use crate::world::dvs::CameraConfig;

/// Marked pixels per random frame.
const EVENTS: usize = 600;

/// The trace through the event engine on several numbers of threads, or the float network alone.
/// The dense engine would take minutes for a network of this size; the small one has it.
pub(super) fn run_all(head: &Head, network: &EemSan) -> Result<Vec<Run>, GoldenError> {
    if (head.kind, head.driver) == (Kind::Loop, LoopDriver::Float) {
        let mut pilot =
            Watched::new(network, Watchable::Float(Box::new(EemSanPolicy::new(network))));
        return Ok(vec![(
            "float".to_owned(),
            run_loop(head, &config(network), &mut pilot, network.steps)?,
        )]);
    }
    let policy = head.quantization()?;
    let schedule = head.schedule.unwrap_or_default();
    let (chip, split) = (&head.chip, head.split);
    let deployment = Deployment::compile_eem_san(network, &policy, chip, split, schedule)
        .map_err(|error| head.compile_error(error))?;
    let mut runs = Vec::new();
    for (name, engine) in engines(&deployment.map).into_iter().skip(1) {
        let policy = EemSanChipPolicy::new(&deployment, engine).expect("an EEM-SAN");
        let mut pilot = Watched::new(network, Watchable::Chip(Box::new(policy)));
        let mut lines = vec![format!("map {}", deployment.map.digest())];
        lines.extend(match head.kind {
            Kind::Loop => run_loop(head, &config(network), &mut pilot, network.steps)?,
            Kind::Network => pilot.run_ticks(head),
        });
        lines.extend(pilot.totals());
        runs.push((name.to_owned(), lines));
    }
    Ok(runs)
}

/// EEM-SAN's settings, with a camera when the network takes frames, told of movers when it is.
fn config(network: &EemSan) -> TrialConfig {
    let camera = network.encoder.is_some().then(CameraConfig::default);
    TrialConfig { camera, told: network.told, ..TrialConfig::eem_san(1.0) }
}

/// A driver whose layers can be watched.
enum Watchable {
    Float(Box<EemSanPolicy>),
    Chip(Box<EemSanChipPolicy>),
}

struct Watched {
    driver: Watchable,
    names: Vec<String>,
    n_encoder: usize,
    steps: u32,
}

impl Watched {
    fn new(network: &EemSan, driver: Watchable) -> Self {
        let names = network.layers().into_iter().map(|(name, _)| name.to_owned()).collect();
        let n_encoder = network.encoder.as_ref().map_or(0, |encoder| encoder.layers.len());
        Self { driver, names, n_encoder, steps: network.steps }
    }

    fn act_watched(&mut self, observation: &Observation, tick: u64) -> (Action, LayerSpikes) {
        match &mut self.driver {
            Watchable::Float(policy) => policy.act_watched(observation, tick),
            Watchable::Chip(policy) => policy.act_watched(observation, tick),
        }
    }

    /// Control ticks of one episode on random observations: a line for each layer and step.
    fn run_ticks(&mut self, head: &Head) -> Vec<String> {
        self.start_trial(Streams::new(head.seed, 0));
        let mut lines = Vec::new();
        for tick in 0..head.count {
            let mut draw = Streams::new(head.seed, 1).at(stream::STIMULUS, tick);
            let frames = if self.n_encoder > 0 { FRAMES_PER_TICK } else { 0 };
            let frames = (0..frames).map(|_| EventFrame::random(&mut draw, EVENTS)).collect();
            let observation = Observation::random(&mut draw, frames);
            let (action, layers) = self.act_watched(&observation, tick);
            for (name, steps) in self.names.iter().zip(&layers) {
                lines.extend(steps.iter().enumerate().map(|(step, spikes)| {
                    let (n, sha) = (spikes.len(), digest([spikes]));
                    format!("tick={tick:04} layer={name} step={step} spikes={n:05} sha={sha}")
                }));
            }
            lines.push(self.state_line(tick));
            lines.push(format!("tick={tick:04} {}", action_text(action, self.steps)));
        }
        lines
    }

    /// The DVS state in thousandths.
    fn state_line(&self, tick: u64) -> String {
        let state = match &self.driver {
            Watchable::Float(policy) => policy.dvs_state(),
            Watchable::Chip(policy) => policy.dvs_state(),
        };
        let milli = |value: &f32| libm::roundf(value * 1000.0) as i32;
        let bytes: Vec<u8> = state.iter().flat_map(|value| milli(value).to_le_bytes()).collect();
        format!("tick={tick:04} state={}", &sha256_hex(&bytes)[..16])
    }

    /// Counters and time, of a chip.
    fn totals(&self) -> Vec<String> {
        match &self.driver {
            Watchable::Float(_) => Vec::new(),
            Watchable::Chip(policy) => total_lines(policy.engine()),
        }
    }
}

impl Pilot for Watched {
    fn start_trial(&mut self, streams: Streams) {
        match &mut self.driver {
            Watchable::Float(policy) => policy.start_trial(streams),
            Watchable::Chip(policy) => policy.start_trial(streams),
        }
    }

    /// Beside the action a line for the encoder, one for its state and one for the decision.
    fn act(&mut self, observation: &Observation, tick: u64) -> (Action, Vec<String>) {
        let (action, layers) = self.act_watched(observation, tick);
        let (encoder, decision) = layers.split_at(self.n_encoder);
        let line = |part: &str, layers: &[Vec<Vec<u32>>]| {
            let spikes =
                |layer: &Vec<Vec<u32>>| layer.iter().map(Vec::len).sum::<usize>().to_string();
            let spikes: Vec<String> = layers.iter().map(spikes).collect();
            let sha = digest(layers.iter().flatten());
            format!("tick={tick:04} {part} spikes={} sha={sha}", spikes.join(","))
        };
        let mut lines = Vec::new();
        if self.n_encoder > 0 {
            lines.extend([line("encoder", encoder), self.state_line(tick)]);
        }
        lines.push(line("decision", decision));
        (action, lines)
    }
}

/// 16 digits of SHA-256 over the spikes of some steps: their number, then the neurons, as
/// little-endian u32.
fn digest<'a>(steps: impl IntoIterator<Item = &'a Vec<u32>>) -> String {
    let mut bytes = Vec::new();
    for spikes in steps {
        bytes.extend((spikes.len() as u32).to_le_bytes());
        bytes.extend(spikes.iter().flat_map(|neuron| neuron.to_le_bytes()));
    }
    sha256_hex(&bytes)[..16].to_owned()
}
