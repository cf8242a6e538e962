//! Motors of Shanghai Lingkong (LKMTECH), MF series: commands and replies on CAN.
//!
//! Every frame is a standard data frame of 8 bytes; byte 0 is the command, and the reply repeats it. Numbers are
//! little-endian and raw: what a step of current or of the encoder is worth is a setting (see [`super::Wheels`]).
//!
//! Sources: the maker's "Motor CAN bus protocol" 2.35 and 2.36. They disagree on the identifier of replies, so
//! both are read; where older firmware has another layout, it is a choice of [`StateLayout`].

mod command;
mod reply;
#[cfg(test)]
mod tests;

pub use command::{Brake, Command, ParameterAccess, SenseOfRotation};
pub use reply::{Encoder, PhaseCurrents, Reply, ReplyId, State1, State2};

use super::frame::{Frame, FrameId, FrameKind};

/// Identifier of the one frame that has the torque currents of the motors 1 to 4.
pub const TORQUES_ID: FrameId = FrameId::Standard(0x280);
/// Largest torque current of either sign in a command, raw.
pub const MAX_IQ: i16 = 2048;

const COMMANDS: u16 = 0x140;
const REPLIES_APART: u16 = 0x180;

/// Number of a motor, 1 to 32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MotorId(u8);

impl MotorId {
    /// The motor of this number; none outside 1 to 32.
    pub fn new(number: u8) -> Option<Self> {
        (1..=32).contains(&number).then_some(Self(number))
    }

    /// The number.
    pub fn number(self) -> u8 {
        self.0
    }

    /// Identifier of its commands, and of the replies of many firmwares.
    pub fn command_id(self) -> FrameId {
        FrameId::Standard(COMMANDS + u16::from(self.0))
    }

    /// Identifier of the replies of the other firmwares.
    pub fn reply_id(self) -> FrameId {
        FrameId::Standard(REPLIES_APART + u16::from(self.0))
    }
}

/// What a frame's identifier tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// A command to this motor or, of many firmwares, its reply.
    CommandOrReply(MotorId),
    /// A reply of this motor.
    Reply(MotorId),
    /// Torque currents of the motors 1 to 4.
    Torques,
}

/// Where a frame belongs, with its bytes; none of a frame that is not of this protocol.
pub fn address(frame: &Frame) -> Option<(Address, [u8; 8])> {
    let FrameId::Standard(id) = frame.id() else { return None };
    if frame.kind() != FrameKind::Data {
        return None;
    }
    let bytes = frame.bytes().try_into().ok()?;
    let address = match id {
        0x141..=0x160 => Address::CommandOrReply(MotorId((id - COMMANDS) as u8)),
        0x181..=0x1A0 => Address::Reply(MotorId((id - REPLIES_APART) as u8)),
        0x280 => Address::Torques,
        _ => return None,
    };
    Some((address, bytes))
}

/// The frame with torque currents of the motors 1 to 4, raw. Their drives have to be set to this mode beforehand;
/// each answers as to a torque command of its own.
pub fn torques_frame(iq: [i16; 4]) -> Frame {
    let mut bytes = [0; 8];
    for (slot, iq) in bytes.chunks_exact_mut(2).zip(iq) {
        slot.copy_from_slice(&iq.to_le_bytes());
    }
    Frame::full(TORQUES_ID, bytes)
}

/// The torque currents in the bytes of such a frame.
pub fn torques(bytes: [u8; 8]) -> [i16; 4] {
    [0, 2, 4, 6].map(|at| i16_at(&bytes, at))
}

fn i16_at(bytes: &[u8; 8], at: usize) -> i16 {
    i16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u16_at(bytes: &[u8; 8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn i32_at(bytes: &[u8; 8], at: usize) -> i32 {
    i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}
