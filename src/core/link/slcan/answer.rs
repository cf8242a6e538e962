//! What an adapter tells a computer.

use super::line::{Ended, Line, Lines, Text};
use super::text::{frame, hex, push_frame};
use crate::link::Frame;

/// Timestamps go from 0 to this and start anew, ms.
const LAST_STAMP_MS: u32 = 59_999;

/// One line, or a bell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A frame from the bus. An error frame has no line, and is written as an empty one.
    Frame {
        /// The frame.
        frame: Frame,
        /// Time of the adapter, 0 to 59,999 ms, where timestamps are on.
        stamp_ms: Option<u16>,
    },
    /// The last command was done.
    Done,
    /// The last command was refused (bell).
    Refused,
    /// The last frame was taken for sending (z or Z; only of adapters that send frames by themselves).
    Taken {
        /// Whether it had 29 bits.
        extended: bool,
    },
    /// s: how the adapter's CAN controller stands.
    Status(Status),
    /// e: what the CAN controller has met.
    Errors(BusErrors),
    /// V: version.
    Version(Text),
    /// v: version of the firmware.
    Firmware(Text),
    /// N: serial number.
    SerialNumber(Text),
    /// F: status flags: bit 0 receive queue full, 1 send queue full, 2 warning, 3 overrun, 5 passive,
    /// 6 arbitration lost, 7 bus error.
    Flags(u8),
    /// A line that is none of these: part of it was lost, or the port speaks something else.
    Damaged,
}

/// How an adapter's CAN controller stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Its state.
    pub state: BusState,
    /// Receive errors.
    pub receive_errors: u16,
    /// Send errors.
    pub send_errors: u16,
}

/// State of a CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// It takes part.
    Active,
    /// One of its error counters is above 95.
    Warning,
    /// One is above 127: it may not interrupt others.
    Passive,
    /// Its send errors are above 255: it takes no part.
    Off,
}

impl BusState {
    const LETTERS: [(Self, u8); 4] =
        [(Self::Active, b'a'), (Self::Warning, b'w'), (Self::Passive, b'p'), (Self::Off, b'b')];

    fn of(letter: u8) -> Option<Self> {
        Self::LETTERS.iter().find(|(_, known)| *known == letter).map(|(state, _)| *state)
    }
}

/// Errors that a CAN controller has met: a bit for each of [`BusErrors::NAMES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusErrors(pub u8);

impl BusErrors {
    const LETTERS: [u8; 8] = *b"abBcfoOs";
    /// Names of the bits, the lowest first.
    pub const NAMES: [&'static str; 8] = [
        "no acknowledgment",
        "bit 0",
        "bit 1",
        "checksum",
        "form",
        "receive overrun",
        "send overrun",
        "stuffing",
    ];

    /// Names of what was met.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        (0..8).filter(move |bit| self.0 >> bit & 1 == 1).map(|bit| Self::NAMES[bit])
    }

    fn decode(text: &[u8]) -> Option<Self> {
        let (count, letters) = text.split_first()?;
        if usize::from(count.checked_sub(b'0')?) != letters.len() {
            return None;
        }
        let bit = |letter: &u8| Self::LETTERS.iter().position(|known| known == letter);
        letters.iter().try_fold(0, |bits, letter| Some(bits | 1 << bit(letter)?)).map(Self)
    }

    fn push(self, line: &mut Line) {
        line.push(b'e');
        line.push(b'0' + self.0.count_ones() as u8);
        (0..8).filter(|bit| self.0 >> bit & 1 == 1).for_each(|bit| line.push(Self::LETTERS[bit]));
    }
}

impl Status {
    fn decode(text: &[u8]) -> Option<Self> {
        let [state, counts @ ..] = text else { return None };
        let (receive, send) = counts.split_at_checked(3)?;
        let (receive_errors, send_errors) = (decimal(receive)?, decimal(send)?);
        Some(Self { state: BusState::of(*state)?, receive_errors, send_errors })
    }

    fn push(self, line: &mut Line) {
        let letter = BusState::LETTERS[self.state as usize].1;
        line.push_all(&[b's', letter]);
        for count in [self.receive_errors, self.send_errors] {
            let count = count.min(999);
            line.push_all(&[count / 100, count / 10 % 10, count % 10].map(|digit| b'0' + digit as u8));
        }
    }
}

/// Number of three decimal digits.
fn decimal(text: &[u8]) -> Option<u16> {
    let [b'0'..=b'9', b'0'..=b'9', b'0'..=b'9'] = text else { return None };
    Some(text.iter().fold(0, |value, digit| 10 * value + u16::from(digit - b'0')))
}

impl Answer {
    /// The line, or bell. A damaged one is written as an empty line.
    pub fn encode(&self) -> Line {
        if *self == Self::Refused {
            return Line::bell();
        }
        Line::of(|line| match *self {
            Self::Frame { frame, stamp_ms } => {
                if push_frame(line, &frame)
                    && let Some(stamp_ms) = stamp_ms
                {
                    line.push_hex(u32::from(stamp_ms), 4);
                }
            }
            Self::Done | Self::Damaged | Self::Refused => {}
            Self::Taken { extended } => line.push(if extended { b'Z' } else { b'z' }),
            Self::Status(status) => status.push(line),
            Self::Errors(errors) => errors.push(line),
            Self::Version(text) => push_text(line, b'V', &text),
            Self::Firmware(text) => push_text(line, b'v', &text),
            Self::SerialNumber(text) => push_text(line, b'N', &text),
            Self::Flags(flags) => {
                line.push(b'F');
                line.push_hex(u32::from(flags), 2);
            }
        })
    }

    /// What this line without its end says.
    pub fn decode(text: &[u8]) -> Self {
        Self::read(text).unwrap_or(Self::Damaged)
    }

    fn read(text: &[u8]) -> Option<Self> {
        let Some((letter, rest)) = text.split_first() else { return Some(Self::Done) };
        match (letter, rest) {
            (b't' | b'T' | b'r' | b'R', _) => {
                let (frame, rest) = frame(text)?;
                let stamp_ms = match rest.len() {
                    0 => None,
                    4 => Some(hex(rest)?).filter(|stamp| *stamp <= LAST_STAMP_MS).map(|stamp| stamp as u16),
                    _ => return None,
                };
                Some(Self::Frame { frame, stamp_ms })
            }
            (b'z', []) => Some(Self::Taken { extended: false }),
            (b'Z', []) => Some(Self::Taken { extended: true }),
            (b's', _) => Status::decode(rest).map(Self::Status),
            (b'e', _) => BusErrors::decode(rest).map(Self::Errors),
            (b'V', _) => Text::new(rest).map(Self::Version),
            (b'v', _) => Text::new(rest).map(Self::Firmware),
            (b'N', _) => Text::new(rest).map(Self::SerialNumber),
            (b'F', [_, _]) => hex(rest).map(|flags| Self::Flags(flags as u8)),
            _ => None,
        }
    }
}

fn push_text(line: &mut Line, letter: u8, text: &Text) {
    line.push(letter);
    line.push_all(text.as_bytes());
}

/// The computer's side: answers in what an adapter sends.
#[derive(Clone, Debug, Default)]
pub struct AnswerDecoder {
    lines: Lines,
    /// A bell cuts a line short: two answers of one piece.
    refused: bool,
}

impl AnswerDecoder {
    /// The next answer in `input`, which loses what was read; none once all is read.
    #[inline]
    pub fn next(&mut self, input: &mut &[u8]) -> Option<Answer> {
        if std::mem::take(&mut self.refused) {
            return Some(Answer::Refused);
        }
        let (answer, cut_short) = self.lines.next(input, |text, end| match end {
            Ended::Line => Some((Answer::decode(text), false)),
            Ended::Bell if text.is_empty() => Some((Answer::Refused, false)),
            Ended::Bell => Some((Answer::Damaged, true)),
        })?;
        self.refused = cut_short;
        Some(answer)
    }
}
