//! What a control loop adds to the lateness that the machine itself has.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;
use std::{io, thread};

use serde::Serialize;

use super::clock::Clock;
use super::pacer::{Pacer, Priority, hurry};
use super::session::{Session, SessionError, SessionOptions, SessionOrder, Status, Timing, Update};
use crate::control::drive::{CheckResult, DriveOrder, Stage, StopReason};

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

/// Why nothing can be said of the control loop.
#[derive(Debug, thiserror::Error)]
pub enum TimingError {
    /// The session could not be opened.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The system gives no thread.
    #[error("cannot start the bare timer loop: {0}")]
    Thread(#[from] io::Error),
    /// The checks took the whole run.
    #[error("the robot was not driven within the run of {seconds} s{open}: give a longer run")]
    NeverDriven {
        /// Length of the run, s.
        seconds: f64,
        /// The checks that had not passed, each behind a semicolon.
        open: String,
    },
    /// The robot was stopped before the run was over.
    #[error("the robot was stopped before the run was over: {reason}")]
    Stopped {
        /// Why.
        reason: StopReason,
    },
    /// The session's thread has ended.
    #[error("the session thread ended before the end of the run, an internal error: report it")]
    Died,
}

impl TimingError {
    /// What kept a run of this length from ending with a driven robot; `None` if nothing did.
    fn of(plan: TimingPlan, status: Option<&Status>) -> Option<Self> {
        let drive = status.and_then(|status| status.drive.as_ref());
        match drive.map(|drive| drive.stage) {
            Some(Stage::Driving) => None,
            Some(Stage::Stopped(reason)) => Some(Self::Stopped { reason }),
            None | Some(Stage::Listening | Stage::Checking) => {
                let checks = drive.iter().flat_map(|drive| &drive.checks);
                let open = checks.filter(|check| check.result != CheckResult::Passed);
                let open = open.map(|check| format!("; {}: {}", check.name, check.text)).collect();
                Some(Self::NeverDriven { seconds: plan.run.as_secs_f64(), open })
            }
        }
    }
}

/// Alternates runs of a bare timer loop and of a session's control loop; `watch` is told of the number of runs done,
/// and may break off.
///
/// # Errors
/// [`TimingError`]; a robot that is not driven at the end of a run is one.
pub fn compare_timing(
    plan: TimingPlan,
    options: &SessionOptions,
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<TimingComparison, TimingError> {
    alternate(plan.runs, &mut || Ok(bare(plan)?), &mut || driven(plan, options.clone()), watch)
}

fn alternate(
    runs: usize,
    bare: &mut dyn FnMut() -> Result<(Timing, Priority), TimingError>,
    control: &mut dyn FnMut() -> Result<Timing, TimingError>,
    watch: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<TimingComparison, TimingError> {
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
fn driven(plan: TimingPlan, options: SessionOptions) -> Result<Timing, TimingError> {
    let clock = Clock::start();
    let mut session = Session::open(options, Arc::new(|| {}))?;
    session.send(SessionOrder::Drive(DriveOrder::Check));
    let mut last = None;
    while clock.now() < plan.run {
        if session.has_died() {
            return Err(TimingError::Died);
        }
        let Some(Update { status, .. }) = session.wait(Duration::from_millis(100)) else { continue };
        let Some(drive) = &last.insert(status).drive else { continue };
        if let Stage::Stopped(_) = drive.stage {
            break;
        }
        let passed = drive.checks.iter().all(|check| check.result == CheckResult::Passed);
        if drive.stage == Stage::Checking && !drive.checks.is_empty() && passed {
            session.send(SessionOrder::Drive(DriveOrder::Arm));
        }
    }
    match TimingError::of(plan, last.as_ref()) {
        Some(error) => Err(error),
        None => Ok(last.map(|status| status.timing).unwrap_or_default()),
    }
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
    use crate::control::drive::Check;
    use crate::device::{Connection, DriveStatus};

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
    fn a_run_that_does_not_end_with_a_driven_robot_is_refused() {
        let plan = TimingPlan { period: Duration::from_millis(1), run: Duration::from_secs(10), runs: 1 };
        let refused = |stage| {
            let check =
                Check { name: "pose", result: CheckResult::Waiting, text: "hold it upright".to_owned() };
            let drive = Some(DriveStatus { stage, motors_off: false, checks: vec![check] });
            TimingError::of(plan, Some(&Status { drive, ..status() })).map(|error| error.to_string())
        };
        assert_eq!(refused(Stage::Driving), None);
        for (stage, said) in [
            (Stage::Listening, "within the run of 10 s; pose: hold it upright"),
            (Stage::Checking, "within the run of 10 s; pose: hold it upright"),
            (Stage::Stopped(StopReason::NotFinite), &StopReason::NotFinite.to_string()),
        ] {
            assert!(refused(stage).is_some_and(|text| text.contains(said)), "{stage:?}");
        }
        assert!(TimingError::of(plan, None).is_some());
    }

    fn status() -> Status {
        Status {
            time: Duration::ZERO,
            connection: Connection::Connected,
            drive: None,
            motors: Default::default(),
            imu: Default::default(),
            counters: Default::default(),
            timing: Default::default(),
            recording: None,
        }
    }

    #[test]
    fn a_bare_loop_ticks_once_a_period() {
        let plan = TimingPlan { period: Duration::from_millis(1), run: Duration::from_millis(20), runs: 1 };
        let (timing, _) = bare(plan).unwrap();
        assert!(timing.ticks > 0 && timing.ticks + timing.skipped <= 22, "{timing:?}");
    }
}
