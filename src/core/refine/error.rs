//! Errors of a refinement.

use crate::record::{LogError, LogKind};

/// Reason why there is no residual or refined model: what is wrong, where, and how to fix it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefineError {
    /// A log lacks a column.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No log was given.
    #[error("no log was given, name at least one")]
    NoLogs,
    /// A log of another machine.
    #[error("{file} is a {kind}, but the model describes a {wanted}: give a model of the same machine")]
    WrongModel {
        /// The log.
        file: String,
        /// Its kind.
        kind: LogKind,
        /// Kind of machine of the model.
        wanted: &'static str,
    },
    /// Logs of different kinds.
    #[error("{first} is a {first_kind} and {second} a {second_kind}: refine with them separately")]
    MixedLogs {
        /// A log.
        first: String,
        /// Its kind.
        first_kind: LogKind,
        /// Another.
        second: String,
        /// Its kind.
        second_kind: LogKind,
    },
    /// The watcher ended it.
    #[error("the search was cancelled: start it again")]
    Cancelled,
    /// Pairs have no motion.
    #[error("{file} contains friction pairs without time: give a log with time, or use `flqr fit`")]
    Pairs {
        /// The log.
        file: String,
    },
    /// Bounds that are no range of speeds.
    #[error(
        "the range from {low} to {high} is empty: give two speeds from 0 up, rad/s or m/s, the lower one first, such as 0..9"
    )]
    Speeds {
        /// Lowest, in the unit of the log.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// A robot's log has no one speed.
    #[error("a range of speeds applies to a motor or axis, but this is the log of a robot: leave it out")]
    SpeedsOfRobot,
    /// A name that is not a parameter.
    #[error("`{name}` is not a parameter of this model: estimate all or some of {allowed}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The names that are allowed.
        allowed: String,
    },
}
