//! The latest steps of a flight, until they go into the replay memory.

use std::collections::VecDeque;

use crate::train::flight::{Step, keep};
use crate::train::replay::{Past, Replay};

/// Steps that wait for their rewards, and what was seen before the first of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Recent {
    steps: VecDeque<Step>,
    past: Past,
}

impl Recent {
    /// Adds a step, if there was one. Every step goes into `replay` once as many more are known as
    /// rewards are summed over, `n`, or its flight has ended.
    pub(super) fn add(&mut self, step: Option<Step>, n: usize, discount: f32, replay: &mut Replay) {
        self.steps.extend(step);
        let ended = self.steps.back().is_some_and(|step| step.ended);
        while self.steps.len() >= n || (ended && !self.steps.is_empty()) {
            let joined = Step::joined(self.steps.iter().take(n), discount);
            replay.push(&joined, [&self.past, &self.past_of_next(n, replay)]);
            let first = self.steps.pop_front();
            first.into_iter().for_each(|step| remember(&mut self.past, step.observation, replay));
        }
        if ended {
            self.past.clear();
        }
    }

    /// What was seen before the observation that follows `n` steps.
    fn past_of_next(&self, n: usize, replay: &Replay) -> Past {
        let mut past = self.past.clone();
        if replay.history_ticks() > 0 {
            let seen = self.steps.iter().take(n).map(|step| step.observation.clone());
            seen.for_each(|seen| remember(&mut past, seen, replay));
        }
        past
    }
}

fn remember(past: &mut Past, seen: Vec<f32>, replay: &Replay) {
    keep(past, seen, replay.history_ticks());
}

#[cfg(test)]
#[path = "recent_tests.rs"]
mod tests;
