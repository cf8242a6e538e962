//! Reading raw frames of any length, one by one.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{BufRead, Read};
use std::time::Duration;

use crate::link::candump::{self, Entry, LoggedFrame};
use crate::link::{Direction, StampedFrame};
use crate::record::{LineProblem, LogError};

/// A line longer than this is damage, not a frame.
const LINE_LIMIT_BYTES: usize = 1 << 10;
/// Frames may be so far out of order: a sent one is stamped before a received one that was waiting.
const OUT_OF_ORDER: Duration = Duration::from_millis(1);

/// Reads a candump file frame by frame. A line that is no classic frame is left out and counted, and so is a last
/// line without an end: it was cut.
pub struct FrameLog<'a, R> {
    reader: R,
    source: Cow<'a, str>,
    line: Vec<u8>,
    interface: String,
    number: u64,
    bytes: u64,
    frames: u64,
    damaged: u64,
    first_problem: Option<LineProblem>,
    /// Latest time so far.
    latest: Duration,
    /// The first frame that runs back in time.
    first_back: Option<LineProblem>,
}

impl<'a, R: BufRead> FrameLog<'a, R> {
    /// A reader of this text; `source` is its name in messages.
    pub fn new(reader: R, source: impl Into<Cow<'a, str>>) -> Self {
        Self {
            reader,
            source: source.into(),
            line: Vec::new(),
            interface: String::new(),
            number: 0,
            bytes: 0,
            frames: 0,
            damaged: 0,
            first_problem: None,
            latest: Duration::ZERO,
            first_back: None,
        }
    }

    /// Bytes read so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Lines that were left out so far.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// The first of them.
    pub fn first_problem(&self) -> Option<&LineProblem> {
        self.first_problem.as_ref()
    }

    /// The first frame that runs back in time; it is not left out.
    pub fn time_problem(&self) -> Option<&LineProblem> {
        self.first_back.as_ref()
    }

    /// The next frame and its interface; times count from 1970.
    ///
    /// # Errors
    /// [`LogError::Io`], and [`LogError::MostlyBad`] at the end of a file without a single frame.
    pub fn next_frame(&mut self) -> Result<Option<(&str, StampedFrame)>, LogError> {
        while self.next_line()? {
            match parse(&self.line) {
                Ok((interface, frame)) => {
                    self.frames += 1;
                    let back = self.latest.saturating_sub(frame.time);
                    self.latest = self.latest.max(frame.time);
                    if back > OUT_OF_ORDER {
                        let problem = format!(
                            "time decreases by {:.3} s: sort the lines by time, or split the file at the clock change",
                            back.as_secs_f64()
                        );
                        let (line, column) = (self.number, String::new());
                        self.first_back.get_or_insert(LineProblem { line, column, problem });
                    }
                    self.interface.clear();
                    self.interface.push_str(interface);
                    return Ok(Some((&self.interface, frame)));
                }
                Err(problem) => self.complain(problem),
            }
        }
        self.end().map(|()| None)
    }

    /// Reads the next line that is not blank and has an end.
    fn next_line(&mut self) -> Result<bool, LogError> {
        let mut too_long = false;
        loop {
            self.line.clear();
            let count = self.read_piece()?;
            self.bytes += count as u64;
            let ended = self.line.ends_with(b"\n");
            self.number += u64::from(ended || (count > 0 && count < LINE_LIMIT_BYTES));
            match (count, ended) {
                (0, _) => return Ok(false),
                (_, true) if too_long => {
                    self.complain("the line is too long for a frame and was skipped".to_owned())
                }
                (_, true) if self.line.trim_ascii().is_empty() => {}
                (_, true) => return Ok(true),
                (LINE_LIMIT_BYTES, false) => {}
                _ => self
                    .complain("the recording ends in the middle of this line, which was skipped".to_owned()),
            }
            too_long = !ended;
        }
    }

    fn read_piece(&mut self) -> Result<usize, LogError> {
        let piece = self.reader.by_ref().take(LINE_LIMIT_BYTES as u64).read_until(b'\n', &mut self.line);
        piece.map_err(|error| LogError::Io {
            file: self.source.to_string(),
            line: self.number,
            problem: error.to_string(),
        })
    }

    fn complain(&mut self, problem: String) {
        self.damaged += 1;
        let (line, column) = (self.number, String::new());
        self.first_problem.get_or_insert(LineProblem { line, column, problem });
    }

    /// Returns whether there was a frame at all.
    fn end(&self) -> Result<(), LogError> {
        match &self.first_problem {
            Some(first) if self.frames == 0 => Err(LogError::MostlyBad {
                file: self.source.to_string(),
                bad: self.damaged as usize,
                rows: self.damaged as usize,
                problems: first.to_string(),
            }),
            _ => Ok(()),
        }
    }
}

/// The interface and the frame of a line that is not blank.
fn parse(line: &[u8]) -> Result<(&str, StampedFrame), String> {
    let left_out = |problem: &dyn Display| format!("{problem}; the line was skipped");
    let text = std::str::from_utf8(line).map_err(|_| left_out(&"this is not text"))?;
    let entry = candump::parse_line(text).map_err(|error| left_out(&error))?;
    let Entry { time, interface, frame, direction } = entry.ok_or_else(|| left_out(&"there is no frame"))?;
    let LoggedFrame::Classic { frame, .. } = frame else {
        return Err(left_out(&"CAN FD frames are not supported"));
    };
    Ok((interface, StampedFrame { time, direction: direction.unwrap_or(Direction::Received), frame }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Frame, FrameId};

    fn read(text: &[u8]) -> (Vec<(String, StampedFrame)>, u64, Option<String>) {
        let mut log = FrameLog::new(text, "run.log");
        let mut frames = Vec::new();
        while let Some((interface, frame)) = log.next_frame().unwrap() {
            frames.push((interface.to_owned(), frame));
        }
        (frames, log.damaged(), log.first_problem().map(ToString::to_string))
    }

    fn text() -> String {
        let mut text = String::new();
        for frame in frames() {
            super::super::push_frame(&mut text, Duration::from_secs(1_700_000_000), "can0", &frame);
        }
        text
    }

    fn frames() -> Vec<StampedFrame> {
        let standard = FrameId::standard(0x141).unwrap();
        let frames = [
            Frame::full(standard, [0xA1, 0, 0, 0, 0x84, 1, 0, 0]),
            Frame::data(FrameId::extended(0x12AB_CDEF).unwrap(), &[0xAA]).unwrap(),
            Frame::remote(standard, 8).unwrap(),
            Frame::error(4, [0, 12, 0, 0, 0, 0, 0, 0]).unwrap(),
            Frame::data(standard, &[]).unwrap(),
        ];
        let stamped = |(index, frame): (u64, Frame)| {
            let direction = if index.is_multiple_of(2) { Direction::Sent } else { Direction::Received };
            StampedFrame { time: Duration::from_micros(index * 125), direction, frame }
        };
        (0..).zip(frames).map(stamped).collect()
    }

    #[test]
    fn written_frames_read_back() {
        let start = Duration::from_secs(1_700_000_000);
        let expected = frames()
            .into_iter()
            .map(|frame| ("can0".to_owned(), StampedFrame { time: start + frame.time, ..frame }));
        assert_eq!(read(text().as_bytes()), (expected.collect(), 0, None));
    }

    #[test]
    fn a_file_cut_anywhere_loses_its_torn_line_only() {
        let (text, all) = (text(), read(text().as_bytes()).0);
        for end in 1..text.len() {
            let lines = text[..end].matches('\n').count();
            if lines == 0 {
                assert!(FrameLog::new(&text.as_bytes()[..end], "run.log").next_frame().is_err());
                continue;
            }
            let (frames, damaged, _) = read(&text.as_bytes()[..end]);
            assert_eq!(
                (frames.as_slice(), damaged),
                (&all[..lines], u64::from(!text[..end].ends_with('\n')))
            );
        }
    }

    #[test]
    fn frames_that_run_back_in_time_are_kept_and_named() {
        let lines = |times: &[&str]| -> String {
            times.iter().map(|time| format!("(1700000000.{time}) can0 141#A1\n")).collect()
        };
        let read = |text: &str| {
            let mut log = FrameLog::new(text.as_bytes(), "run.log");
            let mut count = 0;
            while log.next_frame().unwrap().is_some() {
                count += 1;
            }
            (count, log.damaged(), log.time_problem().map(ToString::to_string))
        };
        assert_eq!(
            read(&lines(&["001000", "002000", "001500", "003000"])),
            (4, 0, None),
            "stamped out of order"
        );
        let (count, damaged, problem) = read(&lines(&["500000", "900000", "250000", "300000", "950000"]));
        let problem = problem.unwrap();
        assert_eq!((count, damaged), (5, 0));
        assert!(problem.starts_with("line 3: time decreases by 0.650 s: sort"), "{problem}");
    }

    #[test]
    fn damaged_lines_are_counted_and_the_first_is_named() {
        let long = "x".repeat(3 * LINE_LIMIT_BYTES);
        let text = text().replacen('\n', &format!("\n\n(1.5 can0 nonsense\n{long}\n"), 1) + "(17";
        let (frames, damaged, first) = read(text.as_bytes());
        assert_eq!((frames.len(), damaged), (5, 3));
        assert!(first.as_ref().unwrap().starts_with("line 3: "), "{first:?}");
    }
}
