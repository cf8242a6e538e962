//! The command line: one file for each command, all over the same core functions as the window.

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

/// What the help of the program ends with.
const AFTER_HELP: &str = "\
Exit codes: 0 done; 1 not done, or done in part; 2 wrong usage; 70 a defect of flqr; 130 interrupted. With --json an \
error is one JSON object on standard output too: {\"error\": {code, message, file, line, column, remedy}}, null where \
not known.

Files: an output is never a file that the command reads. It replaces earlier results of flqr and empty files; a \
recording, or a file that flqr did not write, only with --force. Outputs are checked before the work begins.";

/// Tunes the balance controller of a wheel-legged robot: friction-feedforward LQR, closed with measured data.
///
/// Without a command it opens the window. Numbers are SI, angles in rad.
#[derive(Parser)]
#[command(name = "flqr", version, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    window: window::Arguments,
    /// Print one JSON object on standard output and nothing else there, an error too
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Command {
    /// The LQR design of a model: gain, cost, poles
    Gains(gains::Arguments),
    /// Solve any continuous-time algebraic Riccati equation
    Riccati(riccati::Arguments),
    /// Friction and inertia from bench logs
    Fit(fit::Arguments),
    /// How far a model is from logs of its machine
    Residual(residual::Arguments),
    /// Close the loop with measured data: find what the model lacks and add it
    Refine(refine::Arguments),
    /// The whole loop in under a minute, without files or hardware: a simulated robot with a hidden effect
    Demo(demo::Arguments),
    /// Run the simulated robot
    Simulate(simulate::Arguments),
    /// Every experiment of the paper on the simulated robot, ours beside theirs
    Reproduce(reproduce::Arguments),
    /// A simulated robot that speaks the real robot's protocols, on a CAN interface or pseudo-terminals
    Emulate(Box<emulate::Arguments>),
    /// Write a recording as an MCAP file, which Foxglove, PlotJuggler and Rerun open
    Convert(convert::Arguments),
    /// Write what a robot's firmware or a script takes over
    Export(export::Arguments),
    /// Watch a robot, without sending a single frame
    Monitor(monitor::Arguments),
    /// Control a robot, armed in two steps and limited
    Drive(drive::Arguments),
    /// CAN interfaces and serial ports, and the commands that make one
    Interfaces,
    /// Set the IMU's rate and baud rate, for good
    Imu(imu::Arguments),
    /// How late the control loop's ticks come, beside a bare timer loop on this machine
    Timing(timing::Arguments),
}

/// Exit code of what was not done, or in part.
const FAILED: u8 = 1;
/// Exit code of a wrong command line.
const WRONG_USAGE: u8 = 2;

/// Runs the command line and maps its outcome to an exit code.
pub(crate) fn run() -> ExitCode {
    let parsed = Cli::try_parse().and_then(|cli| {
        let message = "the flags of the window stand alone: give a command its flags behind its name";
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

/// Says why a command ended; gives its exit code.
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

/// Prints what is wrong with the command line, or the help that it asks for.
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

    use flqr_core::control::drive::Excitation;
    use flqr_core::control::{BalanceController, ControllerKind};
    use flqr_core::device::{SessionMode, SessionOptions, Source};
    use flqr_core::identify::{Bounds, FitOptions, Method, Motor};
    use flqr_core::model_file::presets;
    use flqr_gui::command_line;
    use nalgebra::Matrix2x4;

    use super::*;

    /// The words of a line as a shell takes them: single quotes, and a quote behind a backslash.
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
