//! IMU of WitMotion, JY901 and its kin, on a serial line.
//!
//! Packets of 11 bytes, `55 type`, four words, and the low 8 bits of the sum of the ten bytes before; words are
//! little-endian. Source: WitMotion's JY901 SDK (`REG.h`, `wit_c_sdk.c`). Nothing is escaped, so that 0x55 occurs
//! in data too, and a reader that has lost its place moves on by single bytes.

mod decoder;
mod packet;
mod register;
#[cfg(test)]
mod tests;

pub use decoder::Decoder;
pub use packet::{Kind, Packet, Reading};
pub use register::{
    ConfigureError, Content, RegisterWrite, RegisterWriteDecoder, SAVE, UNLOCK, baud_of_code, configure,
    line_bit_s, rate_of_code, read_registers,
};

/// Length of a packet, bytes.
pub const PACKET_BYTES: usize = 11;
