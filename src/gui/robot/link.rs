//! The session with a robot: opened and closed on threads of their own, drained once a frame.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use flqr_core::control::BalanceController;
use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage};
use flqr_core::device::{Connection, SessionMode, SessionOptions, SessionOrder, Source, Status, Update};
use flqr_core::report::capitalised;

use super::feed::{Devices, RobotFeed};
use super::transfer::Transfer;
use crate::history::History;
use crate::job::{Job, Outcome, Waker};

/// An update that comes sooner after an order may have been made before it.
const ORDER_ROUND_TRIP: Duration = Duration::from_millis(300);

type Opened = Result<Box<dyn RobotFeed>, String>;

enum State {
    Closed,
    Opening(Job<(), Opened>),
    Open(Box<dyn RobotFeed>),
}

/// The one session of the window.
pub(crate) struct Link {
    devices: Arc<dyn Devices>,
    state: State,
    /// Options of the session, also after it was closed.
    options: Option<SessionOptions>,
    closing: Option<JoinHandle<()>>,
    /// When a step of arming was last commanded, until an update surely knows of it.
    arming: Option<Instant>,
    /// True if that was the step that switches the motors on.
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
        matches!(self.state, State::Opening(_))
    }

    /// Returns whether the session of before still lets go of its ports.
    pub(crate) fn is_closing(&self) -> bool {
        self.closing.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Options of the current session.
    pub(crate) fn options(&self) -> Option<&SessionOptions> {
        self.options.as_ref().filter(|_| !matches!(self.state, State::Closed))
    }

    /// Returns whether the session may ever send anything.
    pub(crate) fn may_drive(&self) -> bool {
        self.options().is_some_and(|options| matches!(options.mode, SessionMode::Drive { .. }))
    }

    pub(crate) fn is_replay(&self) -> bool {
        self.options().is_some_and(|options| matches!(options.source, Source::Replay { .. }))
    }

    /// Stage of the robot; `None` without a session.
    pub(crate) fn stage(&self) -> Option<Stage> {
        if !self.is_open() {
            return None;
        }
        let drive = self.status.as_ref().and_then(|status| status.drive.as_ref());
        Some(drive.map_or(Stage::Listening, |drive| drive.stage))
    }

    /// Returns whether motors are requested anything, or may be from one moment to the next.
    pub(crate) fn is_hot(&self) -> bool {
        self.may_drive()
            && (self.arming.is_some() || matches!(self.stage(), Some(Stage::Checking | Stage::Driving)))
    }

    /// Returns whether the motors follow the controller, or may from one moment to the next.
    pub(crate) fn is_driven(&self) -> bool {
        let arms = self.arms && self.arming.is_some();
        self.may_drive() && (arms || self.stage() == Some(Stage::Driving))
    }

    /// Returns whether the second step of arming may be taken.
    pub(crate) fn may_arm(&self) -> bool {
        let drive = self.status.as_ref().and_then(|status| status.drive.as_ref());
        self.is_open()
            && drive.is_some_and(|drive| {
                drive.stage == Stage::Checking
                    && !drive.checks.is_empty()
                    && drive.checks.iter().all(|check| check.result == CheckResult::Passed)
            })
    }

    /// Opens a session in place of the one there is.
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
        self.options = Some(options.clone());
        let (devices, wake, before) = (Arc::clone(&self.devices), Arc::clone(waker), self.closing.take());
        let work = move |_: &_| {
            // The port is free only when the session of before has let go of it; its panic was reported there.
            before.map(|thread| thread.join().ok());
            devices.open(options, wake)
        };
        match Job::start("open-session", waker, work) {
            Ok(job) => self.state = State::Opening(job),
            Err(error) => self.problem = Some(format!("Cannot start connecting: {error}.")),
        }
    }

    /// Forgets what the last session has brought.
    pub(crate) fn forget(&mut self) {
        self.history.clear();
        (self.status, self.rows, self.replay_is_paused, self.problem) = (None, 0, false, None);
    }

    /// Ends the session; a robot that it drives is stopped first. A robot that it has not armed is left alone.
    pub(crate) fn close(&mut self, waker: &Waker) {
        let is_driven = self.is_driven();
        self.arming = None;
        self.transfer.begin(None);
        let State::Open(mut feed) = std::mem::replace(&mut self.state, State::Closed) else { return };
        if is_driven {
            feed.send(SessionOrder::Drive(DriveOrder::Stop));
        }
        let wake = Arc::clone(waker);
        let ended = std::thread::Builder::new().name("close-session".to_owned()).spawn(move || {
            drop(feed);
            wake();
        });
        // Without a thread the session has ended right here, when the closure was dropped.
        self.closing = ended.ok();
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

    /// No torque, motors off.
    pub(crate) fn stop(&mut self) {
        if self.may_drive() {
            self.send(SessionOrder::Drive(DriveOrder::Stop));
        }
    }

    /// Takes in the controller of the design. A robot that is not driven gets it at once, a driven one as
    /// [`Transfer`] says.
    pub(crate) fn set_design(&mut self, design: BalanceController) {
        let is_driven = self.is_driven();
        let Some(options) = self.options.as_ref().filter(|_| !matches!(self.state, State::Closed)) else {
            return;
        };
        let controller = self.transfer.set_design(&options.robot, design, is_driven);
        self.send_controller(controller);
    }

    /// Applies the design that waits. Says whether it was sent.
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

    /// Gives a robot that is not driven any more the design that waited.
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

    /// Time between two updates.
    pub(crate) fn set_interval(&mut self, interval: Duration) {
        self.interval = interval;
        self.send(SessionOrder::Interval(interval));
    }

    /// Takes new data since the last call; returns a sentence if the session was opened or refused.
    pub(crate) fn drain(&mut self) -> (Vec<Update>, Option<Result<String, String>>) {
        let message = self.take_opened();
        let State::Open(feed) = &mut self.state else { return (Vec::new(), message) };
        let updates = feed.poll();
        let died = feed.has_died();
        for update in &updates {
            self.rows += update.samples.len() as u64;
            self.history.extend(&update.samples);
        }
        if let Some(update) = updates.last() {
            let was_driven = self.is_driven();
            self.status = Some(update.status.clone());
            if self.arming.is_some_and(|asked| asked.elapsed() > ORDER_ROUND_TRIP) {
                self.arming = None;
            }
            if was_driven {
                self.apply_after_drive();
            }
        }
        if died {
            self.state = State::Closed;
            self.arming = None;
            let problem = "The connection to the robot has ended unexpectedly: this is an internal error. Switch the robot off manually if it still moves.";
            self.problem = Some(problem.to_owned());
            return (updates, Some(Err(problem.to_owned())));
        }
        (updates, message)
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

    /// Rows of the last second.
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
        self.state = State::Closed;
        if let Some(thread) = self.closing.take() {
            thread.join().ok();
        }
    }
}

/// An error of the core as a sentence of the window.
pub(crate) fn sentence(text: &str) -> String {
    let end = if text.ends_with('.') { "" } else { "." };
    format!("{}{end}", capitalised(text))
}
