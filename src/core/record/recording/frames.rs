//! Lines of a recording's raw frames.

use std::time::Duration;

use super::IMU_INTERFACE;
use crate::link::candump::{self, Entry};
use crate::link::jy901::{Kind, Packet};
use crate::link::{Direction, Frame, FrameId, StampedFrame};

/// Adds a frame; its time counts from `start`, which counts from 1970.
pub fn push_frame(text: &mut String, start: Duration, interface: &str, frame: &StampedFrame) {
    let StampedFrame { time, direction, frame } = *frame;
    let direction = Some(direction);
    candump::write_line(text, &Entry { time: start + time, interface, frame: frame.into(), direction });
}

/// Adds a packet of the IMU, received at `time` since `start`.
pub fn push_imu_packet(text: &mut String, start: Duration, time: Duration, packet: &Packet) {
    let frame = Frame::full(FrameId::Standard(u16::from(packet.kind.code())), packet.data);
    push_frame(text, start, IMU_INTERFACE, &StampedFrame { time, direction: Direction::Received, frame });
}

/// The packet of the IMU that a frame of [`IMU_INTERFACE`] is; none of a frame that is no packet.
pub fn imu_packet(frame: &Frame) -> Option<Packet> {
    let kind = Kind::of(u8::try_from(frame.id().raw()).ok()?)?;
    Some(Packet { kind, data: frame.bytes().try_into().ok()? })
}
