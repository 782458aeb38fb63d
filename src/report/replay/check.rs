//! Whether the parts of a replay from a file go together.

use super::{Episode, Replay, ReplayTick};

/// Largest side of an event frame, and most neurons times steps of a tick.
const SIDE_MAX: u32 = 1024;
const SPIKES_MAX: u32 = 1 << 17;

/// (place, problem) of the first thing that is wrong.
type Checked = Result<(), (String, String)>;

impl Replay {
    /// Errs for the first part that cannot be played.
    pub(super) fn check(&self) -> Checked {
        let [columns, rows] = self.frame_size;
        let [steps, neurons] = self.raster_size();
        let spikes = steps.saturating_mul(neurons);
        if columns.max(rows) > SIDE_MAX || spikes > SPIKES_MAX {
            let problem = format!(
                "frames of {columns} x {rows} pixels, {neurons} neurons in {steps} steps of a \
                 tick; at most {SIDE_MAX} each way, and {SPIKES_MAX} together"
            );
            return Err(("frame_size, layers".to_owned(), problem));
        }
        if let Some(plan) = &self.chip {
            plan.check().map_err(|problem| ("chip".to_owned(), problem))?;
        }
        for episode in &self.episodes {
            let place = format!("trial {}", episode.trial);
            self.check_episode(episode).map_err(|(inner, p)| (format!("{place}{inner}"), p))?;
        }
        Ok(())
    }

    fn check_episode(&self, episode: &Episode) -> Checked {
        let (ticks, poses) = (episode.ticks.len(), episode.poses_mm.len());
        let movers = episode.movers_mm.len();
        if poses != ticks + 1 || movers != poses {
            let problem = format!(
                "{ticks} ticks, {poses} poses and {movers} places of movers; one more of these \
                 than ticks expected"
            );
            return Err((String::new(), problem));
        }
        let expected = self.arena.movers_m.len();
        if let Some(tick) = episode.movers_mm.iter().position(|places| places.len() != expected) {
            let found = episode.movers_mm[tick].len();
            return Err((format!(", tick {tick}"), format!("{found} movers of {expected}")));
        }
        for (index, tick) in episode.ticks.iter().enumerate() {
            self.check_tick(tick).map_err(|problem| (format!(", tick {index}"), problem))?;
        }
        Ok(())
    }

    fn check_tick(&self, tick: &ReplayTick) -> Result<(), String> {
        let tables = self.cost_tables.len();
        let cores = 2 * self.chip.as_ref().map_or(0, |plan| plan.utilization.len());
        let counted = [
            ("cores", tick.cores.len(), cores),
            ("layer_spikes", tick.layer_spikes.len(), self.layers.len()),
            ("dynamic_fj", tick.dynamic_fj.len(), tables),
            ("time_ps", tick.time_ps.len(), tables),
        ];
        for (name, found, expected) in counted {
            if found != expected {
                return Err(format!("{found} numbers of {name}, {expected} expected"));
            }
        }
        let places = tick.frames.iter().map(|frame| ("frames", frame, self.pixels()));
        for (name, places, limit) in places.chain([("spikes", &tick.spikes, self.spike_bits())]) {
            if let Some(last) = places.last().filter(|last| **last >= limit) {
                return Err(format!("{name}: place {last} of {limit}"));
            }
        }
        Ok(())
    }
}
