//! What `drive` found, in the form of its JSON file.

use std::collections::BTreeMap;

use hw_model::CoreMap;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::closed_loop::{MoverContact, Outcome, TrialConfig};
use crate::cost::{Ops, artificial_ops};
use crate::evaluate::{Driver, Flown};
use crate::host::{ChipUse, Deployment};
use crate::report::chip_plan::layer_of_core;
use crate::report::contacts::Contacts;
use crate::report::table_file::{Unreadable, of_format};
use crate::world::World;
use crate::world::dvs::CameraConfig;
use crate::world::geometry::Shape;
use crate::world::pairs::Pair;

/// Version of the JSON form.
pub const RESULT_FORMAT: u32 = 1;

/// Farthest that the corner of an arena may be, along each axis.
const BOUNDS_M_MAX: f64 = 1e6;

/// One run of `drive`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveResult {
    /// [`RESULT_FORMAT`].
    pub format: u32,
    /// Revision of the program.
    pub revision: String,
    /// First seed.
    pub seed: u64,
    /// Settings of every trial.
    pub settings: Settings,
    /// Where it took place.
    pub arena: ArenaPicture,
    /// Start and goal of every trial: x, y (mm), heading (mrad), goal x, y (mm).
    pub pairs_mm: Vec<[i32; 5]>,
    /// One entry for each driver and seed.
    pub drivers: Vec<DriverResult>,
}

/// A result file that cannot be used.
#[derive(Debug, Error)]
pub enum ResultError {
    /// Not JSON of the expected form.
    #[error("{file}: not a result of `spikeloop drive --json` ({message})")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader found, with line and column.
        message: String,
    },
    /// Written by another version of this program.
    #[error("{file}: format {found} found, {RESULT_FORMAT} expected; drive again")]
    Format {
        /// The file.
        file: String,
        /// Format in the file.
        found: u64,
    },
    /// Trials do not add up to what the summary says of them.
    #[error(
        "{file}: {driver}, seed {seed}: {what} is {found}, but {expected} trials are so; the file is \
         damaged, drive again"
    )]
    Count {
        /// The file.
        file: String,
        /// Label of the driver.
        driver: String,
        /// Its seed.
        seed: u64,
        /// Field of the summary.
        what: &'static str,
        /// Its value.
        found: usize,
        /// Trials of that kind.
        expected: usize,
    },
}

impl DriveResult {
    /// Reads the text of a result; `file` is the name that errors mention.
    ///
    /// Errors: not a result, one of another format, or one whose trials do not add up.
    pub fn from_json(file: &str, text: &str) -> Result<Self, ResultError> {
        let result: Self = of_format(text, RESULT_FORMAT).map_err(|unreadable| {
            let file = file.to_owned();
            match unreadable {
                Unreadable::Syntax(message) => ResultError::Syntax { file, message },
                Unreadable::Format(found) => ResultError::Format { file, found },
            }
        })?;
        for driver in &result.drivers {
            if let Some((what, found, expected)) = driver.miscounted() {
                let (file, seed) = (file.to_owned(), driver.seed);
                let driver = driver.label.clone();
                return Err(ResultError::Count { file, driver, seed, what, found, expected });
            }
        }
        Ok(result)
    }

    /// Name of one of the drivers: its label, with the seed where there are several.
    pub fn name_of(&self, driver: &DriverResult) -> String {
        match self.seed_range() {
            (first, last) if first == last => driver.label.clone(),
            _ => format!("{}, seed {}", driver.label, driver.seed),
        }
    }

    /// `seed 1`, or `seeds 1 to 3`.
    pub fn seeds(&self) -> String {
        match self.seed_range() {
            (first, last) if first == last => format!("seed {first}"),
            (first, last) => format!("seeds {first} to {last}"),
        }
    }

    fn seed_range(&self) -> (u64, u64) {
        let seeds = || self.drivers.iter().map(|driver| driver.seed);
        (seeds().min().unwrap_or(self.seed), seeds().max().unwrap_or(self.seed))
    }
}

/// Settings that a reader needs to repeat the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Control ticks per second.
    pub control_hz: u32,
    /// Fastest wheel speed.
    pub v_max_m_per_s: f64,
    /// Actuator model by name.
    pub actuators: String,
    /// Control ticks before a trial is out of time.
    pub ticks_max: u64,
    /// Standard deviation of the laser noise.
    pub laser_noise_m: f64,
    /// Whether the action was mixed with 1 % noise.
    pub action_noise: bool,
    /// The event camera of the drivers that need one ([`DriverResult::camera`]); `None` when none
    /// does.
    #[serde(default)]
    pub camera: Option<CameraSettings>,
}

/// How an event camera looks at the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraSettings {
    /// Horizontal field of view.
    pub field_of_view_deg: f64,
    /// Deviation of ln intensity over the surfaces.
    pub contrast_ln: f64,
}

impl CameraSettings {
    /// Settings of `config`.
    pub fn new(config: &CameraConfig) -> Self {
        Self { field_of_view_deg: config.field_of_view_deg, contrast_ln: config.contrast }
    }
}

impl Settings {
    /// Settings of `config`.
    pub fn new(config: &TrialConfig) -> Self {
        Self {
            control_hz: config.control_hz,
            v_max_m_per_s: config.wheel_speed_m_per_s_max,
            actuators: config.actuators.to_string(),
            ticks_max: config.ticks_max,
            laser_noise_m: config.laser_noise_m,
            action_noise: config.action_noise,
            camera: config.camera.as_ref().map(CameraSettings::new),
        }
    }
}

/// An arena as far as a picture needs it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArenaPicture {
    /// Name.
    pub name: String,
    /// Corners of the arena: x min, y min, x max, y max.
    #[serde(deserialize_with = "bounds")]
    pub bounds_m: [f64; 4],
    /// Outlines of polygons.
    pub polygons_m: Vec<Vec<[f64; 2]>>,
    /// Discs: x, y, radius.
    pub discs_m: Vec<[f64; 3]>,
    /// Tracks of moving discs: x, y of both ends, radius, speed (m/s).
    pub movers_m: Vec<[f64; 6]>,
}

impl ArenaPicture {
    /// Outlines of everything in `world`.
    pub fn new(world: &World) -> Self {
        let arena = world.arena();
        let bounds = arena.bounds();
        let mut picture = Self {
            name: arena.name().to_owned(),
            bounds_m: [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y],
            polygons_m: Vec::new(),
            discs_m: Vec::new(),
            movers_m: Vec::new(),
        };
        for obstacle in arena.obstacles() {
            match &obstacle.shape {
                Shape::Polygon(polygon) => {
                    picture
                        .polygons_m
                        .push(polygon.vertices().iter().map(|v| [v.x, v.y]).collect());
                }
                Shape::Disc(disc) => {
                    picture.discs_m.push([disc.centre().x, disc.centre().y, disc.radius_m()]);
                }
            }
        }
        for mover in arena.movers() {
            let (from, to) = (mover.from(), mover.to());
            picture.movers_m.push([
                from.x,
                from.y,
                to.x,
                to.y,
                mover.radius_m(),
                mover.speed_m_per_s(),
            ]);
        }
        picture
    }
}

/// Corners that have something between them.
fn bounds<'de, D: serde::Deserializer<'de>>(from: D) -> Result<[f64; 4], D::Error> {
    let bounds = <[f64; 4]>::deserialize(from)?;
    let [x0, y0, x1, y1] = bounds;
    let within = bounds.iter().all(|side| side.abs() <= BOUNDS_M_MAX);
    if within && x0 < x1 && y0 < y1 {
        return Ok(bounds);
    }
    Err(serde::de::Error::custom(format!(
        "arena.bounds_m: {bounds:?}, must be x min, y min, x max, y max with min below max, within \
         {BOUNDS_M_MAX} m of 0"
    )))
}

impl ArenaPicture {
    /// Name, size, and what stands and moves in it.
    pub fn caption(&self) -> String {
        let [x0, y0, x1, y1] = self.bounds_m;
        let standing = self.polygons_m.len() + self.discs_m.len();
        let moving = self.movers_m.len();
        format!(
            "arena {}: {:.1} x {:.1} m, {standing} obstacles, {moving} movers",
            self.name,
            x1 - x0,
            y1 - y0
        )
    }
}

/// Pairs in whole millimetres and milliradians.
pub fn pairs_mm(pairs: &[Pair]) -> Vec<[i32; 5]> {
    let milli = |value: f64| (value * 1000.0).round() as i32;
    let pair = |pair: &Pair| {
        let [x, y, yaw] = pair.start.rounded_mm_mrad();
        [x, y, yaw, milli(pair.goal.x), milli(pair.goal.y)]
    };
    pairs.iter().map(pair).collect()
}

/// All trials of one driver with one seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriverResult {
    /// What drove.
    pub label: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// SHA-256 of the core map, for a chip.
    pub map_digest: Option<String>,
    /// Name of the chip, for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chip: Option<String>,
    /// SHA-256 of the network, or of the core map and what the host adds to it.
    #[serde(default)]
    pub digest: Option<String>,
    /// Whether it flew with an event camera.
    #[serde(default)]
    pub camera: bool,
    /// About the cost tables, for a chip.
    #[serde(default)]
    pub cost_tables: Vec<CostTableNote>,
    /// Totals and means.
    pub summary: Summary,
    /// Decisions per second of wall-clock time, the world included; differs from run to run.
    pub decisions_per_s: f64,
    /// What each core did in all trials, in core order: the counters that are not 0. Empty when no
    /// chip drove.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counters_by_core: Vec<BTreeMap<String, u64>>,
    /// For each cost table, the chip time of the steps whose slowest core was of a layer, by the
    /// layer's name; barriers are not in it. Empty when no chip drove.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub slowest_layers_ps: BTreeMap<String, BTreeMap<String, u64>>,
    /// Every trial.
    pub trials: Vec<TrialResult>,
}

/// One trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialResult {
    /// Number of the trial.
    pub trial: usize,
    /// success, collision or time-out.
    pub outcome: String,
    /// What was hit.
    pub hit: Option<String>,
    /// How it came to that, when it was a mover.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mover_contact: Option<MoverContact>,
    /// Length of the way.
    pub path_m: f64,
    /// Simulated time.
    pub time_s: f64,
    /// Calls of the policy.
    pub decisions: u64,
    /// x, y (mm), heading (mrad) at every control tick.
    pub trajectory_mm: Vec<[i32; 3]>,
    /// What the chip did, when one drove.
    pub chip: Option<ChipResult>,
}

/// What the chip did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChipResult {
    /// Every counter by name.
    pub counters: BTreeMap<String, u64>,
    /// The same, counted within the decision windows only.
    pub windowed_counters: BTreeMap<String, u64>,
    /// What the host computed, by name.
    #[serde(default)]
    pub host_counters: BTreeMap<String, u64>,
    /// Energy and time by cost table.
    pub costs: BTreeMap<String, Cost>,
}

/// Energy and time by one cost table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Synaptic operations and axons.
    pub synapses_fj: u64,
    /// Compartment updates and spikes.
    pub compartments_fj: u64,
    /// Messages and hops.
    pub network_fj: u64,
    /// All dynamic energy.
    pub dynamic_fj: u64,
    /// Dynamic energy of what was done within the decision windows.
    pub dynamic_windowed_fj: u64,
    /// Dynamic energy of the cores of an encoder of event frames.
    #[serde(default)]
    pub dynamic_encoder_fj: u64,
    /// Modelled chip time.
    pub time_ps: u64,
    /// The part of it that barriers take.
    #[serde(default)]
    pub barrier_ps: u64,
    /// Static power of the chip times the modelled time; not part of the dynamic energy.
    pub static_fj: u64,
}

/// Where prices come from, and what has none.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CostTableNote {
    /// Name of the table.
    pub name: String,
    /// Source of its prices.
    pub source: String,
    /// Operations without a price of energy.
    pub unpriced: Vec<String>,
}

impl CostTableNote {
    /// Notes on all tables of the chip of `map`.
    pub fn all(map: &CoreMap) -> Vec<Self> {
        let note = |table: &hw_model::cost::CostTable| Self {
            name: table.name.clone(),
            source: table.source.clone(),
            unpriced: table.unpriced().into_iter().map(str::to_owned).collect(),
        };
        map.chip().cost_tables.iter().map(note).collect()
    }
}

/// Counters that are not 0, core by core, `slowest_ps.TABLE` among them: of what each core of `map` did
/// and for how long it was the slowest, as of an engine.
pub fn counters_by_core(
    map: &CoreMap,
    by_core: &[hw_model::OpCounts],
    slowest_ps: &[u64],
) -> Vec<BTreeMap<String, u64>> {
    let tables = &map.chip().cost_tables;
    let slowest = |core: usize| {
        let of_core = slowest_ps.iter().skip(core * tables.len());
        tables.iter().zip(of_core).map(|(table, ps)| (slowest_counter(&table.name), *ps))
    };
    let counted = |(core, counts): (usize, &hw_model::OpCounts)| {
        let named = counts.named().into_iter().map(|(name, n)| (name.to_owned(), n));
        named.chain(slowest(core)).filter(|(_, n)| *n > 0).collect()
    };
    by_core.iter().enumerate().map(counted).collect()
}

/// Name of a core's counter of the chip time, in picoseconds by a cost table, of the steps in which
/// it was the slowest core.
pub(super) fn slowest_counter(cost_table: &str) -> String {
    format!("slowest_ps.{cost_table}")
}

/// See [`DriverResult::slowest_layers_ps`]. A core counts for the layer that it has most of.
fn slowest_layers_ps(used: &ChipUse, map: &CoreMap) -> BTreeMap<String, BTreeMap<String, u64>> {
    let (tables, populations) = (&map.chip().cost_tables, map.populations());
    let layers = layer_of_core(map);
    let mut of_tables = BTreeMap::new();
    for (index, table) in tables.iter().enumerate() {
        let mut of_layers = BTreeMap::new();
        let of_cores = used.slowest_ps.iter().skip(index).step_by(tables.len());
        for (layer, ps) in layers.iter().zip(of_cores).filter(|(_, ps)| **ps > 0) {
            let name = layer.map_or("no layer", |layer| &populations[layer].name[..]);
            *of_layers.entry(name.to_owned()).or_default() += ps;
        }
        of_tables.insert(table.name.clone(), of_layers);
    }
    of_tables
}

impl ChipResult {
    /// Prices what `used` counts by every cost table of the chip of `map`.
    pub fn new(used: &ChipUse, map: &CoreMap) -> Self {
        let (chip, tiles) = (map.chip(), map.tiles_in_use());
        let by_name = |counts: &hw_model::OpCounts| {
            counts.named().into_iter().map(|(name, n)| (name.to_owned(), n)).collect()
        };
        let cost = |(table, time_ps): (&hw_model::cost::CostTable, &u64)| {
            let energy = table.energy(&used.counts);
            let cost = Cost {
                synapses_fj: energy.synapses_fj,
                compartments_fj: energy.compartments_fj,
                network_fj: energy.network_fj,
                dynamic_fj: energy.total_fj(),
                dynamic_windowed_fj: table.energy(&used.windowed).total_fj(),
                dynamic_encoder_fj: table.energy(&used.encoder).total_fj(),
                time_ps: *time_ps,
                barrier_ps: used.counts.barriers.saturating_mul(table.barrier_ps(tiles)),
                static_fj: chip.static_power.energy_fj(*time_ps),
            };
            (table.name.clone(), cost)
        };
        let host = used.host.named().into_iter().filter(|(_, n)| *n > 0);
        Self {
            counters: by_name(&used.counts),
            windowed_counters: by_name(&used.windowed),
            host_counters: host.map(|(name, n)| (name.to_owned(), n)).collect(),
            costs: chip.cost_tables.iter().zip(&used.time_ps).map(cost).collect(),
        }
    }
}

/// Totals and means of a driver's trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Trials flown.
    pub trials: usize,
    /// Trials that reached the goal.
    pub success: usize,
    /// Trials that hit something.
    pub collision: usize,
    /// Trials that ran out of time.
    pub time_out: usize,
    /// Mean way of the successful trials; `None` where there are none.
    pub path_m_mean: Option<f64>,
    /// Mean simulated time of the successful trials; `None` where there are none.
    pub time_s_mean: Option<f64>,
    /// Decisions of all trials.
    pub decisions: u64,
    /// What the chip did in all trials.
    pub chip: Option<ChipResult>,
    /// Operations that the artificial counterpart of a compiled EEM-SAN would do per decision: row
    /// (iv) of Table 5, accounting `exact`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub artificial: Option<Ops>,
    /// How it came to contacts; `None` in files of before they were looked into.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contacts: Option<Contacts>,
}

impl DriverResult {
    /// The first count of the summary that is not that of the trials: its name, value, and trials.
    fn miscounted(&self) -> Option<(&'static str, usize, usize)> {
        let s = &self.summary;
        let ended = |outcome: Outcome| {
            let outcome = outcome.to_string();
            self.trials.iter().filter(|trial| trial.outcome == outcome).count()
        };
        let counts = [
            ("trials", s.trials, self.trials.len()),
            ("success", s.success, ended(Outcome::Success)),
            ("collision", s.collision, ended(Outcome::Collision)),
            ("time_out", s.time_out, ended(Outcome::TimeOut)),
        ];
        counts.into_iter().find(|(_, found, expected)| found != expected)
    }

    /// Sums up what `driver` flew.
    pub fn new(driver: &Driver, seed: u64, flown: &[Flown], wall_s: f64) -> Self {
        let map = driver.deployment().map(|deployment| &deployment.map);
        let price = |used: &Option<ChipUse>| {
            used.as_ref().zip(map).map(|(used, map)| ChipResult::new(used, map))
        };
        let mut used: Option<ChipUse> = None;
        flown
            .iter()
            .filter_map(|f| f.chip.as_ref())
            .for_each(|one| *used.get_or_insert_default() += one);
        let of_chip = used.as_ref().zip(map);
        let shape = driver.deployment().and_then(Deployment::eem_san_shape);
        let artificial = shape.as_ref().map(artificial_ops);
        let summary = Summary { artificial, ..Summary::new(flown, price(&used)) };
        Self {
            label: driver.label.clone(),
            seed,
            map_digest: map.map(|map| map.digest()),
            chip: map.map(|map| map.chip().name.clone()),
            digest: driver.digest.clone(),
            camera: driver.needs_camera(),
            cost_tables: map.map_or_else(Vec::new, |map| CostTableNote::all(map)),
            decisions_per_s: summary.decisions as f64 / wall_s.max(1e-9),
            counters_by_core: of_chip.map_or_else(Vec::new, |(used, map)| {
                counters_by_core(map, &used.by_core, &used.slowest_ps)
            }),
            slowest_layers_ps: of_chip
                .map_or_else(BTreeMap::new, |(used, map)| slowest_layers_ps(used, map)),
            summary,
            trials: flown.iter().map(|f| TrialResult::new(f, price(&f.chip))).collect(),
        }
    }
}

impl TrialResult {
    fn new(flown: &Flown, chip: Option<ChipResult>) -> Self {
        let o = &flown.outcome;
        Self {
            trial: flown.trial,
            outcome: o.outcome.to_string(),
            hit: o.hit.clone(),
            mover_contact: o.mover_contact,
            path_m: o.path_m,
            time_s: o.time_s,
            decisions: o.decisions,
            trajectory_mm: o.trajectory.clone(),
            chip,
        }
    }
}

impl Summary {
    fn new(flown: &[Flown], chip: Option<ChipResult>) -> Self {
        let ended = |outcome| flown.iter().filter(move |f| f.outcome.outcome == outcome);
        let mean = |value: fn(&Flown) -> f64| {
            let n = ended(Outcome::Success).count();
            (n > 0).then(|| ended(Outcome::Success).map(value).sum::<f64>() / n as f64)
        };
        Self {
            trials: flown.len(),
            success: ended(Outcome::Success).count(),
            collision: ended(Outcome::Collision).count(),
            time_out: ended(Outcome::TimeOut).count(),
            path_m_mean: mean(|f| f.outcome.path_m),
            time_s_mean: mean(|f| f.outcome.time_s),
            decisions: flown.iter().map(|f| f.outcome.decisions).sum(),
            chip,
            artificial: None,
            contacts: Some(Contacts::new(flown.iter().map(|f| &f.outcome))),
        }
    }
}
