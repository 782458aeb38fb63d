//! What an event camera hands to a controller: which pixels saw a change.

use crate::rng::Draw;

/// Columns of an event frame.
pub const FRAME_COLUMNS: usize = 128;

/// Rows of an event frame.
pub const FRAME_ROWS: usize = 128;

/// Pixels of an event frame.
pub const FRAME_PIXELS: usize = FRAME_COLUMNS * FRAME_ROWS;

/// Words of 64 pixels in a frame.
const WORDS: usize = FRAME_PIXELS / 64;

/// 128 x 128 bits: 1 where at least one event of either polarity fell into the step (EEM-SAN,
/// Algorithm 3: `s(x, y) = |p|`).
#[derive(Clone, PartialEq, Eq)]
pub struct EventFrame {
    words: [u64; WORDS],
}

impl Default for EventFrame {
    fn default() -> Self {
        Self { words: [0; WORDS] }
    }
}

impl core::fmt::Debug for EventFrame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "EventFrame({} active)", self.n_active())
    }
}

impl EventFrame {
    /// A frame with `events` random pixels marked, some of them more than once.
    pub fn random(draw: &mut Draw, events: usize) -> Self {
        let mut frame = Self::default();
        for _ in 0..events {
            let (x, y) = (draw.below(FRAME_COLUMNS as u64), draw.below(FRAME_ROWS as u64));
            frame.set(x as usize, y as usize);
        }
        frame
    }

    /// Whether column `x`, row `y` had an event. Panics outside of the picture.
    pub fn get(&self, x: usize, y: usize) -> bool {
        let pixel = pixel(x, y);
        self.words[pixel / 64] >> (pixel % 64) & 1 == 1
    }

    /// Marks column `x`, row `y`. Panics outside of the picture.
    pub fn set(&mut self, x: usize, y: usize) {
        let pixel = pixel(x, y);
        self.words[pixel / 64] |= 1 << (pixel % 64);
    }

    /// Number of marked pixels.
    pub fn n_active(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Numbers of the marked pixels (row times 128 plus column), rising: the spikes of a step.
    pub fn active(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(word_idx, word)| {
            let mut left = *word;
            core::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros() as usize)?;
                left &= left - 1;
                Some(64 * word_idx + bit)
            })
        })
    }

    /// The bits: pixel `i` is bit `i % 64` of word `i / 64`.
    pub fn words(&self) -> &[u64; WORDS] {
        &self.words
    }
}

fn pixel(x: usize, y: usize) -> usize {
    assert!(
        x < FRAME_COLUMNS && y < FRAME_ROWS,
        "pixel ({x}, {y}) is outside of {FRAME_COLUMNS} x {FRAME_ROWS}"
    );
    y * FRAME_COLUMNS + x
}
