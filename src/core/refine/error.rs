//! Why a loop cannot be closed.

use crate::record::{LogError, LogKind};

/// Why there is no residual or refined model; each says what, where and the mend.
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
    #[error("{file} is a {kind} and the model describes a {wanted}: give a model of the same machine")]
    WrongModel {
        /// The log.
        file: String,
        /// What it holds.
        kind: LogKind,
        /// What the model is for.
        wanted: &'static str,
    },
    /// Logs of different kinds.
    #[error("{first} is a {first_kind} and {second} a {second_kind}: refine with them apart")]
    MixedLogs {
        /// A log.
        first: String,
        /// What it holds.
        first_kind: LogKind,
        /// Another.
        second: String,
        /// What that one holds.
        second_kind: LogKind,
    },
    /// The watcher ended it.
    #[error("the search was cancelled, start it again")]
    Cancelled,
    /// Pairs have no motion.
    #[error("{file} holds friction pairs, which have no motion: give a log with time, or use `flqr fit`")]
    Pairs {
        /// The log.
        file: String,
    },
    /// Bounds that are no range of speeds.
    #[error(
        "no speed is from {low} to {high}: give two from 0 up, rad/s or m/s, the lower one first, as 0..9"
    )]
    Speeds {
        /// Lowest, in the unit of the log.
        low: f64,
        /// Highest.
        high: f64,
    },
    /// A robot's log has no one speed.
    #[error(
        "a range of speeds chooses rows of one motor or axis, and this is a log of a robot: leave it out"
    )]
    SpeedsOfRobot,
    /// A name that is not a parameter.
    #[error("`{name}` is not a parameter of this model, estimate all or some of {allowed}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The names that are allowed.
        allowed: String,
    },
}
