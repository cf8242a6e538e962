//! The session with a robot: opened and closed on threads, drained once a frame.

use std::sync::Arc;
use std::time::{Duration, Instant};

use flqr_core::control::BalanceController;
use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage};
use flqr_core::device::{
    Connection, DriveStatus, Ending, SessionMode, SessionOptions, SessionOrder, Source, Status, Update,
};
use flqr_core::report::capitalised;

use super::feed::{Devices, RobotFeed};
use super::transfer::Transfer;
use crate::history::History;
use crate::job::{Job, Outcome, Waker};

/// An update that comes sooner after an order may have been made before it.
const ORDER_ROUND_TRIP: Duration = Duration::from_millis(300);
/// Problem of a session whose threads have ended unexpectedly.
const DIED: &str = "the connection to the robot has ended unexpectedly: this is an internal error. Switch the robot off manually if it still moves";

type Opened = Result<Box<dyn RobotFeed>, String>;

enum State {
    Closed,
    /// The previous session has not released its ports yet.
    Waiting(Waker),
    Opening(Job<(), Opened>),
    Open(Box<dyn RobotFeed>),
}

/// A session that is being closed.
struct Closing {
    /// Its result: the problems, one sentence each.
    job: Job<(), Vec<String>>,
    /// True if it was open, so that its motors may be on until it has ended.
    was_open: bool,
}

/// The one session of the window.
pub(crate) struct Link {
    devices: Arc<dyn Devices>,
    state: State,
    /// Options of the session, also after it was closed.
    options: Option<SessionOptions>,
    closing: Option<Closing>,
    /// Problems at the end of the last session.
    end_problems: Vec<String>,
    /// Time of the last arming command, until an update must reflect it.
    arming: Option<Instant>,
    /// True if that command switches the motors on.
    arms: bool,
    pub(crate) transfer: Transfer,
    interval: Duration,
    pub(crate) history: History,
    pub(crate) status: Option<Status>,
    pub(crate) rows: u64,
    pub(crate) replay_is_paused: bool,
    /// Reason why the last attempt to connect failed.
    pub(crate) problem: Option<String>,
}

impl Link {
    pub(crate) fn new(devices: Arc<dyn Devices>) -> Self {
        Self {
            devices,
            state: State::Closed,
            options: None,
            closing: None,
            end_problems: Vec::new(),
            arming: None,
            arms: false,
            transfer: Transfer::default(),
            interval: Duration::from_millis(33),
            history: History::default(),
            status: None,
            rows: 0,
            replay_is_paused: false,
            problem: None,
        }
    }

    pub(crate) fn devices(&self) -> &Arc<dyn Devices> {
        &self.devices
    }

    pub(crate) fn is_open(&self) -> bool {
        matches!(self.state, State::Open(_))
    }

    pub(crate) fn is_opening(&self) -> bool {
        matches!(self.state, State::Waiting(_) | State::Opening(_))
    }

    /// Returns whether the previous session still holds its ports.
    pub(crate) fn is_closing(&self) -> bool {
        self.closing.is_some()
    }

    /// Problems at the end of the last session; empty while another one is connecting or open.
    pub(crate) fn end_problems(&self) -> &[String] {
        &self.end_problems
    }

    /// Options of the current session.
    pub(crate) fn options(&self) -> Option<&SessionOptions> {
        self.options.as_ref().filter(|_| !matches!(self.state, State::Closed))
    }

    /// Returns whether the session may send frames.
    pub(crate) fn may_drive(&self) -> bool {
        self.options().is_some_and(|options| matches!(options.mode, SessionMode::Drive { .. }))
    }

    pub(crate) fn is_replay(&self) -> bool {
        self.options().is_some_and(|options| matches!(options.source, Source::Replay { .. }))
    }

    /// Status of the drive; `None` without a session that may drive.
    pub(crate) fn drive(&self) -> Option<&DriveStatus> {
        self.status.as_ref().filter(|_| self.is_open())?.drive.as_ref()
    }

    /// Stage of the robot; `None` without a session.
    pub(crate) fn stage(&self) -> Option<Stage> {
        self.is_open().then(|| self.drive().map_or(Stage::Listening, |drive| drive.stage))
    }

    /// Returns whether commands are sent to the motors, or may be at any moment, or the motors have not confirmed
    /// that they are off.
    pub(crate) fn is_hot(&self) -> bool {
        let is_active =
            self.arming.is_some() || matches!(self.stage(), Some(Stage::Checking | Stage::Driving));
        self.may_drive() && (is_active || self.awaits_motors_off())
    }

    /// Returns whether the motors follow the controller, or may at any moment.
    pub(crate) fn is_driven(&self) -> bool {
        let arms = self.arms && self.arming.is_some();
        self.may_drive() && (arms || self.stage() == Some(Stage::Driving))
    }

    /// Returns whether the robot was stopped, but its motors have not confirmed that they are off.
    pub(crate) fn awaits_motors_off(&self) -> bool {
        self.drive().is_some_and(|drive| matches!(drive.stage, Stage::Stopped(_)) && !drive.motors_off)
    }

    /// Returns whether the second step of arming may be taken.
    pub(crate) fn may_arm(&self) -> bool {
        self.drive().is_some_and(|drive| {
            drive.stage == Stage::Checking
                && !drive.checks.is_empty()
                && drive.checks.iter().all(|check| check.result == CheckResult::Passed)
        })
    }

    /// Opens a session in place of the current one.
    pub(crate) fn open(&mut self, options: SessionOptions, waker: &Waker) {
        self.close(waker);
        self.forget();
        let controller = match &options.mode {
            SessionMode::Drive {
                controller,
                excitation: Excitation::Balance | Excitation::BalanceMultisine,
            } => Some((**controller).clone()),
            SessionMode::Drive { .. } | SessionMode::Listen => None,
        };
        self.transfer.begin(controller);
        self.options = Some(options);
        self.state = State::Waiting(Arc::clone(waker));
        self.start_opening();
    }

    /// Starts to open the session once the previous one has released its ports.
    fn start_opening(&mut self) {
        let (State::Waiting(waker), None, Some(options)) = (&self.state, &self.closing, &self.options) else {
            return;
        };
        let (devices, wake, options) = (Arc::clone(&self.devices), Arc::clone(waker), options.clone());
        match Job::start("open-session", waker, move |_| devices.open(options, wake)) {
            Ok(job) => {
                self.state = State::Opening(job);
                self.end_problems.clear();
            }
            Err(error) => {
                self.state = State::Closed;
                self.problem = Some(format!("Cannot start connecting: {error}."));
            }
        }
    }

    /// Discards the data of the last session.
    pub(crate) fn forget(&mut self) {
        self.history.clear();
        (self.status, self.rows, self.replay_is_paused, self.problem) = (None, 0, false, None);
    }

    /// Ends the session; a robot that it drives is stopped first. A robot that it has not armed is left alone.
    pub(crate) fn close(&mut self, waker: &Waker) {
        if self.is_driven() {
            self.stop();
        }
        self.arming = None;
        self.transfer.begin(None);
        let state = std::mem::replace(&mut self.state, State::Closed);
        if matches!(state, State::Closed | State::Waiting(_)) {
            return;
        }
        let was_open = matches!(state, State::Open(_));
        let work = move |_: &_| {
            let feed = match state {
                State::Open(feed) => Some(feed),
                State::Opening(job) => job.wait().and_then(Result::ok),
                State::Closed | State::Waiting(_) => None,
            };
            feed.map(|feed| problems(feed.close())).unwrap_or_default()
        };
        match Job::start("close-session", waker, work) {
            Ok(job) => self.closing = Some(Closing { job, was_open }),
            // The session has ended right here, when the closure was dropped.
            Err(error) => self.problem = Some(format!("Cannot wait for the end of the connection: {error}.")),
        }
    }

    /// Ends the session and waits until its motors are off. Returns the problems at the end of the last session.
    pub(crate) fn end(&mut self, waker: &Waker) -> Vec<String> {
        self.close(waker);
        if let Some(Closing { job, .. }) = self.closing.take_if(|closing| closing.was_open) {
            self.end_problems = job.wait().unwrap_or_else(|| vec![DIED.to_owned()]);
        }
        std::mem::take(&mut self.end_problems)
    }

    pub(crate) fn send(&mut self, order: SessionOrder) {
        let State::Open(feed) = &mut self.state else { return };
        match &order {
            SessionOrder::Drive(order @ (DriveOrder::Check | DriveOrder::Arm)) => {
                (self.arming, self.arms) = (Some(Instant::now()), *order == DriveOrder::Arm);
                self.transfer.note_armed();
            }
            SessionOrder::Pause(paused) => self.replay_is_paused = *paused,
            _ => {}
        }
        feed.send(order);
    }

    /// Stops the robot: zero torque, motors off.
    pub(crate) fn stop(&mut self) {
        if self.may_drive() {
            self.send(SessionOrder::Drive(DriveOrder::Stop));
        }
    }

    /// Takes the controller of the design. A robot that is not driven gets it at once, a driven one as
    /// [`Transfer`] says. While the session is opened, nothing can be sent: call it again with the current design
    /// when that is done.
    pub(crate) fn set_design(&mut self, design: BalanceController) {
        let is_driven = self.is_driven();
        let Some(options) = self.options.as_ref().filter(|_| matches!(self.state, State::Open(_))) else {
            return;
        };
        let controller = self.transfer.set_design(&options.robot, design, is_driven);
        self.send_controller(controller);
    }

    /// Applies the pending design. Returns whether there was one.
    pub(crate) fn apply_design(&mut self) -> bool {
        let controller = self.transfer.take();
        let is_there = controller.is_some();
        self.send_controller(controller);
        is_there
    }

    fn send_controller(&mut self, controller: Option<BalanceController>) {
        if let Some(controller) = controller {
            self.send(SessionOrder::Drive(DriveOrder::Controller(Box::new(controller))));
        }
    }

    /// Sends the pending design to a robot that is no longer driven.
    fn apply_after_drive(&mut self) {
        if self.is_driven() {
            return;
        }
        let Some(options) = self.options.as_ref().filter(|_| matches!(self.state, State::Open(_))) else {
            return;
        };
        let controller = self.transfer.take_again(&options.robot);
        self.send_controller(controller);
    }

    /// Sets the time between two updates.
    pub(crate) fn set_interval(&mut self, interval: Duration) {
        self.interval = interval;
        self.send(SessionOrder::Interval(interval));
    }

    /// Takes new data; returns them, and sentences if a session was opened, refused, or ended with problems.
    pub(crate) fn drain(&mut self) -> (Vec<Update>, Vec<Result<String, String>>) {
        let mut messages: Vec<_> = self.take_closed().iter().map(|problem| Err(sentence(problem))).collect();
        self.start_opening();
        messages.extend(self.take_opened());
        let State::Open(feed) = &mut self.state else { return (Vec::new(), messages) };
        let updates = feed.poll();
        let died = feed.has_died();
        for update in &updates {
            self.rows += update.samples.len() as u64;
            self.history.extend(&update.samples);
        }
        if let Some(update) = updates.last() {
            let was_driven = self.is_driven();
            self.status = Some(update.status.clone());
            if self.arming.is_some_and(|commanded| commanded.elapsed() > ORDER_ROUND_TRIP) {
                self.arming = None;
            }
            if was_driven {
                self.apply_after_drive();
            }
        }
        if died {
            self.state = State::Closed;
            self.arming = None;
            self.end_problems = vec![DIED.to_owned()];
            self.problem = Some(sentence(DIED));
            messages.push(Err(sentence(DIED)));
        }
        (updates, messages)
    }

    /// Problems of a session that has just ended.
    fn take_closed(&mut self) -> &[String] {
        let Some(closing) = &mut self.closing else { return &[] };
        self.end_problems = match closing.job.poll().1 {
            Outcome::Running => return &[],
            Outcome::Done(problems) => problems,
            Outcome::Broken => vec![DIED.to_owned()],
        };
        self.closing = None;
        &self.end_problems
    }

    fn take_opened(&mut self) -> Option<Result<String, String>> {
        let State::Opening(job) = &mut self.state else { return None };
        let result = match job.poll().1 {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Connecting failed: this is an internal error.".to_owned()),
        };
        Some(match result {
            Ok(mut feed) => {
                feed.send(SessionOrder::Interval(self.interval));
                self.state = State::Open(feed);
                let source = self.options.as_ref().map(|options| options.source.to_string());
                let what = if self.may_drive() { "not armed" } else { "listening only" };
                Ok(format!("Connected to {}: {what}.", source.unwrap_or_default()))
            }
            Err(problem) => {
                self.state = State::Closed;
                let problem = sentence(&problem);
                self.problem = Some(problem.clone());
                Err(problem)
            }
        })
    }

    /// Number of rows in the last second.
    pub(crate) fn rows_hz(&self) -> usize {
        let heard = self.status.as_ref().is_some_and(|status| status.connection == Connection::Connected);
        let times = self.history.time_s();
        let before = times.count_up_to(self.history.end_s() - 1.0);
        if heard { times.len() - before } else { 0 }
    }
}

impl Drop for Link {
    /// The program must not end before the motors are off.
    fn drop(&mut self) {
        let no_window: Waker = Arc::new(|| {});
        self.end(&no_window);
    }
}

/// Problems at the end of a session.
fn problems(ending: Option<Ending>) -> Vec<String> {
    let Some(Ending { motors_off, recording }) = ending else { return vec![DIED.to_owned()] };
    let motors = (!motors_off)
        .then(|| "the motors have not confirmed that they are off: switch off their supply".to_owned());
    motors.into_iter().chain(recording.and_then(|recording| recording.problem)).collect()
}

/// Turns an error of the core into a sentence.
pub(crate) fn sentence(text: &str) -> String {
    let end = if text.ends_with('.') { "" } else { "." };
    format!("{}{end}", capitalised(text))
}
