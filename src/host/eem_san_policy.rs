//! EEM-SAN on the emulated chip, as a driver.

use hw_model::compartment::{CompartmentParams, CompartmentState, Widths, voltage_before_reset};
use hw_model::engine::{SpikeRecord, Stimulus};
use hw_model::id::{CompartmentIdx, CoreId};
use hw_model::{CoreMap, Engine, OpCounts};

use crate::coding::{InputSpikes, LayerSpikes, decode, population_spikes, robot_state};
use crate::host::chip_policy::{ChipUse, HostCounts};
use crate::host::deployment::Deployment;
use crate::host::eem_san_program::{EemSanProgram, EncoderPhase, Injected, Window};
use crate::policy::{Action, EventFrame, Observation, Policy};
use crate::rng::{Streams, stream};

/// Drives with a compiled EEM-SAN on an engine. The encoder keeps its state for an episode.
pub struct EemSanChipPolicy {
    engine: Box<dyn Engine>,
    program: EemSanProgram,
    /// Cores of each population.
    cores: Vec<Vec<CoreId>>,
    latent: Vec<LatentSite>,
    widths: Widths,
    /// Which cores the management processor holds now.
    held: Vec<bool>,
    streams: Streams,
    /// Whether spikes of all layers are kept.
    watches: bool,
    seen: LayerSpikes,
    dvs_state: Vec<f32>,
    used: ChipUse,
}

/// Where a neuron of the encoder's last layer lies.
#[derive(Debug, Clone, Copy)]
struct LatentSite {
    core: CoreId,
    compartment: CompartmentIdx,
    params: CompartmentParams,
}

impl std::fmt::Debug for EemSanChipPolicy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut f = f.debug_struct("EemSanChipPolicy");
        f.field("decisions", &self.used.decisions).finish_non_exhaustive()
    }
}

impl EemSanChipPolicy {
    /// A driver on `engine`, which must run the map of `deployment`; `None` when that is not an
    /// EEM-SAN.
    pub fn new(deployment: &Deployment, engine: Box<dyn Engine>) -> Option<Self> {
        let program = deployment.eem_san.clone()?;
        let map = engine.map();
        Some(Self {
            cores: (0..map.populations().len()).map(|p| cores_of(map, p)).collect(),
            latent: latent_sites(map, &program),
            widths: Widths::new(&map.chip().arithmetic),
            held: vec![false; map.cores().len()],
            streams: Streams::new(0, 0),
            watches: false,
            seen: LayerSpikes::new(),
            dvs_state: Vec::new(),
            used: ChipUse::default(),
            program,
            engine,
        })
    }

    /// Whether it takes the frames of an event camera.
    pub fn takes_frames(&self) -> bool {
        self.program.encoder.is_some()
    }

    /// [`Policy::act`], and the spikes of every layer in its window: encoder, branches, decision
    /// module.
    ///
    /// Panics as `act` does.
    pub fn act_watched(&mut self, observation: &Observation, tick: u64) -> (Action, LayerSpikes) {
        self.watch(true);
        let action = self.act(observation, tick);
        let seen = self.take_spikes();
        self.watch(false);
        (action, seen)
    }

    /// The DVS state of the last tick; empty without an encoder.
    pub fn dvs_state(&self) -> &[f32] {
        &self.dvs_state
    }

    /// The engine, to look at.
    pub fn engine(&self) -> &dyn Engine {
        self.engine.as_ref()
    }

    /// Whether to keep the spikes of all layers from now on.
    pub fn watch(&mut self, on: bool) {
        self.watches = on;
    }

    /// The kept spikes: a layer for each window that has passed, in the order of the program.
    pub fn take_spikes(&mut self) -> LayerSpikes {
        std::mem::take(&mut self.seen)
    }

    /// The encoder's phase of a control tick: voltages of its last layer in its last step, before
    /// spikes reset them, in chip units. Empty without an encoder.
    ///
    /// Shapes: one frame for each step of a window.
    pub fn encode(&mut self, frames: &[EventFrame]) -> Vec<i32> {
        let Some(phase) = self.program.encoder.clone() else { return Vec::new() };
        let (start, counted) = (self.engine.now(), self.engine.core_counts());
        let mut record = self.record(None);
        let mut before = Vec::new();
        for step in 0..phase.chip_steps {
            self.release_only(&phase.layers, |window| window.holds(step, phase.frames));
            if step + 1 == phase.chip_steps {
                before = self.latent.iter().map(|at| self.state(at)).collect();
            }
            let injected = self.program.frames_at(&phase, frames, step);
            self.step(injected, &mut record);
        }
        let after = self.latent.iter().map(|at| self.state(at).current);
        let voltages = self.latent.iter().zip(&before).zip(after);
        let voltages = voltages
            .map(|((at, before), after)| {
                voltage_before_reset(&at.params, &self.widths, *before, after)
            })
            .collect();
        // Voltages before the last step, currents after it.
        self.engine.count_host_reads(2 * self.latent.len() as u64);
        self.keep(&phase.layers, phase.frames, start, &record);
        self.count_phase(&phase, &counted);
        voltages
    }

    /// One decision from cleared state: spike counts of the output neurons.
    ///
    /// Shapes: `inputs[branch][step][line]`, T steps.
    pub fn decide(&mut self, inputs: &[InputSpikes]) -> Vec<u32> {
        let output = self.program.output();
        let windows = self.program.decision.clone();
        self.release_only(&windows, |_| true);
        let mut record = self.record(Some(output.population as usize));
        let start = self.engine.now();
        let mut before = self.engine.core_counts();
        for step in 0..self.program.decision_steps {
            let injected = self.program.codes_at(inputs, step);
            self.step(injected, &mut record);
            let after = self.engine.core_counts();
            for window in windows.iter().filter(|w| w.holds(step, self.program.steps)) {
                for core in &self.cores[window.population as usize] {
                    self.used.windowed += &(after[core.index()] - before[core.index()]);
                }
            }
            before = after;
        }
        self.keep(&windows, self.program.steps, start, &record);
        let counts = self.count_output(&record, start, output);
        self.engine.count_host_reads(counts.len() as u64);
        // Now, not before the next decision: spikes under way would arrive at held cores.
        self.engine.reset_cores(&self.cores_of(&windows));
        self.used.decisions += 1;
        counts
    }

    /// Everything since the policy was made.
    pub fn chip_use(&self) -> ChipUse {
        ChipUse {
            counts: self.engine.total_counts(),
            time_ps: self.engine.chip_time_ps().to_vec(),
            ..self.used.clone()
        }
    }

    fn record(&self, population: Option<usize>) -> SpikeRecord {
        match population {
            _ if self.watches => SpikeRecord::all(self.engine.map()),
            Some(population) => SpikeRecord::of_population(self.engine.map(), population),
            None => SpikeRecord::none(),
        }
    }

    fn step(&mut self, injected: Injected, record: &mut SpikeRecord) {
        let stimulus = Stimulus::new(self.engine.map(), 1, injected)
            .expect("the program was checked against the map");
        self.engine.run(&stimulus, record);
    }

    fn state(&self, at: &LatentSite) -> CompartmentState {
        self.engine.state(at.core, at.compartment)
    }

    fn cores_of(&self, windows: &[Window]) -> Vec<CoreId> {
        let cores = windows.iter().flat_map(|window| &self.cores[window.population as usize]);
        cores.copied().collect()
    }

    /// Lets the cores of those `windows` work for which `open` says so, and holds all others. A
    /// laser-only network has one phase and holds nothing.
    fn release_only(&mut self, windows: &[Window], open: impl Fn(&Window) -> bool) {
        if self.program.encoder.is_none() {
            return;
        }
        let mut held = vec![true; self.held.len()];
        for window in windows.iter().filter(|window| open(window)) {
            self.cores[window.population as usize].iter().for_each(|c| held[c.index()] = false);
        }
        for wanted in [true, false] {
            let changes = |core: &usize| held[*core] == wanted && self.held[*core] != wanted;
            let cores: Vec<CoreId> =
                (0..held.len()).filter(changes).map(|core| CoreId(core as u16)).collect();
            if !cores.is_empty() {
                self.engine.set_held(&cores, wanted);
            }
        }
        self.held = held;
    }

    /// All that the encoder's cores do is within their windows, as they are held outside.
    fn count_phase(&mut self, phase: &EncoderPhase, before: &[OpCounts]) {
        let after = self.engine.core_counts();
        for core in self.cores_of(&phase.layers).iter().map(|core| core.index()) {
            let done = after[core] - before[core];
            self.used.windowed += &done;
            self.used.encoder += &done;
        }
    }

    /// Keeps what the populations of `windows` did in their windows.
    fn keep(&mut self, windows: &[Window], len: u32, start: u64, record: &SpikeRecord) {
        if !self.watches {
            return;
        }
        let spikes = record.by_population(self.engine.map());
        for window in windows {
            let open = start + u64::from(window.start);
            let mut steps = vec![Vec::new(); len as usize];
            for (step, neuron) in &spikes[window.population as usize] {
                let at = step.checked_sub(open).and_then(|at| steps.get_mut(at as usize));
                at.into_iter().for_each(|step| step.push(*neuron));
            }
            self.seen.push(steps);
        }
    }

    fn count_output(&self, record: &SpikeRecord, start: u64, output: Window) -> Vec<u32> {
        let population = &self.engine.map().populations()[output.population as usize];
        let mut counts = vec![0; population.len()];
        let steps = self.program.steps;
        for spike in &record.spikes {
            let neuron = population.neuron_at(spike.core, spike.compartment);
            if let Some(neuron) =
                neuron.filter(|_| output.holds((spike.step - start) as u32, steps))
            {
                counts[neuron] += 1;
            }
        }
        counts
    }

    /// Code of a state, as spikes.
    fn code(&mut self, branch: usize, state: &[f32], name: &str, tick: u64) -> InputSpikes {
        let code = self.program.codes().nth(branch).expect("a code for each branch");
        let activity = code.activity(state);
        self.used.host += &HostCounts {
            gaussians: activity.len() as u64,
            draws: activity.len() as u64 * u64::from(self.program.steps),
            ..HostCounts::default()
        };
        population_spikes(&activity, self.program.steps, &mut self.streams.at(name, tick))
    }

    /// The DVS state: `mu` of the voltages, in the float network's units.
    fn latent_state(&mut self, voltages: &[i32]) -> Vec<f32> {
        let phase = self.program.encoder.as_ref().expect("asked for with an encoder only");
        let scaled: Vec<f32> =
            voltages.iter().map(|v| (f64::from(*v) / phase.voltage_unit) as f32).collect();
        self.used.host.readout_macs += phase.readout.weights.len() as u64;
        phase.readout.apply(&scaled)
    }
}

fn cores_of(map: &CoreMap, population: usize) -> Vec<CoreId> {
    let slices = map.populations()[population].slices.iter();
    let mut cores: Vec<CoreId> = slices.map(|slice| slice.core).collect();
    cores.sort_unstable();
    cores.dedup();
    cores
}

fn latent_sites(map: &CoreMap, program: &EemSanProgram) -> Vec<LatentSite> {
    let Some(last) = program.encoder.as_ref().and_then(|phase| phase.layers.last()) else {
        return Vec::new();
    };
    let mut sites = Vec::new();
    for slice in &map.populations()[last.population as usize].slices {
        let params = map.cores()[slice.core.index()].params(&map.chip().arithmetic);
        for at in slice.first.0..slice.first.0 + slice.len {
            let (core, compartment) = (slice.core, CompartmentIdx(at));
            sites.push(LatentSite { core, compartment, params: params[compartment.index()] });
        }
    }
    sites
}

impl Policy for EemSanChipPolicy {
    fn start_trial(&mut self, streams: Streams) {
        self.streams = streams;
        self.engine.reset();
    }

    /// Panics when the network has an encoder and the observation not five frames: whoever starts
    /// the trial gives it a camera.
    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let state = robot_state(observation);
        let mut inputs = vec![self.code(0, &state, stream::LASER_POPULATION, tick)];
        if let Some(phase) = &self.program.encoder {
            let frames = &observation.frames;
            assert_eq!(frames.len(), phase.frames as usize, "event frames at tick {tick}");
            let voltages = self.encode(frames);
            let state = self.latent_state(&voltages);
            inputs.push(self.code(1, &state, stream::DVS_POPULATION, tick));
            self.dvs_state = state;
        }
        decode(&self.decide(&inputs), self.program.steps)
    }
}
