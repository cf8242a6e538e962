//! A robot that is monitored or driven: orders to the session, and its updates.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use crate::control::{
    BalanceController,
    drive::{Check, DriveOrder, Excitation, Stage},
};
use crate::link::{MotorHealth, StampedFrame, dbc::Choice};
use crate::model::RobotModel;
use crate::record::Sample;

/// Bit rate of an LK motor's bus as delivered, bit/s.
const DEFAULT_BIT_RATE: u32 = 1_000_000;

/// Where the frames come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A CAN interface of the system (SocketCAN), such as `can0`.
    Can {
        /// Name of the interface.
        interface: String,
    },
    /// An adapter on a serial port that speaks SLCAN.
    Slcan {
        /// Port, such as `/dev/ttyACM0` or `COM3`.
        port: String,
        /// Bit rate of the CAN bus, bit/s.
        bit_rate: u32,
    },
    /// A robot emulated in this program.
    Emulated,
    /// A recording: the robot log, or the raw frames next to it.
    Replay {
        /// File.
        file: PathBuf,
    },
}

/// A source that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown source `{text}`: give can:INTERFACE, slcan:PORT@BITRATE, emulated or replay:FILE")]
pub struct SourceError {
    text: String,
}

impl FromStr for Source {
    type Err = SourceError;

    fn from_str(text: &str) -> Result<Self, SourceError> {
        let error = || SourceError { text: text.to_owned() };
        let given = |rest: &str| (!rest.is_empty()).then(|| rest.to_owned()).ok_or_else(error);
        match text.split_once(':') {
            None if text == "emulated" => Ok(Self::Emulated),
            Some(("can", interface)) => Ok(Self::Can { interface: given(interface)? }),
            Some(("slcan", rest)) => {
                let (port, bit_rate) = match rest.rsplit_once('@') {
                    Some((port, rate)) => (port, rate.parse().map_err(|_| error())?),
                    None => (rest, DEFAULT_BIT_RATE),
                };
                Ok(Self::Slcan { port: given(port)?, bit_rate })
            }
            Some(("replay", file)) => Ok(Self::Replay { file: given(file)?.into() }),
            _ => Err(error()),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Can { interface } => write!(f, "can:{interface}"),
            Self::Slcan { port, bit_rate } => write!(f, "slcan:{port}@{bit_rate}"),
            Self::Emulated => f.write_str("emulated"),
            Self::Replay { file } => write!(f, "replay:{}", file.display()),
        }
    }
}

impl Source {
    /// Name of the interface in recordings of raw frames.
    pub(super) fn interface(&self) -> String {
        match self {
            Self::Can { interface } => interface.clone(),
            Self::Slcan { .. } => "slcan0".to_owned(),
            Self::Emulated | Self::Replay { .. } => "can0".to_owned(),
        }
    }

    /// Bit rate of the bus, bit/s; `None` of a recording. A virtual interface has none and is taken for a motor's bus
    /// as delivered.
    pub(super) fn bit_rate(&self) -> Option<u32> {
        match self {
            Self::Slcan { bit_rate, .. } => Some(*bit_rate),
            Self::Emulated => Some(DEFAULT_BIT_RATE),
            #[cfg(target_os = "linux")]
            Self::Can { interface } => {
                Some(crate::device::interfaces::bit_rate(interface).unwrap_or(DEFAULT_BIT_RATE))
            }
            #[cfg(not(target_os = "linux"))]
            Self::Can { .. } => Some(DEFAULT_BIT_RATE),
            Self::Replay { .. } => None,
        }
    }
}

/// A serial port and its speed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialAddress {
    /// Port, such as `/dev/ttyUSB0`.
    pub port: String,
    /// Speed, bit/s.
    pub baud: u32,
}

/// A serial port that cannot be read from its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("invalid serial port `{text}`: give serial:PORT@BAUD, such as serial:/dev/ttyUSB0@115200")]
pub struct SerialAddressError {
    text: String,
}

impl FromStr for SerialAddress {
    type Err = SerialAddressError;

    fn from_str(text: &str) -> Result<Self, SerialAddressError> {
        let error = || SerialAddressError { text: text.to_owned() };
        let (port, baud) =
            text.strip_prefix("serial:").and_then(|rest| rest.rsplit_once('@')).ok_or_else(error)?;
        let baud = baud.parse().ok().filter(|baud| *baud > 0).ok_or_else(error)?;
        if port.is_empty() { Err(error()) } else { Ok(Self { port: port.to_owned(), baud }) }
    }
}

impl fmt::Display for SerialAddress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "serial:{}@{}", self.port, self.baud)
    }
}

/// Whether anything may ever be sent.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionMode {
    /// Nothing is sent, whatever is requested later.
    Listen,
    /// Listens until armed in two steps.
    Drive {
        /// First controller.
        controller: Box<BalanceController>,
        /// What the motors are to do.
        excitation: Excitation,
    },
}

impl SessionMode {
    /// Whether the wheels are to be off the ground.
    pub(super) fn wheels_in_air(&self) -> bool {
        match self {
            Self::Listen => false,
            Self::Drive { excitation, .. } => {
                matches!(excitation, Excitation::SpeedSweep { .. } | Excitation::Multisine { .. })
            }
        }
    }
}

/// A robot whose frames a DBC file describes.
#[derive(Clone, Debug, PartialEq)]
pub struct Described {
    /// The DBC file.
    pub file: PathBuf,
    /// Which of its signals are what.
    pub signals: Vec<Choice>,
}

/// What a session is opened with.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionOptions {
    /// Where the frames come from.
    pub source: Source,
    /// IMU on a serial port of its own; an emulated or replayed robot has its IMU with it.
    pub imu: Option<SerialAddress>,
    /// A robot with another motor protocol than those of the program; it can be watched only.
    pub dbc: Option<Described>,
    /// The robot.
    pub robot: RobotModel,
    /// Whether anything may be sent.
    pub mode: SessionMode,
    /// Recording from the start: the robot log; the raw frames go to a file next to it.
    pub record: Option<PathBuf>,
    /// Seed of an emulated robot's noise.
    pub seed: u64,
    /// Speed of a replay; 1 is real time, infinite as fast as possible.
    pub replay_speed: f64,
}

/// Order to a running session.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionOrder {
    /// To the drive.
    Drive(DriveOrder),
    /// Starts a recording, or ends it.
    Record(Option<PathBuf>),
    /// Holds a replay, or lets it go on.
    Pause(bool),
    /// Speed of a replay.
    ReplaySpeed(f64),
    /// Pushes an emulated robot's body, forward positive, N for s.
    Push {
        /// Force, N.
        force_n: f64,
        /// Duration, s.
        duration_s: f64,
    },
    /// Time between two updates.
    Interval(Duration),
}

/// What has happened since the last update.
#[derive(Clone, Debug, PartialEq)]
pub struct Update {
    /// Rows of the robot log; where more than 0.1 s are between two, nothing was received, and no line is drawn.
    pub samples: Vec<Sample>,
    /// The newest raw frames, at most [`Update::FRAMES`].
    pub frames: Vec<StampedFrame>,
    /// What happened, oldest first.
    pub events: Vec<Event>,
    /// How everything stands.
    pub status: Status,
}

impl Update {
    /// Most raw frames in one update.
    pub const FRAMES: usize = 500;
}

/// Something worth a line of the record.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When, since the session's start.
    pub time: Duration,
    /// What sort.
    pub kind: EventKind,
    /// In a sentence.
    pub text: String,
}

/// Sorts of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Connected, recording begun, stage changed.
    Note,
    /// Something is not as it should be.
    Warning,
    /// The robot was stopped.
    Stop,
}

impl EventKind {
    const ALL: [Self; 3] = [Self::Note, Self::Warning, Self::Stop];

    /// Its name in recordings and lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Stop => "stop",
        }
    }

    /// The sort of this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// How everything stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Time of the session, or of the recording that is replayed.
    pub time: Duration,
    /// The bus.
    pub connection: Connection,
    /// The drive, in a session that may drive.
    pub drive: Option<DriveStatus>,
    /// Left and right motor.
    pub motors: [MotorStatus; 2],
    /// The IMU.
    pub imu: ImuStatus,
    /// Counts since the start.
    pub counters: Counters,
    /// The control loop's ticks.
    pub timing: Timing,
    /// The recording, if one is made.
    pub recording: Option<RecordingStatus>,
}

/// Whether frames come.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Connection {
    /// Open, and the robot is received through the source that was named; its IMU on a separate line does not count.
    #[default]
    Connected,
    /// Open, but nothing has been received yet, or for a second.
    Silent {
        /// What may be wrong, and the remedy.
        hint: String,
    },
    /// Lost; it is tried again by itself.
    Lost {
        /// What the system said.
        reason: String,
    },
    /// A replay that has come to its end.
    Ended,
}

/// How the drive stands.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveStatus {
    /// How far it is from being driven.
    pub stage: Stage,
    /// Whether the motors are off and have said so, or were never switched on.
    pub motors_off: bool,
    /// What has to be right before that.
    pub checks: Vec<Check>,
}

/// How a motor stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorStatus {
    /// Newest temperature, °C.
    pub temperature_c: Option<f64>,
    /// Newest health.
    pub health: Option<MotorHealth>,
    /// Newest torque current, A.
    pub current_a: Option<f64>,
    /// Readings a second, over the last second.
    pub rate_hz: f64,
    /// Age of the newest reading.
    pub age: Option<Duration>,
    /// Replies that did not come.
    pub missed: u64,
}

/// How the IMU stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuStatus {
    /// Readings a second, over the last second.
    pub rate_hz: f64,
    /// Age of the newest reading.
    pub age: Option<Duration>,
    /// Newest temperature, °C.
    pub temperature_c: Option<f64>,
    /// Intact packets.
    pub packets: u64,
    /// Packets with a wrong sum.
    pub corrupted: u64,
    /// Bytes that belonged to no packet.
    pub stray_bytes: u64,
}

/// Counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Frames from the bus.
    pub received: u64,
    /// Frames to the bus.
    pub sent: u64,
    /// Frames a second from the bus, over the last second.
    pub received_hz: f64,
    /// Fraction of the bus that frames took over the last second, stuffing included: at the interface's bit rate, or at
    /// 1 Mbit/s where a virtual interface has none; `None` of a recording.
    pub bus_load: Option<f64>,
    /// Frames that the system or the adapter dropped before they were read.
    pub dropped: u64,
    /// Frames and samples that came but did not reach the control loop, a window or a recording.
    pub lost: u64,
    /// Error frames, damaged lines of an adapter, and those of a recording that is replayed.
    pub errors: u64,
    /// Ticks of the control loop that came a period late or later.
    pub late: u64,
    /// Times the bus was lost and came back.
    pub reconnects: u64,
}

/// Lateness of the control loop's ticks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timing {
    /// Ticks so far.
    pub ticks: u64,
    /// Half of the ticks were not later, s.
    pub median_s: f64,
    /// 99 % of the ticks were not later, s.
    pub p99_s: f64,
    /// The latest one, s.
    pub greatest_s: f64,
    /// Ticks that were left out because the one before took too long.
    pub skipped: u64,
    /// Ticks by lateness: each bin reaches to [`Timing::EDGES_S`]; the last one has all above.
    pub histogram: Vec<u64>,
}

impl Timing {
    /// Upper edges of all bins but the last, s.
    pub const EDGES_S: [f64; 14] =
        [1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2];
}

/// How a recording stands.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingStatus {
    /// The robot log.
    pub file: PathBuf,
    /// Rows written.
    pub rows: u64,
    /// Rows of the robot log that were handed over and are not in the file: final once the recording has ended, zero
    /// while it goes on.
    pub rows_lost: u64,
    /// Frames written.
    pub frames: u64,
    /// Bytes of both files.
    pub bytes: u64,
    /// Why it has ended early: disk full, for instance.
    pub problem: Option<String>,
}

/// What a session has come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ending {
    /// Whether the motors have confirmed that they are off, or were never switched on.
    pub motors_off: bool,
    /// The recording that was being made, complete, if one was.
    pub recording: Option<RecordingStatus>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_and_ports_are_read_as_they_are_written_and_nothing_else_is() {
        for text in ["can:can0", "slcan:/dev/ttyACM0@500000", "emulated", "replay:run:1.log"] {
            assert_eq!(text.parse::<Source>().map(|source| source.to_string()).as_deref(), Ok(text));
        }
        let without_rate = Source::Slcan { port: "COM3".to_owned(), bit_rate: 1_000_000 };
        assert_eq!("slcan:COM3".parse(), Ok(without_rate));
        for text in ["", "can", "can:", "can0", "slcan:", "slcan:@5", "slcan:p@fast", "Emulated", "replay:"] {
            assert!(text.parse::<Source>().is_err(), "{text}");
        }
        let port = "serial:/dev/ttyUSB0@115200";
        assert_eq!(port.parse::<SerialAddress>().map(|port| port.to_string()).as_deref(), Ok(port));
        for text in ["/dev/ttyUSB0@115200", "serial:/dev/ttyUSB0", "serial:@9600", "serial:p@0", "serial:p@x"]
        {
            assert!(text.parse::<SerialAddress>().is_err(), "{text}");
        }
    }
}
