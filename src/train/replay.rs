//! Replay memory: the newest transitions, and batches drawn from them.

use crate::closed_loop::planner::ACTIONS;
use crate::nn::{StateError, StateReader, StateWriter};
use crate::rng::{Streams, stream};
use crate::train::flight::Step;

/// A ring of transitions, each a row of floats.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    width: usize,
    insight: usize,
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
}

impl Replay {
    /// Room for `capacity` transitions of observations of `width` numbers, of which the critics see
    /// `insight` others.
    pub fn new(width: usize, insight: usize, capacity: usize) -> Self {
        Self { width, insight, capacity, rows: Vec::new(), pushed: 0 }
    }

    /// Floats of a row: two observations, two insights, action, reward, terminal, planned action,
    /// costs.
    fn row(&self) -> usize {
        2 * (self.width + self.insight) + 6 + ACTIONS
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

    /// Adds a transition; the oldest gives way when the memory is full.
    pub fn push(&mut self, step: &Step) {
        let at = (self.pushed % self.capacity as u64) as usize * self.row();
        if at >= self.rows.len() {
            self.rows.resize(at + self.row(), 0.0);
        }
        let fields = step.observation.iter().chain(&step.next_observation);
        let fields = fields.chain(&step.insight).chain(&step.next_insight).chain(&step.action);
        let fields = fields.chain([&step.reward, &step.terminal]).chain(&step.planned);
        let row = &mut self.rows[at..];
        row.iter_mut().zip(fields.chain(&step.costs)).for_each(|(to, from)| *to = *from);
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
            batch.costs.extend(&rest[6..]);
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

#[cfg(test)]
#[path = "replay_tests.rs"]
mod tests;
