//! A batch in a fixed number of shards on any number of threads.

use std::ops::Range;

/// How the work of a batch is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shards {
    /// Parts of a batch. Results depend on this number.
    pub count: usize,
    /// Threads that work on them. Results do not depend on this number.
    pub threads: usize,
}

impl Default for Shards {
    fn default() -> Self {
        Self { count: 2, threads: 1 }
    }
}

impl Shards {
    /// Rows of each shard of a batch, in order; none is empty.
    pub fn ranges(&self, batch: usize) -> Vec<Range<usize>> {
        let count = self.count.clamp(1, batch.max(1));
        (0..count).map(|i| batch * i / count..batch * (i + 1) / count).collect()
    }

    /// `work` on every shard of a batch; results in the order of the shards.
    pub fn run<R: Send>(&self, batch: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
        let ranges = self.ranges(batch);
        let threads = self.threads.clamp(1, ranges.len());
        if threads == 1 {
            return ranges.into_iter().map(work).collect();
        }
        let mut slots: Vec<Option<R>> = ranges.iter().map(|_| None).collect();
        let per_thread = ranges.len().div_ceil(threads);
        let scope = crossbeam::thread::scope(|scope| {
            let parts = slots.chunks_mut(per_thread).zip(ranges.chunks(per_thread));
            for (slots, ranges) in parts {
                let work = &work;
                scope.spawn(move |_| {
                    for (slot, range) in slots.iter_mut().zip(ranges) {
                        *slot = Some(work(range.clone()));
                    }
                });
            }
        });
        if let Err(panic) = scope {
            std::panic::resume_unwind(panic);
        }
        slots.into_iter().flatten().collect()
    }
}

/// Sum of the shards' gradients, first shard first.
pub fn sum(gradients: Vec<Vec<f32>>) -> Vec<f32> {
    let mut all = gradients.into_iter();
    let mut total = all.next().unwrap_or_default();
    for gradient in all {
        total.iter_mut().zip(&gradient).for_each(|(sum, d)| *sum += d);
    }
    total
}

/// Samples `range` of every step of `all`, [steps, batch, features].
pub fn samples(all: &[f32], batch: usize, features: usize, range: &Range<usize>) -> Vec<f32> {
    let steps = all.chunks_exact((batch * features).max(1));
    steps.flat_map(|step| &step[range.start * features..range.end * features]).copied().collect()
}

#[cfg(test)]
#[path = "shards_tests.rs"]
mod tests;
