//! How late ticks are: a histogram fine enough for percentiles, and the one that is shown.

use std::time::Duration;

use super::session::Timing;

/// Lateness of ticks in bins of 1.6 % of their value.
#[derive(Clone, Debug)]
pub struct Lateness {
    bins: Vec<u64>,
    ticks: u64,
    skipped: u64,
    greatest: Duration,
}

/// Each power of two of the nanoseconds is split into that many bins.
const SPLIT_BITS: u32 = 6;

impl Lateness {
    /// No ticks yet.
    pub fn new() -> Self {
        Self { bins: vec![0; bin(u64::MAX) + 1], ticks: 0, skipped: 0, greatest: Duration::ZERO }
    }

    /// Counts a tick, and those that were left out since the one before.
    pub fn record(&mut self, late: Duration, skipped: u64) {
        self.bins[bin(nanoseconds(late))] += 1;
        self.ticks += 1;
        self.skipped += skipped;
        self.greatest = self.greatest.max(late);
    }

    /// As a session shows it.
    pub fn timing(&self) -> Timing {
        let mut timing = Timing::default();
        self.fill(&mut timing);
        timing
    }

    /// The same in memory that is there.
    pub(super) fn fill(&self, timing: &mut Timing) {
        timing.ticks = self.ticks;
        timing.median_s = self.quantile_s(0.5);
        timing.p99_s = self.quantile_s(0.99);
        timing.greatest_s = self.greatest.as_secs_f64();
        timing.skipped = self.skipped;
        self.fill_histogram(&mut timing.histogram);
    }

    /// Lateness that `share` of the ticks do not exceed, s, rounded up to the edge of its bin.
    fn quantile_s(&self, share: f64) -> f64 {
        let rank = (share * self.ticks as f64).ceil() as u64;
        let mut counted = 0;
        for (index, count) in self.bins.iter().enumerate() {
            counted += count;
            if counted >= rank && counted > 0 {
                return (upper_edge_ns(index) * 1e-9).min(self.greatest.as_secs_f64());
            }
        }
        0.0
    }

    fn fill_histogram(&self, shown: &mut Vec<u64>) {
        shown.clear();
        shown.resize(Timing::EDGES_S.len() + 1, 0);
        for (index, count) in self.bins.iter().enumerate().filter(|(_, count)| **count > 0) {
            let middle_s = 0.5e-9 * (lower_edge_ns(index) + upper_edge_ns(index));
            shown[Timing::EDGES_S.partition_point(|edge| *edge < middle_s)] += count;
        }
    }
}

impl Default for Lateness {
    fn default() -> Self {
        Self::new()
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// The first 64 bins hold a nanosecond each; from there on, every power of two is split into 64 bins.
fn bin(nanoseconds: u64) -> usize {
    let power = nanoseconds.max(1).ilog2().saturating_sub(SPLIT_BITS);
    ((power as usize) << SPLIT_BITS) + (nanoseconds >> power) as usize
}

fn lower_edge_ns(index: usize) -> f64 {
    let power = (index >> SPLIT_BITS).saturating_sub(1);
    let mantissa = index - (power << SPLIT_BITS);
    mantissa as f64 * 2_f64.powi(power as i32)
}

fn upper_edge_ns(index: usize) -> f64 {
    lower_edge_ns(index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_follow_each_other_without_gaps() {
        for value in (0..1 << 16).chain([1 << 20, (1 << 40) + 12_345, u64::MAX]) {
            let index = bin(value);
            let (lower, upper) = (lower_edge_ns(index), upper_edge_ns(index));
            assert!(lower <= value as f64 && (value as f64) < upper || value == u64::MAX, "{value}");
            assert!(upper - lower <= (lower / 64.0).max(1.0), "{value}: {lower} to {upper}");
        }
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        // 1 µs to 1000 µs in an order that no sorting has touched (367 and 1000 have no common factor).
        let mut lateness = Lateness::new();
        for step in 0..1000_u64 {
            lateness.record(Duration::from_micros(1 + step * 367 % 1000), u64::from(step == 7) * 3);
        }
        let timing = lateness.timing();
        for (found, sorted) in [(timing.median_s, 500e-6), (timing.p99_s, 990e-6)] {
            assert!(found >= sorted && found < sorted * (1.0 + 1.0 / 64.0 + 1e-9), "{found} of {sorted}");
        }
        assert_eq!((timing.ticks, timing.skipped, timing.greatest_s), (1000, 3, 1e-3));
        assert_eq!(timing.histogram.iter().sum::<u64>(), 1000);
    }

    #[test]
    fn ticks_fall_into_the_shown_bin_that_reaches_to_their_lateness() {
        for (nanoseconds, shown) in
            [(0, 0), (900, 0), (1_500, 1), (30_000, 5), (700_000, 9), (19_000_000, 13), (1 << 40, 14)]
        {
            let mut lateness = Lateness::new();
            lateness.record(Duration::from_nanos(nanoseconds), 0);
            let histogram = lateness.timing().histogram;
            assert_eq!(histogram.iter().position(|count| *count == 1), Some(shown), "{nanoseconds} ns");
        }
        assert_eq!(Lateness::new().timing().p99_s, 0.0);
    }
}
