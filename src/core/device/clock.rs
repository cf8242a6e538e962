//! Time of a session.

use std::time::{Duration, SystemTime};

/// A steady clock that starts at zero with the session, and when that was.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: Steady,
    epoch: SystemTime,
}

impl Clock {
    /// A clock that reads zero now.
    pub fn start() -> Self {
        Self { start: Steady::now(), epoch: SystemTime::now() }
    }

    /// Time since the start; never goes back, whatever happens to the system's time.
    pub fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// The system's time at the start.
    pub fn epoch(&self) -> SystemTime {
        self.epoch
    }

    /// Sleeps until the clock reads `deadline`, without drift; returns at once where it already does.
    pub fn sleep_until(&self, deadline: Duration) {
        self.start.sleep_until(deadline);
    }
}

#[cfg(target_os = "linux")]
use linux::Steady;
#[cfg(not(target_os = "linux"))]
use portable::Steady;

#[cfg(target_os = "linux")]
mod linux {
    use std::time::Duration;

    use nix::errno::Errno;
    use nix::sys::time::TimeSpec;
    use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};

    const CLOCK: ClockId = ClockId::CLOCK_MONOTONIC;

    /// A reading of the kernel's steady clock, which can be slept on by an absolute time.
    #[derive(Clone, Copy, Debug)]
    pub(super) struct Steady(Duration);

    impl Steady {
        pub(super) fn now() -> Self {
            Self(clock_gettime(CLOCK).expect("every kernel has a steady clock").into())
        }

        pub(super) fn elapsed(self) -> Duration {
            Self::now().0.saturating_sub(self.0)
        }

        pub(super) fn sleep_until(self, deadline: Duration) {
            let until = TimeSpec::from_duration(self.0.saturating_add(deadline));
            // A signal ends the sleep early.
            while clock_nanosleep(CLOCK, ClockNanosleepFlags::TIMER_ABSTIME, &until) == Err(Errno::EINTR) {}
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod portable {
    use std::thread;
    use std::time::{Duration, Instant};

    #[derive(Clone, Copy, Debug)]
    pub(super) struct Steady(Instant);

    impl Steady {
        pub(super) fn now() -> Self {
            Self(Instant::now())
        }

        pub(super) fn elapsed(self) -> Duration {
            self.0.elapsed()
        }

        pub(super) fn sleep_until(self, deadline: Duration) {
            let left = deadline.saturating_sub(self.elapsed());
            if !left.is_zero() {
                thread::sleep(left);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_ends_at_the_deadline_or_later_and_a_past_deadline_is_no_sleep() {
        let clock = Clock::start();
        let deadline = clock.now() + Duration::from_millis(2);
        clock.sleep_until(deadline);
        let woken = clock.now();
        assert!(woken >= deadline);
        clock.sleep_until(Duration::ZERO);
        assert!(clock.epoch() <= SystemTime::now());
    }
}
