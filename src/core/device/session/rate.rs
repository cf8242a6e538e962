//! Amounts and peaks of the last second.

use std::time::Duration;

/// How finely a second is divided.
const BINS: usize = 20;
const BIN: Duration = Duration::from_millis(1000 / BINS as u64);

/// The last second in bins.
#[derive(Clone, Debug, Default)]
struct Bins<T> {
    bins: [T; BINS],
    /// Number of the newest bin since the start.
    newest: u64,
}

impl<T: Copy + Default> Bins<T> {
    /// Lets go of what is older than a second; gives the bin of now.
    fn advance(&mut self, now: Duration) -> &mut T {
        let bin = (now.as_nanos() / BIN.as_nanos()) as u64;
        let passed = bin.saturating_sub(self.newest).min(BINS as u64);
        for step in 1..=passed {
            self.bins[((bin - passed + step) % BINS as u64) as usize] = T::default();
        }
        self.newest = self.newest.max(bin);
        &mut self.bins[(self.newest % BINS as u64) as usize]
    }
}

/// Sum over the last second.
#[derive(Clone, Debug, Default)]
pub(super) struct Rate(Bins<f64>);

impl Rate {
    pub(super) fn add(&mut self, now: Duration, amount: f64) {
        *self.0.advance(now) += amount;
    }

    /// The sum over the second that ended with the last whole bin.
    pub(super) fn per_second(&mut self, now: Duration) -> f64 {
        self.0.advance(now);
        self.0.bins.iter().sum::<f64>()
    }
}

/// Greatest time of the last second.
#[derive(Clone, Debug, Default)]
pub(super) struct Peak(Bins<Duration>);

impl Peak {
    pub(super) fn add(&mut self, now: Duration, value: Duration) {
        let bin = self.0.advance(now);
        *bin = value.max(*bin);
    }

    pub(super) fn of_last_second(&mut self, now: Duration) -> Duration {
        self.0.advance(now);
        self.0.bins.into_iter().max().unwrap_or_default()
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
        let mut peak = Peak::default();
        for ms in [100, 900, 950] {
            peak.add(at(ms), at(ms % 97));
        }
        assert_eq!([1000, 1930, 1990, 3000].map(|now| peak.of_last_second(at(now))), [77, 77, 0, 0].map(at));
        // A clock that stands still or runs back counts into the newest bin.
        rate.add(at(100), 1.0);
        assert_eq!(rate.per_second(at(9000)), 1.0);
    }
}
