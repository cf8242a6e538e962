//! How far a robot is from being driven, and why it is not any more.

use std::fmt;

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
    #[error("stop command from the operator")]
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
    /// A command that is not ours.
    #[error(
        "another controller sent the {motor} motor the command 0x{command:02X}: switch that controller off"
    )]
    OtherController {
        /// Which.
        motor: Motor,
        /// Command byte, or 0x280.
        command: u16,
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
    /// A wheel turns too fast on the ground.
    #[error("the {motor} wheel turns at {speed_rad_s:.1} rad/s relative to the body")]
    WheelSpeed {
        /// Which.
        motor: Motor,
        /// Speed, rad/s.
        speed_rad_s: f64,
    },
    /// The robot turns too fast.
    #[error("the robot turns at {yaw_rate_rad_s:.2} rad/s")]
    YawRate {
        /// Yaw rate, rad/s.
        yaw_rate_rad_s: f64,
    },
    /// Pitch or pitch rate stands still while the other one moves.
    #[error(
        "the IMU's {value} has not changed while the {} moved by {turned_rad:.3} rad: switch the IMU off and on, and \
         check its settings",
        value.other()
    )]
    ImuStuck {
        /// What stands still.
        value: ImuValue,
        /// By how much the other one moved, rad.
        turned_rad: f64,
    },
    /// Pitch and pitch rate contradict each other.
    #[error(
        "the IMU's pitch changed by {mismatch_rad:.3} rad more than its pitch rate says: check the IMU, its calibration \
         and its mounting"
    )]
    PitchMismatch {
        /// Change of the pitch less the integrated rate, rad.
        mismatch_rad: f64,
    },
    /// Pitch and gravity contradict each other.
    #[error(
        "gravity says {mismatch_rad:.3} rad more than the IMU's pitch: check the IMU, its calibration and its mounting"
    )]
    GravityMismatch {
        /// Direction of gravity less the pitch, rad.
        mismatch_rad: f64,
    },
    /// A motor's torque must have moved its shaft, and the encoder does not show it.
    #[error(
        "the {motor} encoder stands still although the torque must have changed the motor's speed by {missed_rad_s:.1} \
         rad/s: check the encoder, and that the motor gives torque"
    )]
    EncoderFrozen {
        /// Which.
        motor: Motor,
        /// Change of speed that is missing, rad/s.
        missed_rad_s: f64,
    },
    /// The body swings, and neither encoder shows it.
    #[error("both encoders stand still although the body swings back and forth: check the encoders")]
    EncodersFrozen,
    /// A motor's angle and its speed contradict each other.
    #[error(
        "the {motor} motor's angle changed by {mismatch_rad:.2} rad more than its speed says: check the encoder, and \
         encoder_steps in [link]"
    )]
    EncoderMismatch {
        /// Which.
        motor: Motor,
        /// Change of the angle less the integrated speed, rad.
        mismatch_rad: f64,
    },
    /// Wheels and IMU contradict each other about the heading.
    #[error(
        "the robot turned by {mismatch_rad:.2} rad more by its wheels than by the IMU: check the encoders, that no wheel \
         slips, and that left_motor_id and right_motor_id in [link] are not swapped"
    )]
    YawMismatch {
        /// Heading by the wheels less that by the IMU, rad.
        mismatch_rad: f64,
    },
    /// A motor turns against its torque.
    #[error(
        "the {motor} motor turns against its torque: check the motor's calibration and its phase wires, and \
         {motor}_direction in [link]"
    )]
    TorqueReversed {
        /// Which.
        motor: Motor,
    },
    /// Each motor turns by the torque of the other one.
    #[error(
        "each motor turns by the torque of the other one: check left_motor_id and right_motor_id in [link], and the slots \
         of torque_command"
    )]
    TorquesSwapped,
    /// Neither wheels nor body move under a torque.
    #[error(
        "the robot is held: neither its wheels nor its body moved under a torque. Let it go once it is armed"
    )]
    Held,
    /// Wheels that are to be in the air are not.
    #[error(
        "the wheels are on the ground or held: they turned {factor:.2} times as fast as in the air. Lift them, then \
         check and arm again"
    )]
    WheelsOnGround {
        /// Speed over that in the air.
        factor: f64,
    },
    /// The torque acts later than the model says.
    #[error(
        "the torque acts {delay_s:.3} s later than delay_s in [actuation] says: check the latency of the CAN adapter, or \
         set delay_s and design again"
    )]
    TorqueDelay {
        /// Delay beyond the model's, s.
        delay_s: f64,
    },
    /// Replies come too late.
    #[error(
        "replies of the {motor} motor take {round_trip_s:.4} s: use a faster CAN adapter or a higher baud rate, or close \
         other programs"
    )]
    RoundTrip {
        /// Which.
        motor: Motor,
        /// From a query to its reply, s.
        round_trip_s: f64,
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
            Self::WheelSpeed { .. } => "wheel_speed",
            Self::YawRate { .. } => "yaw_rate",
            Self::ImuStuck { .. } => "imu_stuck",
            Self::PitchMismatch { .. } => "pitch_mismatch",
            Self::GravityMismatch { .. } => "gravity_mismatch",
            Self::EncoderFrozen { .. } | Self::EncodersFrozen => "encoder_frozen",
            Self::EncoderMismatch { .. } => "encoder_mismatch",
            Self::YawMismatch { .. } => "yaw_mismatch",
            Self::TorqueReversed { .. } => "torque_reversed",
            Self::TorquesSwapped => "torques_swapped",
            Self::Held => "held",
            Self::WheelsOnGround { .. } => "wheels_on_ground",
            Self::TorqueDelay { .. } => "torque_delay",
            Self::RoundTrip { .. } => "round_trip",
            Self::TorqueScale { .. } => "torque_scale",
            Self::NotFinite => "not_finite",
            Self::Late { .. } => "late",
            Self::BusDown => "bus_down",
        }
    }
}

/// A value of the IMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImuValue {
    /// Pitch.
    Pitch,
    /// Pitch rate.
    PitchRate,
}

impl ImuValue {
    fn other(self) -> Self {
        match self {
            Self::Pitch => Self::PitchRate,
            Self::PitchRate => Self::Pitch,
        }
    }
}

impl fmt::Display for ImuValue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Pitch => "pitch",
            Self::PitchRate => "pitch rate",
        })
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
