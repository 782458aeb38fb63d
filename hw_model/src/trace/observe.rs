//! What an engine did, as lines of text: one effect per line, sorted by step, core, compartment.

use sha2::{Digest, Sha256};

use crate::compartment::CompartmentState;
use crate::core_map::Core;
use crate::counters::OpCounts;
use crate::engine::{Engine, Spike, SpikeRecord, Stimulus};
use crate::id::{CompartmentIdx, CoreId};

/// How much is written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// A line for each compartment that spiked or is not at rest (voltage after reset):
    /// `t=0001 core=000 cx=0000 u=-0000448 v=-0000448 s=0 r=00`.
    Compartment,
    /// A line for each core:
    /// `t=0001 core=000 spikes=0012 synops=000300 active=0100 state=<16 digits of SHA-256>`.
    Step,
}

/// Runs `engine` through `stimulus` one step at a time and writes down every step.
pub fn observe(engine: &mut dyn Engine, stimulus: &Stimulus, detail: Detail) -> Vec<String> {
    let mut observer = Observer::new(engine, detail);
    let steps = 0..stimulus.steps();
    steps.flat_map(|step| observer.step(engine, &stimulus.part(step..step + 1))).collect()
}

/// Watches one engine step by step.
#[derive(Debug, Clone)]
pub struct Observer {
    detail: Detail,
    compartments: Vec<usize>,
    counted: Vec<OpCounts>,
}

impl Observer {
    /// Ready to watch `engine` from its present step on.
    pub fn new(engine: &dyn Engine, detail: Detail) -> Self {
        let compartments = engine.map().cores().iter().map(Core::compartments).collect();
        Self { detail, compartments, counted: engine.core_counts() }
    }

    /// Runs `stimulus`, usually of one step, and writes down what has changed and what is there.
    pub fn step(&mut self, engine: &mut dyn Engine, stimulus: &Stimulus) -> Vec<String> {
        self.step_recorded(engine, stimulus, &mut SpikeRecord::none())
    }

    /// The same; the spikes that `kept` wants are added to it.
    pub fn step_recorded(
        &mut self,
        engine: &mut dyn Engine,
        stimulus: &Stimulus,
        kept: &mut SpikeRecord,
    ) -> Vec<String> {
        let step = engine.now();
        let mut record = SpikeRecord::all(engine.map());
        engine.run(stimulus, &mut record);
        let wanted = record.spikes.iter().filter(|spike| kept.wants(spike.core));
        let wanted: Vec<Spike> = wanted.copied().collect();
        kept.spikes.extend(wanted);
        let engine: &dyn Engine = engine;
        match self.detail {
            Detail::Compartment => self.compartment_lines(engine, step, &record.spikes),
            Detail::Step => self.core_lines(engine, step),
        }
    }

    fn compartment_lines(&self, engine: &dyn Engine, step: u64, spikes: &[Spike]) -> Vec<String> {
        let mut lines = Vec::new();
        let cores = self.compartments.iter().enumerate();
        let sites = cores.flat_map(|(core, len)| (0..*len).map(move |cx| (core, cx)));
        for (core, cx) in sites {
            let site = (CoreId(core as u16), CompartmentIdx(cx as u16));
            let state = engine.state(site.0, site.1);
            let spiked = spikes.iter().any(|s| (s.core, s.compartment) == site);
            if spiked || state != CompartmentState::default() {
                let CompartmentState { current: u, voltage: v, refractory_left: r } = state;
                let s = u8::from(spiked);
                lines.push(format!(
                    "t={step:04} core={core:03} cx={cx:04} u={u:+08} v={v:+08} s={s} r={r:02}"
                ));
            }
        }
        lines
    }

    fn core_lines(&mut self, engine: &dyn Engine, step: u64) -> Vec<String> {
        let counts = engine.core_counts();
        let before = std::mem::replace(&mut self.counted, counts.clone());
        let lines = counts.into_iter().zip(before).enumerate().map(|(core, (now, before))| {
            let done = now - before;
            let (spikes, synops) = (done.spikes(), done.synaptic_ops());
            let active = done.updates_active + done.updates_spiking;
            let state = &state_digest(engine, CoreId(core as u16))[..16];
            format!(
                "t={step:04} core={core:03} spikes={spikes:04} synops={synops:06} \
                 active={active:04} state={state}"
            )
        });
        lines.collect()
    }
}

/// SHA-256 over the state of a core, as 64 hexadecimal digits: `u` and `v` as little-endian i32
/// and the refractory count as a byte, for each compartment in order.
pub fn state_digest(engine: &dyn Engine, core: CoreId) -> String {
    let mut digest = Sha256::new();
    for cx in 0..engine.map().cores()[core.index()].compartments() {
        let state = engine.state(core, CompartmentIdx(cx as u16));
        digest.update(state.current.to_le_bytes());
        digest.update(state.voltage.to_le_bytes());
        digest.update([state.refractory_left]);
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Counters that are left out while they are 0: only held cores and faulty chips have them.
const RARE: [&str; 3] = ["management_writes", "deliveries_while_held", "messages_lost"];

/// Every counter of the whole chip, then the modelled time by every cost table.
pub fn total_lines(engine: &dyn Engine) -> Vec<String> {
    let totals = engine.total_counts().named().into_iter();
    let totals = totals.filter(|(name, count)| *count > 0 || !RARE.contains(name));
    let totals = totals.map(|(counter, count)| format!("total {counter} {count}"));
    let tables = engine.map().chip().cost_tables.iter().zip(engine.chip_time_ps());
    totals.chain(tables.map(|(table, ps)| format!("time {} ps {ps}", table.name))).collect()
}
