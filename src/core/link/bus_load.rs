//! How long frames keep a bus busy.

use super::{Frame, FrameId, FrameKind};

/// Bits after the checksum, which are never stuffed: delimiter, acknowledgment and its delimiter, end of frame,
/// and the pause to the next frame.
const TAIL: u32 = 1 + 2 + 7 + 3;

/// x¹⁵ + x¹⁴ + x¹⁰ + x⁸ + x⁷ + x⁴ + x³ + 1 (ISO 11898-1).
const POLYNOMIAL: u16 = 0x4599;

/// Bits that a frame takes on the bus, stuff bits and the pause after it included (ISO 11898-1): 111 to 135 of a
/// standard frame of 8 bytes. An error frame is a report of the interface and takes none.
///
/// ```
/// use flqr_core::link::{Frame, FrameId, bus_load};
///
/// let id = FrameId::standard(0x141).ok_or("not a standard identifier")?;
/// assert!((111..=135).contains(&bus_load::bits(&Frame::full(id, [0x55; 8]))));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bits(frame: &Frame) -> u32 {
    let mut line = Line::default();
    let remote = match frame.kind() {
        FrameKind::Data => 0,
        FrameKind::Remote => 1,
        FrameKind::Error => return 0,
    };
    // Start of frame, identifier with its flags, two reserved bits or one, length.
    line.send(0, 1);
    match frame.id() {
        FrameId::Standard(id) => {
            line.send(u32::from(id), 11);
            line.send(remote << 2, 3);
        }
        FrameId::Extended(id) => {
            line.send(id >> 18, 11);
            line.send(0b11, 2);
            line.send(id, 18);
            line.send(remote << 2, 3);
        }
    }
    line.send(u32::from(frame.length()), 4);
    frame.bytes().iter().for_each(|byte| line.send(u32::from(*byte), 8));
    line.send(u32::from(line.checksum), 15);
    line.bits + TAIL
}

/// The part of a frame that is stuffed: after five equal bits comes an opposite one.
#[derive(Default)]
struct Line {
    bits: u32,
    checksum: u16,
    last: u32,
    equal: u32,
}

impl Line {
    /// Sends the lowest bits of a value, the highest of them first.
    fn send(&mut self, value: u32, count: u32) {
        for at in (0..count).rev() {
            self.send_bit(value >> at & 1);
        }
    }

    fn send_bit(&mut self, bit: u32) {
        self.bits += 1;
        self.equal = if self.bits > 1 && bit == self.last { self.equal + 1 } else { 1 };
        self.last = bit;
        if self.equal == 5 {
            self.bits += 1;
            self.last = 1 - bit;
            self.equal = 1;
        }
        let carry = u32::from(self.checksum >> 14) & 1 ^ bit;
        self.checksum = (self.checksum << 1 & 0x7FFF) ^ if carry == 1 { POLYNOMIAL } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;

    fn standard(id: u16, data: &[u8]) -> Frame {
        Frame::data(FrameId::Standard(id), data).unwrap()
    }

    #[test]
    fn the_checksum_is_the_catalogued_one() {
        let mut line = Line::default();
        b"123456789".iter().for_each(|byte| line.send(u32::from(*byte), 8));
        // CRC-15/CAN in the catalogue of parametrised CRC algorithms.
        assert_eq!(line.checksum, 0x059E);
    }

    #[test]
    fn frames_take_the_bits_that_another_program_counts() {
        // 34 zeros, and so 6 stuff bits, and 13 bits of tail: by hand. The others by a division of whole
        // polynomials and a string of bits, in another language.
        let remote = |length| Frame::remote(FrameId::Standard(0x123), length).unwrap();
        let extended = |id, data: &[u8]| Frame::data(FrameId::Extended(id), data).unwrap();
        for (frame, expected) in [
            (standard(0, &[]), 34 + 6 + 13),
            (standard(0x7FF, &[]), 50),
            (standard(0x14, &[1]), 58),
            (standard(0x141, &[0xA1, 0, 0, 0, 0x84, 1, 0, 0]), 120),
            (standard(0x141, &[0xA1, 0x23, 0x36, 1, 0xE1, 0xFE, 0, 0xC0]), 116),
            (standard(0x280, &[0x84, 1, 0x7C, 0xFE, 0, 0, 0, 0]), 122),
            (standard(0x555, &[0x55; 8]), 112),
            (standard(0, &[0; 8]), 127),
            (standard(0x7FF, &[0xFF; 8]), 126),
            (remote(0), 48),
            (remote(8), 48),
            (extended(0x12AB_CDEF, &[0xAA, 0x55]), 85),
            (extended(0, &[0; 8]), 150),
            (Frame::remote(FrameId::Extended(0x1FFF_FFFF), 0).unwrap(), 74),
            (Frame::error(4, [0; 8]).unwrap(), 0),
        ] {
            assert_eq!(bits(&frame), expected, "{frame:?}");
        }
    }

    #[test]
    fn no_frame_leaves_the_bounds() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let (mut least, mut greatest) = (u32::MAX, 0);
        for round in 0..50_000 {
            // Bytes of few changes are stuffed most.
            let data = random.next_u64() & random.next_u64() & random.next_u64();
            let data = if round % 2 == 0 { data } else { data ^ 0x3333_3333_3333_3333 };
            let frame = standard((random.next_u32() & 0x7FF) as u16, &data.to_le_bytes());
            let bits = bits(&frame);
            (least, greatest) = (least.min(bits), greatest.max(bits));
            let wide = Frame::data(FrameId::Extended(random.next_u32() >> 3), frame.bytes()).unwrap();
            assert!((131..=160).contains(&super::bits(&wide)));
        }
        assert!(least >= 111 && greatest <= 135, "{least} {greatest}");
        assert!(least < 115 && greatest > 124, "{least} {greatest}");
    }
}
