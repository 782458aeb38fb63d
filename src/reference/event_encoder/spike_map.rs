//! The spikes of one layer in one step, as bits.

/// Zeros around a picture.
pub(super) const MARGIN: usize = 1;

/// One bit for each neuron `[row][column][channel]` of a square picture, with a margin of zeros
/// around it, so that every window of a convolution lies within.
#[derive(Debug, Clone)]
pub(super) struct SpikeMap {
    channels: usize,
    side: usize,
    /// Words of a row, one of them to spare: 64 bits can be read from any pixel on.
    row_words: usize,
    words: Vec<u64>,
}

impl SpikeMap {
    /// No spikes, in `channels` channels of `side` x `side` pixels.
    pub(super) fn new(channels: usize, side: usize) -> Self {
        let padded = side + 2 * MARGIN;
        let row_words = (padded * channels).div_ceil(64) + 1;
        Self { channels, side, row_words, words: vec![0; padded * row_words] }
    }

    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// A spike of neuron number `neuron`, counted by row, column and channel.
    pub(super) fn mark(&mut self, neuron: usize) {
        let row = neuron / (self.side * self.channels);
        self.merge(row, neuron % (self.side * self.channels), 1);
    }

    /// Spikes of the neurons `first..` of row `row` whose bits are set, at most 32 of them.
    #[inline(always)]
    pub(super) fn merge(&mut self, row: usize, first: usize, bits: u64) {
        let bit = MARGIN * self.channels + first;
        let word = (row + MARGIN) * self.row_words + bit / 64;
        self.words[word] |= bits << (bit % 64);
        // Two shifts, as one of 64 is none.
        self.words[word + 1] |= bits >> 1 >> (63 - bit % 64);
    }

    /// A row with its margin; row 0 is the margin above the picture.
    #[inline(always)]
    pub(super) fn padded_row(&self, row: usize) -> PaddedRow<'_> {
        PaddedRow { words: &self.words[row * self.row_words..][..self.row_words] }
    }

    /// Number of spikes.
    pub(super) fn n_spikes(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The neurons that spiked, counted by channel, row and column, rising.
    pub(super) fn channel_by_channel(&self) -> Vec<u32> {
        let area = self.side * self.side;
        let spiked = |neuron: &usize| {
            let (channel, pixel) = (neuron / area, neuron % area);
            let (row, column) = (pixel / self.side + MARGIN, pixel % self.side + MARGIN);
            self.padded_row(row).bits(column * self.channels + channel) & 1 == 1
        };
        (0..self.channels * area).filter(spiked).map(|neuron| neuron as u32).collect()
    }
}

/// A row of a [`SpikeMap`].
#[derive(Debug, Clone, Copy)]
pub(super) struct PaddedRow<'a> {
    words: &'a [u64],
}

impl<'a> PaddedRow<'a> {
    /// Its bits; the first channels are those of the margin.
    #[inline(always)]
    pub(super) fn words(self) -> &'a [u64] {
        self.words
    }

    /// The first `len` bits from bit `at` on, at most 64 of them.
    ///
    /// The margin moves a window: the one of output pixel `x` begins a pixel before input pixel
    /// `2 x`, which is bit `2 x` times channels.
    #[inline(always)]
    pub(super) fn window(self, at: usize, len: usize) -> u64 {
        self.bits(at) & (u64::MAX >> 64usize.saturating_sub(len))
    }

    /// 64 bits from bit `at` on.
    #[inline(always)]
    pub(super) fn bits(self, at: usize) -> u64 {
        let (word, shift) = (at / 64, at % 64);
        self.words[word] >> shift | self.words[word + 1] << 1 << (63 - shift)
    }
}

#[cfg(test)]
#[path = "spike_map_tests.rs"]
mod tests;
