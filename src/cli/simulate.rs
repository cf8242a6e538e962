//! `flqr simulate`: the simulated robot in a scenario.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::record::{self, Log};
use flqr_core::simulate::{Run, Sample, Scenario, SimulationSettings, Statistics, Summary};
use serde::Serialize;

use super::output::{Failure, Output, complain};
use super::progress::Progress;
use super::{file, gains, input};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) with a [robot] and an [lqr] table
    model: PathBuf,
    /// What the robot is put through: flat, kick
    #[arg(long, value_name = "NAME", default_value = "flat")]
    scenario: Scenario,
    /// LQR alone, or with the friction feedforward
    #[arg(long, value_enum, default_value = "flqr")]
    controller: ControllerName,
    /// Simulated time, s
    #[arg(long, default_value_t = 60.0, value_parser = positive)]
    seconds: f64,
    /// Write the run as a robot log
    #[arg(long, value_name = "OUT.csv")]
    log: Option<PathBuf>,
    /// Seed of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum ControllerName {
    Lqr,
    Flqr,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Simulated {
    statistics: Quantities,
    settled: bool,
    fell: bool,
}

#[derive(Serialize)]
struct Quantities {
    x_m: Summary,
    x_dot_m_s: Summary,
    pitch_rad: Summary,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("it must be a number of seconds above 0".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (name, robot) = input::load_robot(&arguments.model)?;
    let design = gains::design(&arguments.model, &robot)?;
    let kind = match arguments.controller {
        ControllerName::Lqr => ControllerKind::Lqr,
        ControllerName::Flqr => ControllerKind::Flqr,
    };
    let in_file = |error: String| Failure::Message(format!("{}: {error}", arguments.model.display()));
    let controller =
        BalanceController::new(kind, &robot, design.gain).map_err(|error| in_file(error.to_string()))?;
    let settings = SimulationSettings { seed: arguments.seed, ..SimulationSettings::default() };
    let bar = Progress::new("simulating");
    let run = arguments
        .scenario
        .run(&robot, controller, settings, arguments.seconds, &mut |sample: &Sample| {
            bar.set((1000.0 * sample.time_s) as u64, (1000.0 * arguments.seconds) as u64);
            ControlFlow::Continue(())
        })
        .map_err(|error| in_file(error.to_string()))?;
    drop(bar);
    if let Some(path) = &arguments.log {
        write_log(path, &run.samples)?;
    }
    report(output, &name, &run)
}

fn write_log(path: &Path, samples: &[Sample]) -> Result<(), Failure> {
    let rows: Vec<_> = samples.iter().map(Sample::to_row).collect();
    let columns = Sample::COLUMNS
        .iter()
        .enumerate()
        .map(|(index, name)| (*name, rows.iter().map(|row| row[index]).collect::<Vec<_>>()));
    let log = Log::from_columns(path.display().to_string(), columns);
    file::write(path, "log", |out| record::write_log(&log, out))
}

fn report(output: &Output, name: &str, run: &Run) -> Result<(), Failure> {
    let Statistics { from_s, x_m, x_dot_m_s, pitch_rad, settled, fell } = run.statistics;
    let keys = Simulated { statistics: Quantities { x_m, x_dot_m_s, pitch_rad }, settled, fell };
    if let Some(fall) = &run.fall {
        complain(&format!("the robot fell at {:.3} s", fall.time_s));
    }
    output.result(&keys, |out| {
        writeln!(out, "{name}, from {from_s} s on\n")?;
        writeln!(out, "{:12}{:>12}{:>12}{:>12}{:>12}", "", "min", "max", "mean", "std")?;
        for (label, Summary { min, max, mean, std }) in
            [("x, m", x_m), ("x_dot, m/s", x_dot_m_s), ("pitch, rad", pitch_rad)]
        {
            writeln!(out, "{label:12}{min:>12.4}{max:>12.4}{mean:>12.4}{std:>12.4}")?;
        }
        writeln!(out, "\nsettled: {}, fell: {}", yes(settled), yes(fell))
    })
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}
