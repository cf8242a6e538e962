//! Recordings of a robot: files that grow line by line while it runs.
//!
//! A recording `NAME` is
//! - `NAME.csv`, a robot log: [`Row::columns`], with a comment for every event where
//!   it happened, such as `# 12.345 s stop: …`;
//! - `NAME.log`, the raw frames as `candump -L` writes them, times since 1970, received ones ending in ` R` and
//!   sent ones in ` T`. A packet of the IMU stands there as a frame of the interface [`IMU_INTERFACE`]: its id is
//!   the packet's type (0x51 to 0x59), its data are the packet's eight bytes; the sum follows from them;
//! - with the wheels in the air also a bench log of each motor, `NAME.left.csv` and `NAME.right.csv`.
//!
//! Every line is written with its end, so where the program was killed the last line without one is torn and is
//! left out by whoever reads. Numbers have the fewest digits that read back to the same number.

mod frame_log;
mod frames;
mod names;
mod row;
mod text;

pub use frame_log::FrameLog;
pub use frames::{imu_packet, push_frame, push_imu_packet};
pub use names::Names;
pub use row::Row;
pub(super) use row::{OPTIONAL_COLUMNS, ROW_COLUMNS};
pub use text::{
    About, bench_header, parse_event, parse_start, push_bench_row, push_event, push_row, robot_header,
};

#[cfg(test)]
mod tests;

/// Beginning of the first line of every recorded log.
pub const FIRST_LINE: &str = "# flqr recording";

/// Interface under which packets of the IMU stand among the frames.
pub const IMU_INTERFACE: &str = "imu";
