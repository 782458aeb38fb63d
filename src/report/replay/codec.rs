//! Ticks of a trial as short text, in a form that a page can read without help.
//!
//! Text is base64 of bytes, which are deflated (RFC 1951, what a browser calls `deflate-raw`).
//! Inflated they are numbers in LEB128: seven bits per byte, low ones first, the top bit says that
//! more follow. The numbers are, in this order,
//!
//! ```text
//! ticks
//! frames of each tick: how many; for each, how many pixels, then the gap before each
//! spikes of each tick: how many differ from the tick before, then the gap before each
//! nine columns, tick by tick: how many values, then each less the one of the tick before
//! ```
//!
//! The gap before a place is the number of places passed over since the last one. Columns are those
//! of [`COLUMNS`]; a difference `d` is written as `2 d`, or `-2 d - 1` when it is negative.

use std::io::{Read, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

use super::ReplayTick;

/// Fields of a tick that are numbers, in the order of the text.
pub const COLUMNS: [&str; 9] = [
    "laser_mm",
    "goal_mm",
    "speed",
    "action",
    "layer_spikes",
    "dvs_state",
    "cores",
    "dynamic_fj",
    "time_ps",
];

/// Largest text of numbers that is read, inflated: an upper bound for hostile files.
const BYTES_MAX: u64 = 1 << 28;
/// Most ticks of a trial, and most frames of a tick.
const TICKS_MAX: u64 = 1 << 20;
const FRAMES_MAX: u64 = 64;
/// Most bits of a number: a page counts in doubles.
const BITS_MAX: u32 = 56;

/// The ticks of a trial as text; places in frames and spikes rise.
pub fn to_text(ticks: &[ReplayTick]) -> String {
    let mut numbers = vec![ticks.len() as u64];
    for tick in ticks {
        numbers.push(tick.frames.len() as u64);
        tick.frames.iter().for_each(|frame| push_places(&mut numbers, frame));
    }
    let mut before: &[u32] = &[];
    for tick in ticks {
        push_places(&mut numbers, &toggled(before, &tick.spikes));
        before = &tick.spikes;
    }
    for column in 0..COLUMNS.len() {
        let mut before = Vec::new();
        for tick in ticks {
            let row = row(tick, column);
            numbers.push(row.len() as u64);
            let last = |index: usize| before.get(index).copied().unwrap_or(0);
            let changes =
                row.iter().enumerate().map(|(index, value)| value.wrapping_sub(last(index)));
            numbers.extend(changes.map(|d| ((d << 1) ^ (d >> 63)) as u64));
            before = row;
        }
    }
    to_base64(&deflated(&leb128(&numbers)))
}

/// Ticks of a text.
///
/// Errors: what is wrong with the text.
pub fn of_text(text: &str) -> Result<Vec<ReplayTick>, String> {
    let bytes = STANDARD.decode(text).map_err(|error| format!("base64: {error}"))?;
    let bytes = inflated(&bytes)?;
    let mut reader = Reader { bytes: &bytes };
    // Nothing is reserved before it is read: a count may claim any length.
    let ticks = reader.at_most(TICKS_MAX, "ticks")?;
    let mut frames = Vec::new();
    for _ in 0..ticks {
        let count = reader.at_most(FRAMES_MAX, "frames of a tick")?;
        frames.push((0..count).map(|_| reader.places()).collect::<Result<Vec<_>, _>>()?);
    }
    let mut made: Vec<ReplayTick> = Vec::new();
    for frames in frames {
        let before = made.last().map_or(&[][..], |tick| &tick.spikes);
        let spikes = toggled(before, &reader.places()?);
        made.push(ReplayTick { frames, spikes, ..ReplayTick::default() });
    }
    for (column, name) in COLUMNS.iter().enumerate() {
        let mut before = Vec::new();
        for (index, tick) in made.iter_mut().enumerate() {
            let row = reader.row(&before)?;
            set_row(tick, column, &row).ok_or_else(|| {
                format!("tick {index}: {name}: {row:?} is not what belongs there")
            })?;
            before = row;
        }
    }
    match reader.bytes.len() {
        0 => Ok(made),
        left => Err(format!("{left} bytes are left over")),
    }
}

/// Base64 with padding (RFC 4648).
pub(super) fn to_base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// For `#[serde(with = ...)]`.
pub(super) mod ticks {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::ReplayTick;

    pub(in crate::report::replay) fn serialize<S: Serializer>(
        ticks: &[ReplayTick],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&super::to_text(ticks))
    }

    pub(in crate::report::replay) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<ReplayTick>, D::Error> {
        let text = String::deserialize(deserializer)?;
        super::of_text(&text).map_err(|error| serde::de::Error::custom(format!("ticks: {error}")))
    }
}

/// Values of a column of [`COLUMNS`].
fn row(tick: &ReplayTick, column: usize) -> Vec<i64> {
    fn all<T: Copy + Into<i64>>(values: &[T]) -> Vec<i64> {
        values.iter().map(|value| (*value).into()).collect()
    }
    let counts = |counts: &[u64]| counts.iter().map(|count| *count as i64).collect();
    match column {
        0 => all(&tick.laser_mm),
        1 => all(&[tick.goal_mm]),
        2 => all(&tick.speed),
        3 => all(&tick.action),
        4 => counts(&tick.layer_spikes),
        5 => all(&tick.dvs_state),
        6 => counts(&tick.cores),
        7 => counts(&tick.dynamic_fj),
        _ => counts(&tick.time_ps),
    }
}

/// The inverse of [`row`]; `None` where the values do not fit.
fn set_row(tick: &mut ReplayTick, column: usize, row: &[i64]) -> Option<()> {
    fn all<T: TryFrom<i64>>(row: &[i64]) -> Option<Vec<T>> {
        row.iter().map(|value| T::try_from(*value).ok()).collect()
    }
    match column {
        0 => tick.laser_mm = all(row)?,
        1 => [tick.goal_mm] = all(row)?.try_into().ok()?,
        2 => tick.speed = all(row)?.try_into().ok()?,
        3 => tick.action = all(row)?.try_into().ok()?,
        4 => tick.layer_spikes = all(row)?,
        5 => tick.dvs_state = all(row)?,
        6 => tick.cores = all(row)?,
        7 => tick.dynamic_fj = all(row)?,
        _ => tick.time_ps = all(row)?,
    }
    Some(())
}

/// How many places, then the gap before each.
fn push_places(numbers: &mut Vec<u64>, places: &[u32]) {
    numbers.push(places.len() as u64);
    let mut next = 0;
    let gap = |place: &u32| u64::from(place - std::mem::replace(&mut next, place + 1));
    numbers.extend(places.iter().map(gap));
}

/// Places that are in one of two rising lists and not in the other.
fn toggled(a: &[u32], b: &[u32]) -> Vec<u32> {
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    let mut either = Vec::new();
    loop {
        match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if x == y => {
                a.next();
                b.next();
            }
            (Some(x), Some(y)) if x < y => either.extend(a.next()),
            (_, Some(_)) => either.extend(b.next()),
            (Some(_), None) => either.extend(a.next()),
            (None, None) => return either,
        }
    }
}

/// Numbers of a text, one after the other.
struct Reader<'a> {
    /// Those that are left, in LEB128.
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn next(&mut self) -> Result<u64, String> {
        let (mut number, mut shift) = (0, 0);
        while let Some((byte, rest)) = self.bytes.split_first() {
            self.bytes = rest;
            if shift >= BITS_MAX {
                return Err(format!("a number of more than {BITS_MAX} bits"));
            }
            number |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err("ends too early".to_owned())
    }

    /// The next number, which says how many there are of something.
    fn at_most(&mut self, limit: u64, what: &str) -> Result<u64, String> {
        match self.next()? {
            count if count <= limit => Ok(count),
            count => Err(format!("{count} {what}, at most {limit}")),
        }
    }

    fn places(&mut self) -> Result<Vec<u32>, String> {
        let (count, mut next) = (self.next()?, 0u64);
        let mut place = |_| -> Result<u32, String> {
            let place = next + self.next()?;
            next = place + 1;
            u32::try_from(place).map_err(|_| format!("place {place}, at most {}", u32::MAX))
        };
        (0..count).map(&mut place).collect()
    }

    fn row(&mut self, before: &[i64]) -> Result<Vec<i64>, String> {
        let count = self.next()?;
        let mut value = |index: u64| -> Result<i64, String> {
            let written = self.next()? as i64;
            let change = (written >> 1) ^ -(written & 1);
            let last = usize::try_from(index).ok().and_then(|index| before.get(index));
            Ok(last.copied().unwrap_or(0).wrapping_add(change))
        };
        (0..count).map(&mut value).collect()
    }
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let done = encoder.write_all(bytes).and_then(|()| encoder.finish());
    done.expect("memory takes all that is written")
}

fn inflated(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut inflated = Vec::new();
    let limited = &mut DeflateDecoder::new(bytes).take(BYTES_MAX + 1);
    limited.read_to_end(&mut inflated).map_err(|error| format!("deflate: {error}"))?;
    match inflated.len() as u64 {
        0..=BYTES_MAX => Ok(inflated),
        _ => Err(format!("more than {BYTES_MAX} bytes when inflated")),
    }
}

fn leb128(numbers: &[u64]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for number in numbers {
        let mut left = *number;
        while left > 0x7f {
            bytes.push(left as u8 | 0x80);
            left >>= 7;
        }
        bytes.push(left as u8);
    }
    bytes
}

#[cfg(test)]
#[path = "codec_tests.rs"]
mod tests;
