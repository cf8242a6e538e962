//! How far a robot is from being driven, and why it is not any more.

use std::fmt;

use crate::control::{BalanceController, Reference};
use crate::link::MotorErrors;
use crate::model::Motor;

/// How far a robot is from being driven. From each stage only the next one can be reached, and `Stopped` from
/// all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Nothing is sent.
    Listening,
    /// Motors are queried, without torque, and everything that must be right is checked.
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

/// Order to the drive.
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
    /// Somebody requested it.
    #[error("stop command from the operator")]
    Requested,
    /// The time that was given is over.
    #[error("the time has elapsed")]
    TimeOver,
    /// The excitation has come to its end.
    #[error("the experiment is done")]
    Done,
    /// No reading of the IMU.
    #[error(
        "the IMU has been silent for {silent_s:.3} s: check its cable, rate and baud rate, and the load \
         of this computer"
    )]
    ImuSilent {
        /// For how long, s.
        silent_s: f64,
    },
    /// The same reading again and again.
    #[error("the IMU has sent the same measurement for {frozen_s:.3} s: power-cycle it")]
    ImuFrozen {
        /// For how long, s.
        frozen_s: f64,
    },
    /// No reply of a motor.
    #[error(
        "the {motor} motor has been silent for {silent_s:.3} s: check its cable, supply and id, and the \
         load of this computer"
    )]
    MotorSilent {
        /// Which.
        motor: Motor,
        /// For how long, s.
        silent_s: f64,
    },
    /// No voltage and errors of a motor that still tells its motion.
    #[error(
        "the {motor} motor has reported neither voltage nor errors for {silent_s:.1} s: check its firmware and the bus load"
    )]
    HealthSilent {
        /// Which.
        motor: Motor,
        /// For how long, s.
        silent_s: f64,
    },
    /// A silence over which a motor may have turned by any number of turns.
    #[error(
        "the {motor} motor was silent for so long that its number of turns is unknown: set motor_timeout_s in [safety] \
         to at most 0.06"
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
        /// Code of the command in the motor protocol.
        command: u32,
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
        "the {motor} motor is off: it has switched itself off, or has not accepted the command to switch on: check its supply and \
         read its errors"
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
    #[error(
        "the robot tilts by {pitch_rad:.3} rad: set it upright, and check the signs of IMU and motors if it fell at once"
    )]
    Tilt {
        /// Pitch, rad.
        pitch_rad: f64,
    },
    /// Too fast.
    #[error("the robot moves at {x_dot_m_s:.2} m/s: put it back, or raise speed_m_s in [safety]")]
    Speed {
        /// Speed, m/s.
        x_dot_m_s: f64,
    },
    /// Too far away.
    #[error("the robot is {x_m:.2} m from where it was armed: put it back, or raise distance_m in [safety]")]
    Distance {
        /// Way, m.
        x_m: f64,
    },
    /// A wheel turns too fast.
    #[error(
        "the {motor} motor turns at {speed_rad_s:.1} rad/s: put the wheels on the ground, or raise motor_speed_rad_s in [safety]"
    )]
    MotorSpeed {
        /// Which.
        motor: Motor,
        /// Speed, rad/s.
        speed_rad_s: f64,
    },
    /// A wheel turns too fast on the ground.
    #[error(
        "the {motor} wheel turns at {speed_rad_s:.1} rad/s relative to the body: check that it does not slip, or raise \
         wheel_speed_rad_s in [safety]"
    )]
    WheelSpeed {
        /// Which.
        motor: Motor,
        /// Speed, rad/s.
        speed_rad_s: f64,
    },
    /// The robot turns too fast.
    #[error(
        "the robot turns at {yaw_rate_rad_s:.2} rad/s: check the directions of both motors in [link], or raise yaw_rate_rad_s \
         in [safety]"
    )]
    YawRate {
        /// Yaw rate, rad/s.
        yaw_rate_rad_s: f64,
    },
    /// Pitch or pitch rate stands still while the other one moves.
    #[error(
        "the {value} of the IMU has not changed while the {} moved by {turned_rad:.3} rad: power-cycle the \
         IMU and check its settings",
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
        "the pitch of the IMU and its integrated pitch rate differ by {mismatch_rad:.3} rad: check the IMU, its calibration \
         and its mounting"
    )]
    PitchMismatch {
        /// Change of the pitch less the integrated rate, rad.
        mismatch_rad: f64,
    },
    /// Pitch and gravity contradict each other.
    #[error(
        "gravity and the pitch of the IMU differ by {mismatch_rad:.3} rad: check the IMU, its calibration and its mounting"
    )]
    GravityMismatch {
        /// Direction of gravity less the pitch, rad.
        mismatch_rad: f64,
    },
    /// A motor's torque must have moved its shaft, and the encoder does not show it.
    #[error(
        "the {motor} encoder does not change although the torque should have changed the motor speed by {missed_rad_s:.1} \
         rad/s: check the encoder and the torque of the motor"
    )]
    EncoderFrozen {
        /// Which.
        motor: Motor,
        /// Change of speed that is missing, rad/s.
        missed_rad_s: f64,
    },
    /// The body swings, and neither encoder shows it.
    #[error("both encoders do not change although the body swings: check the encoders")]
    EncodersFrozen,
    /// A motor's angle and its speed contradict each other.
    #[error(
        "the angle of the {motor} motor and its integrated speed differ by {mismatch_rad:.2} rad: check the encoder, and \
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
        "yaw from the wheels and from the IMU differ by {mismatch_rad:.2} rad: check the encoders and for wheel \
         slip, and whether left_motor_id and right_motor_id in [link] are swapped"
    )]
    YawMismatch {
        /// Heading by the wheels less that by the IMU, rad.
        mismatch_rad: f64,
    },
    /// A motor turns against its torque.
    #[error(
        "the {motor} motor turns in the direction opposite to its torque: check the motor's calibration and its phase wires, and \
         {motor}_direction in [link]"
    )]
    TorqueReversed {
        /// Which.
        motor: Motor,
    },
    /// Each motor turns by the torque of the other one.
    #[error(
        "each motor responds to the torque of the other one: check left_motor_id and right_motor_id in [link], and the slots \
         of torque_command"
    )]
    TorquesSwapped,
    /// Neither wheels nor body move under a torque.
    #[error(
        "the robot is held: neither its wheels nor its body responded to torque: release it after arming"
    )]
    Held,
    /// Wheels that are to be in the air are not.
    #[error(
        "the wheels are on the ground or held: they responded {factor:.2} times as fast as in the air: lift them, \
         then check and arm again"
    )]
    WheelsOnGround {
        /// Speed over that in the air.
        factor: f64,
    },
    /// The torque acts later than the model says.
    #[error(
        "the torque acts {delay_s:.3} s later than delay_s in [actuation]: check the latency of the CAN adapter, or \
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
    /// A motor does much more or less than it is requested.
    #[error(
        "the torque of the motors is {factor:.2} times the command: check torque_constant_nm_a and \
         current_steps_per_a in [link]"
    )]
    TorqueScale {
        /// Done over asked.
        factor: f64,
    },
    /// A reading that is no number, or a torque that would be none.
    #[error("a measurement is not a finite number")]
    NotFinite,
    /// A tick came too late.
    #[error("a tick of the control loop came {late_s:.3} s late: close other programs")]
    Late {
        /// By how much, s.
        late_s: f64,
    },
    /// The bus does not work.
    #[error("CAN bus failure: bus off, adapter unplugged or queue full")]
    BusDown,
}

impl StopReason {
    /// Name for files and scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Requested => "requested",
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
    /// What was found and, unless it is right, the remedy.
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
