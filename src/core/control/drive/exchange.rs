//! What goes into a step of the drive and what comes out.

use std::fmt;
use std::ops::Deref;
use std::time::Duration;

use super::stage::{DriveOrder, Stage};
use crate::ParameterError;
use crate::control::gate::Refusal;
use crate::link::{ImuReading, MotorEvent, MotorOrder};
use crate::record::{BenchSample, Sample};

/// Choices of the one who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveSettings {
    /// Whether readings are brought to the time at which the new torque will act (`estimate.rs`). Without, the
    /// controller gets each sensor's newest reading as it is, as in [`crate::simulate`]. Default: true.
    pub latency_compensation: bool,
    /// Whether the robot is stopped where the motors clearly do more or less than they are requested.
    /// Default: true.
    pub torque_scale_check: bool,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self { latency_compensation: true, torque_scale_check: true }
    }
}

/// A robot that cannot be driven.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// Torques that the motor protocol cannot express; what to set.
    #[error("the robot can be monitored but not driven: {0}")]
    NoTorqueRange(&'static str),
    /// Torques without bound.
    #[error(
        "the robot can be monitored but not driven: set torque_nm in [limits], the largest torque of one motor"
    )]
    NoTorqueLimit,
    /// A limit that the current command cannot express.
    #[error(
        "torque_nm = {limit_nm} in [limits] is above {greatest_nm:.2} N m, the largest torque of the motor \
         protocol: lower it, or check torque_constant_nm_a and current_steps_per_a in [link]"
    )]
    TorqueLimit {
        /// Of the model, N m.
        limit_nm: f64,
        /// Of the command, N m.
        greatest_nm: f64,
    },
    /// Gains that must not drive the robot.
    #[error("the robot can be monitored but not driven: {0}")]
    Gains(#[from] Refusal),
    /// A sweep whose dwells are too short.
    #[error("{seconds} s is too short for the speeds of a sweep: give at least {least} s")]
    SweepTooShort {
        /// Asked for, s.
        seconds: f64,
        /// Needed, s.
        least: f64,
    },
    /// A parameter out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// What was received since the last step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// From the motors, in the order in which it was received.
    pub motors: &'a [MotorEvent],
    /// From the IMU, in the order in which it was received.
    pub imu: &'a [ImuReading],
    /// From whoever drives.
    pub orders: &'a [DriveOrder],
    /// Whether nothing can be sent just now.
    pub bus_down: bool,
    /// By how much this step comes too late.
    pub late: Duration,
}

/// What comes of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Output {
    /// To be sent now, in this order.
    pub orders: Orders,
    /// Row of the robot log, at every step of checking and driving, once every sensor has been received.
    pub sample: Option<Sample>,
    /// Row of both motors' bench logs, at every driven step with the wheels in the air.
    pub bench: Option<BenchSample>,
    /// What happened, oldest first.
    pub events: Vec<DriveEvent>,
}

/// At most four orders to the motors.
#[derive(Clone, Copy, PartialEq)]
pub struct Orders {
    orders: [MotorOrder; 4],
    count: usize,
}

impl Default for Orders {
    fn default() -> Self {
        Self { orders: [MotorOrder::Off; 4], count: 0 }
    }
}

impl Orders {
    /// Adds one.
    pub(super) fn push(&mut self, order: MotorOrder) {
        self.orders[self.count] = order;
        self.count += 1;
    }
}

impl Deref for Orders {
    type Target = [MotorOrder];

    fn deref(&self) -> &[MotorOrder] {
        &self.orders[..self.count]
    }
}

impl fmt::Debug for Orders {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Something worth a line of the record.
#[derive(Clone, Debug, PartialEq)]
pub enum DriveEvent {
    /// Another stage has been reached; in [`Stage::Stopped`] with the reason.
    Stage(Stage),
    /// Something that was requested was done.
    Note(&'static str),
    /// Something was refused or is not as it should be.
    Warning(String),
}

impl fmt::Display for DriveEvent {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Stage(Stage::Listening) => f.write_str("listening: nothing is sent"),
            Self::Stage(Stage::Checking) => f.write_str("checking before arming: no torque"),
            Self::Stage(Stage::Driving) => f.write_str("armed: the motors follow the controller"),
            Self::Stage(Stage::Stopped(reason)) => write!(f, "stopped: {reason}"),
            Self::Note(text) => f.write_str(text),
            Self::Warning(text) => f.write_str(text),
        }
    }
}
