//! What a computer tells an adapter.

use super::line::{Ended, Line, Lines};
use super::text::{frame, hex, push_frame};
use crate::link::Frame;

/// Bit rates of the codes 0 to 8.
const BIT_RATES: [u32; 9] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// One command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// An empty line; ends what stood on the line before.
    Nothing,
    /// S: bit rate, code 0 to 8; 9 is some makers' own.
    BitRate(u8),
    /// s: bit timing, raw.
    BitTiming(u16),
    /// O: open.
    Open,
    /// L: open for listening; the adapter does not even acknowledge frames.
    Listen,
    /// C: close.
    Close,
    /// t, T, r, R: send this frame. An error frame cannot be sent, and is written as an empty line.
    Send(Frame),
    /// V: version.
    Version,
    /// v: version of the firmware.
    Firmware,
    /// N: serial number.
    SerialNumber,
    /// F: status flags.
    Flags,
    /// Z: timestamps on or off.
    Timestamps(bool),
    /// M: acceptance code.
    AcceptanceCode(u32),
    /// m: acceptance mask.
    AcceptanceMask(u32),
    /// X: frames come by themselves.
    AutoPoll(bool),
    /// P: one frame, please.
    Poll,
    /// A: all frames, please.
    PollAll,
    /// U: speed of the serial line, code.
    UartRate(u8),
    /// Q: open by itself after power-up, code.
    AutoStart(u8),
}

/// Bit rate of a code, bit/s.
pub fn bit_rate_of_code(code: u8) -> Option<u32> {
    BIT_RATES.get(usize::from(code)).copied()
}

/// How an adapter is opened: closed first, then its bit rate (bit/s), then open, or open for listening. None of a
/// bit rate that has no code.
///
/// ```
/// use flqr_core::link::slcan::opening;
///
/// let commands = opening(1_000_000, true).ok_or("not a bit rate of SLCAN")?;
/// let lines: Vec<_> = commands.iter().flat_map(|command| command.encode().to_vec()).collect();
/// assert_eq!(lines, *b"C\rS8\rL\r");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn opening(bit_rate: u32, listen: bool) -> Option<[Command; 3]> {
    let code = BIT_RATES.iter().position(|known| *known == bit_rate)? as u8;
    let open = if listen { Command::Listen } else { Command::Open };
    Some([Command::Close, Command::BitRate(code), open])
}

impl Command {
    /// The line.
    pub fn encode(&self) -> Line {
        Line::of(|line| match *self {
            Self::Nothing => {}
            Self::BitRate(code) => push_code(line, b'S', code),
            Self::BitTiming(timing) => push_number(line, b's', u32::from(timing), 4),
            Self::Open => line.push(b'O'),
            Self::Listen => line.push(b'L'),
            Self::Close => line.push(b'C'),
            Self::Send(frame) => {
                push_frame(line, &frame);
            }
            Self::Version => line.push(b'V'),
            Self::Firmware => line.push(b'v'),
            Self::SerialNumber => line.push(b'N'),
            Self::Flags => line.push(b'F'),
            Self::Timestamps(on) => push_code(line, b'Z', u8::from(on)),
            Self::AcceptanceCode(code) => push_number(line, b'M', code, 8),
            Self::AcceptanceMask(mask) => push_number(line, b'm', mask, 8),
            Self::AutoPoll(on) => push_code(line, b'X', u8::from(on)),
            Self::Poll => line.push(b'P'),
            Self::PollAll => line.push(b'A'),
            Self::UartRate(code) => push_code(line, b'U', code),
            Self::AutoStart(code) => push_code(line, b'Q', code),
        })
    }

    /// The command of this line without its end; `None` if it is not one.
    pub fn decode(text: &[u8]) -> Option<Self> {
        let Some((letter, rest)) = text.split_first() else { return Some(Self::Nothing) };
        match (letter, rest) {
            (b't' | b'T' | b'r' | b'R', _) => {
                let (frame, rest) = frame(text)?;
                rest.is_empty().then_some(Self::Send(frame))
            }
            (b'O', []) => Some(Self::Open),
            (b'L', []) => Some(Self::Listen),
            (b'C', []) => Some(Self::Close),
            (b'V', []) => Some(Self::Version),
            (b'v', []) => Some(Self::Firmware),
            (b'N', []) => Some(Self::SerialNumber),
            (b'F', []) => Some(Self::Flags),
            (b'P', []) => Some(Self::Poll),
            (b'A', []) => Some(Self::PollAll),
            (b'S', [code @ b'0'..=b'9']) => Some(Self::BitRate(code - b'0')),
            (b'U', [code @ b'0'..=b'9']) => Some(Self::UartRate(code - b'0')),
            (b'Q', [code @ b'0'..=b'9']) => Some(Self::AutoStart(code - b'0')),
            (b'Z', [on @ b'0'..=b'1']) => Some(Self::Timestamps(*on == b'1')),
            (b'X', [on @ b'0'..=b'1']) => Some(Self::AutoPoll(*on == b'1')),
            (b's', [_, _, _, _]) => Some(Self::BitTiming(hex(rest)? as u16)),
            (b'M', [_, _, _, _, _, _, _, _]) => Some(Self::AcceptanceCode(hex(rest)?)),
            (b'm', [_, _, _, _, _, _, _, _]) => Some(Self::AcceptanceMask(hex(rest)?)),
            _ => None,
        }
    }
}

/// A code is one digit; none is above 9.
fn push_code(line: &mut Line, letter: u8, code: u8) {
    line.push(letter);
    line.push(b'0' + code.min(9));
}

fn push_number(line: &mut Line, letter: u8, value: u32, digits: u32) {
    line.push(letter);
    line.push_hex(value, digits);
}

/// A line that an adapter does not know; it answers with a bell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownCommand;

/// The adapter's side: commands in what a computer sends.
#[derive(Clone, Debug, Default)]
pub struct CommandDecoder {
    lines: Lines,
}

impl CommandDecoder {
    /// The next command in `input`, which loses what was read; none once all is read. A line that is no command
    /// is one that the adapter refuses.
    pub fn next(&mut self, input: &mut &[u8]) -> Option<Result<Command, UnknownCommand>> {
        self.lines.next(input, |text, end| {
            Some(Command::decode(text).filter(|_| end == Ended::Line).ok_or(UnknownCommand))
        })
    }
}
