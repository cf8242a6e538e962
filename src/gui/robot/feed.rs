//! Source of sessions and interface lists, separate from their use in the window.

use std::fmt;

use flqr_core::device::{self, Ending, Interfaces, Session, SessionOptions, SessionOrder, Update};

use crate::job::Waker;

/// A robot that is monitored or driven. Dropping it sets the torque to zero and switches the motors off.
pub trait RobotFeed: Send {
    /// Passes an order on. Never waits.
    fn send(&mut self, order: SessionOrder);

    /// Returns all updates since the last call. Never waits.
    fn poll(&mut self) -> Vec<Update>;

    /// Returns whether it has ended unexpectedly.
    fn has_died(&self) -> bool;

    /// Switches the motors off, ends the session and returns its outcome; `None` after an internal error. Waits
    /// until the motors confirm that they are off, and until the recording is complete.
    fn close(self: Box<Self>) -> Option<Ending>;
}

/// Opens robots and lists possible connections.
pub trait Devices: fmt::Debug + Send + Sync {
    /// Opens a session, which calls `wake` for each update. May wait.
    ///
    /// # Errors
    /// One sentence: what, where, the remedy.
    fn open(&self, options: SessionOptions, wake: Waker) -> Result<Box<dyn RobotFeed>, String>;

    /// Lists possible connections. May block.
    fn interfaces(&self) -> Interfaces;
}

/// The robots of this machine.
#[derive(Debug)]
pub(crate) struct System;

impl Devices for System {
    fn open(&self, options: SessionOptions, wake: Waker) -> Result<Box<dyn RobotFeed>, String> {
        match Session::open(options, wake) {
            Ok(session) => Ok(Box::new(session)),
            Err(error) => Err(error.to_string()),
        }
    }

    fn interfaces(&self) -> Interfaces {
        device::interfaces()
    }
}

impl RobotFeed for Session {
    fn send(&mut self, order: SessionOrder) {
        Self::send(self, order);
    }

    fn poll(&mut self) -> Vec<Update> {
        Self::poll(self)
    }

    fn has_died(&self) -> bool {
        Self::has_died(self)
    }

    fn close(self: Box<Self>) -> Option<Ending> {
        Self::close(*self)
    }
}
