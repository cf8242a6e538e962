//! `flqr drive`: control a robot, armed in two steps and limited.

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use clap::{Args, ValueEnum};
use flqr_core::control::ControllerKind;
use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage, StopReason};
use flqr_core::device::{
    DriveStatus, Ending, Session, SessionMode, SessionOptions, SessionOrder, Source, Status, stop_all,
};

use super::interrupt::{Duty, Interrupt};
use super::monitor::Wire;
use super::output::{Failure, Output, complain};
use super::robot_lines::{End, Lines, Outcome, died};
use super::{controller, input};

/// Timeout of the checks, and of arming after that.
const CHECKS_LAST: Duration = Duration::from_secs(30);
/// Timeout after a stop for both motors to confirm that they are off.
const MOTORS_OFF_LAST: Duration = Duration::from_secs(2);
/// Time between two arm commands, longer than the response takes to arrive.
const ARM_AGAIN: Duration = Duration::from_secs(1);

/// Without --arm, only queries are sent: the checks run and their results are printed. With --arm, the robot is
/// driven when all checks have passed, after a confirmation on the terminal or with --yes. Ctrl+C or Enter stops it.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Connection to the robot: can:INTERFACE, slcan:PORT@BITRATE, emulated
    source: Source,
    /// Model file (TOML) that the controller is designed for, with [link], [limits] and [safety]
    model: PathBuf,
    #[command(flatten)]
    wire: Wire,
    /// State feedback without (lqr) or with (flqr) friction feedforward
    #[arg(long, value_enum, default_value = "flqr")]
    controller: ControllerName,
    /// Task: balance, multisine (balance with added multisine torques); with the wheels in the air:
    /// friction-sweep (constant speeds), air-multisine
    #[arg(long, value_enum, default_value = "balance")]
    run: RunName,
    /// Driving time, s [default: until stopped; friction-sweep 120, air-multisine 60]
    #[arg(long, value_parser = input::seconds)]
    seconds: Option<f64>,
    /// Drive the robot when the checks have passed
    #[arg(long)]
    arm: bool,
    /// With --arm: skip the confirmation
    #[arg(long, requires = "arm")]
    yes: bool,
    /// Random seed of an emulated robot's noise
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

    /// Time at which a run without a natural end is stopped.
    fn end(&self) -> Duration {
        let on_ground = matches!(self.run, RunName::Balance | RunName::Multisine);
        self.seconds.filter(|_| on_ground).map_or(Duration::MAX, Duration::from_secs_f64)
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (_, robot) = input::load_robot(&arguments.model)?;
    let kind = match arguments.controller {
        ControllerName::Lqr => ControllerKind::Lqr,
        ControllerName::Flqr => ControllerKind::Flqr,
    };
    let controller = controller::design(&robot, Some(kind))
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
    let interrupt = Interrupt::watch(Duty::Drive)?;
    let mut session = Session::open(options, Arc::new(|| {})).map_err(Failure::from_error)?;
    session.send(SessionOrder::Drive(DriveOrder::Check));
    let enter_stops = Arc::new(AtomicBool::new(false));
    let mut dialogue = Dialogue {
        arguments,
        interrupt: &interrupt,
        lines: Lines::start(output)?,
        entered: entered_lines(Arc::clone(&enter_stops)),
        enter_stops,
        arming: Arming::default(),
        driven_since: None,
        stopped_since: None,
        stopping: false,
    };
    let mut last = None;
    let held = dialogue.hold(&mut session, &mut last);
    // The motors are off before anybody is waited for.
    let ending = session.close();
    let done = dialogue.conclude(last.map_or(Duration::ZERO, |status| status.time), held, ending);
    interrupt.wait_for_suspension();
    done
}

/// Lines entered on the terminal, if there is one; each stops the robot at once while `stops` is set.
fn entered_lines(stops: Arc<AtomicBool>) -> Option<Receiver<String>> {
    if !io::stdin().is_terminal() {
        return None;
    }
    let (sender, lines) = channel();
    let read = move || {
        for line in io::stdin().lines().map_while(Result::ok) {
            if stops.load(Ordering::Acquire) {
                stop_all();
            }
            if sender.send(line).is_err() {
                return;
            }
        }
    };
    // The thread ends with the program: nothing can wake it from reading.
    std::thread::Builder::new().name("terminal".to_owned()).spawn(read).ok()?;
    Some(lines)
}

/// Sequence from the checks to the end. Signals and Enter stop the robot independently of
/// this thread.
struct Dialogue<'a> {
    arguments: &'a Arguments,
    interrupt: &'a Interrupt,
    lines: Lines<'a>,
    entered: Option<Receiver<String>>,
    /// An entered line stops the robot instead of answering a question.
    enter_stops: Arc<AtomicBool>,
    arming: Arming,
    driven_since: Option<Duration>,
    stopped_since: Option<Duration>,
    stopping: bool,
}

impl Dialogue<'_> {
    fn hold(&mut self, session: &mut Session, last: &mut Option<Status>) -> Result<End, Failure> {
        loop {
            // Asked before, so that the last updates of a thread that has ended are read.
            let is_over = session.has_died();
            match session.wait(Duration::from_millis(100)) {
                Some(update) => {
                    self.lines.update(&update)?;
                    *last = Some(update.status);
                }
                None if is_over => return Err(died()),
                None => {}
            }
            if let Some(end) = self.go_on(last.as_ref(), session)? {
                return Ok(end);
            }
        }
    }

    /// Advances the sequence; returns the reason if the run has ended.
    fn go_on(&mut self, status: Option<&Status>, session: &mut Session) -> Result<Option<End>, Failure> {
        let drive = status.and_then(|status| status.drive.as_ref());
        let now = status.map_or(Duration::ZERO, |status| status.time);
        match drive.map_or(Stage::Listening, |drive| drive.stage) {
            Stage::Stopped(_) if self.interrupt.came() && self.driven_since.is_none() => {
                return Ok(Some(End::Interrupt));
            }
            Stage::Stopped(reason) => {
                let since = *self.stopped_since.get_or_insert(now);
                let motors_off = drive.is_some_and(|drive| drive.motors_off);
                if motors_off || now.saturating_sub(since) > MOTORS_OFF_LAST {
                    return Ok(Some(End::Stopped(reason)));
                }
            }
            Stage::Driving => {
                let since = *self.driven_since.get_or_insert(now);
                let over = now.saturating_sub(since) >= self.arguments.end();
                if !self.stopping && (over || self.wants_to_stop()) {
                    self.stopping = true;
                    session.send(SessionOrder::Drive(if over {
                        DriveOrder::Finish
                    } else {
                        DriveOrder::Stop
                    }));
                }
            }
            // Should an order to arm be on its way, it is undone: closing the session switches the motors off.
            Stage::Listening | Stage::Checking if self.interrupt.came() => {
                session.send(SessionOrder::Drive(DriveOrder::Release));
                return Ok(Some(End::Interrupt));
            }
            // What is entered from here on stops the robot.
            Stage::Listening | Stage::Checking if self.arming.is_on_its_way(now) => {}
            Stage::Checking if drive.is_some_and(passed) => {
                self.enter_stops.store(false, Ordering::Release);
                self.arming.ready_at.get_or_insert(now);
                if !self.arguments.arm {
                    return Ok(Some(End::Checked));
                }
                if self.agreed()? {
                    self.arming.ordered_at = Some(now);
                    self.enter_stops.store(true, Ordering::Release);
                    session.send(SessionOrder::Drive(DriveOrder::Arm));
                }
            }
            Stage::Listening | Stage::Checking => self.discard_early_answers(),
        }
        if self.driven_since.is_none() && self.arming.is_too_late(now) {
            return Err(failed_checks(drive));
        }
        Ok(None)
    }

    /// Prints the last line and maps the outcome to a result.
    fn conclude(
        mut self,
        time: Duration,
        held: Result<End, Failure>,
        ending: Option<Ending>,
    ) -> Result<(), Failure> {
        let mut problems: Vec<String> = Vec::new();
        let (mut is_defect, mut is_unread) = (false, false);
        let end = match held {
            Ok(end) => Some(end),
            Err(Failure::ReaderGone) => {
                is_unread = true;
                if self.driven_since.is_some() {
                    problems.push("the robot was stopped: standard output was closed".to_owned());
                }
                None
            }
            Err(Failure::Defect(problem)) => {
                is_defect = true;
                problems.push(problem);
                None
            }
            Err(
                Failure::Message(problem)
                | Failure::Input(problem)
                | Failure::Output(problem)
                | Failure::Partial(problem),
            ) => {
                problems.push(problem);
                None
            }
            Err(usage @ Failure::Usage(_)) => return Err(usage),
        };
        let signal = self.interrupt.signal();
        match &end {
            Some(End::Stopped(StopReason::Requested)) => {
                let usual = signal.is_none_or(|signal| ["SIGINT", "SIGTERM", "Ctrl+C"].contains(&signal));
                problems.extend(
                    signal
                        .filter(|_| !usual)
                        .map(|signal| format!("the robot was stopped: received {signal}")),
                );
            }
            Some(End::Stopped(StopReason::TimeOver | StopReason::Done)) => {}
            Some(End::Stopped(reason)) => problems.push(format!("the robot was stopped: {reason}")),
            _ => {}
        }
        let Ending { motors_off, recording } = ending.unwrap_or_default();
        if !motors_off {
            let text = "the motors have not confirmed that they are off: switch off their supply";
            problems.push(text.to_owned());
        }
        problems.extend(recording.as_ref().and_then(|recording| recording.problem.clone()));
        let problem = (!problems.is_empty()).then(|| problems.join("; "));
        let outcome = Outcome { problem: problem.clone(), signal, motors_off: Some(motors_off), recording };
        let printed = if is_unread {
            Err(Failure::ReaderGone)
        } else {
            self.lines.end(time, end.as_ref(), outcome).and_then(|()| self.lines.finish(self.interrupt))
        };
        match problem {
            None => printed,
            Some(problem) if is_defect => Err(Failure::Defect(problem)),
            Some(problem) => Err(Failure::Message(problem)),
        }
    }

    fn wants_to_stop(&self) -> bool {
        self.interrupt.came() || self.entered.as_ref().is_some_and(|lines| lines.try_recv().is_ok())
    }

    /// Returns whether the motors may receive torque.
    fn agreed(&mut self) -> Result<bool, Failure> {
        if self.arguments.yes {
            return Ok(true);
        }
        let Some(lines) = &self.entered else {
            let problem =
                "the checks have passed, but there is no terminal for the confirmation: add --yes to --arm";
            return Err(Failure::Message(problem.to_owned()));
        };
        if !std::mem::replace(&mut self.arming.asked, true) {
            // What was typed before the question does not answer it.
            lines.try_iter().for_each(drop);
            complain(
                "the checks have passed. Hold the robot, then type drive and press Enter; Enter or Ctrl+C stops it",
            );
        }
        Ok(lines.try_recv().is_ok_and(|line| line.trim() == "drive"))
    }

    /// A line that was typed while a check is open must not arm the robot as soon as it passes.
    fn discard_early_answers(&self) {
        let answers = self.entered.iter().filter(|_| self.arming.asked);
        if answers.flat_map(Receiver::try_iter).count() > 0 {
            complain("a check no longer passes: type drive when all checks pass");
        }
    }
}

/// State of arming.
#[derive(Default)]
struct Arming {
    /// Time at which the checks first passed.
    ready_at: Option<Duration>,
    /// The user has been asked for confirmation.
    asked: bool,
    /// Time of the last arm command.
    ordered_at: Option<Duration>,
}

impl Arming {
    /// Returns whether the response to an arm command may still be on its way. It is a refusal if a check has failed
    /// meanwhile.
    fn is_on_its_way(&self, now: Duration) -> bool {
        self.ordered_at.is_some_and(|at| now.saturating_sub(at) < ARM_AGAIN)
    }

    /// Returns whether the robot should be driving by now.
    fn is_too_late(&self, now: Duration) -> bool {
        !self.asked && now.saturating_sub(self.ready_at.unwrap_or_default()) > CHECKS_LAST
    }
}

fn passed(drive: &DriveStatus) -> bool {
    !drive.checks.is_empty() && drive.checks.iter().all(|check| check.result == CheckResult::Passed)
}

fn failed_checks(drive: Option<&DriveStatus>) -> Failure {
    let checks = drive.iter().flat_map(|drive| &drive.checks);
    let of = |result: CheckResult| -> Vec<String> {
        let open = checks.clone().filter(|check| check.result == result);
        open.map(|check| format!("{}: {}", check.name, check.text)).collect()
    };
    let mut open = of(CheckResult::Failed);
    if open.is_empty() {
        // What is waited for may wait for what has failed.
        open = of(CheckResult::Waiting);
    }
    if open.is_empty() {
        open.push(
            "the checks pass only intermittently and every attempt to arm failed: hold the robot still"
                .to_owned(),
        );
    }
    Failure::Message(format!("the robot is not ready to drive: {}", open.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arming_is_ordered_again_after_a_refusal_but_not_for_ever() {
        let seconds = Duration::from_secs_f64;
        let mut arming = Arming { ready_at: Some(seconds(5.0)), ..Arming::default() };
        assert!(!arming.is_on_its_way(seconds(5.0)), "no order was given");
        arming.ordered_at = Some(seconds(5.0));
        let on_its_way = [5.0, 5.03, 5.9, 6.0, 8.0].map(|now| arming.is_on_its_way(seconds(now)));
        assert_eq!(on_its_way, [true, true, true, false, false]);
        let too_late = [30.1, 35.0, 35.1].map(|now| arming.is_too_late(seconds(now)));
        assert_eq!(too_late, [false, false, true]);
        arming.asked = true;
        assert!(!arming.is_too_late(seconds(1000.0)), "whoever is asked has time");
        let never_ready = Arming::default();
        assert!(never_ready.is_too_late(seconds(30.1)) && !never_ready.is_too_late(seconds(30.0)));
    }
}
