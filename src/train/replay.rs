//! Replay memory: the newest transitions, and batches drawn from them.

use std::collections::VecDeque;

use crate::closed_loop::planner::ACTIONS;
use crate::nn::{StateError, StateReader, StateWriter};
use crate::rng::{Streams, stream};
use crate::train::flight::Step;

/// A ring of transitions, each a row of floats.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    width: usize,
    insight: usize,
    history_ticks: usize,
    capacity: usize,
    rows: Vec<f32>,
    pushed: u64,
}

/// A batch, field by field.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Batch {
    /// [rows, width].
    pub observations: Vec<f32>,
    /// [rows, 2].
    pub actions: Vec<f32>,
    /// `[rows]`.
    pub rewards: Vec<f32>,
    /// [rows, width].
    pub next_observations: Vec<f32>,
    /// [rows, insight].
    pub insights: Vec<f32>,
    /// [rows, insight].
    pub next_insights: Vec<f32>,
    /// `[rows]`.
    pub terminal: Vec<f32>,
    /// [rows, 2].
    pub planned: Vec<f32>,
    /// [rows, 36].
    pub costs: Vec<f32>,
    /// What was seen before the observations before and after.
    pub pasts: [Pasts; 2],
}

/// What was seen in the ticks before the rows of a batch.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pasts {
    /// Oldest first, [rows, ticks, width]; zeros where the flight had not begun.
    pub observations: Vec<f32>,
    /// How many of the ticks are of the flight, `[rows]`.
    pub known: Vec<f32>,
}

/// What was seen in the latest ticks of a flight, oldest first.
pub type Past = VecDeque<Vec<f32>>;

impl Replay {
    /// Room for `capacity` transitions of observations of `width` numbers, of which the critics see
    /// `insight` others.
    pub fn new(width: usize, insight: usize, capacity: usize) -> Self {
        Self { width, insight, history_ticks: 0, capacity, rows: Vec::new(), pushed: 0 }
    }

    /// The same with what was seen in the `ticks` ticks before each observation.
    pub fn with_history(self, ticks: usize) -> Self {
        Self { history_ticks: ticks, ..self }
    }

    /// Ticks before each observation that are kept.
    pub fn history_ticks(&self) -> usize {
        self.history_ticks
    }

    /// Floats of a row: two observations, two insights, action, reward, terminal, planned action,
    /// costs, two pasts.
    fn row(&self) -> usize {
        2 * (self.width + self.insight) + 6 + ACTIONS + 2 * self.past()
    }

    /// Floats of a past: how many ticks of it are known, then the ticks.
    fn past(&self) -> usize {
        if self.history_ticks == 0 { 0 } else { 1 + self.history_ticks * self.width }
    }

    /// Transitions in memory.
    pub fn len(&self) -> usize {
        self.rows.len() / self.row()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Transitions ever seen.
    pub fn pushed(&self) -> u64 {
        self.pushed
    }

    /// Adds a transition; the oldest gives way when the memory is full. `pasts` are of the
    /// observations before and after; without history they do not matter.
    pub fn push(&mut self, step: &Step, pasts: [&Past; 2]) {
        let at = (self.pushed % self.capacity as u64) as usize * self.row();
        if at >= self.rows.len() {
            self.rows.resize(at + self.row(), 0.0);
        }
        let fields = step.observation.iter().chain(&step.next_observation);
        let fields = fields.chain(&step.insight).chain(&step.next_insight).chain(&step.action);
        let fields = fields.chain([&step.reward, &step.terminal]).chain(&step.planned);
        let row = &mut self.rows[at..];
        row.iter_mut().zip(fields.chain(&step.costs)).for_each(|(to, from)| *to = *from);
        if self.history_ticks > 0 {
            let (width, ticks, len) = (self.width, self.history_ticks, self.past());
            let first = at + self.row() - 2 * len;
            let rows = self.rows[first..].chunks_exact_mut(len);
            rows.zip(pasts).for_each(|(row, past)| write_past(row, past, width, ticks));
        }
        self.pushed += 1;
    }

    /// `rows` transitions drawn with replacement, for update number `update`.
    ///
    /// Panics when the memory is empty.
    pub fn draw(&self, rows: usize, streams: &Streams, update: u64) -> Batch {
        let mut draw = streams.at(stream::REPLAY, update);
        let mut batch = Batch::default();
        for _ in 0..rows {
            let at = draw.below(self.len() as u64) as usize * self.row();
            let (observation, rest) = self.rows[at..at + self.row()].split_at(self.width);
            let (next, rest) = rest.split_at(self.width);
            let (insight, rest) = rest.split_at(self.insight);
            let (next_insight, rest) = rest.split_at(self.insight);
            batch.observations.extend(observation);
            batch.next_observations.extend(next);
            batch.insights.extend(insight);
            batch.next_insights.extend(next_insight);
            batch.actions.extend(&rest[..2]);
            batch.rewards.push(rest[2]);
            batch.terminal.push(rest[3]);
            batch.planned.extend(&rest[4..6]);
            batch.costs.extend(&rest[6..6 + ACTIONS]);
            let pasts = rest[6 + ACTIONS..].chunks_exact(self.past().max(1));
            for (past, all) in pasts.zip(&mut batch.pasts) {
                all.known.push(past[0]);
                all.observations.extend(&past[1..]);
            }
        }
        batch
    }

    /// Adds the memory to a checkpoint.
    pub fn write(&self, state: &mut StateWriter) {
        state.count("replay.pushed", self.pushed);
        state.floats("replay.rows", &[self.len(), self.row()], &self.rows);
    }

    /// Takes over what [`Replay::write`] wrote for the same width and capacity.
    ///
    /// Errors: missing, another width or length.
    pub fn read(&mut self, state: &StateReader) -> Result<(), StateError> {
        let pushed = state.count("replay.pushed")?;
        let rows = pushed.min(self.capacity as u64) as usize;
        self.rows = state.floats("replay.rows", &[rows, self.row()])?;
        self.pushed = pushed;
        Ok(())
    }
}

/// Number of known ticks, zeros for the others, then the known ones.
fn write_past(row: &mut [f32], past: &Past, width: usize, ticks: usize) {
    let known = past.len().min(ticks);
    row.fill(0.0);
    row[0] = known as f32;
    let places = row[1 + (ticks - known) * width..].chunks_exact_mut(width);
    let newest = past.iter().skip(past.len() - known);
    places.zip(newest).for_each(|(place, seen)| place.copy_from_slice(seen));
}

#[cfg(test)]
#[path = "replay_tests.rs"]
mod tests;
