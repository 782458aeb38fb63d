//! Recorded trials in the form of a file: what the page plays.

mod check;
pub mod codec;
mod frame;

pub use frame::frame_picture;

use hw_model::ChipSpec;
use hw_model::OpCounts;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::evaluate::{Driver, RASTER_NEURONS_MAX, Recording, Tick};
use crate::policy::{EventFrame, FRAME_COLUMNS, FRAME_ROWS};
use crate::report::chip_plan::ChipPlan;
use crate::report::results::{ArenaPicture, Settings, pairs_mm};
use crate::report::table_file::{Unreadable, of_format};
use crate::world::World;
use crate::world::pairs::Pair;

/// Version of the JSON form.
pub const REPLAY_FORMAT: u32 = 2;

/// Trials of one driver, tick by tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Replay {
    /// [`REPLAY_FORMAT`].
    pub format: u32,
    /// Revision of the program.
    pub revision: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// What drove.
    pub driver: String,
    /// SHA-256 of the network, or of the core map and what the host adds to it.
    pub digest: Option<String>,
    /// Settings of every trial.
    pub settings: Settings,
    /// Radius of the robot.
    pub robot_radius_m: f64,
    /// The goal is reached within this distance.
    pub goal_radius_m: f64,
    /// Where it took place.
    pub arena: ArenaPicture,
    /// Columns and rows of an event frame.
    pub frame_size: [u32; 2],
    /// Layers whose spikes are there.
    pub layers: Vec<ReplayLayer>,
    /// Names of the cost tables of [`ReplayTick::dynamic_fj`] and [`ReplayTick::time_ps`].
    pub cost_tables: Vec<String>,
    /// The chip, when one drove.
    pub chip: Option<ChipPlan>,
    /// The trials.
    pub episodes: Vec<Episode>,
}

/// A layer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplayLayer {
    /// Name.
    pub name: String,
    /// Neurons.
    pub neurons: u32,
    /// Steps per control tick whose spikes are kept; 0 for a layer whose spikes are counted only.
    pub steps: u32,
}

/// One trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Number of the trial.
    pub trial: usize,
    /// success, collision or time-out.
    pub outcome: String,
    /// What was hit.
    pub hit: Option<String>,
    /// Start and goal: x, y (mm), heading (mrad), goal x, y (mm).
    pub pair_mm: [i32; 5],
    /// x, y (mm), heading (mrad) at the beginning of every control tick and at the end.
    pub poses_mm: Vec<[i32; 3]>,
    /// x, y (mm) of every mover at the same times.
    pub movers_mm: Vec<Vec<[i32; 2]>>,
    /// Every control tick; in a file, the text of [`codec`].
    #[serde(with = "codec::ticks")]
    pub ticks: Vec<ReplayTick>,
}

/// One control tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReplayTick {
    /// Ranges of the 18 sectors of 10 degrees in front, from left to right.
    pub laser_mm: Vec<u32>,
    /// Distance from the robot's centre to the goal's.
    pub goal_mm: u32,
    /// Speed along the heading (mm/s) and turning speed (mrad/s).
    pub speed: [i32; 2],
    /// Event frames since the tick before, oldest first: the active pixels, rising, pixel (x, y)
    /// being number `x * rows + y`.
    pub frames: Vec<Vec<u32>>,
    /// Left and right wheel, thousandths of the fastest.
    pub action: [i32; 2],
    /// Spikes, rising: of the bits of all layers one after the other, each step by step, neuron by
    /// neuron, those that are set.
    pub spikes: Vec<u32>,
    /// Number of spikes of every layer.
    pub layer_spikes: Vec<u64>,
    /// The DVS state that the host computed, hundredths.
    pub dvs_state: Vec<i32>,
    /// Synaptic operations of every core, then spikes of every core.
    pub cores: Vec<u64>,
    /// Dynamic energy since the trial began, by cost table.
    pub dynamic_fj: Vec<u64>,
    /// Modelled chip time since the trial began, by cost table.
    pub time_ps: Vec<u64>,
}

/// A replay that cannot be used.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// Not JSON of the expected form.
    #[error("{file}: not a replay of `spikeloop drive --replay` ({message})")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// Written by another version of this program.
    #[error("{file}: format {found} found, {REPLAY_FORMAT} expected; drive again")]
    Format {
        /// The file.
        file: String,
        /// Format in the file.
        found: u64,
    },
    /// Parts do not go together.
    #[error("{file}: {place}: {problem}; the file is damaged, drive again")]
    Damaged {
        /// The file.
        file: String,
        /// Where in the file.
        place: String,
        /// What is wrong.
        problem: String,
    },
}

impl Replay {
    /// Recordings of one driver with one seed, as data.
    ///
    /// Panics without a recording.
    pub fn new(
        revision: &str,
        driver: &Driver,
        seed: u64,
        world: &World,
        pairs: &[Pair],
        recordings: &[Recording],
    ) -> Self {
        let config = &recordings[0].config;
        let steps = |layer: usize| {
            let ticks = recordings.iter().flat_map(|recording| &recording.ticks);
            let steps = ticks.map(|tick| tick.spikes.get(layer).map_or(0, Vec::len));
            steps.max().unwrap_or(0) as u32
        };
        let layer = |(index, (name, neurons)): (usize, (String, usize))| ReplayLayer {
            name,
            neurons: neurons as u32,
            steps: if neurons <= RASTER_NEURONS_MAX { steps(index) } else { 0 },
        };
        let layers: Vec<ReplayLayer> = driver.layers().into_iter().enumerate().map(layer).collect();
        let deployment = driver.deployment();
        let chip = deployment.map(|deployment| deployment.map.chip());
        let tables = chip.map_or(&[][..], |chip| &chip.cost_tables);
        let episode = |recording| Episode::new(recording, pairs, &layers, chip);
        Self {
            format: REPLAY_FORMAT,
            revision: revision.to_owned(),
            seed,
            driver: driver.label.clone(),
            digest: driver.digest.clone(),
            settings: Settings::new(config),
            robot_radius_m: config.robot_radius_m,
            goal_radius_m: config.goal_radius_m,
            arena: ArenaPicture::new(world),
            frame_size: [FRAME_COLUMNS as u32, FRAME_ROWS as u32],
            cost_tables: tables.iter().map(|table| table.name.clone()).collect(),
            chip: deployment.map(ChipPlan::new),
            episodes: recordings.iter().map(episode).collect(),
            layers,
        }
    }

    /// Reads the text of a replay and checks that its parts go together; `file` is the name that
    /// errors mention.
    ///
    /// Errors: not a replay, one of another format, or one that cannot be played.
    pub fn from_json(file: &str, text: &str) -> Result<Self, ReplayError> {
        let replay: Self = of_format(text, REPLAY_FORMAT).map_err(|unreadable| {
            let file = file.to_owned();
            match unreadable {
                Unreadable::Syntax(message) => ReplayError::Syntax { file, message },
                Unreadable::Format(found) => ReplayError::Format { file, found },
            }
        })?;
        let damaged =
            |(place, problem)| ReplayError::Damaged { file: file.to_owned(), place, problem };
        replay.check().map_err(damaged)?;
        Ok(replay)
    }

    /// Synaptic operations of every core over all trials.
    pub fn operations_of_cores(&self) -> Vec<u64> {
        let mut sums = vec![0u64; self.chip.as_ref().map_or(0, |plan| plan.utilization.len())];
        for tick in self.episodes.iter().flat_map(|episode| &episode.ticks) {
            sums.iter_mut().zip(&tick.cores).for_each(|(sum, n)| *sum = sum.saturating_add(*n));
        }
        sums
    }

    /// Layers whose spikes are kept.
    pub fn kept_layers(&self) -> impl Iterator<Item = &ReplayLayer> {
        self.layers.iter().filter(|layer| layer.steps > 0)
    }

    /// Steps of a tick, and neurons, of a picture of the kept spikes.
    pub fn raster_size(&self) -> [u32; 2] {
        let neurons = self.kept_layers().fold(0u32, |sum, l| sum.saturating_add(l.neurons));
        [self.kept_layers().map(|layer| layer.steps).max().unwrap_or(0), neurons]
    }

    /// Bits that [`ReplayTick::spikes`] are places of.
    pub fn spike_bits(&self) -> u32 {
        self.layers.iter().fold(0, |sum, l| sum.saturating_add(l.neurons.saturating_mul(l.steps)))
    }

    /// Pixels of an event frame.
    pub fn pixels(&self) -> u32 {
        self.frame_size[0].saturating_mul(self.frame_size[1])
    }
}

impl Episode {
    fn new(
        recording: &Recording,
        pairs: &[Pair],
        layers: &[ReplayLayer],
        chip: Option<&ChipSpec>,
    ) -> Self {
        let Recording { flown, ticks, movers_mm, .. } = recording;
        Self {
            trial: flown.trial,
            outcome: flown.outcome.outcome.to_string(),
            hit: flown.outcome.hit.clone(),
            pair_mm: pairs_mm(&pairs[flown.trial..=flown.trial])[0],
            poses_mm: flown.outcome.trajectory.clone(),
            movers_mm: movers_mm.clone(),
            ticks: ticks.iter().map(|tick| ReplayTick::new(tick, layers, chip)).collect(),
        }
    }
}

impl ReplayTick {
    fn new(tick: &Tick, layers: &[ReplayLayer], chip: Option<&ChipSpec>) -> Self {
        let seen = &tick.observation;
        let milli = |value: f64| (value * 1000.0).round() as i32;
        let of_cores = |count: fn(&OpCounts) -> u64| tick.cores.iter().map(count);
        let cores = of_cores(OpCounts::synaptic_ops).chain(of_cores(OpCounts::spikes)).collect();
        let used = tick.chip.as_ref().zip(chip);
        let price = |(used, chip): (&crate::host::ChipUse, &ChipSpec)| {
            chip.cost_tables.iter().map(|table| table.energy(&used.counts).total_fj()).collect()
        };
        Self {
            laser_mm: seen.laser_m.iter().map(|range| milli(*range) as u32).collect(),
            goal_mm: milli(seen.goal_distance_m) as u32,
            speed: [milli(seen.linear_m_per_s), milli(seen.angular_rad_per_s)],
            frames: seen.frames.iter().map(pixels_by_column).collect(),
            action: [milli(tick.action.left), milli(tick.action.right)],
            spikes: spike_places(tick, layers),
            layer_spikes: tick.layer_spikes.clone(),
            dvs_state: tick.dvs_state.iter().map(|x| (x * 100.0).round() as i32).collect(),
            cores,
            dynamic_fj: used.map(price).unwrap_or_default(),
            time_ps: used.map(|(used, _)| used.time_ps.clone()).unwrap_or_default(),
        }
    }
}

/// Column by column: edges that move leave columns of events.
fn pixels_by_column(frame: &EventFrame) -> Vec<u32> {
    let place = |pixel: usize| (pixel % FRAME_COLUMNS * FRAME_ROWS + pixel / FRAME_COLUMNS) as u32;
    let mut ones: Vec<u32> = frame.active().map(place).collect();
    ones.sort_unstable();
    ones
}

/// Places of a tick's spikes among the bits of all layers.
fn spike_places(tick: &Tick, layers: &[ReplayLayer]) -> Vec<u32> {
    let (mut places, mut first) = (Vec::new(), 0);
    for (layer, steps) in layers.iter().zip(&tick.spikes) {
        for (step, neurons) in (0..layer.steps).zip(steps) {
            places.extend(neurons.iter().map(|neuron| first + step * layer.neurons + neuron));
        }
        first += layer.steps * layer.neurons;
    }
    places
}

#[cfg(test)]
#[path = "replay_tests.rs"]
mod tests;
