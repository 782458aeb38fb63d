//! Event streams in files.
//!
//! An npz archive of one-dimensional int32 arrays, all events sorted by time:
//!
//! | array | content |
//! |---|---|
//! | `t` | microseconds, above 0 and at most the duration |
//! | `x`, `y` | column and row, 0..=127, from the top left |
//! | `p` | 1 for ON, 0 for OFF |
//! | `duration` | one element: microseconds, whole steps of 10 ms |

use std::path::Path;

use super::{COLUMNS, Event, EventFrame, ROWS, STEP_US};
use crate::files;
use crate::npz::{self, Npz, NpzError};

/// Most events of one file.
pub const EVENTS_MAX: usize = 50_000_000;

/// Events of a whole number of steps.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EventStream {
    events: Vec<Event>,
    n_steps: u64,
}

/// A stream that cannot be written or a file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EventStreamError {
    /// Not readable, or an array is missing or of another type.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// Cannot be written.
    #[error("{file}: cannot write the events: {message}")]
    Write {
        /// The file.
        file: String,
        /// What the system says.
        message: String,
    },
    /// Arrays of different lengths.
    #[error("{file}: t has {t} elements, {array} has {n}; every event needs all of t, x, y, p")]
    Lengths {
        /// The file.
        file: String,
        /// Elements of `t`.
        t: usize,
        /// The other array.
        array: &'static str,
        /// Its elements.
        n: usize,
    },
    /// More events than the limit.
    #[error("{file}: {n} events, limit {limit} (EVENTS_MAX); split the recording", limit = EVENTS_MAX)]
    Many {
        /// The file.
        file: String,
        /// Events.
        n: usize,
    },
    /// A value outside of its range.
    #[error("{file}: {array}[{index}] is {value}, must be {min}..={max}")]
    Value {
        /// The file.
        file: String,
        /// The array.
        array: &'static str,
        /// Element.
        index: usize,
        /// Its value.
        value: i64,
        /// Smallest value allowed.
        min: i64,
        /// Largest value allowed.
        max: i64,
    },
    /// Not whole steps, negative, or too long.
    #[error(
        "{file}: duration {value:?} us, must be one multiple of {step} (10 ms steps), below 2^31",
        step = STEP_US
    )]
    Duration {
        /// The file.
        file: String,
        /// What was found.
        value: Vec<i64>,
    },
}

impl EventStream {
    /// Appends one step. `events` are those of the step, by time; their clock may have started
    /// earlier or later, only the time within the step counts.
    pub fn push_step(&mut self, events: &[Event]) {
        let start_us = self.n_steps * STEP_US;
        let within_us = |t_us: u64| t_us.saturating_sub(1) % STEP_US + 1;
        let moved = |event: &Event| Event { t_us: start_us + within_us(event.t_us), ..*event };
        self.events.extend(events.iter().map(moved));
        self.n_steps += 1;
    }

    /// The events, by time.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Steps of 10 ms.
    pub fn n_steps(&self) -> u64 {
        self.n_steps
    }

    /// The frames of all steps (EEM-SAN, Algorithm 3), replayed from the events.
    pub fn frames(&self) -> impl Iterator<Item = EventFrame> + '_ {
        let mut left = &self.events[..];
        (1..=self.n_steps).map(move |step| {
            let n = left.partition_point(|event| event.t_us <= step * STEP_US);
            let (now, later) = left.split_at(n);
            left = later;
            EventFrame::of_events(now)
        })
    }

    /// The content of a file.
    ///
    /// Errors: more events or a longer duration than a file can hold.
    pub fn to_npz(&self, file: &str) -> Result<Vec<u8>, EventStreamError> {
        let (file, n) = (file.to_owned(), self.events.len());
        if n > EVENTS_MAX {
            return Err(EventStreamError::Many { file, n });
        }
        let duration_us = self.n_steps.saturating_mul(STEP_US);
        let Ok(duration) = i32::try_from(duration_us) else {
            let value = vec![i64::try_from(duration_us).unwrap_or(i64::MAX)];
            return Err(EventStreamError::Duration { file, value });
        };
        let array = |name: &str, value: &dyn Fn(&Event) -> i32| {
            (name.to_owned(), self.events.iter().map(value).collect())
        };
        npz::to_bytes(&[
            array("t", &|event| event.t_us as i32),
            array("x", &|event| i32::from(event.x)),
            array("y", &|event| i32::from(event.y)),
            array("p", &|event| i32::from(event.on)),
            ("duration".to_owned(), vec![duration]),
        ])
        .map_err(|e| EventStreamError::Write { file, message: e.to_string() })
    }

    /// Writes a file whole or not at all.
    ///
    /// Errors: as [`Self::to_npz`], or what the system says.
    pub fn write(&self, path: &Path) -> Result<(), EventStreamError> {
        let file = path.display().to_string();
        let bytes = self.to_npz(&file)?;
        files::write_atomically(path, &bytes)
            .map_err(|e| EventStreamError::Write { file, message: e.to_string() })
    }

    /// Reads a file.
    ///
    /// Errors: [`EventStreamError`] for the first thing that is wrong.
    pub fn read(path: &Path) -> Result<Self, EventStreamError> {
        Self::of_npz(Npz::open(path)?, &path.display().to_string())
    }

    /// The same from memory; `file` is the name that errors mention.
    pub fn from_npz(file: &str, bytes: Vec<u8>) -> Result<Self, EventStreamError> {
        Self::of_npz(Npz::from_bytes(file, bytes)?, file)
    }

    fn of_npz(mut npz: Npz, file: &str) -> Result<Self, EventStreamError> {
        let duration = npz.ints("duration")?.values;
        let n_steps = n_steps(&duration)
            .ok_or_else(|| EventStreamError::Duration { file: file.to_owned(), value: duration })?;
        let t = npz.ints("t")?.values;
        if t.len() > EVENTS_MAX {
            return Err(EventStreamError::Many { file: file.to_owned(), n: t.len() });
        }
        let mut other = |array: &'static str, max: i64| {
            let values = npz.ints(array)?.values;
            if values.len() != t.len() {
                let (file, n) = (file.to_owned(), values.len());
                return Err(EventStreamError::Lengths { file, t: t.len(), array, n });
            }
            check(file, array, &values, |_| 0, max)?;
            Ok(values)
        };
        let x = other("x", COLUMNS as i64 - 1)?;
        let y = other("y", ROWS as i64 - 1)?;
        let p = other("p", 1)?;
        let duration_us = (n_steps * STEP_US) as i64;
        check(file, "t", &t, |i| if i == 0 { 1 } else { t[i - 1] }, duration_us)?;
        let event =
            |i: usize| Event { t_us: t[i] as u64, y: y[i] as u8, x: x[i] as u8, on: p[i] == 1 };
        Ok(Self { events: (0..t.len()).map(event).collect(), n_steps })
    }
}

fn n_steps(duration: &[i64]) -> Option<u64> {
    let [duration_us] = duration else { return None };
    let duration_us = u64::from(u32::try_from(*duration_us).ok()?);
    duration_us.is_multiple_of(STEP_US).then_some(duration_us / STEP_US)
}

/// Errs for the first element outside of `min(index)..=max`.
fn check(
    file: &str,
    array: &'static str,
    values: &[i64],
    min: impl Fn(usize) -> i64,
    max: i64,
) -> Result<(), EventStreamError> {
    let outside = |(i, value): &(usize, &i64)| !(min(*i)..=max).contains(*value);
    match values.iter().enumerate().find(outside) {
        None => Ok(()),
        Some((index, value)) => {
            let (file, min) = (file.to_owned(), min(index));
            Err(EventStreamError::Value { file, array, index, value: *value, min, max })
        }
    }
}

#[cfg(test)]
#[path = "stream_file_tests.rs"]
mod tests;
