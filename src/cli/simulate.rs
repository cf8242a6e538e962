//! `flqr simulate`: simulates a robot in a scenario.

use std::fmt::Display;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, ValueEnum};
use flqr_core::model::{Model, Motor, Payload, State};
use flqr_core::record;
use flqr_core::simulate::{
    self, BenchRun, ControllerChoice, Experiment, ExperimentError, Outcome, Push, Run, Scenario, SpeedGains,
    Statistics, StepResponse, Summary,
};
use nalgebra::{Matrix2x4, RowVector4};
use serde::Serialize;

use super::logs::MotorName;
use super::output::{Failure, Output, complain};
use super::output_file::{self, Force, OutputFile};
use super::progress::Progress;
use super::{Cli, input};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) that the controller is designed for: a [robot], or a rotary [axis] for experiments with the
    /// wheels in the air
    model: PathBuf,
    /// Scenario. On the ground: flat (released at 0.05 rad), bridge (single-sided), kick, cruise (out and back),
    /// station (station keeping), multisine (added to the controller's torques). Wheels in the air: speed-tracking,
    /// friction-sweep, and multisine with pi
    #[arg(long, value_name = "NAME", default_value = "flat")]
    scenario: Scenario,
    /// State feedback without (lqr) or with (flqr) friction feedforward; in the air, lqr and pi are PI speed
    /// control and flqr adds friction feedforward
    #[arg(long, value_enum, default_value = "flqr")]
    controller: ControllerName,
    /// Simulated time, s, at most 3600 [default: 60, friction-sweep 120]
    #[arg(long, value_parser = duration, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Write the run as a robot log; in the air, as a bench log of one motor
    #[arg(long, value_name = "OUT.csv")]
    log: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// Random seed of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Motor of the bench log and of its statistics, in the air [default: left]
    #[arg(long, value_enum)]
    motor: Option<MotorName>,
    /// Proportional gain of the speed control in the air, N m s/rad, with --ki [default: by scenario]
    #[arg(long, requires = "ki", value_parser = not_negative)]
    kp: Option<f64>,
    /// Integral gain of the speed control in the air, N m/rad, with --kp
    #[arg(long, requires = "kp", value_parser = not_negative)]
    ki: Option<f64>,
    /// Model file of the simulated robot, if it differs from the controller's model
    #[arg(long, value_name = "ACTUAL.toml")]
    robot: Option<PathBuf>,
    /// Gain of each motor instead of the design: x, x_dot, pitch, pitch_rate
    #[arg(long, value_name = "K1,K2,K3,K4", allow_hyphen_values = true)]
    gain: Option<MotorGain>,
    /// Leg height instead of the model's, m
    #[arg(long, value_name = "M")]
    leg_height: Option<f64>,
    #[command(flatten)]
    settings: ScenarioSettings,
}

impl Arguments {
    fn log_file(&self) -> Option<OutputFile<'_>> {
        self.log.as_deref().map(|path| OutputFile::new(path, "log"))
    }
}

fn wrong_usage(refused: impl Display) -> Failure {
    Failure::Usage(Cli::command().error(ErrorKind::ArgumentConflict, refused))
}

/// Settings of a scenario.
#[derive(Args)]
struct ScenarioSettings {
    /// Target of speed-tracking, rad/s [default: 5]
    #[arg(long, value_name = "RAD_S", allow_negative_numbers = true)]
    target_speed: Option<f64>,
    /// Force of the kick, forward positive, N [default: 30]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    kick_force: Option<f64>,
    /// Duration of the kick, s [default: 0.1]
    #[arg(long, value_name = "S")]
    kick_duration: Option<f64>,
    /// Slope of the ground, positive uphill in x, rad, added to the model's [default: 0]
    #[arg(long, value_name = "RAD", allow_negative_numbers = true)]
    slope: Option<f64>,
    /// Payload on the body, unknown to the controller, kg
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
    /// Height of the payload above the axle along the body, m [default: the centre of mass]
    #[arg(long, value_name = "M", allow_negative_numbers = true, requires = "payload")]
    payload_height: Option<f64>,
    /// Scale factor of the multisine torques on the ground [default: 1]
    #[arg(long, value_name = "FACTOR")]
    torque_scale: Option<f64>,
    /// Height of the kick above the axle along the body, m [default: the centre of mass]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    kick_height: Option<f64>,
    /// Time of the kick, s [default: 8.5]
    #[arg(long, value_name = "S")]
    kick_at: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ControllerName {
    Lqr,
    Flqr,
    Pi,
}

/// One row of K.
#[derive(Clone, Copy)]
struct MotorGain([f64; 4]);

impl FromStr for MotorGain {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|entry| entry.trim().parse()).collect();
        let entries = numbers.ok().and_then(|numbers| <[f64; 4]>::try_from(numbers).ok());
        let finite = entries.filter(|entries| entries.iter().all(|entry| entry.is_finite()));
        finite.map(Self).ok_or_else(|| "it must be four numbers, such as -0.6,-0.9,-6.6,-0.6".to_owned())
    }
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Simulated<'a> {
    statistics: Quantities,
    /// `None` in the air, where settling is not defined.
    settled: Option<bool>,
    fell: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    fall: Option<Fallen>,
    #[serde(skip_serializing_if = "Option::is_none")]
    target_x_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tracking: Option<Tracking>,
    warnings: &'a [String],
}

#[derive(Serialize)]
#[serde(untagged)]
enum Quantities {
    Ground { x_m: Summary, x_dot_m_s: Summary, pitch_rad: Summary },
    Bench { motor_speed_rad_s: Summary, torque_nm: Summary },
}

#[derive(Serialize)]
struct Fallen {
    time_s: f64,
    state: State,
}

#[derive(Serialize)]
struct Tracking {
    left: StepResponse,
    right: StepResponse,
}

fn duration(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.001..=3600.0).contains(&seconds) => Ok(seconds),
        _ => Err("it must be a number of seconds from 0.001 to 3600".to_owned()),
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(gain) if gain.is_finite() && gain >= 0.0 => Ok(gain),
        _ => Err("it must be a number, 0 or above".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let mut experiment = experiment(arguments);
    if let Err(refused) = experiment.check_usage() {
        return Err(wrong_usage(refused));
    }
    if experiment.on_ground() && arguments.motor.is_some() {
        let refused =
            "--motor applies in the air only, because a log on the ground contains both motors: leave it out";
        return Err(wrong_usage(refused));
    }
    let inputs: Vec<&Path> =
        [&arguments.model].into_iter().chain(&arguments.robot).map(PathBuf::as_path).collect();
    output_file::check(&inputs, arguments.log_file().as_slice(), arguments.force)?;
    let declared = input::load_model(&arguments.model)?;
    if let (Some(payload), None, Some(robot)) =
        (&mut experiment.payload, arguments.settings.payload_height, declared.robot())
    {
        payload.height_m = robot.parameters.com_height_m;
    }
    let actual = arguments.robot.as_deref().map(input::load_model).transpose()?;
    let actual = actual.as_ref().unwrap_or(&declared);
    let in_file = |error: ExperimentError| match error {
        ExperimentError::NotFinite { problem, .. } => Failure::from_error(problem),
        ExperimentError::Actual(error) => {
            let file = arguments.robot.as_ref().unwrap_or(&arguments.model);
            Failure::Message(format!("{}: {error}", file.display()))
        }
        error => Failure::Message(format!("{}: {error}", arguments.model.display())),
    };
    let warnings = experiment.check(&declared, actual).map_err(in_file)?;
    warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    let outcome = simulated(&experiment, &declared, actual);
    let kept = match &outcome {
        Ok(outcome) => Some(outcome),
        Err(ExperimentError::NotFinite { kept, .. }) => Some(&**kept),
        Err(_) => None,
    };
    let motor = arguments.motor.map_or(Motor::Left, Motor::from);
    if let (Some(file), Some(kept)) = (arguments.log_file(), kept) {
        let log = kept.log(motor);
        file.write(|out| record::write_log(&log, out))?;
    }
    let title = title(&experiment, &declared, actual);
    let mut of_models = input::warnings_of(&declared);
    if *actual != declared {
        of_models.extend(input::warnings_of(actual));
    }
    let with = |warnings: &[String]| [warnings, &of_models].concat();
    match &outcome.map_err(in_file)? {
        Outcome::Ground(run) => report_ground(output, &title, run, &with(&run.warnings)),
        Outcome::Bench(run) => {
            let side = if motor == Motor::Left { "left" } else { "right" };
            let of = declared.robot().map_or(String::new(), |_| format!(", {side} motor"));
            report_bench(output, &format!("{title}{of}"), run, motor, &with(&run.warnings))
        }
    }
}

/// Describes the run in one line.
fn title(experiment: &Experiment, declared: &Model, actual: &Model) -> String {
    let Experiment { scenario, controller, seconds, seed, .. } = experiment;
    let robot = if declared == actual { String::new() } else { format!(" on {:?}", actual.name) };
    let controller = controller.name();
    format!("{}{robot}: {scenario}, {controller}, {seconds} s, seed {seed}", declared.name)
}

fn experiment(arguments: &Arguments) -> Experiment {
    let controller = match arguments.controller {
        ControllerName::Lqr => ControllerChoice::Lqr,
        ControllerName::Flqr => ControllerChoice::Flqr,
        ControllerName::Pi => ControllerChoice::Pi,
    };
    let default = Experiment::new(arguments.scenario, controller);
    let settings = &arguments.settings;
    Experiment {
        target_speed_rad_s: settings.target_speed.unwrap_or(default.target_speed_rad_s),
        kick: Push {
            start_s: settings.kick_at.unwrap_or(default.kick.start_s),
            force_n: settings.kick_force.unwrap_or(default.kick.force_n),
            duration_s: settings.kick_duration.unwrap_or(default.kick.duration_s),
            height_m: settings.kick_height.or(default.kick.height_m),
        },
        seconds: arguments.seconds.unwrap_or(default.seconds),
        seed: arguments.seed,
        speed_gains: arguments.kp.zip(arguments.ki).map(|(kp, ki)| SpeedGains { kp, ki }),
        gain: arguments.gain.map(|MotorGain(row)| Matrix2x4::from_rows(&[RowVector4::from(row); 2])),
        leg_height_m: arguments.leg_height,
        slope_rad: settings.slope.unwrap_or(default.slope_rad),
        payload: settings.payload.map(|mass_kg| Payload {
            mass_kg,
            height_m: settings.payload_height.unwrap_or(0.0),
            forward_m: 0.0,
        }),
        torque_scale: settings.torque_scale.unwrap_or(default.torque_scale),
        ..default
    }
}

fn simulated(experiment: &Experiment, declared: &Model, actual: &Model) -> Result<Outcome, ExperimentError> {
    let bar = Progress::new("simulating");
    simulate::run(experiment, declared, actual, &mut |share| {
        bar.set_share(share);
        ControlFlow::Continue(())
    })
}

fn report_ground(output: &Output, title: &str, run: &Run, warnings: &[String]) -> Result<(), Failure> {
    let Statistics { from_s, x_m, x_dot_m_s, pitch_rad, settled, fell } = run.statistics;
    let keys = Simulated {
        statistics: Quantities::Ground { x_m, x_dot_m_s, pitch_rad },
        settled: Some(settled),
        fell,
        fall: run.fall.map(|fall| Fallen { time_s: fall.time_s, state: fall.state }),
        target_x_m: Some(run.target_x_m),
        tracking: None,
        warnings,
    };
    if let Some(fall) = &run.fall {
        let State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s } = fall.state;
        complain(&format!(
            "the robot fell at {:.3} s with x {x_m:.3} m, x_dot {x_dot_m_s:.3} m/s, pitch {pitch_rad:.3} rad, \
             pitch rate {pitch_rate_rad_s:.3} rad/s",
            fall.time_s
        ));
    }
    output.answer(&keys, |out| {
        writeln!(out, "{title}; from {from_s} s, target x {} m\n", run.target_x_m)?;
        table(out, &[("x, m", x_m), ("x_dot, m/s", x_dot_m_s), ("pitch, rad", pitch_rad)])?;
        writeln!(out, "\nsettled: {}, fell: {}", yes(settled), yes(fell))
    })
}

fn report_bench(
    output: &Output,
    title: &str,
    run: &BenchRun,
    motor: Motor,
    warnings: &[String],
) -> Result<(), Failure> {
    let [motor_speed_rad_s, torque_nm] = run.statistics(motor);
    let keys = Simulated {
        statistics: Quantities::Bench { motor_speed_rad_s, torque_nm },
        settled: None,
        fell: false,
        fall: None,
        target_x_m: None,
        tracking: run.tracking.map(|[left, right]| Tracking { left, right }),
        warnings,
    };
    output.answer(&keys, |out| {
        writeln!(out, "{title}\n")?;
        table(out, &[("speed, rad/s", motor_speed_rad_s), ("torque, N m", torque_nm)])?;
        let Some(tracking) = run.tracking else { return Ok(()) };
        writeln!(
            out,
            "\n{:12}{:>14}{:>18}{:>20}",
            "", "rise time, s", "overshoot, rad/s", "steady error, rad/s"
        )?;
        for (label, response) in ["left", "right"].iter().zip(tracking) {
            let rise = response.rise_time_s.map_or("never".to_owned(), |time| format!("{time:.4}"));
            let (overshoot, error) = (response.overshoot_rad_s, response.steady_error_rad_s);
            writeln!(out, "{label:12}{rise:>14}{overshoot:>18.4}{error:>20.4}")?;
        }
        Ok(())
    })
}

fn table(out: &mut dyn Write, rows: &[(&str, Summary)]) -> io::Result<()> {
    writeln!(out, "{:12}{:>12}{:>12}{:>12}{:>12}", "", "min", "max", "mean", "std")?;
    for (label, Summary { min, max, mean, std }) in rows {
        writeln!(out, "{label:12}{min:>12.4}{max:>12.4}{mean:>12.4}{std:>12.4}")?;
    }
    Ok(())
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}
