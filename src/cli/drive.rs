//! `flqr drive`: control a robot, armed in two steps and limited.

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use clap::{Args, ValueEnum};
use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage, StopReason};
use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::device::{Session, SessionMode, SessionOptions, SessionOrder, Source, Status};
use flqr_core::lqr;
use flqr_core::model_file::RobotModel;

use super::input;
use super::interrupt::Interrupt;
use super::monitor::{Wire, seconds};
use super::output::{Failure, Output, complain};
use super::robot_lines::Lines;

/// How long the checks may take to pass.
const CHECKS_LAST: Duration = Duration::from_secs(30);

/// Without --arm nothing is sent but queries: the checks are made and told. With --arm the robot is driven once they
/// have passed, after a question on the terminal or with --yes. Ctrl+C, or Enter, stops it.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Where the frames come from and go to: can:INTERFACE, slcan:PORT@BITRATE, emulated
    source: Source,
    /// Model file (TOML) that makes the controller, with [link], [limits] and [safety]
    model: PathBuf,
    #[command(flatten)]
    wire: Wire,
    /// State feedback without or with friction feedforward
    #[arg(long, value_enum, default_value = "flqr")]
    controller: ControllerName,
    /// What the motors do: balance, multisine (balance with torques on top), and with the wheels in the air
    /// friction-sweep (constant speeds) and air-multisine
    #[arg(long, value_enum, default_value = "balance")]
    run: RunName,
    /// How long the robot is driven, s [default: until stopped, friction-sweep 120, air-multisine 60]
    #[arg(long, value_parser = seconds)]
    seconds: Option<f64>,
    /// Drive once the checks have passed
    #[arg(long)]
    arm: bool,
    /// With --arm: do not ask
    #[arg(long, requires = "arm")]
    yes: bool,
    /// Seed of an emulated robot's noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum ControllerName {
    Lqr,
    Flqr,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum RunName {
    Balance,
    Multisine,
    FrictionSweep,
    AirMultisine,
}

impl Arguments {
    fn excitation(&self) -> Excitation {
        match self.run {
            RunName::Balance => Excitation::Balance,
            RunName::Multisine => Excitation::BalanceMultisine,
            RunName::FrictionSweep => Excitation::SpeedSweep { seconds: self.seconds.unwrap_or(120.0) },
            RunName::AirMultisine => Excitation::Multisine { seconds: self.seconds.unwrap_or(60.0) },
        }
    }

    /// When a run that has no end of its own is stopped.
    fn end(&self) -> Duration {
        let on_ground = matches!(self.run, RunName::Balance | RunName::Multisine);
        self.seconds.filter(|_| on_ground).map_or(Duration::MAX, Duration::from_secs_f64)
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (_, robot) = input::load_robot(&arguments.model)?;
    let controller = controller(arguments, &robot)
        .map_err(|problem| Failure::Message(format!("{}: {problem}", arguments.model.display())))?;
    let options = SessionOptions {
        source: arguments.source.clone(),
        imu: arguments.wire.imu.clone(),
        dbc: None,
        robot,
        mode: SessionMode::Drive { controller: Box::new(controller), excitation: arguments.excitation() },
        record: arguments.wire.record.clone(),
        seed: arguments.seed,
        replay_speed: 1.0,
    };
    let interrupt = Interrupt::watch()?;
    let mut session = Session::open(options, Arc::new(|| {})).map_err(Failure::from_error)?;
    session.send(SessionOrder::Drive(DriveOrder::Check));
    Dialogue { arguments, interrupt, lines: Lines::new(output), entered: entered_lines() }.hold(&mut session)
}

fn controller(arguments: &Arguments, robot: &RobotModel) -> Result<BalanceController, String> {
    let weights = robot.weights.ok_or("it has no [lqr] table: add q_diagonal and r_diagonal")?;
    let gain =
        lqr::design(&robot.parameters.linear_model(), &weights).map_err(|error| error.to_string())?.gain;
    let kind = match arguments.controller {
        ControllerName::Lqr => ControllerKind::Lqr,
        ControllerName::Flqr => ControllerKind::Flqr,
    };
    BalanceController::new(kind, robot, gain).map_err(|error| error.to_string())
}

/// Lines that the user enters, where somebody can.
fn entered_lines() -> Option<Receiver<String>> {
    if !io::stdin().is_terminal() {
        return None;
    }
    let (sender, lines) = channel();
    let read = move || {
        for line in io::stdin().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    };
    // The thread ends with the program: nothing can wake it from reading.
    std::thread::Builder::new().name("terminal".to_owned()).spawn(read).ok()?;
    Some(lines)
}

/// The course of events, from the checks to the end.
struct Dialogue<'a> {
    arguments: &'a Arguments,
    interrupt: Interrupt,
    lines: Lines<'a>,
    entered: Option<Receiver<String>>,
}

impl Dialogue<'_> {
    fn hold(mut self, session: &mut Session) -> Result<(), Failure> {
        let mut asked = false;
        let mut armed_at = None;
        let mut ready_at = None;
        let mut stopping = false;
        loop {
            let Some(update) = session.wait(Duration::from_millis(100)) else { continue };
            self.lines.update(&update)?;
            let status = &update.status;
            let now = status.time;
            let stage = status.drive.as_ref().map_or(Stage::Listening, |drive| drive.stage);
            match stage {
                Stage::Stopped(reason) => return self.ended(now, reason),
                Stage::Driving => {
                    let since = *armed_at.get_or_insert(now);
                    let over = now.saturating_sub(since) >= self.arguments.end();
                    if !stopping && (over || self.wants_to_stop()) {
                        stopping = true;
                        session.send(SessionOrder::Drive(DriveOrder::Stop));
                    }
                }
                Stage::Listening | Stage::Checking if self.interrupt.came() => {
                    session.send(SessionOrder::Drive(DriveOrder::Release));
                    return self.lines.end(now, None);
                }
                Stage::Checking if passed(status) => {
                    ready_at.get_or_insert(now);
                    if !self.arguments.arm {
                        return self.lines.end(now, None);
                    }
                    if self.agreed(&mut asked)? {
                        session.send(SessionOrder::Drive(DriveOrder::Arm));
                    }
                }
                Stage::Listening | Stage::Checking => {
                    if ready_at.is_none() && now > CHECKS_LAST {
                        return Err(failed_checks(status));
                    }
                }
            }
        }
    }

    fn ended(&self, now: Duration, reason: StopReason) -> Result<(), Failure> {
        self.lines.end(now, Some(Stage::Stopped(reason)))?;
        match reason {
            StopReason::Asked | StopReason::Done => Ok(()),
            reason => Err(Failure::Message(format!("the robot was stopped: {reason}"))),
        }
    }

    fn wants_to_stop(&self) -> bool {
        self.interrupt.came() || self.entered.as_ref().is_some_and(|lines| lines.try_recv().is_ok())
    }

    /// Whether the motors may get torque.
    fn agreed(&self, asked: &mut bool) -> Result<bool, Failure> {
        if self.arguments.yes {
            return Ok(!std::mem::replace(asked, true));
        }
        let Some(lines) = &self.entered else {
            let problem =
                "the checks have passed, but there is no terminal to ask on: give --yes beside --arm";
            return Err(Failure::Message(problem.to_owned()));
        };
        if !std::mem::replace(asked, true) {
            complain(
                "the checks have passed. Hold the robot, then type drive and Enter; Enter or Ctrl+C stops it",
            );
        }
        Ok(lines.try_recv().is_ok_and(|line| line.trim() == "drive"))
    }
}

fn passed(status: &Status) -> bool {
    status.drive.as_ref().is_some_and(|drive| {
        !drive.checks.is_empty() && drive.checks.iter().all(|check| check.result == CheckResult::Passed)
    })
}

fn failed_checks(status: &Status) -> Failure {
    let checks = status.drive.iter().flat_map(|drive| &drive.checks);
    let open: Vec<&str> =
        checks.filter(|check| check.result != CheckResult::Passed).map(|check| check.text.as_str()).collect();
    Failure::Message(format!("the robot is not ready to be driven: {}", open.join("; ")))
}
