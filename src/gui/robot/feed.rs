//! Where sessions and lists of interfaces come from, apart from what the window does with them.

use std::fmt;

use flqr_core::device::{SessionOptions, SessionOrder, Update};

use crate::job::Waker;

/// A robot that is watched or driven. Dropping it stops everything: no torque, motors off.
pub trait RobotFeed: Send {
    /// Hands an order over. Never waits.
    fn send(&mut self, order: SessionOrder);

    /// All updates since the last call. Never waits.
    fn poll(&mut self) -> Vec<Update>;
}

/// What opens robots, and knows where they could be.
pub trait Devices: fmt::Debug + Send + Sync {
    /// Opens a session, which calls `wake` when it has something to tell. May wait.
    ///
    /// # Errors
    /// One sentence: what, where, the mend.
    fn open(&self, options: SessionOptions, wake: Waker) -> Result<Box<dyn RobotFeed>, String>;

    /// What there is to connect to. May wait.
    fn interfaces(&self) -> Interfaces;
}

/// What there is to connect to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interfaces {
    /// CAN interfaces of the system.
    pub can: Vec<Offer>,
    /// Serial ports.
    pub serial: Vec<Offer>,
    /// Commands that make a CAN interface.
    pub commands: Vec<String>,
}

/// One of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// What to connect to.
    pub name: String,
    /// How it stands, in a few words.
    pub text: String,
    /// Whether it can be used as it stands.
    pub usable: bool,
}

/// The robots of this machine.
#[derive(Debug)]
pub(crate) struct System;

impl Devices for System {
    fn open(&self, options: SessionOptions, _wake: Waker) -> Result<Box<dyn RobotFeed>, String> {
        Err(format!("{} cannot be opened: this version of flqr has no link yet", options.source))
    }

    fn interfaces(&self) -> Interfaces {
        Interfaces::default()
    }
}
