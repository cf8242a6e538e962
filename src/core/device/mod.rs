//! The one room with effects: sockets, serial ports, files of a recording, threads and clocks.
#![expect(clippy::disallowed_methods, reason = "the only module of the core with system calls")]

mod bus_health;
#[cfg(target_os = "linux")]
mod can;
mod clock;
#[cfg(unix)]
mod emulator;
mod imu_port;
mod interfaces;
mod lateness;
mod open;
mod open_error;
mod pacer;
#[cfg(unix)]
mod pty;
#[cfg(unix)]
#[cfg(test)]
mod pty_tests;
mod reconnect;
mod recorder;
mod replace_file;
mod retry;
mod serial;
mod session;
mod slcan;
mod stop;
mod timing;

pub use bus_health::{BusHealth, BusState};
#[cfg(target_os = "linux")]
pub use can::SocketCan;
pub use clock::Clock;
#[cfg(unix)]
pub use emulator::{EmulatorCounts, EmulatorPorts, EmulatorServer};
pub use imu_port::{ImuConfigureError, ImuPort, open_imu};
pub use interfaces::{Advice, CanInterface, Interfaces, SerialPort, interfaces};
pub use lateness::Lateness;
pub use open::{BusPair, open_bus};
pub use open_error::OpenError;
pub use pacer::{Pacer, Priority, Tick, hurry};
pub use recorder::{Recorder, RecorderError, RecorderInput};
pub use replace_file::{abandon_replacements, check_replaceable, real_path, replace_file};
pub use session::{
    Connection, Counters, Described, DriveStatus, Ending, Event, EventKind, FileError, ImuStatus,
    MotorStatus, RecordingStatus, SerialAddress, SerialAddressError, Session, SessionError, SessionMode,
    SessionOptions, SessionOrder, Source, SourceError, Status, Timing, Update, Waker,
};
pub use stop::{all_stopped, stop_all};
pub use timing::{LatenessSummary, TimingComparison, TimingError, TimingPlan, compare_timing};
