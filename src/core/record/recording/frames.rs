//! Lines of a recording's raw frames.

use std::fmt::Write;
use std::time::Duration;

use super::IMU_INTERFACE;
use crate::link::{Direction, Frame, FrameId, FrameKind, StampedFrame};

/// Length of a packet of the IMU, bytes.
pub const IMU_PACKET: usize = 11;
/// Each packet of the IMU begins with it.
const IMU_START: u8 = 0x55;

/// Adds a frame; its time counts from `start`, which counts from 1970.
pub fn push_frame(text: &mut String, start: Duration, interface: &str, frame: &StampedFrame) {
    let time = start + frame.time;
    let written = write_line(text, time, interface, frame);
    written.expect("writing to a string cannot fail");
}

/// Adds a packet of the IMU.
pub fn push_imu_packet(text: &mut String, start: Duration, time: Duration, packet: &[u8; IMU_PACKET]) {
    let [_, kind, data @ .., _] = *packet;
    let frame = Frame::full(FrameId::Standard(u16::from(kind)), data);
    push_frame(text, start, IMU_INTERFACE, &StampedFrame { time, direction: Direction::Received, frame });
}

/// The packet of the IMU that a recorded frame was, its sum made anew; none of a frame that was no packet.
pub fn imu_packet(frame: &Frame) -> Option<[u8; IMU_PACKET]> {
    let kind = u8::try_from(frame.id().raw()).ok()?;
    let data: [u8; 8] = frame.bytes().try_into().ok()?;
    let mut packet = [0; IMU_PACKET];
    packet[0] = IMU_START;
    packet[1] = kind;
    packet[2..10].copy_from_slice(&data);
    packet[10] = packet[..10].iter().fold(0, |sum, byte| sum.wrapping_add(*byte));
    Some(packet)
}

fn write_line(
    text: &mut String,
    time: Duration,
    interface: &str,
    stamped: &StampedFrame,
) -> std::fmt::Result {
    let StampedFrame { frame, direction, .. } = stamped;
    write!(text, "({}.{:06}) {interface} ", time.as_secs(), time.subsec_micros())?;
    match (frame.kind(), frame.id()) {
        (FrameKind::Error, id) => write!(text, "{:08X}#", id.raw() | 0x2000_0000)?,
        (_, FrameId::Standard(id)) => write!(text, "{id:03X}#")?,
        (_, FrameId::Extended(id)) => write!(text, "{id:08X}#")?,
    }
    if frame.kind() == FrameKind::Remote {
        write!(text, "R{}", frame.length())?;
    }
    for byte in frame.bytes() {
        write!(text, "{byte:02X}")?;
    }
    text.write_str(if *direction == Direction::Sent { " T\n" } else { " R\n" })
}
