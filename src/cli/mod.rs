//! Command line: one file per command, on the same core functions as the window.

mod controller;
mod convert;
mod defect;
mod demo;
mod drive;
mod emulate;
mod error_keys;
mod export;
mod finite;
mod fit;
mod gains;
mod imu;
mod input;
mod interfaces;
mod interrupt;
mod logs;
mod monitor;
mod output;
mod output_file;
mod printer;
mod progress;
mod refine;
mod reproduce;
mod residual;
mod riccati;
mod robot_lines;
mod simulate;
mod timing;
mod window;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

pub(crate) use defect::guard;
use error_keys::ErrorKeys;
use output::{Failure, Output};

/// Text after the program's help.
const AFTER_HELP: &str = "\
Exit codes: 0 success; 1 failure or partial result; 2 usage error; 70 internal error; 130 interrupted. With --json, an error \
is also printed as one JSON object on standard output: {\"error\": {code, message, file, line, column, remedy}}, null if \
unknown.

Files: a command never overwrites its input. It overwrites earlier results of flqr and empty files; recordings and \
files that flqr did not write are overwritten only with --force. Outputs are checked before the work starts.";

/// Tunes the balance controller of a wheel-legged robot: LQR with friction feedforward, refined with measured data.
///
/// Without a command, opens the window. Units are SI, angles in rad.
#[derive(Parser)]
#[command(name = "flqr", version, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    window: window::Arguments,
    /// Print one JSON object, and nothing else, on standard output; also for errors
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Design the LQR for a model: gain, cost matrix, poles
    Gains(gains::Arguments),
    /// Solve a continuous-time algebraic Riccati equation
    Riccati(riccati::Arguments),
    /// Identify friction and inertia from bench logs
    Fit(fit::Arguments),
    /// Compute the residual of a model on logs
    Residual(residual::Arguments),
    /// Find the effects that a model lacks in measured data and add them
    Refine(refine::Arguments),
    /// Run the whole loop in under a minute without files or hardware, on a simulated robot with a hidden effect
    Demo(demo::Arguments),
    /// Simulate a robot in a scenario
    Simulate(simulate::Arguments),
    /// Reproduce the experiments of the paper in simulation and compare the results
    Reproduce(reproduce::Arguments),
    /// Emulate a robot with its real protocols on a CAN interface or pseudo-terminals
    Emulate(Box<emulate::Arguments>),
    /// Convert a recording to MCAP for Foxglove, PlotJuggler and Rerun
    Convert(convert::Arguments),
    /// Export the controller for firmware or scripts
    Export(export::Arguments),
    /// Monitor a robot without sending any frame
    Monitor(monitor::Arguments),
    /// Drive a robot, with two-step arming and limits
    Drive(drive::Arguments),
    /// List CAN interfaces and serial ports, with the commands that set one up
    Interfaces,
    /// Set the output rate and baud rate of the IMU permanently
    Imu(imu::Arguments),
    /// Measure the timing jitter of the control loop against a bare timer loop
    Timing(timing::Arguments),
}

/// Exit code of a failure or a partial result.
const FAILED: u8 = 1;
/// Exit code of a usage error.
const WRONG_USAGE: u8 = 2;

/// Runs the command line and maps its outcome to an exit code.
pub(crate) fn run() -> ExitCode {
    let parsed = Cli::try_parse().and_then(|cli| {
        let message = "flags of the window cannot be combined with a command: put the flags of a command after its name";
        match cli.command.is_some() && cli.window != window::Arguments::default() {
            true => Err(Cli::command().error(ErrorKind::ArgumentConflict, message)),
            false => Ok(cli),
        }
    });
    match parsed.map_err(Failure::Usage).and_then(done) {
        Ok(()) | Err(Failure::ReaderGone) => ExitCode::SUCCESS,
        Err(failure) => report(failure),
    }
}

/// Runs the command.
fn done(cli: Cli) -> Result<(), Failure> {
    let output = Output::new(cli.json);
    match cli.command {
        None => window::run(cli.window),
        Some(Command::Gains(arguments)) => gains::run(&arguments, &output),
        Some(Command::Riccati(arguments)) => riccati::run(&arguments, &output),
        Some(Command::Fit(arguments)) => fit::run(&arguments, &output),
        Some(Command::Residual(arguments)) => residual::run(&arguments, &output),
        Some(Command::Refine(arguments)) => refine::run(&arguments, &output),
        Some(Command::Demo(arguments)) => demo::run(&arguments, &output),
        Some(Command::Simulate(arguments)) => simulate::run(&arguments, &output),
        Some(Command::Reproduce(arguments)) => reproduce::run(&arguments, &output),
        Some(Command::Emulate(arguments)) => emulate::run(&arguments, &output),
        Some(Command::Convert(arguments)) => convert::run(&arguments, &output),
        Some(Command::Export(arguments)) => export::run(&arguments, &output),
        Some(Command::Monitor(arguments)) => monitor::run(&arguments, &output),
        Some(Command::Drive(arguments)) => drive::run(&arguments, &output),
        Some(Command::Interfaces) => interfaces::run(&output),
        Some(Command::Imu(arguments)) => imu::run(&arguments, &output),
        Some(Command::Timing(arguments)) => timing::run(&arguments, &output),
    }
}

/// Reports why a command failed and returns its exit code.
fn report(failure: Failure) -> ExitCode {
    let (code, message, exit) = match failure {
        Failure::Usage(error) => return report_usage(&error),
        Failure::Message(message) => ("failed", message, FAILED),
        Failure::Input(message) => ("input_file", message, FAILED),
        Failure::Output(message) => ("output_file", message, FAILED),
        Failure::Defect(message) => ("defect", message, defect::EXIT_CODE),
        Failure::Partial(message) => {
            output::complain(&message);
            return ExitCode::from(FAILED);
        }
        Failure::ReaderGone => return ExitCode::SUCCESS,
    };
    output::complain(&message);
    if error_keys::wanted() {
        ErrorKeys::new(code, &message).print();
    }
    ExitCode::from(exit)
}

/// Prints the usage error or the requested help.
fn report_usage(error: &clap::Error) -> ExitCode {
    // Nobody reads it: the exit code says the same.
    error.print().unwrap_or(());
    if !error.use_stderr() {
        return ExitCode::SUCCESS;
    }
    if error_keys::wanted() {
        ErrorKeys::usage(&error.to_string()).print();
    }
    ExitCode::from(WRONG_USAGE)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use flqr_core::control::{BalanceController, ControllerKind, drive::Excitation};
    use flqr_core::device::{SessionMode, SessionOptions, Source};
    use flqr_core::identify::{Bounds, FitOptions, Method};
    use flqr_core::model::Motor;
    use flqr_core::model_file::presets;
    use flqr_gui::command_line;
    use nalgebra::Matrix2x4;

    use super::*;

    /// Splits a line as a shell does: single quotes and backslash-escaped quotes.
    fn words(line: &str) -> Vec<String> {
        let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
        let mut letters = line.chars();
        while let Some(letter) = letters.next() {
            match letter {
                '\'' => quoted = !quoted,
                '\\' if !quoted => word.extend(letters.next()),
                ' ' if !quoted => words.push(std::mem::take(&mut word)),
                _ => word.push(letter),
            }
        }
        words.push(word);
        words
    }

    fn session(source: &str, mode: SessionMode) -> SessionOptions {
        SessionOptions {
            source: source.parse().unwrap(),
            imu: Some("serial:/dev/ttyUSB0@115200".parse().unwrap()),
            dbc: None,
            robot: presets::paper().robot().unwrap().clone(),
            mode,
            record: None,
            seed: 1,
            replay_speed: 2.5,
        }
    }

    fn drive(excitation: Excitation) -> SessionMode {
        let paper = presets::paper();
        let controller =
            BalanceController::new(ControllerKind::Lqr, paper.robot().unwrap(), Matrix2x4::zeros()).unwrap();
        SessionMode::Drive { controller: Box::new(controller), excitation }
    }

    #[test]
    fn what_the_window_copies_is_a_command() {
        let path = Some(Path::new("it's my robot.toml"));
        let map = ["torque_nm=Motor current*0.32".parse().unwrap(), "time_s=t".parse().unwrap()];
        let log = Path::new("a log.csv");
        let every = FitOptions {
            method: Method::Pso,
            bounds: Bounds::Paper,
            estimate: vec!["all".to_owned()],
            seed: 3,
        };
        let mut lines = vec![
            command_line::gains(path),
            command_line::gains(None),
            command_line::fit(log, &map, Motor::Right, &every, Some(path)),
            command_line::fit(log, &[], Motor::Left, &FitOptions::default(), None),
        ];
        for source in ["can:can0", "slcan:/dev/ttyACM0@1000000", "emulated", "replay:a recording.csv"] {
            let options = session(source, SessionMode::Listen);
            lines.push(command_line::robot(&options, &[], ControllerKind::Flqr, path));
        }
        for excitation in [
            Excitation::Balance,
            Excitation::BalanceMultisine,
            Excitation::SpeedSweep { seconds: 30.5 },
            Excitation::Multisine { seconds: 60.0 },
        ] {
            let options = session("can:can0", drive(excitation));
            lines.push(command_line::robot(&options, &[], ControllerKind::Lqr, None));
        }
        for line in lines {
            let read = Cli::try_parse_from(words(&line));
            assert!(read.is_ok(), "{line}: {}", read.err().unwrap());
        }
        assert_eq!("can:can0".parse::<Source>().unwrap().to_string(), "can:can0");
    }
}
