//! Event statistics in the terms in which recordings of real sensors are described.

use serde::Serialize;

use super::{Event, EventFrame, PIXELS, STEP_S};

/// Counts of many steps.
#[derive(Debug, Clone, Default)]
pub struct Activity {
    n_on: u64,
    n_off: u64,
    active: Vec<usize>,
}

/// An [`Activity`] in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Simulated time.
    pub time_s: f64,
    /// Events of all pixels.
    pub events_per_s: f64,
    /// Events per pixel.
    pub hz_per_px: f64,
    /// Pixels with an event in a step of 10 ms, median over the steps.
    pub active_percent_median: f64,
    /// The same, exceeded by one step in twenty.
    pub active_percent_p95: f64,
    /// ON events per OFF event; none without OFF events.
    pub on_per_off: Option<f64>,
}

impl Activity {
    /// Counts one step.
    pub fn add(&mut self, frame: &EventFrame, events: &[Event]) {
        let n_on = events.iter().filter(|event| event.on).count() as u64;
        self.n_on += n_on;
        self.n_off += events.len() as u64 - n_on;
        self.active.push(frame.n_active());
    }

    /// Steps counted.
    pub fn n_steps(&self) -> usize {
        self.active.len()
    }

    /// The counts in numbers; `None` before the first step.
    pub fn summary(&self) -> Option<Summary> {
        let mut active = self.active.clone();
        active.sort_unstable();
        let percent = |share: f64| {
            let rank = (share * (active.len() - 1) as f64).round() as usize;
            active.get(rank).map(|n| 100.0 * *n as f64 / PIXELS as f64)
        };
        if active.is_empty() {
            return None;
        }
        let time_s = active.len() as f64 * STEP_S;
        let events_per_s = (self.n_on + self.n_off) as f64 / time_s;
        Some(Summary {
            time_s,
            events_per_s,
            hz_per_px: events_per_s / PIXELS as f64,
            active_percent_median: percent(0.5)?,
            active_percent_p95: percent(0.95)?,
            on_per_off: (self.n_off > 0).then(|| self.n_on as f64 / self.n_off as f64),
        })
    }
}

#[cfg(test)]
#[path = "statistics_tests.rs"]
mod tests;
