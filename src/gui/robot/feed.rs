//! Source of sessions and interface lists, separate from their use in the window.

use std::fmt;

use flqr_core::device::{self, Interfaces, Session, SessionOptions, SessionOrder, Update};

use crate::job::Waker;

/// A robot that is watched or driven. Dropping it stops everything: no torque, motors off.
pub trait RobotFeed: Send {
    /// Hands an order over. Never waits.
    fn send(&mut self, order: SessionOrder);

    /// All updates since the last call. Never waits.
    fn poll(&mut self) -> Vec<Update>;

    /// Returns whether it has ended although nobody requested it.
    fn has_died(&self) -> bool;
}

/// Opens robots and lists possible connections.
pub trait Devices: fmt::Debug + Send + Sync {
    /// Opens a session, which calls `wake` when it has something to tell. May wait.
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
}
