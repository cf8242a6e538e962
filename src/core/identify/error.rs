//! Reason why a fit is refused.

use super::motion::MotionError;
use crate::record::{LogError, LogKind};

/// Reason why no fit could be made: what is wrong, where, and how to fix it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Nothing to fit.
    #[error("no log was given: name at least one")]
    NoLogs,
    /// A log lacks columns.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A motion could not be fitted.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A model of another axis.
    #[error(
        "{file} is a {kind}, but the model describes the axis of a {wanted}: give a model of the same axis, or none"
    )]
    WrongModel {
        /// The log.
        file: String,
        /// Its kind.
        kind: LogKind,
        /// Kind of machine of the model.
        wanted: LogKind,
    },
    /// A number that is none.
    #[error("{file}: pair {row} has the value {value} in `{column}`, remove the pair or record it again")]
    NotFinite {
        /// The log.
        file: String,
        /// Pair, from 1.
        row: usize,
        /// Column that holds it.
        column: &'static str,
        /// The value.
        value: f64,
    },
    /// A number that no motor reaches.
    #[error(
        "{file}: pair {row} has the impossible value {value:e} in `{column}`, beyond {limit:e}: remove the pair or map the right column and unit"
    )]
    Impossible {
        /// The log.
        file: String,
        /// Pair, from 1.
        row: usize,
        /// Column that holds it.
        column: &'static str,
        /// The value.
        value: f64,
        /// The largest magnitude that is believed, unit of the column.
        limit: f64,
    },
    /// A name that is not one of the six.
    #[error("`{name}` cannot be estimated from constant speeds: estimate all or some of {allowed}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The names that are allowed.
        allowed: String,
    },
    /// No stretch of constant speed is long enough.
    #[error(
        "{file}: no segment of constant speed is long enough for friction pairs ({reason}): hold each speed for {seconds} s or more"
    )]
    NoPairs {
        /// The log.
        file: String,
        /// Kind found instead.
        reason: String,
        /// Stretches of constant speed that are too short.
        short_dwells: usize,
        /// The least time at one speed, s.
        seconds: f64,
    },
    /// One speed tells nothing about a curve.
    #[error(
        "all {pairs} pairs of {file} are at one speed, {speed_rad_s:.3} rad/s: record at least {needed} speeds, or add logs at other speeds"
    )]
    OneSpeed {
        /// The logs.
        file: String,
        /// Number of pairs.
        pairs: usize,
        /// Their speed, rad/s.
        speed_rad_s: f64,
        /// Speeds that are needed.
        needed: usize,
    },
    /// Six parameters need six speeds.
    #[error(
        "the pairs of {file} have {found} distinct speeds, but six parameters need at least {needed}: record more speeds"
    )]
    TooFewSpeeds {
        /// The logs.
        file: String,
        /// Distinct speeds.
        found: usize,
        /// Speeds that are needed.
        needed: usize,
    },
    /// Torques without any difference.
    #[error(
        "the torques of {file} are all {value} N m: the torque column is neither a measured nor a commanded torque: map the right one"
    )]
    ConstantTorque {
        /// The logs.
        file: String,
        /// The one value, N m.
        value: f64,
    },
    /// Logs that answer different questions.
    #[error("{first} contains {first_kind} and {second} contains {second_kind}: fit them separately")]
    MixedLogs {
        /// A log.
        first: String,
        /// Its kind.
        first_kind: &'static str,
        /// Another log.
        second: String,
        /// Its kind.
        second_kind: &'static str,
    },
    /// Data are wanting, and of what was recorded a part could not be read.
    #[error("{refusal}; {unread}")]
    Unread {
        /// Missing column.
        refusal: Box<FitError>,
        /// Unreadable parts, with lines and columns, and the remedy.
        unread: String,
    },
    /// A robot on its wheels does not show its motors' friction alone.
    #[error(
        "{file}: a robot log gives friction only with the wheels in the air at constant speeds: record such a sweep"
    )]
    RobotMotion {
        /// The log.
        file: String,
    },
    /// The watcher ended the fit.
    #[error("the fit was cancelled after {iteration} of {iterations} iterations: start it again")]
    Cancelled {
        /// Iterations done.
        iteration: usize,
        /// Iterations requested.
        iterations: usize,
    },
}
