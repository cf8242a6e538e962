//! The command line: one file for each command, all over the same core functions as the window.

mod controller;
mod convert;
mod demo;
mod drive;
mod emulate;
mod export;
mod file;
mod fit;
mod gains;
mod imu;
mod input;
mod interfaces;
mod interrupt;
mod monitor;
mod output;
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

use clap::{CommandFactory, Parser, Subcommand};

use output::{Failure, Output};

/// Tunes the balance controller of a wheel-legged robot: friction-feedforward LQR, closed with measured data.
///
/// Without a command it opens the window. Numbers are SI, angles in rad.
#[derive(Parser)]
#[command(name = "flqr", version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    window: window::Arguments,
    /// Print one JSON object on standard output and nothing else there
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

/// Runs the command and maps its outcome to an exit code: 0 done, 1 could not be done.
pub(crate) fn run(cli: Cli) -> ExitCode {
    if cli.command.is_some() && cli.window != window::Arguments::default() {
        let message = "the flags of the window stand alone: give a command its flags behind its name";
        Cli::command().error(clap::error::ErrorKind::ArgumentConflict, message).exit();
    }
    let output = Output::new(cli.json);
    let done = match cli.command {
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
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::ReaderGone) => ExitCode::SUCCESS,
        Err(Failure::Message(message)) => {
            output::complain(&message);
            ExitCode::FAILURE
        }
    }
}
