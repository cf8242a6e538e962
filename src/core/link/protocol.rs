//! Protocols of motor drives on CAN: the side of the computer and the side of the drive.
//!
//! A protocol is two codecs without input or output and one entry in [`protocol`]. The computer's side,
//! [`MotorProtocol`], turns orders to both wheel motors into frames and frames into reports; [`super::Wheels`] adds what
//! all protocols share: mounting directions, counted turns and events. The drive's side, [`MotorDrive`], is what the
//! emulated robot answers with. Both work in the motor's own sense of rotation, at the output shaft, in SI units.

use std::fmt;
use std::time::Duration;

use super::{Frame, MotorErrors, MotorHealth, MotorOrder, StampedFrame, lk};
use crate::model::{LinkSettings, Motor, MotorProtocolName};

/// Frames of one order, at most.
pub const MOST_FRAMES: usize = 4;
/// Reports of one frame, at most.
pub const MOST_REPORTS: usize = 4;

/// Frames of one order.
pub type Frames = [Option<Frame>; MOST_FRAMES];
/// Reports of one frame.
pub type Reports = [Option<Report>; MOST_REPORTS];

/// A motor protocol that `[link]` can name.
#[derive(Clone, Copy, Debug)]
pub struct Protocol {
    /// Creates the computer's side.
    pub host: fn(&LinkSettings) -> Box<dyn MotorProtocol>,
    /// Creates the side of one drive after power-up.
    pub drive: fn(&DriveSetup<'_>) -> Box<dyn MotorDrive>,
    /// Describes a frame in words; `None` if it is not of this protocol.
    pub describe: fn(&StampedFrame, &LinkSettings) -> Option<String>,
    /// Warning to show before arming, if the drives may hold their last torque when commands stop to arrive.
    pub command_loss: Option<&'static str>,
    /// True if drives report unprompted, so that there is no round trip to measure.
    pub reports_unprompted: bool,
    /// Base identifiers that drives may answer on, the default first; empty if the protocol leaves no choice.
    pub reply_bases: &'static [u16],
    /// Torque constant of an emulated motor whose wiring gives none, N m/A.
    pub emulated_constant_nm_a: Option<f64>,
}

/// Looks a protocol up.
pub fn protocol(name: MotorProtocolName) -> &'static Protocol {
    match name {
        MotorProtocolName::Lk => &lk::PROTOCOL,
    }
}

/// Computer's side of a motor protocol, for both wheel motors of a robot.
///
/// Frames go in and reports come out; time is that of the frames. One order goes to both motors at once, so that a
/// protocol can put the commands of several motors in one frame. Drives may report when they are asked, when they are
/// commanded, or unprompted.
pub trait MotorProtocol: fmt::Debug + Send {
    /// Encodes an order. A protocol sends nothing for an order that its drives do not need, and a torque beyond
    /// [`MotorProtocol::torque_range`] is clamped. If drives have no command to switch on or off, the next frame of
    /// each motor reports [`Report::Switched`].
    fn encode(&mut self, order: &MotorOrder) -> Frames;

    /// Decodes a frame. Frames that this program sent are handed in too, each once and before its reply: they show
    /// which replies to expect, and only [`Report::Commanded`] may come of them. A frame of another device has no
    /// reports.
    fn decode(&mut self, frame: &StampedFrame) -> Reports;

    /// Takes the time at which a frame, handed to [`MotorProtocol::decode`] when it was ordered, was written to the bus.
    fn written(&mut self, frame: &StampedFrame) {
        let _ = frame;
    }

    /// Range and step of the torque command.
    ///
    /// # Errors
    /// What to set in `[link]` before torques can be commanded.
    fn torque_range(&self) -> Result<TorqueRange, &'static str>;

    /// Longest silence of a motor over which its turns can still be counted.
    fn longest_silence(&self) -> Duration;
}

/// Torques that a protocol can command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRange {
    /// Largest torque of either sign, N m.
    pub max_nm: f64,
    /// Resolution, N m.
    pub step_nm: f64,
}

/// Contents of a frame about one motor, in the motor's own sense of rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Report {
    /// Reading of the motion.
    Motion {
        /// Which.
        motor: Motor,
        /// Angle.
        angle: ShaftAngle,
        /// Speed, rad/s.
        speed_rad_s: f64,
        /// Torque current, A.
        current_a: f64,
        /// Temperature, °C.
        temperature_c: f64,
    },
    /// Reading of the drive's condition.
    Health(Motor, MotorHealth),
    /// Acknowledgement that the motor is switched on or off.
    Switched {
        /// Which.
        motor: Motor,
        /// True if it is on.
        on: bool,
    },
    /// A command that is no query; if it was received, another controller sent it.
    Commanded {
        /// Which.
        motor: Motor,
        /// Code that identifies the command.
        command: u32,
        /// Torque current of a torque command, A.
        current_a: Option<f64>,
    },
}

/// Angle that a drive reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShaftAngle {
    /// Encoder steps within a turn of the encoder; turns are counted by [`super::Wheels`].
    WithinTurn {
        /// Reading, from 0.
        steps: u32,
        /// Steps of a turn.
        turn_steps: u32,
        /// Angle of the output shaft for a turn of the encoder, rad: 2π divided by the gear ratio between them.
        turn_rad: f64,
    },
    /// Angle that the drive counts over turns, rad.
    Continuous(f64),
}

/// What an emulated drive is built from.
#[derive(Clone, Copy, Debug)]
pub struct DriveSetup<'a> {
    /// True wiring.
    pub wiring: &'a LinkSettings,
    /// Which motor.
    pub motor: Motor,
    /// Random number for the encoder's zero.
    pub random: u32,
    /// Base identifier of the replies, where the protocol leaves a choice.
    pub reply_base: Option<u16>,
}

/// Side of one drive of a motor protocol, for the emulated robot.
pub trait MotorDrive: fmt::Debug + Send {
    /// Obeys a frame and answers it; `None` if the frame is not for this drive.
    fn receive(
        &mut self,
        frame: &Frame,
        state: &mut DriveState,
        measured: &DriveMeasurement,
    ) -> Option<DriveAnswer>;

    /// Starts again after a loss of power.
    fn power_up(&mut self, measured: &DriveMeasurement);

    /// Frame with a command code and otherwise zeros, as another controller would send it.
    fn foreign_command(&self, code: u8) -> Frame;

    /// Frame that the drive sends unprompted at a tick of 1 ms.
    fn tick(&mut self, state: &DriveState, measured: &DriveMeasurement) -> Option<Frame> {
        let _ = (state, measured);
        None
    }
}

/// Answer of a drive to a frame that is for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveAnswer {
    /// The reply.
    Reply(Frame),
    /// No reply.
    Silence,
}

/// State that commands change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveState {
    /// True if it is switched on.
    pub on: bool,
    /// Current command.
    pub demand: Demand,
    /// Errors that are still there.
    pub causes: MotorErrors,
    /// Errors that are reported until they are cleared.
    pub errors: MotorErrors,
}

impl DriveState {
    /// Returns whether it gives torque on demand.
    pub fn works(&self) -> bool {
        self.on && self.errors.is_none()
    }
}

/// What a drive is commanded to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// Nothing.
    None,
    /// A torque, N m.
    Torque(f64),
    /// A speed.
    Speed {
        /// Setpoint, rad/s.
        target_rad_s: f64,
        /// Largest torque, N m.
        limit_nm: f64,
    },
}

/// Measurements of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveMeasurement {
    /// Angle of the output shaft, rad.
    pub angle_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_s: f64,
    /// Torque, N m.
    pub torque_nm: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Voltage of the supply, V.
    pub voltage_v: f64,
}
