//! The statistics of a run while it goes on, so that a batch of runs need not be kept.

use super::super::simulation::TICK_S;
use super::super::statistics::{SETTLED_RANGE_M, SETTLED_WINDOW_S, STATISTICS_FROM_S, Statistics, Summary};
use crate::model::State;

/// [`Statistics`] of states at every tick of 1 ms, up to rounding the same as of their samples.
#[derive(Clone, Debug)]
pub(super) struct RunningStatistics {
    tick: u64,
    late_from: u64,
    settled_from: u64,
    /// Of the first ticks, which count if the run ends with them, and of those after.
    early: [Quantity; 3],
    late: [Quantity; 3],
    last_x: Quantity,
    long_enough: bool,
}

/// Extremes, and sums of the distances from the first value and of their squares.
#[derive(Clone, Copy, Debug)]
struct Quantity {
    first: f64,
    count: f64,
    min: f64,
    max: f64,
    sum: f64,
    squares: f64,
}

impl RunningStatistics {
    /// Of a run that will be so many ticks long unless it falls.
    pub(super) fn new(ticks: u64) -> Self {
        let in_ticks = |seconds: f64| (seconds / TICK_S).round() as u64;
        // As many samples as span the window to within a tick.
        let window = in_ticks(SETTLED_WINDOW_S) - 1;
        Self {
            tick: 0,
            late_from: in_ticks(STATISTICS_FROM_S),
            settled_from: ticks.saturating_sub(window),
            early: [Quantity::NONE; 3],
            late: [Quantity::NONE; 3],
            last_x: Quantity::NONE,
            long_enough: ticks > window,
        }
    }

    pub(super) fn push(&mut self, state: &State) {
        let values = [state.x_m, state.x_dot_m_s, state.pitch_rad];
        let add = |quantities: &mut [Quantity; 3]| {
            for (quantity, value) in quantities.iter_mut().zip(values) {
                quantity.push(value);
            }
        };
        if self.tick <= self.late_from {
            add(&mut self.early);
        }
        if self.tick >= self.late_from {
            add(&mut self.late);
        }
        if self.tick >= self.settled_from {
            self.last_x.push(state.x_m);
        }
        self.tick += 1;
    }

    /// The statistics of a run that ends after at least one tick.
    pub(super) fn finish(&self, fell: bool) -> Statistics {
        let late = self.tick > self.late_from + 1;
        let [x_m, x_dot_m_s, pitch_rad] =
            if late { self.late } else { self.early }.map(|quantity| quantity.summary());
        Statistics {
            from_s: if late { STATISTICS_FROM_S } else { 0.0 },
            x_m,
            x_dot_m_s,
            pitch_rad,
            settled: self.long_enough && !fell && self.last_x.max - self.last_x.min < SETTLED_RANGE_M,
            fell,
        }
    }
}

impl Quantity {
    const NONE: Self =
        Self { first: 0.0, count: 0.0, min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0, squares: 0.0 };

    fn push(&mut self, value: f64) {
        if self.count == 0.0 {
            self.first = value;
        }
        let distance = value - self.first;
        self.count += 1.0;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.sum += distance;
        self.squares += distance * distance;
    }

    fn summary(&self) -> Summary {
        let Self { first, count, min, max, sum, squares } = *self;
        let distance = sum / count;
        let variance = squares / count - distance * distance;
        Summary { min, max, mean: first + distance, std: variance.max(0.0).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Sample;

    /// Swings that die away, about a place that is not 0.
    fn state(tick: u64) -> State {
        let time = tick as f64 / 1000.0;
        let swing = (-0.2 * time).exp() * (2.3 * time).sin();
        State { x_m: 0.7 + swing, x_dot_m_s: 2.3 * swing, pitch_rad: -0.1 * swing, ..State::default() }
    }

    #[test]
    fn they_are_those_of_the_samples() {
        let nothing = Sample {
            time_s: 0.0,
            x_m: 0.0,
            x_dot_m_s: 0.0,
            pitch_rad: 0.0,
            pitch_rate_rad_s: 0.0,
            motor_angle_left_rad: 0.0,
            motor_angle_right_rad: 0.0,
            motor_speed_left_rad_s: 0.0,
            motor_speed_right_rad_s: 0.0,
            torque_left_nm: 0.0,
            torque_right_nm: 0.0,
        };
        let mut settled = [false; 2];
        for ticks in [1, 9_999, 10_000, 15_000, 15_001, 15_002, 20_000, 45_000] {
            let mut running = RunningStatistics::new(ticks);
            let mut samples = Vec::new();
            for tick in 0..ticks {
                let State { x_m, x_dot_m_s, pitch_rad, .. } = state(tick);
                running.push(&state(tick));
                samples.push(Sample { time_s: tick as f64 / 1000.0, x_m, x_dot_m_s, pitch_rad, ..nothing });
            }
            let (found, exact) = (running.finish(false), Statistics::of(&samples).unwrap());
            assert_eq!(
                (found.from_s, found.settled, found.fell),
                (exact.from_s, exact.settled, exact.fell),
                "{ticks} ticks"
            );
            let summaries = |s: &Statistics| [s.x_m, s.x_dot_m_s, s.pitch_rad];
            for (found, exact) in summaries(&found).into_iter().zip(summaries(&exact)) {
                assert_eq!((found.min, found.max), (exact.min, exact.max), "{ticks} ticks");
                let error = (found.mean - exact.mean).abs().max((found.std - exact.std).abs());
                assert!(error < 1e-13, "{error} after {ticks} ticks");
            }
            settled[usize::from(found.settled)] = true;
        }
        assert_eq!(settled, [true; 2], "both answers occur");
    }
}
