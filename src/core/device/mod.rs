//! The one room with effects: sockets, serial ports, files of a recording, threads and clocks.

mod recorder;
mod session;

pub use recorder::{Recorder, RecorderError, RecorderInput};
pub use session::{
    Connection, Counters, DriveStatus, Event, EventKind, ImuStatus, MotorStatus, RecordingStatus,
    SerialAddress, SessionMode, SessionOptions, SessionOrder, Source, SourceError, Status, Timing, Update,
};
