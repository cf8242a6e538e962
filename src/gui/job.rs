//! Background jobs: a handle with progress, cancel and a result, on a named thread.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Wakes the window after a worker has put something in a channel.
pub(crate) type Waker = Arc<dyn Fn() + Send + Sync>;

/// Progress reports that wait for the window; each one more takes the place of the newest.
const PROGRESS_CAPACITY: usize = 256;

/// Progress wakes the window at most this often, ms: drawing it must not take the processor from the work.
const WAKE_INTERVAL_MS: u64 = 50;

/// Reports on their way to the window.
struct Reports<P>(Arc<Mutex<VecDeque<P>>>);

impl<P> Reports<P> {
    fn put(&self, report: P) {
        // Nobody panics while it is locked.
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.truncate(PROGRESS_CAPACITY - 1);
        waiting.push_back(report);
    }

    fn take(&self) -> Vec<P> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).into()
    }
}

/// Reports of a job.
pub(crate) struct Reporter<P> {
    started: Instant,
    /// When progress may wake the window next, ms after the start.
    next_wake_ms: AtomicU64,
    reports: Reports<P>,
    cancel: Arc<AtomicBool>,
    waker: Waker,
}

impl<P> Reporter<P> {
    /// Returns whether the window no longer wants the result.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// Hands progress to the window; `Break` when the job has been cancelled.
    pub(crate) fn progress(&self, progress: P) -> ControlFlow<()> {
        if self.is_cancelled() {
            return ControlFlow::Break(());
        }
        let now_ms = self.started.elapsed().as_millis() as u64;
        self.reports.put(progress);
        if now_ms >= self.next_wake_ms.load(Ordering::Relaxed) {
            self.next_wake_ms.store(now_ms + WAKE_INTERVAL_MS, Ordering::Relaxed);
            (self.waker)();
        }
        ControlFlow::Continue(())
    }
}

/// Outcome of a job.
#[derive(Debug)]
pub(crate) enum Outcome<R> {
    /// Still at work.
    Running,
    /// Its result.
    Done(R),
    /// Its thread ended without one.
    Broken,
}

/// A running job. Dropping it cancels the work and drops its result, so a result can never be taken for
/// that of a later job. The thread isn't joined: the window must not wait for it.
pub(crate) struct Job<P, R> {
    reports: Reports<P>,
    result: Receiver<R>,
    cancel: Arc<AtomicBool>,
}

impl<P: Send + 'static, R: Send + 'static> Job<P, R> {
    /// Starts `work` on a thread called `name`.
    pub(crate) fn start(
        name: &str,
        waker: &Waker,
        work: impl FnOnce(&Reporter<P>) -> R + Send + 'static,
    ) -> std::io::Result<Self> {
        let reports = Arc::new(Mutex::new(VecDeque::new()));
        let (result_sender, result) = sync_channel(1);
        let cancel = Arc::new(AtomicBool::new(false));
        let reporter = Reporter {
            started: Instant::now(),
            next_wake_ms: AtomicU64::new(0),
            reports: Reports(Arc::clone(&reports)),
            cancel: Arc::clone(&cancel),
            waker: Arc::clone(waker),
        };
        std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            let wake = WakeOnDrop(Arc::clone(&reporter.waker));
            // An error means that the window no longer wants the result.
            result_sender.send(work(&reporter)).ok();
            drop(result_sender);
            drop(wake);
        })?;
        Ok(Self { reports: Reports(reports), result, cancel })
    }

    /// Reports since the last call: of many reports the first and always the last.
    pub(crate) fn poll(&mut self) -> (Vec<P>, Outcome<R>) {
        let outcome = match self.result.try_recv() {
            Ok(result) => Outcome::Done(result),
            Err(TryRecvError::Empty) => Outcome::Running,
            Err(TryRecvError::Disconnected) => Outcome::Broken,
        };
        (self.reports.take(), outcome)
    }

    /// Waits for the result; `None` if the work panicked.
    pub(crate) fn wait(&self) -> Option<R> {
        self.result.recv().ok()
    }

    /// Asks the work to stop; its result says that it was stopped.
    pub(crate) fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl<P, R> Drop for Job<P, R> {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

/// Wakes the window even when the work panics, so that it can say so.
struct WakeOnDrop(Waker);

impl Drop for WakeOnDrop {
    fn drop(&mut self) {
        (self.0)();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<P: Send + 'static, R: Send + 'static>(job: &mut Job<P, R>) -> (Vec<P>, Outcome<R>) {
        let mut all = Vec::new();
        loop {
            let (progress, outcome) = job.poll();
            all.extend(progress);
            if !matches!(outcome, Outcome::Running) {
                return (all, outcome);
            }
            std::thread::yield_now();
        }
    }

    fn no_waker() -> Waker {
        Arc::new(|| {})
    }

    #[test]
    fn progress_comes_in_order_and_then_the_result() {
        let mut job = Job::start("test", &no_waker(), |reporter: &Reporter<u32>| {
            (0..5).all(|i| reporter.progress(i).is_continue())
        })
        .unwrap();
        let (progress, outcome) = wait(&mut job);
        assert_eq!(progress, [0, 1, 2, 3, 4]);
        assert!(matches!(outcome, Outcome::Done(true)));
    }

    #[test]
    fn the_last_progress_comes_however_much_there_was() {
        let count = 10 * PROGRESS_CAPACITY;
        let work = move |reporter: &Reporter<usize>| (0..=count).all(|i| reporter.progress(i).is_continue());
        let mut job = Job::start("test", &no_waker(), work).unwrap();
        while Arc::strong_count(&job.reports.0) > 1 {
            std::thread::yield_now();
        }
        let (progress, outcome) = job.poll();
        assert_eq!((progress.len(), progress.last()), (PROGRESS_CAPACITY, Some(&count)));
        assert!(progress.is_sorted() && matches!(outcome, Outcome::Done(true)));
    }

    #[test]
    fn a_cancelled_job_stops() {
        let mut job = Job::start("test", &no_waker(), |reporter: &Reporter<()>| {
            while reporter.progress(()).is_continue() {
                std::thread::yield_now();
            }
            "stopped"
        })
        .unwrap();
        job.cancel();
        assert!(matches!(wait(&mut job).1, Outcome::Done("stopped")));
    }

    #[test]
    fn a_job_that_panics_differs_from_one_that_runs() {
        let mut job = Job::<(), ()>::start("test", &no_waker(), |_| panic!("expected in this test")).unwrap();
        assert!(matches!(wait(&mut job).1, Outcome::Broken));
    }
}
