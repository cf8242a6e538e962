//! Time that a frame takes on the bus.

use super::frame::{Frame, FrameId, FrameKind};

/// Generator of CAN's 15-bit sum (ISO 11898-1).
const POLYNOMIAL: u16 = 0x4599;
/// Bits behind the sum, which are never stuffed: delimiter of the sum, acknowledgement with its delimiter, end of
/// frame, and the space to the next frame.
const UNSTUFFED_BITS: u32 = 1 + 2 + 7 + 3;

/// Bits of a frame on the bus, stuff bits and the space to the next frame included; of an error frame those of an
/// error flag and its delimiter.
pub fn bits(frame: &Frame) -> u32 {
    if frame.kind() == FrameKind::Error {
        return 6 + 8 + 3;
    }
    let mut wire = Wire::default();
    let remote = u32::from(frame.kind() == FrameKind::Remote);
    wire.push(0, 1);
    match frame.id() {
        FrameId::Standard(id) => {
            wire.push(u32::from(id), 11);
            wire.push(remote, 1);
            wire.push(0, 2);
        }
        FrameId::Extended(id) => {
            wire.push(id >> 18, 11);
            wire.push(0b11, 2);
            wire.push(id & 0x3_FFFF, 18);
            wire.push(remote, 1);
            wire.push(0, 2);
        }
    }
    wire.push(u32::from(frame.length()), 4);
    frame.bytes().iter().for_each(|byte| wire.push(u32::from(*byte), 8));
    let sum = wire.sum;
    wire.push(u32::from(sum), 15);
    wire.bits + UNSTUFFED_BITS
}

/// Bits in the order in which they go over the wire.
#[derive(Default)]
struct Wire {
    bits: u32,
    sum: u16,
    last: u32,
    /// Equal bits in a row, stuff bits included.
    run: u32,
}

impl Wire {
    fn push(&mut self, value: u32, count: u32) {
        (0..count).rev().for_each(|place| self.push_bit(value >> place & 1));
    }

    fn push_bit(&mut self, bit: u32) {
        let carry = u32::from(self.sum >> 14 & 1) ^ bit;
        self.sum = (self.sum << 1 & 0x7FFF) ^ if carry == 1 { POLYNOMIAL } else { 0 };
        self.run = if self.run > 0 && bit == self.last { self.run + 1 } else { 1 };
        (self.last, self.bits) = (bit, self.bits + 1);
        if self.run == 5 {
            // After five equal bits a bit of the other kind, which begins a run of its own.
            (self.last, self.run, self.bits) = (1 - bit, 1, self.bits + 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_lie_between_the_bounds_of_the_standard_and_reach_the_lower_one() {
        // 44 bits and the data of a standard frame, 64 of an extended one, and 3 between frames; at most one stuff
        // bit for every four of those that may be stuffed.
        let mut lowest = u32::MAX;
        for seed in 0..2000_u64 {
            let bytes = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
            for length in 0..=8_u8 {
                let data = &bytes[..usize::from(length)];
                let raw = 8 * u32::from(length);
                let standard = bits(&Frame::data(FrameId::Standard(0x2AA), data).unwrap());
                assert!((47 + raw..=47 + raw + (34 + raw - 1) / 4).contains(&standard), "{standard}");
                let extended = bits(&Frame::data(FrameId::Extended(0x0AAA_AAAA), data).unwrap());
                assert!((67 + raw..=67 + raw + (54 + raw - 1) / 4).contains(&extended), "{extended}");
                if length == 8 {
                    lowest = lowest.min(standard);
                }
            }
        }
        assert!((111..=135).contains(&lowest), "{lowest}");
    }

    /// A frame of zeros: the sum of a stream of zeros is zero, so that there is a stuff bit behind every five.
    #[test]
    fn zeros_are_stuffed_as_often_as_can_be() {
        let frame = Frame::data(FrameId::Standard(0), &[]).unwrap();
        assert_eq!(bits(&frame), 34 + 34 / 5 + 13);
    }
}
