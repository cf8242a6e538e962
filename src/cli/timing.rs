//! `flqr timing`: measures the timing jitter of the control loop against a bare timer loop.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::time::Duration;

use clap::Args;
use clap::builder::RangedU64ValueParser;
use flqr_core::control::ControllerKind;
use flqr_core::control::drive::Excitation;
use flqr_core::device::{
    LatenessSummary, Priority, SessionMode, SessionOptions, Source, TimingComparison, TimingPlan,
    compare_timing,
};
use flqr_core::model_file::presets;
use serde::Serialize;

use super::controller;
use super::output::{self, Failure, Output};
use super::progress::Progress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Length of each run, s, including the checks before driving
    #[arg(long, default_value_t = 20, value_parser = RangedU64ValueParser::<u64>::new().range(10..=3600))]
    seconds: u64,
    /// Number of runs of each loop; they alternate
    #[arg(long, default_value_t = 5, value_parser = RangedU64ValueParser::<u64>::new().range(1..=1000))]
    runs: u64,
}

/// Keys of the JSON object; lateness in s.
#[derive(Serialize)]
struct Report {
    bare: LatenessSummary,
    control: LatenessSummary,
    p99_ratio: f64,
    real_time_priority: bool,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let plan = TimingPlan {
        period: Duration::from_millis(1),
        run: Duration::from_secs(arguments.seconds),
        runs: arguments.runs as usize,
    };
    let progress = Progress::new("timing");
    let comparison = compare_timing(plan, &options()?, &mut |done| {
        progress.set(done as u64, arguments.runs);
        ControlFlow::Continue(())
    });
    let comparison = comparison.map_err(Failure::from_error)?;
    drop(progress);
    if let Priority::Usual(reason) = &comparison.priority {
        output::complain(&format!("warning: {reason}"));
    }
    let report = Report::of(&comparison);
    output.result(&report, |out| print(out, &report, plan))
}

/// Emulates the paper's robot with its real protocols, driven by FLQR.
fn options() -> Result<SessionOptions, Failure> {
    let model = presets::paper();
    let robot = model.robot().expect("the preset of the paper describes a robot").clone();
    let controller =
        Box::new(controller::design(&robot, Some(ControllerKind::Flqr)).map_err(Failure::Message)?);
    Ok(SessionOptions {
        source: Source::Emulated,
        imu: None,
        dbc: None,
        robot,
        mode: SessionMode::Drive { controller, excitation: Excitation::Balance },
        record: None,
        seed: 1,
        replay_speed: 1.0,
    })
}

impl Report {
    fn of(comparison: &TimingComparison) -> Self {
        Self {
            bare: LatenessSummary::of(&comparison.bare),
            control: LatenessSummary::of(&comparison.control),
            p99_ratio: comparison.p99_ratio(),
            real_time_priority: comparison.priority == Priority::RealTime,
        }
    }
}

fn print(out: &mut dyn Write, report: &Report, plan: TimingPlan) -> io::Result<()> {
    let priority = if report.real_time_priority { "real-time" } else { "usual" };
    writeln!(
        out,
        "timing jitter at 1000 Hz, {} alternating runs of {} s each, {priority} priority; µs\n",
        plan.runs,
        plan.run.as_secs()
    )?;
    writeln!(out, "{:14}{:>10}{:>10}{:>10}{:>10}{:>10}", "", "p50", "p99", "max", "ticks", "skipped")?;
    for (name, summary) in [("bare timer", report.bare), ("control loop", report.control)] {
        let LatenessSummary { p50_s, p99_s, max_s, ticks, skipped } = summary;
        let [p50, p99, max] = [p50_s, p99_s, max_s].map(|seconds| 1e6 * seconds);
        writeln!(out, "{name:14}{p50:>10.1}{p99:>10.1}{max:>10.1}{ticks:>10}{skipped:>10}")?;
    }
    writeln!(out, "\nratio of 99th percentiles, median of the runs: {:.3}", report.p99_ratio)
}
