//! Lines of a recording's raw frames.

use std::fmt::Write;
use std::ops::Range;
use std::time::Duration;

use super::IMU_INTERFACE;
use crate::link::jy901::{Kind, Packet};
use crate::link::{Direction, Frame, FrameId, FrameKind, StampedFrame};

/// Adds a frame; its time counts from `start`, which counts from 1970.
pub fn push_frame(text: &mut String, start: Duration, interface: &str, frame: &StampedFrame) {
    let time = start + frame.time;
    let written = write_line(text, time, interface, frame);
    written.expect("writing to a string cannot fail");
}

/// Adds a packet of the IMU, heard at `time` since `start`.
pub fn push_imu_packet(text: &mut String, start: Duration, time: Duration, packet: &Packet) {
    let frame = Frame::full(FrameId::Standard(u16::from(packet.kind.code())), packet.data);
    push_frame(text, start, IMU_INTERFACE, &StampedFrame { time, direction: Direction::Received, frame });
}

/// The packet of the IMU that a frame of [`IMU_INTERFACE`] is; none of a frame that is no packet.
pub fn imu_packet(frame: &Frame) -> Option<Packet> {
    let kind = Kind::of(u8::try_from(frame.id().raw()).ok()?)?;
    Some(Packet { kind, data: frame.bytes().try_into().ok()? })
}

/// The frame of a line, and where in it the name of its interface stands.
pub(super) fn parse_line(line: &[u8]) -> Result<(Range<usize>, StampedFrame), String> {
    parse(line).ok_or_else(|| "this is no frame as candump -L writes it, it was left out".to_owned())
}

fn parse(line: &[u8]) -> Option<(Range<usize>, StampedFrame)> {
    let text = std::str::from_utf8(line).ok()?;
    let mut words = text.split_ascii_whitespace();
    let (time, interface, frame) = (words.next()?, words.next()?, words.next()?);
    let direction = if words.next() == Some("T") { Direction::Sent } else { Direction::Received };
    let (seconds, micros) = time.strip_prefix('(')?.strip_suffix(')')?.split_once('.')?;
    let time = Duration::from_secs(seconds.parse().ok()?) + Duration::from_micros(micros.parse().ok()?);
    let (id, data) = frame.split_once('#')?;
    let raw = u32::from_str_radix(id, 16).ok()?;
    let bytes: Vec<u8> = data
        .as_bytes()
        .chunks(2)
        .map_while(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok())
        .collect();
    let frame = if id.len() == 8 && raw & 0x2000_0000 != 0 {
        Frame::error(raw & 0x1FFF_FFFF, bytes.try_into().ok()?)?
    } else {
        let id = if id.len() == 3 {
            FrameId::standard(u16::try_from(raw).ok()?)?
        } else {
            FrameId::extended(raw)?
        };
        match data.strip_prefix('R') {
            Some(length) => Frame::remote(id, length.parse().ok()?)?,
            None => Frame::data(id, &bytes)?,
        }
    };
    let start = text.find(interface)?;
    Some((start..start + interface.len(), StampedFrame { time, direction, frame }))
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
