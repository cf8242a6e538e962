//! Reading of a line.

use std::time::Duration;

use super::{ERROR_BIT, Entry, FdFrame, LoggedFrame};
use crate::link::{Direction, Frame, FrameId};

/// A line that is not a frame: what is wrong, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("column {column}: {problem}")]
pub struct LineError {
    /// Column, counted in bytes from 1.
    pub column: usize,
    /// What is wrong there.
    pub problem: LineProblem,
}

/// What can be wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineProblem {
    /// No time.
    #[error("a time in brackets is missing: record with `candump -L`")]
    NoTime,
    /// A time that is none.
    #[error("the time is not (seconds.decimals)")]
    BadTime,
    /// Nothing after the time.
    #[error("the name of the interface is missing")]
    NoInterface,
    /// Nothing after the interface.
    #[error("the frame is missing")]
    NoFrame,
    /// An identifier that is none.
    #[error("an identifier has 3 or 8 hexadecimal digits")]
    BadId,
    /// An identifier with more bits than its kind has.
    #[error("the identifier {id:X} is too large: 3 digits go up to 7FF, 8 digits up to 1FFFFFFF")]
    IdTooLarge {
        /// The identifier.
        id: u32,
    },
    /// Half a byte.
    #[error("a byte has two hexadecimal digits")]
    BadByte,
    /// More bytes than a frame has.
    #[error("a classic frame has at most 8 bytes")]
    TooManyBytes,
    /// A number of bytes that FD frames do not have.
    #[error("a CAN FD frame has 0 to 8, 12, 16, 20, 24, 32, 48 or 64 bytes, not {bytes}")]
    BadFdLength {
        /// Number of bytes.
        bytes: usize,
    },
    /// No flags.
    #[error("the flags of a CAN FD frame are one hexadecimal digit after ##")]
    BadFlags,
    /// A length that classic frames do not have.
    #[error("the length is a digit from 0 to 8")]
    BadLength,
    /// A number of bytes that is not the length given.
    #[error("{bytes} bytes do not match the announced length {length}")]
    OtherLength {
        /// Announced.
        length: usize,
        /// There.
        bytes: usize,
    },
    /// A length code that is none.
    #[error("a length code after _ is a digit from 9 to F and goes with 8 bytes")]
    BadLengthCode,
    /// A CAN XL frame.
    #[error("CAN XL frames are not supported")]
    Xl,
    /// Something after the frame that is no direction.
    #[error("after the frame only R or T can stand")]
    BadDirection,
    /// Something after the end.
    #[error("the line should end here")]
    Excess,
}

/// Reads a line, with or without its end; none of a blank one.
///
/// # Errors
/// [`LineError`]: what is wrong and in which column.
///
/// ```
/// use flqr_core::link::candump::{LoggedFrame, parse_line};
///
/// let entry = parse_line("(1.500000) can0 141#9C00000000000000")?.ok_or("a blank line")?;
/// let LoggedFrame::Classic { frame, .. } = entry.frame else { return Err("a CAN FD frame".into()) };
/// assert_eq!((entry.time.as_secs_f64(), entry.interface, frame.id().raw()), (1.5, "can0", 0x141));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn parse_line(line: &str) -> Result<Option<Entry<'_>>, LineError> {
    let mut words = Words { line, at: 0 };
    let Some(first) = words.next() else { return Ok(None) };
    let time = time(first)?;
    let interface = words.next().ok_or(words.error(LineProblem::NoInterface))?.text;
    let frame = words.next().ok_or(words.error(LineProblem::NoFrame))?;
    let (frame, direction) = match frame.text.split_once('#') {
        Some(_) => (compact(frame)?, words.next().map(direction).transpose()?),
        None => spaced(frame, &mut words)?,
    };
    match words.next() {
        None => Ok(Some(Entry { time, interface, frame, direction })),
        Some(excess) => Err(excess.error(0, LineProblem::Excess)),
    }
}

/// What stands between blanks, and where.
#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Word<'a> {
    fn error(&self, offset: usize, problem: LineProblem) -> LineError {
        LineError { column: self.at + offset + 1, problem }
    }

    /// What follows the first `bytes` bytes, which are ASCII.
    fn after(&self, bytes: usize) -> Self {
        Word { text: self.text.get(bytes..).unwrap_or_default(), at: self.at + bytes }
    }

    fn until(&self, bytes: usize) -> Self {
        Word { text: self.text.get(..bytes).unwrap_or(self.text), at: self.at }
    }
}

struct Words<'a> {
    line: &'a str,
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<Word<'a>> {
        let rest = &self.line[self.at..];
        let start = self.at + rest.find(|c: char| !c.is_ascii_whitespace())?;
        let text = self.line[start..].split(|c: char| c.is_ascii_whitespace()).next()?;
        self.at = start + text.len();
        Some(Word { text, at: start })
    }

    fn error(&self, problem: LineProblem) -> LineError {
        LineError { column: self.at + 1, problem }
    }
}

fn time(word: Word<'_>) -> Result<Duration, LineError> {
    let Some(text) = word.text.strip_prefix('(') else { return Err(word.error(0, LineProblem::NoTime)) };
    let bad = word.error(0, LineProblem::BadTime);
    let text = text.strip_suffix(')').ok_or(bad)?;
    let (seconds, decimals) = text.split_once('.').unwrap_or((text, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(seconds) || !digits(decimals) || decimals.len() > 9 {
        return Err(bad);
    }
    let fraction = decimals.bytes().fold(0, |value, digit| 10 * value + u32::from(digit - b'0'));
    let nanoseconds = fraction * 10_u32.pow(9 - decimals.len() as u32);
    Ok(Duration::new(seconds.parse().map_err(|_| bad)?, nanoseconds))
}

fn direction(word: Word<'_>) -> Result<Direction, LineError> {
    match word.text {
        "R" | "r" => Ok(Direction::Received),
        "T" | "t" => Ok(Direction::Sent),
        _ => Err(word.error(0, LineProblem::BadDirection)),
    }
}

enum Id {
    Bus(FrameId),
    Error(u32),
}

fn id(word: Word<'_>) -> Result<Id, LineError> {
    let bad = word.error(0, LineProblem::BadId);
    if !word.text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(bad);
    }
    let value = || u32::from_str_radix(word.text, 16).map_err(|_| bad);
    let (id, value) = match word.text.len() {
        3 => (FrameId::standard(value()? as u16).map(Id::Bus), value()?),
        8 if value()? & !0x1FFF_FFFF == ERROR_BIT => (Some(Id::Error(value()? & 0x1FFF_FFFF)), value()?),
        8 => (FrameId::extended(value()?).map(Id::Bus), value()?),
        _ => return Err(bad),
    };
    id.ok_or(word.error(0, LineProblem::IdTooLarge { id: value }))
}

/// `id#…`, without blanks.
fn compact(word: Word<'_>) -> Result<LoggedFrame, LineError> {
    let hash = word.text.find('#').unwrap_or(word.text.len());
    let (id_word, rest) = (word.until(hash), word.after(hash + 1));
    if rest.text.contains(':') {
        return Err(rest.error(0, LineProblem::Xl));
    }
    match (id(id_word)?, rest.text.as_bytes().first()) {
        (Id::Bus(id), Some(b'#')) => fd(id, rest.after(1)),
        (Id::Error(_), Some(b'#' | b'R' | b'r')) => Err(rest.error(0, LineProblem::BadByte)),
        (Id::Bus(id), Some(b'R' | b'r')) => remote(id, rest.after(1)),
        (id, _) => data(id, rest),
    }
}

fn fd(id: FrameId, rest: Word<'_>) -> Result<LoggedFrame, LineError> {
    let flags = rest.text.chars().next().and_then(|digit| digit.to_digit(16));
    let flags = flags.ok_or(rest.error(0, LineProblem::BadFlags))?;
    let mut bytes = [0; 64];
    let length = hex_bytes(rest.after(1), &mut bytes)?;
    let too_many = LineProblem::BadFdLength { bytes: length };
    let data = bytes.get(..length).ok_or(rest.error(1, too_many))?;
    let frame = FdFrame::new(id, flags as u8, data).ok_or(rest.error(1, too_many))?;
    Ok(LoggedFrame::Fd(frame))
}

fn remote(id: FrameId, rest: Word<'_>) -> Result<LoggedFrame, LineError> {
    let (rest, raw_length_code) = length_code(rest)?;
    let length = match rest.text.as_bytes() {
        [] => 0,
        [digit @ b'0'..=b'8'] => digit - b'0',
        _ => return Err(rest.error(0, LineProblem::BadLength)),
    };
    if raw_length_code.is_some() && length != 8 {
        return Err(rest.error(rest.text.len(), LineProblem::BadLengthCode));
    }
    let frame = Frame::remote(id, length).ok_or(rest.error(0, LineProblem::BadLength))?;
    Ok(LoggedFrame::Classic { frame, raw_length_code })
}

fn data(id: Id, rest: Word<'_>) -> Result<LoggedFrame, LineError> {
    let (rest, raw_length_code) = length_code(rest)?;
    let mut bytes = [0; 8];
    let length = hex_bytes(rest, &mut bytes)?;
    if raw_length_code.is_some() && length != 8 {
        return Err(rest.error(rest.text.len(), LineProblem::BadLengthCode));
    }
    let frame = match id {
        Id::Bus(id) => bytes.get(..length).and_then(|data| Frame::data(id, data)),
        Id::Error(classes) if length <= 8 => Frame::error(classes, bytes),
        Id::Error(_) => None,
    };
    let frame = frame.ok_or(rest.error(0, LineProblem::TooManyBytes))?;
    Ok(LoggedFrame::Classic { frame, raw_length_code })
}

/// Splits `_` and a length code off the end.
fn length_code(word: Word<'_>) -> Result<(Word<'_>, Option<u8>), LineError> {
    let Some(at) = word.text.find('_') else { return Ok((word, None)) };
    let code = match word.after(at + 1).text.as_bytes() {
        [digit] => char::from(*digit).to_digit(16).filter(|code| *code > 8),
        _ => None,
    };
    let code = code.ok_or(word.error(at, LineProblem::BadLengthCode))?;
    Ok((word.until(at), Some(code as u8)))
}

/// Writes the bytes of pairs of digits, dots between them allowed, as far as there is room; their number.
fn hex_bytes(word: Word<'_>, bytes: &mut [u8]) -> Result<usize, LineError> {
    let text = word.text.as_bytes();
    let (mut at, mut count) = (0, 0);
    while at < text.len() {
        if count > 0 && text[at] == b'.' {
            at += 1;
        }
        let pair = text.get(at..at + 2).and_then(hex_byte).ok_or(word.error(at, LineProblem::BadByte))?;
        if let Some(byte) = bytes.get_mut(count) {
            *byte = pair;
        }
        count += 1;
        at += 2;
    }
    Ok(count)
}

fn hex_byte(pair: &[u8]) -> Option<u8> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    Some((digit(pair[0])? << 4 | digit(pair[1])?) as u8)
}

/// `id   [length]  bytes`, what candump writes for people; `-x` puts the direction and two flags before it, and
/// `-a` the bytes as characters after it.
fn spaced<'a>(first: Word<'a>, words: &mut Words<'a>) -> Result<(LoggedFrame, Option<Direction>), LineError> {
    let (id_word, direction) = match first.text {
        "RX" | "TX" => {
            words.next();
            words.next();
            let id_word = words.next().ok_or(words.error(LineProblem::NoFrame))?;
            (id_word, Some(if first.text == "RX" { Direction::Received } else { Direction::Sent }))
        }
        _ => (first, None),
    };
    let id = id(id_word)?;
    let announced = words.next().ok_or(words.error(LineProblem::BadLength))?;
    let digits = announced.text.strip_prefix('[').and_then(|text| text.strip_suffix(']'));
    let is_fd = digits.is_some_and(|digits| digits.len() == 2);
    let length = digits.and_then(|digits| digits.parse().ok()).filter(|length| *length <= 64);
    let length: usize = length.ok_or(announced.error(0, LineProblem::BadLength))?;
    let frame = match (id, is_fd) {
        (Id::Bus(id), true) => {
            let mut bytes = [0; 64];
            spaced_bytes(words, &mut bytes[..length])?;
            let bad = announced.error(0, LineProblem::BadFdLength { bytes: length });
            LoggedFrame::Fd(FdFrame::new(id, 0x4, &bytes[..length]).ok_or(bad)?)
        }
        (id, _) => spaced_classic(id, length, announced, words)?.into(),
    };
    skip_characters(words);
    Ok((frame, direction))
}

fn spaced_classic(
    id: Id,
    length: usize,
    announced: Word<'_>,
    words: &mut Words<'_>,
) -> Result<Frame, LineError> {
    let bad = announced.error(0, LineProblem::BadLength);
    let mut bytes = [0; 8];
    let room = bytes.get_mut(..length).ok_or(bad)?;
    let after_length = words.at;
    let frame = match id {
        Id::Bus(id) if words.next().is_some_and(|word| word.text == "remote") => {
            words.next();
            Frame::remote(id, length as u8)
        }
        Id::Bus(id) => {
            words.at = after_length;
            spaced_bytes(words, room)?;
            Frame::data(id, room)
        }
        Id::Error(classes) => {
            spaced_bytes(words, room)?;
            let frame = Frame::error(classes, bytes);
            let after_bytes = words.at;
            if words.next().is_none_or(|word| word.text != "ERRORFRAME") {
                words.at = after_bytes;
            }
            frame
        }
    };
    frame.ok_or(bad)
}

fn spaced_bytes(words: &mut Words<'_>, bytes: &mut [u8]) -> Result<(), LineError> {
    let length = bytes.len();
    for (at, byte) in bytes.iter_mut().enumerate() {
        let missing = words.error(LineProblem::OtherLength { length, bytes: at });
        let word = words.next().ok_or(missing)?;
        let pair = Some(word.text.as_bytes()).filter(|text| text.len() == 2).and_then(hex_byte);
        *byte = pair.ok_or(word.error(0, LineProblem::BadByte))?;
    }
    Ok(())
}

fn skip_characters(words: &mut Words<'_>) {
    let before = words.at;
    if words.next().is_some_and(|word| word.text.starts_with('\'')) {
        words.at = words.line.len();
    } else {
        words.at = before;
    }
}
