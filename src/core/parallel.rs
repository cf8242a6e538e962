//! The one data-parallel map of the core: its result does not depend on the number of threads.
#![expect(
    clippy::disallowed_methods,
    reason = "the only place in the core that starts threads; they end before the function returns, and no result depends on them"
)]

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::{panic, thread};

/// Number of threads that the machine runs at the same time.
pub fn available() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Applies `f` to every item, on up to `threads` threads; the results are in the order of the items.
///
/// `f` must not depend on anything but its item, so that the result is the same on any number of threads. A panic
/// in `f` goes on in the caller.
///
/// ```
/// use std::num::NonZeroUsize;
///
/// let two = NonZeroUsize::MIN.saturating_add(1);
/// assert_eq!(flqr_core::parallel::map(&[1, 2, 3], two, |n| n * n), [1, 4, 9]);
/// ```
pub fn map<T: Sync, R: Send>(items: &[T], threads: NonZeroUsize, f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    map_watched(items, threads, f, &mut |_| ControlFlow::Continue(()))
        .expect("a watch that never breaks off leaves no item out")
}

/// As [`map`]; `watch` is called on the caller's thread with the number of items done, after each of them, and may
/// break off: then no further item is begun, and there is no result.
pub fn map_watched<T: Sync, R: Send>(
    items: &[T],
    threads: NonZeroUsize,
    f: impl Fn(&T) -> R + Sync,
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Option<Vec<R>> {
    let threads = threads.get().min(items.len());
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    if threads > 1 {
        on_threads(items, threads, &f, watch, &mut results)?;
    } else {
        for (done, (result, item)) in results.iter_mut().zip(items).enumerate() {
            *result = Some(f(item));
            if watch(done + 1).is_break() {
                return None;
            }
        }
    }
    results.into_iter().collect()
}

/// Each thread takes the next item that nobody has, until there is none or the work is stopped.
fn on_threads<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    f: &(impl Fn(&T) -> R + Sync),
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
    results: &mut [Option<R>],
) -> Option<()> {
    let (next, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (next, stopped) = (&next, &stopped);
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        let work = |sender: mpsc::Sender<(usize, R)>| {
            move || {
                while !stopped.load(Ordering::Relaxed) {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { return };
                    // The receiver lives as long as the scope's own thread does not panic.
                    if sender.send((index, f(item))).is_err() {
                        return;
                    }
                }
            }
        };
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work(sender.clone()))).collect();
        drop(sender);
        for (done, (index, result)) in receiver.iter().enumerate() {
            results[index] = Some(result);
            if !stopped.load(Ordering::Relaxed) && watch(done + 1).is_break() {
                stopped.store(true, Ordering::Relaxed);
            }
        }
        for worker in workers {
            if let Err(cause) = worker.join() {
                panic::resume_unwind(cause);
            }
        }
    });
    (!stopped.load(Ordering::Relaxed)).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn threads(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).unwrap()
    }

    /// Work whose length differs from item to item, so that threads overtake each other.
    fn digits(seed: &u64) -> u64 {
        (0..seed % 7 * 10_000).fold(*seed, |state, step| {
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(step) ^ (state >> 29)
        })
    }

    #[test]
    fn results_are_in_order_whatever_the_number_of_threads() {
        for count in [0, 1, 2, 100] {
            let items: Vec<u64> = (1..=count).collect();
            let expected: Vec<_> = items.iter().map(digits).collect();
            for workers in [1, 2, 7] {
                assert_eq!(map(&items, threads(workers), digits), expected);
            }
        }
    }

    #[test]
    fn a_panic_reaches_the_caller() {
        for workers in [1, 2, 7] {
            let caught = panic::catch_unwind(|| {
                map(&[1, 2, 3, 4], threads(workers), |item| {
                    assert!(*item != 3, "item three");
                    *item
                })
            });
            let cause = caught.unwrap_err();
            assert_eq!(cause.downcast_ref::<&str>(), Some(&"item three"), "{workers} threads");
        }
    }

    #[test]
    fn the_watch_counts_and_may_break_off() {
        for workers in [1, 2, 7] {
            let mut seen = Vec::new();
            let all = map_watched(&[5; 20], threads(workers), |item| *item, &mut |done| {
                seen.push(done);
                ControlFlow::Continue(())
            });
            assert_eq!(all, Some(vec![5; 20]));
            assert_eq!(seen, (1..=20).collect::<Vec<_>>());
            let (mut calls, begun) = (0, AtomicUsize::new(0));
            let stopped = map_watched(
                &[40_000; 1000],
                threads(workers),
                |item| {
                    begun.fetch_add(1, Ordering::Relaxed);
                    digits(item)
                },
                &mut |_| {
                    calls += 1;
                    ControlFlow::Break(())
                },
            );
            assert_eq!((stopped, calls), (None, 1));
            assert!(begun.into_inner() < 1000 || workers > 1);
        }
    }
}
