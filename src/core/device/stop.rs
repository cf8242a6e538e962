//! Requests to stop, which reach the control loop and the sending thread whatever every other thread of the program does.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Every session that may drive: a signal of the system concerns all of them.
static SESSIONS: Mutex<Vec<Weak<StopLine>>> = Mutex::new(Vec::new());

fn sessions() -> MutexGuard<'static, Vec<Weak<StopLine>>> {
    // A panic leaves the list whole: each change is a single call.
    SESSIONS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Requests a stop of every robot that this process drives, and returns at once.
pub fn stop_all() {
    sessions().iter().filter_map(Weak::upgrade).for_each(|line| line.request());
}

/// Returns whether every session of this process has obeyed all requests and its motors have confirmed that they are
/// off.
pub fn all_stopped() -> bool {
    sessions().iter().filter_map(Weak::upgrade).all(|line| line.has_stopped())
}

/// The line from whoever requests a stop to one session.
#[derive(Debug, Default)]
pub(super) struct StopLine {
    requests: AtomicU64,
    obeyed: AtomicU64,
    /// Whether the motors have been switched on and have not confirmed that they are off.
    motors_on: AtomicBool,
    /// Whether the session's control loop has ended, so that nothing more will come of a request.
    ended: AtomicBool,
}

impl StopLine {
    /// A line that [`stop_all`] reaches.
    pub(super) fn register() -> Arc<Self> {
        let line = Arc::new(Self::default());
        let mut sessions = sessions();
        sessions.retain(|session| session.strong_count() > 0);
        sessions.push(Arc::downgrade(&line));
        line
    }

    /// Requests a stop.
    pub(super) fn request(&self) {
        self.requests.fetch_add(1, Ordering::AcqRel);
    }

    /// The newest request, if the control loop has not obeyed it yet.
    pub(super) fn pending(&self) -> Option<u64> {
        let newest = self.requests.load(Ordering::Acquire);
        (newest != self.obeyed.load(Ordering::Acquire)).then_some(newest)
    }

    /// Notes that the control loop has stopped the robot as requested.
    pub(super) fn obeyed(&self, request: u64) {
        self.obeyed.store(request, Ordering::Release);
    }

    /// Notes whether the motors may have torque.
    pub(super) fn set_motors_on(&self, on: bool) {
        self.motors_on.store(on, Ordering::Release);
    }

    /// Notes that the control loop has ended.
    pub(super) fn end(&self) {
        self.ended.store(true, Ordering::Release);
    }

    fn has_stopped(&self) -> bool {
        let ended = self.ended.load(Ordering::Acquire);
        ended || (self.pending().is_none() && !self.motors_on.load(Ordering::Acquire))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_stopped_once_the_request_was_obeyed_and_the_motors_are_off() {
        let line = StopLine::default();
        assert!(line.has_stopped() && line.pending().is_none());
        line.set_motors_on(true);
        line.request();
        line.request();
        assert_eq!(line.pending(), Some(2));
        line.obeyed(1);
        assert!(line.pending().is_some(), "a later request is open");
        line.obeyed(2);
        assert!(!line.has_stopped(), "the motors are still on");
        line.set_motors_on(false);
        assert!(line.has_stopped());
        line.request();
        line.end();
        assert!(line.has_stopped(), "nobody is left to obey");
    }

    #[test]
    fn every_registered_line_is_reached_while_it_lives() {
        let lines = [StopLine::register(), StopLine::register()];
        stop_all();
        assert!(lines.iter().all(|line| line.pending().is_some()));
        drop(lines);
        let line = StopLine::register();
        assert!(line.pending().is_none());
    }
}
