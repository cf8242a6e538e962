//! Frames as text, the same in both directions.

use super::line::Line;
use crate::link::{Frame, FrameId, FrameKind};

/// Values of hexadecimal digits; 0xFF of all other bytes.
const DIGITS: [u8; 256] = {
    let mut table = [0xFF; 256];
    let mut value = 0;
    while value < 16 {
        table[b"0123456789ABCDEF"[value as usize] as usize] = value;
        table[b"0123456789abcdef"[value as usize] as usize] = value;
        value += 1;
    }
    table
};

/// Number of these hexadecimal digits, at most 8.
pub(super) fn hex(text: &[u8]) -> Option<u32> {
    let mut value = 0_u32;
    let mut seen = 0;
    for byte in text {
        let digit = DIGITS[usize::from(*byte)];
        seen |= digit;
        value = value << 4 | u32::from(digit & 0xF);
    }
    (seen & 0xF0 == 0 && !text.is_empty()).then_some(value)
}

/// A line's frame and what follows it; `None` if it is not one. The first byte is t, T, r or R.
pub(super) fn frame(text: &[u8]) -> Option<(Frame, &[u8])> {
    let (kind, text) = text.split_first()?;
    let (id, text) = match kind {
        b't' | b'r' => {
            let (digits, text) = text.split_at_checked(3)?;
            (FrameId::standard(hex(digits)? as u16)?, text)
        }
        _ => {
            let (digits, text) = text.split_at_checked(8)?;
            (FrameId::extended(hex(digits)?)?, text)
        }
    };
    let (length, text) = text.split_first()?;
    let length = length.checked_sub(b'0').filter(|length| *length <= 8)?;
    if matches!(kind, b'r' | b'R') {
        return Some((Frame::remote(id, length)?, text));
    }
    let (digits, text) = text.split_at_checked(2 * usize::from(length))?;
    let mut bytes = [0; 8];
    let mut seen = 0;
    for (byte, pair) in bytes.iter_mut().zip(digits.as_chunks::<2>().0) {
        let [high, low] = pair.map(|digit| DIGITS[usize::from(digit)]);
        seen |= high | low;
        *byte = high << 4 | low & 0xF;
    }
    let frame = Frame::data(id, &bytes[..usize::from(length)])?;
    (seen & 0xF0 == 0).then_some((frame, text))
}

/// Writes a frame; says whether it has a form, which an error frame has not.
pub(super) fn push_frame(line: &mut Line, frame: &Frame) -> bool {
    let (standard, extended) = match frame.kind() {
        FrameKind::Data => (b't', b'T'),
        FrameKind::Remote => (b'r', b'R'),
        FrameKind::Error => return false,
    };
    match frame.id() {
        FrameId::Standard(id) => {
            line.push(standard);
            line.push_hex(u32::from(id), 3);
        }
        FrameId::Extended(id) => {
            line.push(extended);
            line.push_hex(id, 8);
        }
    }
    line.push(b'0' + frame.length());
    frame.bytes().iter().for_each(|byte| line.push_hex(u32::from(*byte), 2));
    true
}
