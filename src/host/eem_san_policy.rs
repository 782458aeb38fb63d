//! EEM-SAN on the emulated chip, as a driver.

use hw_model::compartment::{CompartmentParams, CompartmentState, Widths, voltage_before_reset};
use hw_model::core_map::Population;
use hw_model::engine::{SpikeRecord, Stimulus};
use hw_model::id::{CompartmentIdx, CoreId};
use hw_model::{CoreMap, Engine, OpCounts};

use crate::coding::{InputSpikes, LayerSpikes, decode, population_spikes, robot_state};
use crate::host::chip_policy::{ChipUse, HostCounts};
use crate::host::deployment::Deployment;
use crate::host::eem_san_program::{
    CodedPort, EemSanProgram, EncoderPhase, Injected, Schedule, Window,
};
use crate::host::watch::spikes_by_step;
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
    stream: Stream,
    used: ChipUse,
}

/// Where an episode that streams is.
#[derive(Debug, Clone, Default)]
struct Stream {
    /// Chip steps of the episode.
    steps: u64,
    /// Codes of the tick before, by branch.
    codes: Vec<InputSpikes>,
    /// (step of the episode, neuron) of the output's latest spikes.
    outputs: Vec<(u64, usize)>,
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
            cores: map.populations().iter().map(Population::cores).collect(),
            latent: latent_sites(map, &program),
            widths: Widths::new(&map.chip().arithmetic),
            held: vec![false; map.cores().len()],
            streams: Streams::new(0, 0),
            watches: false,
            seen: LayerSpikes::new(),
            dvs_state: Vec::new(),
            stream: Stream::default(),
            used: ChipUse::default(),
            program,
            engine,
        })
    }

    /// Its schedule.
    pub fn schedule(&self) -> Schedule {
        self.program.schedule
    }

    /// Steps by which the populations are behind when it streams ([`EemSanProgram::delays`]).
    pub fn delays(&self) -> Vec<u64> {
        self.program.delays()
    }

    /// Lines of each code: robot and laser state, DVS state.
    pub fn code_lines(&self) -> Vec<usize> {
        self.program.codes().map(CodedPort::lines).collect()
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
        let voltages = self.latent_voltages(&before);
        self.keep(&phase.layers, phase.frames, start, &record);
        self.count_phase(&phase, &counted);
        if self.program.schedule == Schedule::HeldCleared {
            self.engine.reset_cores(&self.cores_of(&phase.layers), true);
        }
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
        self.engine.reset_cores(&self.cores_of(&windows), true);
        self.used.decisions += 1;
        counts
    }

    /// A control tick that streams: a chip step for each frame, with the codes of the tick before,
    /// if any. Voltages as by [`EemSanChipPolicy::encode`], and the spike counts of the newest
    /// decision that is complete. Watched spikes are those of all populations in these steps.
    ///
    /// Panics without an encoder.
    pub fn stream(&mut self, frames: &[EventFrame], codes: &[InputSpikes]) -> (Vec<i32>, Vec<u32>) {
        let phase = self.program.encoder.clone().expect("streaming has an encoder");
        let (windows, output) = (self.program.decision.clone(), self.program.output());
        let (start, counted) = (self.engine.now(), self.engine.core_counts());
        let begun = self.stream.steps;
        let mut record = self.record(Some(output.population as usize));
        let mut before = Vec::new();
        for frame in frames {
            let step = self.stream.steps;
            self.clear_windows(&windows, step);
            before = self.latent.iter().map(|at| self.state(at)).collect();
            let injected = self.program.streamed_at(&phase, frame, codes, step);
            self.step(injected, &mut record);
            self.stream.steps += 1;
        }
        let voltages = self.latent_voltages(&before);
        let every = |population| Window { population, start: 0 };
        let populations: Vec<Window> = (0..self.cores.len() as u32).map(every).collect();
        self.keep(&populations, frames.len() as u32, start, &record);
        self.count_stream(&phase, &counted);
        self.take_outputs(&record, start, begun, output);
        (voltages, self.streamed_counts(output))
    }

    /// Clears layers whose next window begins; what is under way belongs to it.
    fn clear_windows(&mut self, windows: &[Window], step: u64) {
        let begins = |window: &&Window| {
            let late = step.checked_sub(self.program.streamed_start(window));
            late.is_some_and(|late| late % u64::from(self.program.steps) == 0)
        };
        let beginning: Vec<Window> = windows.iter().filter(begins).copied().collect();
        self.engine.reset_cores(&self.cores_of(&beginning), false);
    }

    fn count_stream(&mut self, phase: &EncoderPhase, before: &[OpCounts]) {
        let after = self.engine.core_counts();
        after.iter().zip(before).for_each(|(a, b)| self.used.windowed += &(*a - *b));
        for core in self.cores_of(&phase.layers).iter().map(|core| core.index()) {
            self.used.encoder += &(after[core] - before[core]);
        }
        self.used.decisions += 1;
    }

    /// Keeps the output's spikes as long as a window can still need them.
    fn take_outputs(&mut self, record: &SpikeRecord, start: u64, begun: u64, output: Window) {
        let population = &self.engine.map().populations()[output.population as usize];
        for spike in &record.spikes {
            if let Some(neuron) = population.neuron_at(spike.core, spike.compartment) {
                self.stream.outputs.push((begun + spike.step - start, neuron));
            }
        }
        let kept = self.stream.steps.saturating_sub(3 * u64::from(self.program.steps));
        self.stream.outputs.retain(|(step, _)| *step >= kept);
        self.engine.count_host_reads(population.len() as u64);
    }

    /// Counts of the newest window that is over; zeros before the first.
    fn streamed_counts(&self, output: Window) -> Vec<u32> {
        let population = &self.engine.map().populations()[output.population as usize];
        let mut counts = vec![0; population.len()];
        let (first, len) = (self.program.streamed_start(&output), u64::from(self.program.steps));
        let Some(windows) = self.stream.steps.checked_sub(first).map(|steps| steps / len) else {
            return counts;
        };
        if windows > 0 {
            let open = first + (windows - 1) * len;
            let within = |spike: &&(u64, usize)| (open..open + len).contains(&spike.0);
            self.stream.outputs.iter().filter(within).for_each(|(_, neuron)| counts[*neuron] += 1);
        }
        counts
    }

    /// Everything since the policy was made.
    pub fn chip_use(&self) -> ChipUse {
        ChipUse {
            counts: self.engine.total_counts(),
            by_core: self.engine.core_counts(),
            time_ps: self.engine.chip_time_ps().to_vec(),
            slowest_ps: self.engine.slowest_ps().to_vec(),
            ..self.used.clone()
        }
    }

    /// Voltages of the encoder's last layer in the last step, before spikes reset them: from the
    /// voltages before the step, which were read, and the currents after it.
    fn latent_voltages(&mut self, before: &[CompartmentState]) -> Vec<i32> {
        self.engine.count_host_reads(2 * self.latent.len() as u64);
        let sites = self.latent.iter().zip(before);
        let voltage = |(at, before): (&LatentSite, &CompartmentState)| {
            voltage_before_reset(&at.params, &self.widths, *before, self.state(at).current)
        };
        sites.map(voltage).collect()
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
            self.seen.push(spikes_by_step(&spikes[window.population as usize], open, len));
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
            gaussians: code.gaussians() as u64,
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
        self.stream = Stream::default();
        self.engine.reset();
    }

    /// Panics when the network has an encoder and the observation not five frames: whoever starts
    /// the trial gives it a camera.
    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let state = robot_state(observation);
        let mut inputs = vec![self.code(0, &state, stream::LASER_POPULATION, tick)];
        let streams = self.program.schedule == Schedule::Streaming;
        let mut counts = Vec::new();
        if let Some(phase) = &self.program.encoder {
            let frames = &observation.frames;
            assert_eq!(frames.len(), phase.frames as usize, "event frames at tick {tick}");
            let voltages = if streams {
                let codes = std::mem::take(&mut self.stream.codes);
                let (voltages, newest) = self.stream(frames, &codes);
                counts = newest;
                voltages
            } else {
                self.encode(frames)
            };
            let state = self.latent_state(&voltages);
            inputs.push(self.code(1, &state, stream::DVS_POPULATION, tick));
            self.dvs_state = state;
        }
        if streams {
            self.stream.codes = inputs;
        } else {
            counts = self.decide(&inputs);
        }
        decode(&counts, self.program.steps)
    }
}
