//! What a control loop's ticks add to the lateness that the machine itself has.

use std::ops::ControlFlow;
use std::time::Duration;
use std::{panic, thread};

use serde::Serialize;

use super::clock::Clock;
use super::pacer::{Pacer, Priority, Tick, hurry};
use super::session::Timing;

/// How long, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimingPlan {
    /// Time between two ticks.
    pub period: Duration,
    /// Time of one run.
    pub run: Duration,
    /// Runs of each sort.
    pub runs: usize,
}

/// Runs of a bare timer loop and of a control loop on the same machine, one after the other.
#[derive(Clone, Debug)]
pub struct TimingComparison {
    /// Each run of the bare timer loop.
    pub bare: Vec<Timing>,
    /// Each run of the control loop; the run of the bare loop with the same number came right before.
    pub control: Vec<Timing>,
    /// What the system allowed.
    pub priority: Priority,
}

/// Percentiles of one sort of runs: the median over the runs of each, s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LatenessSummary {
    /// Half of the ticks were not later.
    pub p50_s: f64,
    /// 99 % of the ticks were not later.
    pub p99_s: f64,
    /// The latest tick of all runs.
    pub max_s: f64,
    /// Ticks of all runs.
    pub ticks: u64,
    /// Ticks of all runs that were left out.
    pub skipped: u64,
}

impl LatenessSummary {
    /// Of some runs.
    pub fn of(runs: &[Timing]) -> Self {
        Self {
            p50_s: median(runs.iter().map(|run| run.median_s)),
            p99_s: median(runs.iter().map(|run| run.p99_s)),
            max_s: runs.iter().map(|run| run.greatest_s).fold(0.0, f64::max),
            ticks: runs.iter().map(|run| run.ticks).sum(),
            skipped: runs.iter().map(|run| run.skipped).sum(),
        }
    }
}

impl TimingComparison {
    /// 99th percentile of the control loop over that of the bare loop before it: the median over all pairs.
    pub fn p99_ratio(&self) -> f64 {
        median(self.control.iter().zip(&self.bare).map(|(control, bare)| control.p99_s / bare.p99_s))
    }
}

/// Alternates runs of a bare timer loop and of one that calls `tick`, on a thread that has hurried; `watch` is told of
/// the number of runs done, and may break off.
///
/// # Panics
/// Where `tick` does.
pub fn compare_timing(
    plan: TimingPlan,
    mut tick: impl FnMut(Tick) + Send,
    watch: &mut (dyn FnMut(usize) -> ControlFlow<()> + Send),
) -> TimingComparison {
    thread::scope(|scope| {
        let runs = scope.spawn(|| {
            let priority = hurry();
            let mut comparison = TimingComparison { bare: Vec::new(), control: Vec::new(), priority };
            for done in 0..plan.runs {
                comparison.bare.push(run(plan, &mut |_| ()));
                comparison.control.push(run(plan, &mut tick));
                if watch(done + 1).is_break() {
                    break;
                }
            }
            comparison
        });
        runs.join().unwrap_or_else(|panicked| panic::resume_unwind(panicked))
    })
}

fn run(plan: TimingPlan, tick: &mut dyn FnMut(Tick)) -> Timing {
    let clock = Clock::start();
    let mut pacer = Pacer::new(clock, plan.period);
    while clock.now() < plan.run {
        tick(pacer.wait());
    }
    pacer.timing()
}

/// The middle value; of an even number the mean of the two in the middle. Not a number of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    match (sorted.len() / 2, sorted.len() % 2) {
        (0, 0) => f64::NAN,
        (middle, 1) => sorted[middle],
        (middle, _) => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(median_s: f64, p99_s: f64, greatest_s: f64) -> Timing {
        Timing { ticks: 10, median_s, p99_s, greatest_s, skipped: 1, histogram: Vec::new() }
    }

    #[test]
    fn the_ratio_is_the_median_over_pairs_of_neighbouring_runs() {
        let comparison = TimingComparison {
            bare: vec![timing(1.0, 10.0, 20.0), timing(2.0, 100.0, 300.0), timing(3.0, 30.0, 40.0)],
            control: vec![timing(1.0, 11.0, 20.0), timing(2.0, 90.0, 300.0), timing(3.0, 60.0, 40.0)],
            priority: Priority::RealTime,
        };
        assert_eq!(comparison.p99_ratio(), 1.1);
        let summary = LatenessSummary::of(&comparison.bare);
        let expected = LatenessSummary { p50_s: 2.0, p99_s: 30.0, max_s: 300.0, ticks: 30, skipped: 3 };
        assert_eq!(summary, expected);
    }

    #[test]
    fn runs_alternate_and_end_when_told_to() {
        let plan = TimingPlan { period: Duration::from_millis(1), run: Duration::from_millis(5), runs: 9 };
        let mut ticks = 0;
        let comparison = compare_timing(plan, |_| ticks += 1, &mut |done| {
            if done == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!((comparison.bare.len(), comparison.control.len()), (2, 2));
        assert_eq!(ticks, comparison.control.iter().map(|run| run.ticks).sum::<u64>());
        assert!(ticks > 0);
    }
}
