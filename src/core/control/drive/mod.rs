//! A real robot under control: from what was heard to what is asked of the motors, in stages, within limits,
//! under watchdogs. Pure: time and all that was heard are arguments.

mod stage;

pub use stage::{Check, CheckResult, DriveOrder, Excitation, Stage, StopReason};
