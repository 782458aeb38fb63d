//! Events and event frames.

use crate::policy::EventFrame;

/// One change of brightness at one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Event {
    /// Microseconds since the camera was switched on.
    pub t_us: u64,
    /// Row, 0 is the top.
    pub y: u8,
    /// Column, 0 is the left.
    pub x: u8,
    /// Brighter (ON), not darker (OFF).
    pub on: bool,
}

impl EventFrame {
    /// The frame of some events, whatever their times.
    pub fn of_events<'e>(events: impl IntoIterator<Item = &'e Event>) -> Self {
        let mut frame = Self::default();
        events.into_iter().for_each(|event| frame.set(usize::from(event.x), usize::from(event.y)));
        frame
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
