//! Ticks of a control loop at absolute deadlines.

use std::time::Duration;

use super::clock::Clock;
use super::lateness::Lateness;
use super::session::Timing;

/// A tick that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// When it was due.
    pub due: Duration,
    /// How late it comes.
    pub late: Duration,
    /// Ticks that are left out after it because they were due before it came.
    pub skipped: u64,
}

/// Ticks of one period, all at multiples of it after the first: a late tick makes no other one late.
///
/// The thread sleeps until each deadline, it never spins: with the timer's slack at a nanosecond and real-time priority
/// the wake-up is what the kernel can do.
#[derive(Debug)]
pub struct Pacer {
    clock: Clock,
    period: Duration,
    next: Duration,
    lateness: Lateness,
}

impl Pacer {
    /// Ticks every `period`, the first one a period from now, on the thread that calls [`Pacer::wait`].
    ///
    /// # Panics
    /// If the period is zero.
    pub fn new(clock: Clock, period: Duration) -> Self {
        assert!(!period.is_zero(), "ticks need time between them");
        Self { clock, period, next: clock.now() + period, lateness: Lateness::new() }
    }

    /// Sleeps until the next tick is due.
    pub fn wait(&mut self) -> Tick {
        self.clock.sleep_until(self.next);
        self.due(self.clock.now())
    }

    /// Reading of its clock.
    pub fn now(&self) -> Duration {
        self.clock.now()
    }

    /// Lateness of all ticks so far.
    pub fn timing(&self) -> Timing {
        self.lateness.timing()
    }

    /// The same in memory that is there.
    pub(super) fn fill_timing(&self, timing: &mut Timing) {
        self.lateness.fill(timing);
    }

    /// The tick that comes at `now`, which is not before its deadline.
    fn due(&mut self, now: Duration) -> Tick {
        let due = self.next;
        let late = now.saturating_sub(due);
        let skipped = u64::try_from(late.as_nanos() / self.period.as_nanos()).unwrap_or(u64::MAX);
        self.lateness.record(late, skipped);
        self.next = due + self.period * u32::try_from(skipped + 1).unwrap_or(u32::MAX);
        Tick { due, late, skipped }
    }
}

/// What the system has allowed a thread that has to be on time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Priority {
    /// Before all usual threads.
    RealTime,
    /// As all others; the text says why and what would change it.
    Usual(String),
}

/// Makes the calling thread's timer exact and asks for real-time priority.
pub fn hurry() -> Priority {
    #[cfg(target_os = "linux")]
    let slack = nix::sys::prctl::set_timerslack(1);
    #[cfg(not(target_os = "linux"))]
    let slack: Result<(), std::io::Error> = Ok(());
    match (real_time(), slack) {
        (Ok(()), _) => Priority::RealTime,
        (Err(reason), Ok(())) => Priority::Usual(reason),
        (Err(reason), Err(slack)) => {
            Priority::Usual(format!("{reason}; the timer slack is unchanged: {slack}"))
        }
    }
}

/// Keeps the program's memory in place, so that no thread of a driven robot waits for a page of it, where the system
/// allows it. Without a limit it is kept in place from then on too; with one, a later allocation might fail for it.
#[cfg(target_os = "linux")]
pub(super) fn lock_memory() {
    use nix::sys::mman::{MlockAllFlags, mlockall};
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
    let is_unlimited = getrlimit(Resource::RLIMIT_MEMLOCK).is_ok_and(|(soft, _)| soft == RLIM_INFINITY);
    let later = if is_unlimited { MlockAllFlags::MCL_FUTURE } else { MlockAllFlags::empty() };
    // What is not allowed is no reason not to drive.
    mlockall(MlockAllFlags::MCL_CURRENT | later).unwrap_or(());
}

#[cfg(not(target_os = "linux"))]
pub(super) fn lock_memory() {}

#[cfg(target_os = "linux")]
fn real_time() -> Result<(), String> {
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    // Above usual threads, below the kernel's own interrupt threads, which are at 50 and bring the frames.
    let value = ThreadPriorityValue::try_from(40)?;
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(value),
        ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo),
    )
    .map_err(|_| {
        "no real-time priority: allow it with a line `@realtime - rtprio 50` in /etc/security/limits.conf, your user \
         in the group realtime, and a new login"
            .to_owned()
    })
}

#[cfg(not(target_os = "linux"))]
fn real_time() -> Result<(), String> {
    thread_priority::set_current_thread_priority(thread_priority::ThreadPriority::Max)
        .map_err(|error| format!("no real-time priority: {error:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn pacer() -> Pacer {
        let mut pacer = Pacer::new(Clock::start(), MS);
        pacer.next = 10 * MS;
        pacer
    }

    #[test]
    fn deadlines_do_not_drift_with_lateness() {
        let mut pacer = pacer();
        for tick in 0..100 {
            let due = (10 + tick) * MS;
            let late = Duration::from_micros(u64::from(tick % 7) * 90);
            assert_eq!(pacer.due(due + late), Tick { due, late, skipped: 0 });
        }
        assert_eq!(pacer.timing().ticks, 100);
    }

    #[test]
    fn a_stall_is_one_late_tick_and_the_ones_it_covers_are_left_out() {
        let mut pacer = pacer();
        assert_eq!(pacer.due(60 * MS + MS / 2), Tick { due: 10 * MS, late: 50 * MS + MS / 2, skipped: 50 });
        assert_eq!(pacer.due(61 * MS), Tick { due: 61 * MS, late: Duration::ZERO, skipped: 0 });
        let timing = pacer.timing();
        assert_eq!((timing.ticks, timing.skipped), (2, 50));
    }

    #[test]
    fn a_tick_never_comes_early() {
        let clock = Clock::start();
        let mut pacer = Pacer::new(clock, MS);
        for _ in 0..5 {
            let tick = pacer.wait();
            assert!(clock.now() >= tick.due);
        }
    }
}
