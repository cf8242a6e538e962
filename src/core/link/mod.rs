//! The robot on the wire: protocols without input or output, and what all buses have in common.
//!
//! Bytes go in and values come out, or the other way round; time is an argument. Ports, sockets and threads
//! are in [`crate::device`].

mod bus;
pub mod bus_load;
pub mod candump;
pub mod dbc;
mod describe;
mod frame;
pub mod ht8115;
mod imu;
pub mod jy901;
pub mod lk;
mod motors;
pub mod protocol;
pub mod slcan;
mod wheels;
mod wire_error;

pub use bus::{Bus, BusError};
pub use describe::describe;
pub use frame::{Direction, Frame, FrameId, FrameKind, StampedFrame};
pub use imu::{ImuAssembler, ImuReading};
pub use motors::{MotorErrors, MotorEvent, MotorHealth, MotorOrder, MotorState};
pub use wheels::Wheels;
pub use wire_error::WireError;
