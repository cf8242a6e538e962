//! When to look again for what was lost.

use std::time::Duration;

/// Tries at growing pauses, from 0.2 s to 2 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Retry {
    next: Duration,
    pause: Duration,
}

const SHORTEST: Duration = Duration::from_millis(200);
const LONGEST: Duration = Duration::from_secs(2);

impl Default for Retry {
    fn default() -> Self {
        Self { next: Duration::ZERO, pause: SHORTEST }
    }
}

impl Retry {
    /// The thing was lost at `now`. The pause is as long as it has grown: what comes and goes is not looked for at
    /// once.
    pub(super) fn after_loss(&mut self, now: Duration) {
        self.next = now + self.pause;
    }

    /// A try has failed.
    pub(super) fn after_failure(&mut self, now: Duration) {
        self.pause = (2 * self.pause).min(LONGEST);
        self.next = now + self.pause;
    }

    pub(super) fn time_left(&self, now: Duration) -> Duration {
        self.next.saturating_sub(now)
    }

    pub(super) fn is_due(&self, now: Duration) -> bool {
        now >= self.next
    }

    /// What was found works.
    pub(super) fn settle(&mut self) {
        self.pause = SHORTEST;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_up_to_two_seconds_and_start_anew_once_settled() {
        let mut retry = Retry::default();
        let mut now = Duration::from_secs(5);
        retry.after_loss(now);
        let mut pauses = Vec::new();
        for _ in 0..6 {
            assert!(!retry.is_due(now));
            let pause = retry.time_left(now);
            now += pause;
            assert!(retry.is_due(now));
            pauses.push(pause.as_millis());
            retry.after_failure(now);
        }
        assert_eq!(pauses, [200, 400, 800, 1600, 2000, 2000]);
        retry.settle();
        retry.after_loss(now);
        assert_eq!(retry.time_left(now), SHORTEST);
    }
}
