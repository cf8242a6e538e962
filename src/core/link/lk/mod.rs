//! Motors of Shanghai Lingkong (LKMTECH), MF series: commands and replies on CAN.
//!
//! Every frame is a standard data frame of 8 bytes; byte 0 is the command, and the reply repeats it. Numbers are
//! little-endian and raw: what a step of current or of the encoder is worth is a setting of `[link]`.
//!
//! Sources: the maker's "Motor CAN bus protocol" 2.35 and 2.36. They disagree on the identifier of replies, so
//! both are read; where older firmware has another layout, it is a choice of [`StateLayout`].

mod command;
mod describe;
mod drive;
mod host;
mod reply;
#[cfg(test)]
mod tests;

pub use command::{Brake, Command, ParameterAccess, SenseOfRotation};
pub use reply::{Encoder, PhaseCurrents, Reply, ReplyId, State1, State2};

use std::ops::Range;

use super::WireError;
use super::frame::{Frame, FrameId, FrameKind};
use super::protocol::Protocol;

/// Entry of this protocol.
pub(super) const PROTOCOL: Protocol = Protocol {
    host: |settings| Box::new(host::Host::new(settings)),
    drive: |setup| Box::new(drive::Drive::new(setup)),
    describe: describe::describe,
    command_loss: Some(host::NO_TIMEOUT),
    reports_unprompted: false,
    reply_bases: &[COMMANDS, REPLIES_APART],
    emulated_constant_nm_a: Some(drive::TORQUE_CONSTANT_NM_A),
};

/// Places of the fields in the 8 bytes of a frame.
mod field {
    use std::ops::Range;

    pub(super) const LENGTH: usize = 8;
    /// Command, in every frame.
    pub(super) const COMMAND: usize = 0;

    // Commands.
    /// Brake action, or sense of rotation.
    pub(super) const OPTION: usize = 1;
    /// Limit of current or speed.
    pub(super) const LIMIT: Range<usize> = 2..4;
    /// Current, speed or angle.
    pub(super) const VALUE: Range<usize> = 4..8;
    /// Torque current or power.
    pub(super) const CURRENT: Range<usize> = 4..6;
    /// Zero of the encoder, in commands and replies.
    pub(super) const OFFSET: Range<usize> = 6..8;

    // Replies.
    /// °C, signed.
    pub(super) const TEMPERATURE: usize = 1;
    /// State of the brake.
    pub(super) const BRAKE: usize = 1;
    /// State 2: torque current, speed, encoder.
    pub(super) const IQ: Range<usize> = 2..4;
    pub(super) const SPEED: Range<usize> = 4..6;
    pub(super) const ENCODER: Range<usize> = 6..8;
    /// State 1 of protocol 2.35 and 2.36.
    pub(super) const VOLTAGE: Range<usize> = 2..4;
    pub(super) const SUPPLY_CURRENT: Range<usize> = 4..6;
    pub(super) const POWER: usize = 6;
    /// State 1 of older firmware.
    pub(super) const OLDER_VOLTAGE: Range<usize> = 3..5;
    /// State 1: error bits.
    pub(super) const ERRORS: usize = 7;
    /// State 3.
    pub(super) const PHASES: [Range<usize>; 3] = [2..4, 4..6, 6..8];
    /// Reply to 0x90.
    pub(super) const POSITION: Range<usize> = 2..4;
    pub(super) const RAW: Range<usize> = 4..6;
    /// Reply to 0x94.
    pub(super) const TURN_ANGLE: Range<usize> = 4..8;
}

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

/// Address of a frame; `None` if it is not of this protocol.
pub fn address(frame: &Frame) -> Option<Address> {
    let FrameId::Standard(id) = frame.id() else { return None };
    if frame.kind() != FrameKind::Data {
        return None;
    }
    match id {
        0x141..=0x160 => Some(Address::CommandOrReply(MotorId((id - COMMANDS) as u8))),
        0x181..=0x1A0 => Some(Address::Reply(MotorId((id - REPLIES_APART) as u8))),
        0x280 => Some(Address::Torques),
        _ => None,
    }
}

/// Bytes of a frame.
///
/// # Errors
/// [`WireError::Truncated`] if there are fewer than 8.
pub fn payload(frame: &Frame) -> Result<[u8; 8], WireError> {
    let bytes = frame.bytes();
    bytes.try_into().map_err(|_| WireError::Truncated { needed: field::LENGTH, got: bytes.len() })
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
    [0, 2, 4, 6].map(|at| i16_at(&bytes, at..at + 2))
}

fn i16_at(bytes: &[u8; 8], at: Range<usize>) -> i16 {
    u16_at(bytes, at).cast_signed()
}

fn u16_at(bytes: &[u8; 8], Range { start, .. }: Range<usize>) -> u16 {
    u16::from_le_bytes([bytes[start], bytes[start + 1]])
}

fn u32_at(bytes: &[u8; 8], Range { start, .. }: Range<usize>) -> u32 {
    u32::from_le_bytes([bytes[start], bytes[start + 1], bytes[start + 2], bytes[start + 3]])
}
