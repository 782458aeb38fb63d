//! Work on numbered items by several threads, with the same result for any number of them.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `work` on each number below `n`, the next one on whichever of up to `threads` threads is free;
/// results in the order of the numbers.
///
/// Errors: of those numbers that were come to, the first that has one. A thread that meets an error
/// takes no more.
pub fn in_turn<R: Send, E: Send>(
    n: usize,
    threads: usize,
    work: impl Fn(usize) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let work_on_some = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= n {
                return done;
            }
            let result = work(number);
            let failed = result.is_err();
            done.push((number, result));
            if failed {
                return done;
            }
        }
    };
    let scope = crossbeam::thread::scope(|scope| {
        let workers: Vec<_> =
            (0..threads.clamp(1, n.max(1))).map(|_| scope.spawn(|_| work_on_some())).collect();
        let shares =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|p| resume_unwind(p)));
        shares.flatten().collect::<Vec<_>>()
    });
    let mut done = scope.unwrap_or_else(|panic| resume_unwind(panic));
    done.sort_unstable_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
#[path = "in_turn_tests.rs"]
mod tests;
