//! Amounts in a second.

use std::time::Duration;

/// How finely a second is divided.
const BINS: usize = 20;
const BIN: Duration = Duration::from_millis(1000 / BINS as u64);

/// Sum over the last second.
#[derive(Clone, Debug, Default)]
pub(super) struct Rate {
    bins: [f64; BINS],
    /// Number of the newest bin since the start.
    newest: u64,
}

impl Rate {
    pub(super) fn add(&mut self, now: Duration, amount: f64) {
        self.advance(now);
        self.bins[(self.newest % BINS as u64) as usize] += amount;
    }

    /// The sum over the second that ended with the last whole bin.
    pub(super) fn per_second(&mut self, now: Duration) -> f64 {
        self.advance(now);
        self.bins.iter().sum::<f64>()
    }

    fn advance(&mut self, now: Duration) {
        let bin = (now.as_nanos() / BIN.as_nanos()) as u64;
        let passed = bin.saturating_sub(self.newest).min(BINS as u64);
        for step in 1..=passed {
            self.bins[((bin - passed + step) % BINS as u64) as usize] = 0.0;
        }
        self.newest = self.newest.max(bin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_is_that_of_the_last_second_and_ends_with_the_source() {
        let mut rate = Rate::default();
        let at = |ms: u64| Duration::from_millis(ms);
        for ms in 0..3000 {
            rate.add(at(ms), 8.0);
        }
        let found = rate.per_second(at(2999));
        assert!((found - 8000.0).abs() <= 8000.0 / BINS as f64, "{found}");
        let half = rate.per_second(at(3500));
        assert!((half - 4000.0).abs() <= 8000.0 / BINS as f64, "{half}");
        assert_eq!(rate.per_second(at(9000)), 0.0);
        // A clock that stands still or runs back counts into the newest bin.
        rate.add(at(100), 1.0);
        assert_eq!(rate.per_second(at(9000)), 1.0);
    }
}
