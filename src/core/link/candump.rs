//! Logs of can-utils' `candump`, one frame a line.
//!
//! Read: the form that `candump -L` writes, `(seconds.microseconds) interface frame [R|T]`, and, where its lines
//! have a time, the form for people, `(seconds.microseconds)  interface  id   [length]  bytes`. Written: the
//! former. Besides what candump writes, blanks in any number, times with 0 to 9 decimals, dots between bytes
//! and small letters are read. CAN XL frames are not.

use std::time::Duration;

use super::{Direction, Frame, FrameId, FrameKind};

mod line;
#[cfg(test)]
mod tests;

pub use line::{LineError, LineProblem, parse_line};

/// One line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry<'a> {
    /// When; candump's own is since 1970 unless asked otherwise. Written in whole microseconds.
    pub time: Duration,
    /// Name of the interface.
    pub interface: &'a str,
    /// The frame.
    pub frame: LoggedFrame,
    /// Which way it went, where the log says so (`candump -x`).
    pub direction: Option<Direction>,
}

/// A frame of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoggedFrame {
    /// A classic frame.
    Classic {
        /// The frame.
        frame: Frame,
        /// Length code above 8 that a frame of 8 bytes had on the bus: 9 to 15.
        raw_length_code: Option<u8>,
    },
    /// A CAN FD frame.
    Fd(FdFrame),
}

/// A CAN FD frame: read and written, but no more, for no motor or IMU of the robot speaks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FdFrame {
    id: FrameId,
    flags: u8,
    length: u8,
    bytes: [u8; 64],
}

impl FdFrame {
    /// A frame with these flags (1 faster data, 2 error state, 4 FD); none of a length that FD frames do not have.
    pub fn new(id: FrameId, flags: u8, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 64];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        let has_length = matches!(data.len(), 0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64);
        (has_length && flags <= 0xF).then_some(Self { id, flags, length: data.len() as u8, bytes })
    }

    /// Identifier.
    pub fn id(&self) -> FrameId {
        self.id
    }

    /// Flags.
    pub fn flags(&self) -> u8 {
        self.flags
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

impl From<Frame> for LoggedFrame {
    fn from(frame: Frame) -> Self {
        Self::Classic { frame, raw_length_code: None }
    }
}

/// Bit of an identifier of 8 digits that makes it an error frame's.
const ERROR_BIT: u32 = 0x2000_0000;

/// Appends a line, with its line feed.
pub fn write_line(out: &mut String, entry: &Entry<'_>) {
    out.push('(');
    push_decimal(out, entry.time.as_secs(), 1);
    out.push('.');
    push_decimal(out, u64::from(entry.time.subsec_micros()), 6);
    out.push_str(") ");
    out.push_str(entry.interface);
    out.push(' ');
    match &entry.frame {
        LoggedFrame::Classic { frame, raw_length_code } => push_classic(out, frame, *raw_length_code),
        LoggedFrame::Fd(frame) => {
            push_id(out, frame.id);
            out.push_str("##");
            push_hex(out, u32::from(frame.flags), 1);
            push_bytes(out, frame.bytes());
        }
    }
    out.push_str(match entry.direction {
        None => "\n",
        Some(Direction::Received) => " R\n",
        Some(Direction::Sent) => " T\n",
    });
}

fn push_classic(out: &mut String, frame: &Frame, raw_length_code: Option<u8>) {
    match frame.kind() {
        FrameKind::Error => push_hex(out, frame.id().raw() | ERROR_BIT, 8),
        FrameKind::Data | FrameKind::Remote => push_id(out, frame.id()),
    }
    out.push('#');
    if frame.kind() == FrameKind::Remote {
        out.push('R');
        if frame.length() > 0 {
            push_hex(out, u32::from(frame.length()), 1);
        }
    }
    push_bytes(out, frame.bytes());
    if let Some(code) = raw_length_code {
        out.push('_');
        push_hex(out, u32::from(code), 1);
    }
}

fn push_id(out: &mut String, id: FrameId) {
    match id {
        FrameId::Standard(id) => push_hex(out, u32::from(id), 3),
        FrameId::Extended(id) => push_hex(out, id, 8),
    }
}

fn push_bytes(out: &mut String, bytes: &[u8]) {
    bytes.iter().for_each(|byte| push_hex(out, u32::from(*byte), 2));
}

fn push_hex(out: &mut String, value: u32, digits: u32) {
    out.extend(
        (0..digits).rev().map(|digit| char::from(b"0123456789ABCDEF"[(value >> (4 * digit) & 0xF) as usize])),
    );
}

fn push_decimal(out: &mut String, value: u64, digits: usize) {
    let mut text = [b'0'; 20];
    let mut rest = value;
    for digit in text.iter_mut().rev() {
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    let leading = text.iter().take_while(|digit| **digit == b'0').count();
    out.extend(text[leading.min(20 - digits)..].iter().map(|digit| char::from(*digit)));
}
