//! The emulated chip as a driver.

use hw_model::engine::SpikeRecord;
use hw_model::{Engine, OpCounts};

use crate::coding::{InputSpikes, LayerSpikes, decode, encode};
use crate::host::deployment::{DecisionProgram, Deployment};
use crate::host::watch::spikes_by_step;
use crate::policy::{Action, Observation, Policy};
use crate::rng::Streams;

/// What the chip did since it was last asked.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChipUse {
    /// Decisions made.
    pub decisions: u64,
    /// Everything, all steps, host operations included.
    pub counts: OpCounts,
    /// What each core did, in core order; barriers and host operations are in none.
    pub by_core: Vec<OpCounts>,
    /// What cores did within their own population's decision window: the operations of
    /// Algorithm 1, without what idle and trailing steps add.
    pub windowed: OpCounts,
    /// What the cores of an EEM-SAN's encoder did.
    pub encoder: OpCounts,
    /// What the host computed.
    pub host: HostCounts,
    /// Modelled chip time in picoseconds, one value for each cost table.
    pub time_ps: Vec<u64>,
    /// The part of it in which each core was the slowest, [cores, cost tables].
    pub slowest_ps: Vec<u64>,
}

/// Work of the host beside injecting spikes and reading counters, which the chip counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HostCounts {
    /// Multiplications with additions of the readout of the DVS state.
    pub readout_macs: u64,
    /// Gaussians of population codes.
    pub gaussians: u64,
    /// Random draws of codes.
    pub draws: u64,
}

impl HostCounts {
    /// Every counter with its name, in a fixed order.
    pub fn named(&self) -> [(&'static str, u64); 3] {
        [("readout_macs", self.readout_macs), ("gaussians", self.gaussians), ("draws", self.draws)]
    }
}

impl std::ops::AddAssign<&HostCounts> for HostCounts {
    fn add_assign(&mut self, other: &HostCounts) {
        self.readout_macs += other.readout_macs;
        self.gaussians += other.gaussians;
        self.draws += other.draws;
    }
}

impl std::ops::AddAssign<&ChipUse> for ChipUse {
    fn add_assign(&mut self, other: &ChipUse) {
        self.decisions += other.decisions;
        self.counts += &other.counts;
        let cores = self.by_core.len().max(other.by_core.len());
        self.by_core.resize(cores, OpCounts::default());
        self.by_core.iter_mut().zip(&other.by_core).for_each(|(sum, one)| *sum += one);
        self.windowed += &other.windowed;
        self.encoder += &other.encoder;
        self.host += &other.host;
        for (sums, others) in
            [(&mut self.time_ps, &other.time_ps), (&mut self.slowest_ps, &other.slowest_ps)]
        {
            sums.resize(sums.len().max(others.len()), 0);
            sums.iter_mut().zip(others).for_each(|(sum, one)| *sum += one);
        }
    }
}

/// Drives with a compiled network on an engine.
pub struct ChipPolicy {
    engine: Box<dyn Engine>,
    program: DecisionProgram,
    /// Population of each core, for the windows.
    population_of_core: Vec<Option<usize>>,
    streams: Streams,
    decisions: u64,
    windowed: OpCounts,
    host: HostCounts,
    /// Spikes of all layers in the last decision, if they are kept.
    seen: Option<LayerSpikes>,
}

impl std::fmt::Debug for ChipPolicy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChipPolicy").field("decisions", &self.decisions).finish_non_exhaustive()
    }
}

impl ChipPolicy {
    /// A driver on `engine`, which must run the map of `deployment`; `None` when the deployment
    /// has no encoder and decoder.
    pub fn new(deployment: &Deployment, engine: Box<dyn Engine>) -> Option<Self> {
        let program = deployment.program.clone()?;
        let map = engine.map();
        let mut population_of_core = vec![None; map.cores().len()];
        for (population, about) in map.populations().iter().enumerate() {
            about.slices.iter().for_each(|s| population_of_core[s.core.index()] = Some(population));
        }
        let streams = Streams::new(0, 0);
        let (windowed, host) = (OpCounts::default(), HostCounts::default());
        Some(Self {
            engine,
            program,
            population_of_core,
            streams,
            decisions: 0,
            windowed,
            host,
            seen: None,
        })
    }

    /// The engine, to look at.
    pub fn engine(&self) -> &dyn Engine {
        self.engine.as_ref()
    }

    /// [`Policy::act`], and the spikes of every layer in its window.
    pub fn act_watched(&mut self, observation: &Observation, tick: u64) -> (Action, LayerSpikes) {
        self.seen = Some(LayerSpikes::new());
        let action = self.act(observation, tick);
        (action, self.seen.take().unwrap_or_default())
    }

    /// One decision from cleared state: spike counts of the output neurons.
    ///
    /// Shapes: `input[step][line]`, T steps.
    pub fn decide(&mut self, input: &InputSpikes) -> Vec<u32> {
        self.engine.reset();
        let output = self.program.output as usize;
        let mut record = match self.seen {
            Some(_) => SpikeRecord::all(self.engine.map()),
            None => SpikeRecord::of_population(self.engine.map(), output),
        };
        let start = self.engine.now();
        let mut before = self.engine.core_counts();
        for step in 0..self.program.chip_steps {
            let stimulus = self.program.stimulus(self.engine.map(), input, step);
            self.engine.run(&stimulus, &mut record);
            let after = self.engine.core_counts();
            self.add_windowed(step, &before, &after);
            before = after;
        }
        let outputs = self.engine.map().populations()[output].len();
        self.engine.count_host_reads(outputs as u64);
        self.decisions += 1;
        self.keep(&record, start);
        self.count_output(&record, start, outputs)
    }

    fn add_windowed(&mut self, step: u32, before: &[OpCounts], after: &[OpCounts]) {
        let cores = self.population_of_core.iter().zip(before.iter().zip(after));
        for (population, (before, after)) in cores {
            if population.is_some_and(|population| self.program.in_window(population, step)) {
                self.windowed += &(*after - *before);
            }
        }
    }

    /// Keeps what every layer did in its window, if that is wanted.
    fn keep(&mut self, record: &SpikeRecord, start: u64) {
        let Some(seen) = &mut self.seen else { return };
        let spikes = record.by_population(self.engine.map());
        let windows = spikes.iter().zip(&self.program.window_starts);
        let steps = self.program.steps;
        *seen =
            windows.map(|(s, open)| spikes_by_step(s, start + u64::from(*open), steps)).collect();
    }

    fn count_output(&self, record: &SpikeRecord, start: u64, outputs: usize) -> Vec<u32> {
        let population = &self.engine.map().populations()[self.program.output as usize];
        let open = start + u64::from(self.program.output_start());
        let window = open..open + u64::from(self.program.steps);
        let mut counts = vec![0; outputs];
        for spike in record.spikes.iter().filter(|spike| window.contains(&spike.step)) {
            if let Some(neuron) = population.neuron_at(spike.core, spike.compartment) {
                counts[neuron] += 1;
            }
        }
        counts
    }

    /// Everything since the policy was made.
    pub fn chip_use(&self) -> ChipUse {
        ChipUse {
            decisions: self.decisions,
            counts: self.engine.total_counts(),
            by_core: self.engine.core_counts(),
            windowed: self.windowed,
            encoder: OpCounts::default(),
            host: self.host,
            time_ps: self.engine.chip_time_ps().to_vec(),
            slowest_ps: self.engine.slowest_ps().to_vec(),
        }
    }
}

impl Policy for ChipPolicy {
    fn start_trial(&mut self, streams: Streams) {
        self.streams = streams;
    }

    fn act(&mut self, observation: &Observation, tick: u64) -> Action {
        let program = &self.program;
        let input = encode(&program.encoder, observation, program.steps, &self.streams, tick);
        let drawn: usize = input.iter().map(Vec::len).sum();
        self.host.draws += drawn as u64;
        let counts = self.decide(&input);
        decode(&counts, self.program.steps)
    }
}
