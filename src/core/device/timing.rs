//! What a control loop adds to the lateness that the machine itself has.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;
use std::{io, thread};

use serde::Serialize;

use super::clock::Clock;
use super::pacer::{Pacer, Priority, hurry};
use super::session::{Session, SessionError, SessionOptions, SessionOrder, Timing};
use crate::control::drive::{CheckResult, DriveOrder, Stage};

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

/// Alternates runs of a bare timer loop and of a session's control loop; `watch` is told of the number of runs done, and
/// may break off.
///
/// # Errors
/// The session's, and a system that gives no thread.
pub fn compare_timing(
    plan: TimingPlan,
    options: &SessionOptions,
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<TimingComparison, SessionError> {
    alternate(plan.runs, &mut || Ok(bare(plan)?), &mut || driven(plan, options.clone()), watch)
}

fn alternate(
    runs: usize,
    bare: &mut dyn FnMut() -> Result<(Timing, Priority), SessionError>,
    control: &mut dyn FnMut() -> Result<Timing, SessionError>,
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<TimingComparison, SessionError> {
    let mut comparison =
        TimingComparison { bare: Vec::new(), control: Vec::new(), priority: Priority::RealTime };
    for done in 1..=runs {
        let (timing, priority) = bare()?;
        comparison.priority = priority;
        comparison.bare.push(timing);
        comparison.control.push(control()?);
        if watch(done).is_break() {
            break;
        }
    }
    Ok(comparison)
}

/// A loop with nothing in it, on a thread that has hurried as a session's does.
fn bare(plan: TimingPlan) -> io::Result<(Timing, Priority)> {
    let run = move || {
        let priority = hurry();
        let clock = Clock::start();
        let mut pacer = Pacer::new(clock, plan.period);
        while clock.now() < plan.run {
            pacer.wait();
        }
        (pacer.timing(), priority)
    };
    thread::Builder::new()
        .name("timer".to_owned())
        .spawn(run)?
        .join()
        .map_err(|_| io::ErrorKind::Other.into())
}

/// A session as it is, which is checked, armed and driven, and what it says of its own loop.
fn driven(plan: TimingPlan, options: SessionOptions) -> Result<Timing, SessionError> {
    let clock = Clock::start();
    let mut session = Session::open(options, Arc::new(|| {}))?;
    session.send(SessionOrder::Drive(DriveOrder::Check));
    let mut timing = Timing::default();
    while clock.now() < plan.run && !session.has_died() {
        let Some(update) = session.wait(Duration::from_millis(100)) else { continue };
        timing = update.status.timing;
        let Some(drive) = update.status.drive else { continue };
        let passed = drive.checks.iter().all(|check| check.result == CheckResult::Passed);
        if drive.stage == Stage::Checking && !drive.checks.is_empty() && passed {
            session.send(SessionOrder::Drive(DriveOrder::Arm));
        }
    }
    Ok(timing)
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
        let mut order = Vec::new();
        let shared = std::cell::RefCell::new(&mut order);
        let comparison = alternate(
            9,
            &mut || {
                shared.borrow_mut().push("bare");
                Ok((timing(1.0, 2.0, 3.0), Priority::RealTime))
            },
            &mut || {
                shared.borrow_mut().push("control");
                Ok(timing(1.0, 3.0, 4.0))
            },
            &mut |done| if done == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) },
        );
        assert_eq!(comparison.unwrap().p99_ratio(), 1.5);
        assert_eq!(order, ["bare", "control", "bare", "control"]);
    }

    #[test]
    fn a_bare_loop_ticks_once_a_period() {
        let plan = TimingPlan { period: Duration::from_millis(1), run: Duration::from_millis(20), runs: 1 };
        let (timing, _) = bare(plan).unwrap();
        assert!(timing.ticks > 0 && timing.ticks + timing.skipped <= 22, "{timing:?}");
    }
}
