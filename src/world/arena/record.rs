//! The JSON text of an arena as it stands in a file.
//!
//! One set of records reads our own files and the published worlds that were transcribed from
//! SAN's and BDETT's Gazebo files. Those carry notes that mean nothing to a trial; the keys of
//! the notes are listed, every other unknown key is an error, so a misspelt one cannot be lost.

use std::collections::BTreeMap;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

/// Keys that were not asked for.
pub(super) type Rest = BTreeMap<String, IgnoredAny>;

/// The file.
#[derive(Debug, Deserialize)]
pub(super) struct ArenaRecord {
    pub(super) name: Option<String>,
    pub(super) arena: Option<BoundsRecord>,
    #[serde(default)]
    pub(super) walls: Vec<ObstacleRecord>,
    #[serde(default)]
    pub(super) obstacles: Vec<ObstacleRecord>,
    #[serde(default, alias = "dynamic_obstacles")]
    pub(super) movers: Vec<MoverRecord>,
    #[serde(default)]
    pub(super) environments: Vec<ArenaRecord>,
    #[serde(flatten)]
    pub(super) rest: Rest,
}

impl ArenaRecord {
    /// Notes, and the training schedule that SAN's rooms carry.
    pub(super) const NOTES: &[&str] = &[
        "source",
        "units",
        "note",
        "physics",
        "models_per_loop_iteration",
        "static_differences_from_san",
        "curriculum_index",
        "world_file_prefix",
        "episodes",
        "start_max_steps",
        "step_increment_per_episode",
        "max_steps",
        "epsilon_start",
        "epsilon_decay",
        "R1_starts",
        "R1_goals",
    ];
}

/// Bounds, m.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct BoundsRecord {
    pub(super) xmin: f64,
    pub(super) xmax: f64,
    pub(super) ymin: f64,
    pub(super) ymax: f64,
    #[serde(flatten, skip_serializing)]
    pub(super) rest: Rest,
}

impl BoundsRecord {
    pub(super) const NOTES: &[&str] = &["size"];
}

/// A box (x, y, yaw, size, or vertices, or both), a polygon (vertices) or a cylinder (x, y,
/// radius); m and rad.
#[derive(Debug, Default, Deserialize, Serialize)]
pub(super) struct ObstacleRecord {
    pub(super) name: String,
    pub(super) shape: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) x: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) y: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) yaw: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) size: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) radius: Option<f64>,
    pub(super) height: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vertices: Option<Vec<[f64; 2]>>,
    #[serde(flatten, skip_serializing)]
    pub(super) rest: Rest,
}

impl ObstacleRecord {
    pub(super) const NOTES: &[&str] = &["static"];
}

/// A cylinder that goes from `(x, y)` to `to` and back at `speed` m/s. The transcription of
/// BDETT's world says it differently: by name-less `id`, the direction of `bdett_v_out`, the free
/// way `free_run_forward_m`, and `eemsan_speed` from EEM-SAN's table of obstacle speeds.
#[derive(Debug, Default, Deserialize, Serialize)]
pub(super) struct MoverRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) name: Option<String>,
    #[serde(skip_serializing)]
    pub(super) id: Option<u64>,
    #[serde(skip_serializing)]
    pub(super) shape: Option<String>,
    pub(super) x: f64,
    pub(super) y: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) to: Option<[f64; 2]>,
    pub(super) radius: f64,
    pub(super) height: f64,
    #[serde(alias = "eemsan_speed")]
    pub(super) speed: f64,
    #[serde(skip_serializing)]
    pub(super) bdett_v_out: Option<[f64; 2]>,
    #[serde(skip_serializing)]
    pub(super) free_run_forward_m: Option<f64>,
    #[serde(flatten, skip_serializing)]
    pub(super) rest: Rest,
}

impl MoverRecord {
    pub(super) const NOTES: &[&str] = &[
        "bdett_speed",
        "counter_out",
        "counter_back",
        "counter_cycle",
        "loop_iterations_per_leg",
        "loop_iterations_pause",
        "eemsan_abs_vx_vy",
        "start_clearance_of_centre",
        "free_run_backward_m",
    ];
}
