//! Executors of core maps. All give the same spikes, states and counts, bit for bit.
//!
//! One time step of the chip (the order is that of LOIHI's own phases; a spike made or injected
//! in step `t` is accumulated at its target in step `t + 1`, wherever the target lies):
//!
//! 1. every core takes the spikes of the step before from its input axons and adds the weights;
//! 2. every core updates its compartments ([`crate::compartment::update`]);
//! 3. spikes leave on output axons, the host injects its own;
//! 4. all cores meet at the barrier.
//!
//! A *held* core takes part in none of this but the barrier: it updates no compartment, keeps its
//! state and sends nothing, and spikes that arrive at it are lost, counted as
//! [`OpCounts::deliveries_while_held`] and as nothing else. What silicon does with them is not
//! public, so a program that holds cores had better keep that counter at 0.
//!
//! A chip may have [`Faults`]: both engines lose the same messages.

use crate::compartment::CompartmentState;
use crate::core_map::CoreMap;
use crate::counters::OpCounts;
use crate::faults::Faults;
use crate::id::{CompartmentIdx, CoreId};

mod barrier;
mod dense;
mod event;
mod lanes;
mod plan;
mod record;
mod slowest;
mod stimulus;

pub use dense::DenseEngine;
pub use event::{EventEngine, MemoryUse};
pub use record::{PopulationSpikes, Spike, SpikeRecord};
pub use stimulus::{Stimulus, StimulusError};

/// Something that runs a [`CoreMap`].
pub trait Engine: Send {
    /// The map being run.
    fn map(&self) -> &CoreMap;

    /// Steps done so far; the next step has this number.
    fn now(&self) -> u64;

    /// Runs all steps of `stimulus`, adding the spikes of the recorded cores to `record`.
    fn run(&mut self, stimulus: &Stimulus, record: &mut SpikeRecord);

    /// State of one compartment. Panics when there is no such compartment.
    fn state(&self, core: CoreId, compartment: CompartmentIdx) -> CompartmentState;

    /// Counts of every core, in core order; barriers and host operations are in none of them.
    fn core_counts(&self) -> Vec<OpCounts>;

    /// Counts of the whole chip, barriers and host operations included.
    fn total_counts(&self) -> OpCounts;

    /// Modelled chip time so far in picoseconds, one value for each cost table of the chip.
    fn chip_time_ps(&self) -> &[u64];

    /// The part of it in which each core was the one that the step waited for, without barriers.
    ///
    /// Shape: [cores, cost tables]. Of cores equally slow it is the first. For each table the sum over
    /// cores and the barriers are [`Engine::chip_time_ps`].
    fn slowest_ps(&self) -> &[u64];

    /// The management processor clears all state and all spikes under way; counted. Held cores
    /// stay held.
    fn reset(&mut self);

    /// The management processor clears the state of `cores`, and with `spikes` all spikes under
    /// way to them; counted as by [`Engine::reset`]. Panics when there is no such core.
    fn reset_cores(&mut self, cores: &[CoreId], spikes: bool);

    /// The management processor holds `cores` from the next step on, or lets them go on.
    ///
    /// On the chip it writes each core's update-count register: a core updates as many groups of
    /// compartments as it says, at 0 none. That a hold costs no more than this write is an
    /// assumption of the model. One register write is counted for each core named, held before or
    /// not. Panics when there is no such core.
    fn set_held(&mut self, cores: &[CoreId], held: bool);

    /// The chip has these faults from its first step on.
    ///
    /// Panics after the first step, and when there is no such core.
    fn set_faults(&mut self, faults: Faults);

    /// The host reads `n` spike counters or states; counted.
    fn count_host_reads(&mut self, n: u64);
}

/// Panics when `faults` do not go with an engine on `map` that has done `now` steps.
fn check_faults(map: &CoreMap, now: u64, faults: &Faults) {
    assert!(now == 0, "faults are there from the first step on, and {now} steps are done");
    let (last, cores) = (faults.dead_cores().last(), map.cores().len());
    assert!(
        last.is_none_or(|core| core.index() < cores),
        "core {last:?} of {cores} cannot be dead"
    );
}

/// Barrier durations of a map, one for each cost table.
fn barriers_ps(map: &CoreMap) -> Vec<u64> {
    let tiles = map.tiles_in_use();
    map.chip().cost_tables.iter().map(|table| table.barrier_ps(tiles)).collect()
}
