//! Recordings as MCAP files, which Foxglove, PlotJuggler and Rerun open.
//!
//! Messages are protocol buffers with their description in the file (`FileDescriptorSet`): the one encoding that
//! all three decode into numbers (Rerun keeps JSON as bytes). Chunks are not compressed. Times are nanoseconds
//! since 1970 where the recording says when it began, else since the log's own zero.
//!
//! | topic | from | message |
//! |---|---|---|
//! | `/state` | robot log | `x_m`, `x_dot_m_s`, `pitch_rad`, `pitch_rate_rad_s` |
//! | `/motors/left`, `/motors/right` | robot log | `angle_rad`, `speed_rad_s`, `torque_nm`, `temperature_c` |
//! | `/supply` | robot log | `voltage_v` |
//! | `/bench` or another name given by the caller | any other column of a log | the columns |
//! | `/events` | comments of a recording | `foxglove.Log`, for Foxglove's Log panel |
//! | `/can/INTERFACE` | raw frames | `id`, `extended`, `remote`, `error`, `sent`, `length`, `data` |
//! | `/imu/acceleration`, `/imu/rate`, `/imu/angle`, … | packets of the IMU among the frames | in its own axes |
//!
//! Numbers that a log does not have are NaN. Same input, same bytes.

mod convert;
mod protobuf;
#[cfg(test)]
mod tests;
mod topics;
mod writer;

pub use convert::{Conversion, ConvertError, Input, convert};
pub use writer::is_opening;
