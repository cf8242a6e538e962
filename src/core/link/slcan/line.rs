//! Lines in a stream of bytes, and lines to send.

use std::ops::Deref;

pub(super) const END: u8 = b'\r';
pub(super) const BELL: u8 = 0x07;
const LINE_FEED: u8 = b'\n';
/// More than any line that means something.
const LONGEST: usize = 64;

/// A line to send, with its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    bytes: [u8; 32],
    length: usize,
}

impl Line {
    /// A line of this text, which is at most 31 characters long.
    pub(super) fn of(text: impl FnOnce(&mut Self)) -> Self {
        let mut line = Self { bytes: [0; 32], length: 0 };
        text(&mut line);
        line.push(END);
        line
    }

    /// A line that is only a bell, and has no end.
    pub(super) fn bell() -> Self {
        let mut line = Self { bytes: [0; 32], length: 0 };
        line.push(BELL);
        line
    }

    pub(super) fn push(&mut self, byte: u8) {
        self.bytes[self.length] = byte;
        self.length += 1;
    }

    pub(super) fn push_all(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.push(*byte));
    }

    /// The lowest digits of a number, hexadecimal.
    pub(super) fn push_hex(&mut self, value: u32, digits: u32) {
        for digit in (0..digits).rev() {
            self.push(b"0123456789ABCDEF"[(value >> (4 * digit) & 0xF) as usize]);
        }
    }
}

impl Deref for Line {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// Text that an adapter says of itself: at most 24 printable ASCII characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text {
    bytes: [u8; 24],
    length: u8,
}

impl Text {
    /// This text; `None` if it is too long or not printable.
    pub fn new(text: &[u8]) -> Option<Self> {
        let mut bytes = [0; 24];
        bytes.get_mut(..text.len())?.copy_from_slice(text);
        let printable = text.iter().all(|byte| (b' '..=b'~').contains(byte));
        printable.then_some(Self { bytes, length: text.len() as u8 })
    }

    /// The characters.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

impl std::fmt::Display for Text {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.as_bytes().iter().try_for_each(|byte| write!(f, "{}", char::from(*byte)))
    }
}

/// How a line has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// Carriage return or line feed.
    Line,
    /// Bell.
    Bell,
}

/// Splits a stream into lines; keeps what has no end yet.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    held: [u8; LONGEST],
    length: usize,
}

impl Default for Lines {
    fn default() -> Self {
        Self { held: [0; LONGEST], length: 0 }
    }
}

impl Lines {
    /// What is made of the next line in `input`, which loses what was read; none once all is read. A line that is
    /// too long comes cut to a length that means nothing.
    pub(super) fn next<T>(
        &mut self,
        input: &mut &[u8],
        make: impl Fn(&[u8], Ended) -> Option<T>,
    ) -> Option<T> {
        while let Some(at) = input.iter().position(|byte| matches!(*byte, END | BELL | LINE_FEED)) {
            let (text, rest) = input.split_at(at);
            let (end, rest) = (rest[0], &rest[1..]);
            *input = rest;
            let text = if self.length == 0 { text } else { self.complete(text) };
            let made = match end {
                LINE_FEED if text.is_empty() => None,
                BELL => make(text, Ended::Bell),
                _ => make(text, Ended::Line),
            };
            if made.is_some() {
                return made;
            }
        }
        self.hold(input);
        *input = &[];
        None
    }

    fn complete(&mut self, text: &[u8]) -> &[u8] {
        self.hold(text);
        let length = std::mem::take(&mut self.length);
        &self.held[..length]
    }

    fn hold(&mut self, text: &[u8]) {
        let taken = text.len().min(LONGEST - self.length);
        self.held[self.length..][..taken].copy_from_slice(&text[..taken]);
        self.length += taken;
    }
}
