//! Statistics of runs, as in the paper's Tables 5 and 6.

use std::cmp::Ordering;

use serde::Serialize;

use super::simulation::FALL_PITCH_RAD;
use crate::record::Sample;

/// Start of the statistics: by then the robot has stood up and a kick has died away, s.
pub(super) const STATISTICS_FROM_S: f64 = 15.0;
/// Length of the end of a run that decides whether it has settled, s.
pub(super) const SETTLED_WINDOW_S: f64 = 10.0;
/// Peak to peak of x within that end below which it has, m.
pub(super) const SETTLED_RANGE_M: f64 = 0.05;

/// Extremes, mean and standard deviation (over all samples, not an estimate for more) of one quantity,
/// in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation; what the paper's tables call variance.
    pub std: f64,
}

/// Statistics of what the robot recorded: measured values, as in the paper, so that they can be computed
/// again from the log of the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Start of the samples that count, s: 15, or 0 in a run that is not longer than that.
    pub from_s: f64,
    /// Displacement, m.
    pub x_m: Summary,
    /// Speed, m/s.
    pub x_dot_m_s: Summary,
    /// Pitch, rad.
    pub pitch_rad: Summary,
    /// True if x stayed within 0.05 m peak to peak over the last 10 s. A run that fell or is shorter than
    /// 10 s has not settled.
    pub settled: bool,
    /// True if the pitch passed 0.8 rad either way.
    pub fell: bool,
}

impl Statistics {
    /// Statistics of a run's samples in the order of time, from 15 s on where it is longer; none without
    /// samples.
    pub fn of(samples: &[Sample]) -> Option<Self> {
        let end_s = samples.last()?.time_s;
        let from_s = if end_s > STATISTICS_FROM_S { STATISTICS_FROM_S } else { samples[0].time_s };
        Self::between(samples, [from_s, end_s])
    }

    /// Statistics of the samples between two times, inclusive; `None` without samples between them.
    /// Whether the robot settled or fell is said of the whole run.
    ///
    /// ```
    /// use flqr_core::record::Sample;
    /// use flqr_core::simulate::Statistics;
    ///
    /// let row = |i: u32| Sample::from_row([f64::from(i), f64::from(i % 2), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    /// let samples: Vec<Sample> = (0..10).map(row).collect();
    /// let statistics = Statistics::between(&samples, [0.0, 9.0]).ok_or("no samples")?;
    /// assert_eq!((statistics.x_m.min, statistics.x_m.max, statistics.x_m.mean), (0.0, 1.0, 0.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn between(samples: &[Sample], range_s: [f64; 2]) -> Option<Self> {
        let end_s = samples.last()?.time_s;
        let after = |from_s: f64| &samples[samples.partition_point(|sample| sample.time_s < from_s)..];
        let counted = between(samples, |sample| sample.time_s, range_s);
        if counted.is_empty() {
            return None;
        }
        let fell = samples.iter().any(|sample| sample.pitch_rad.abs() > FALL_PITCH_RAD);
        // The last sample stands for the tick that it begins, so a run of 10 s ends at 9.999 s.
        let window = SETTLED_WINDOW_S - 0.0015;
        let last = summary(after(end_s - window), |sample| sample.x_m);
        let long_enough = end_s - samples[0].time_s >= window;
        Some(Self {
            from_s: range_s[0],
            x_m: summary(counted, |sample| sample.x_m),
            x_dot_m_s: summary(counted, |sample| sample.x_dot_m_s),
            pitch_rad: summary(counted, |sample| sample.pitch_rad),
            settled: long_enough && !fell && last.max - last.min < SETTLED_RANGE_M,
            fell,
        })
    }
}

/// The samples from one time to another, both included; `None` if the times are in no order.
pub(super) fn between<T>(samples: &[T], time_s: impl Fn(&T) -> f64, [from_s, to_s]: [f64; 2]) -> &[T] {
    if from_s.partial_cmp(&to_s).is_none_or(Ordering::is_gt) {
        return &[];
    }
    let from = samples.partition_point(|sample| time_s(sample) < from_s);
    let to = samples.partition_point(|sample| time_s(sample) <= to_s);
    &samples[from..to]
}

pub(super) fn summary<T>(samples: &[T], value: impl Fn(&T) -> f64) -> Summary {
    let count = samples.len() as f64;
    let values = || samples.iter().map(&value);
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    Summary {
        min: values().fold(f64::INFINITY, f64::min),
        max: values().fold(f64::NEG_INFINITY, f64::max),
        mean,
        std: variance.sqrt(),
    }
}
