//! How far a robot is from being driven, and why it is not any more.

use crate::control::{BalanceController, Reference};
use crate::link::MotorErrors;
use crate::robot::Motor;

/// How far a robot is from being driven. From each stage only the next one can be reached, and `Stopped` from
/// all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Nothing is sent.
    Listening,
    /// Motors are asked for readings, without torque, and all that has to be right is checked.
    Checking,
    /// The motors are on and follow the controller.
    Driving,
    /// No torque, motors off.
    Stopped(StopReason),
}

impl Stage {
    /// Name for files and scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Listening => "listening",
            Self::Checking => "checking",
            Self::Driving => "driving",
            Self::Stopped(_) => "stopped",
        }
    }
}

/// What is asked of the drive.
#[derive(Clone, Debug, PartialEq)]
pub enum DriveOrder {
    /// First step of arming: from listening to checking.
    Check,
    /// Second step: from checking to driving; refused until every check has passed.
    Arm,
    /// No torque, motors off, at once.
    Stop,
    /// The same, because the time that was given is over.
    Finish,
    /// After a stop, or in place of arming: back to listening.
    Release,
    /// Another controller from the next tick on, without a bump.
    Controller(Box<BalanceController>),
    /// Where the robot is to be, counted from where it was armed.
    Reference(Reference),
}

/// What the motors are to do once armed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Excitation {
    /// Balance.
    Balance,
    /// Balance with torques of a multisine on top.
    BalanceMultisine,
    /// Wheels in the air: constant speeds one after the other, s in all.
    SpeedSweep {
        /// Time for all speeds, s.
        seconds: f64,
    },
    /// Wheels in the air: torques of a multisine, s in all.
    Multisine {
        /// How long, s.
        seconds: f64,
    },
}

/// Why a robot was stopped.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StopReason {
    /// Somebody asked for it.
    #[error("stop was asked for")]
    Asked,
    /// The time that was given is over.
    #[error("the time is over")]
    TimeOver,
    /// The excitation has come to its end.
    #[error("the experiment is done")]
    Done,
    /// No reading of the IMU.
    #[error(
        "the IMU has been silent for {silent_s:.3} s: look at its cable, rate and baud rate, or at what else keeps this \
         computer busy"
    )]
    ImuSilent {
        /// For how long, s.
        silent_s: f64,
    },
    /// The same reading again and again.
    #[error("the IMU has sent the very same reading for {frozen_s:.3} s: switch it off and on")]
    ImuFrozen {
        /// For how long, s.
        frozen_s: f64,
    },
    /// No reply of a motor.
    #[error(
        "the {motor} motor has been silent for {silent_s:.3} s: look at its cable, supply and id, or at what else keeps \
         this computer busy"
    )]
    MotorSilent {
        /// Which.
        motor: Motor,
        /// For how long, s.
        silent_s: f64,
    },
    /// No voltage and errors of a motor that still tells its motion.
    #[error(
        "the {motor} motor has told neither voltage nor errors for {silent_s:.1} s: look at its firmware and the bus load"
    )]
    HealthSilent {
        /// Which.
        motor: Motor,
        /// For how long, s.
        silent_s: f64,
    },
    /// A silence over which a motor may have turned by any number of turns.
    #[error(
        "the {motor} motor was silent for so long that its turns are not known: set motor_timeout_s in [safety] to at \
         most 0.06"
    )]
    TurnsLost {
        /// Which.
        motor: Motor,
    },
    /// Torques that are not ours.
    #[error("another controller commands the {motor} motor: switch it off")]
    OtherController {
        /// Which.
        motor: Motor,
    },
    /// Error bits.
    #[error("the {motor} motor reports {errors}")]
    MotorError {
        /// Which.
        motor: Motor,
        /// What it reports.
        errors: MotorErrors,
    },
    /// A motor is off that is to be on.
    #[error(
        "the {motor} motor is off: it has switched itself off, or has never taken the order to switch on"
    )]
    MotorOff {
        /// Which.
        motor: Motor,
    },
    /// A motor is too hot.
    #[error("the {motor} motor is at {temperature_c} °C: let it cool down")]
    MotorHot {
        /// Which.
        motor: Motor,
        /// Its temperature, °C.
        temperature_c: f64,
    },
    /// The supply is out of its limits.
    #[error("the supply is at {voltage_v:.1} V: charge or check the battery")]
    Voltage {
        /// Voltage, V.
        voltage_v: f64,
    },
    /// Tilted too far.
    #[error("the robot tilts by {pitch_rad:.3} rad")]
    Tilt {
        /// Pitch, rad.
        pitch_rad: f64,
    },
    /// Too fast.
    #[error("the robot drives at {x_dot_m_s:.2} m/s")]
    Speed {
        /// Speed, m/s.
        x_dot_m_s: f64,
    },
    /// Too far away.
    #[error("the robot is {x_m:.2} m from where it was armed")]
    Distance {
        /// Way, m.
        x_m: f64,
    },
    /// A wheel turns too fast.
    #[error("the {motor} motor turns at {speed_rad_s:.1} rad/s")]
    MotorSpeed {
        /// Which.
        motor: Motor,
        /// Speed, rad/s.
        speed_rad_s: f64,
    },
    /// A motor does much more or less than it is asked for.
    #[error(
        "the motors do {factor:.2} times what they are asked for: check torque_constant_nm_a (0.32 or 0.81) and \
         current_steps_per_a (124.12 or 62.5) in [link]"
    )]
    TorqueScale {
        /// Done over asked.
        factor: f64,
    },
    /// A reading that is no number, or a torque that would be none.
    #[error("a reading is not a finite number")]
    NotFinite,
    /// A tick came too late.
    #[error("a tick of the control loop came {late_s:.3} s late: close other programs")]
    Late {
        /// By how much, s.
        late_s: f64,
    },
    /// The bus does not work.
    #[error("the CAN bus does not work: bus off, adapter unplugged or queue full")]
    BusDown,
}

impl StopReason {
    /// Name for files and scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Asked => "asked",
            Self::TimeOver => "time_over",
            Self::Done => "done",
            Self::ImuSilent { .. } => "imu_silent",
            Self::ImuFrozen { .. } => "imu_frozen",
            Self::MotorSilent { .. } => "motor_silent",
            Self::HealthSilent { .. } => "health_silent",
            Self::TurnsLost { .. } => "turns_lost",
            Self::OtherController { .. } => "other_controller",
            Self::MotorError { .. } => "motor_error",
            Self::MotorOff { .. } => "motor_off",
            Self::MotorHot { .. } => "motor_hot",
            Self::Voltage { .. } => "voltage",
            Self::Tilt { .. } => "tilt",
            Self::Speed { .. } => "speed",
            Self::Distance { .. } => "distance",
            Self::MotorSpeed { .. } => "motor_speed",
            Self::TorqueScale { .. } => "torque_scale",
            Self::NotFinite => "not_finite",
            Self::Late { .. } => "late",
            Self::BusDown => "bus_down",
        }
    }
}

/// One thing that has to be right before a robot is driven.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What is checked, in a few words.
    pub name: &'static str,
    /// How it stands.
    pub result: CheckResult,
    /// What was found and, unless it is right, the mend.
    pub text: String,
}

/// How a check stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckResult {
    /// Right.
    Passed,
    /// Not known yet: something is to be done or waited for.
    Waiting,
    /// Wrong; driving is refused.
    Failed,
}
