//! CAN adapters on a serial port that speak SLCAN.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use super::bus_health::{BusHealth, BusState};
use super::clock::Clock;
use super::open_error::OpenError;
use super::serial::SerialLine;
use crate::link::slcan::{self, Answer, AnswerDecoder, Command};
use crate::link::{Bus, BusError, Direction, Frame, FrameKind, StampedFrame};

/// Speed of the serial port, bit/s. Adapters on USB take any; one behind a real UART at this speed carries 500
/// frames a second, not a robot's 4000.
const BAUD: u32 = 115_200;

/// Time that an adapter has for an answer. Some never answer.
const ANSWER_TIME: Duration = Duration::from_millis(100);

/// Time for which all that comes after closing is let go: answers to whoever had the port before, and their frames.
const SETTLE_TIME: Duration = Duration::from_millis(50);

/// Times that an adapter is opened before it is taken to refuse: it may be slower than the pause after closing.
const TRIES: u32 = 3;

/// Most bytes of one read: a full bus sends 180 bytes a millisecond.
const CHUNK: usize = 8192;

/// A listening bus lets that much time's frames gather before it reads, so that a full bus does not wake it 8000
/// times a second. USB adapters send no more often.
const GATHER: Duration = Duration::from_millis(1);

/// The half that reads. Closes the adapter when it is dropped.
pub(super) struct Reader {
    name: String,
    line: SerialLine,
    listen_only: bool,
    health: Arc<BusHealth>,
    decoder: AnswerDecoder,
    chunk: Vec<u8>,
    /// Bytes of the chunk that are read and not decoded.
    waiting: std::ops::Range<usize>,
}

/// The half that sends.
pub(super) struct Writer {
    name: String,
    line: SerialLine,
}

/// Opens an adapter; to listen only, the adapter itself is told so, and there is no half that sends.
pub(super) fn open(
    name: &str,
    bit_rate: u32,
    listen_only: bool,
    health: &Arc<BusHealth>,
) -> Result<(Reader, Option<Writer>), OpenError> {
    let commands = slcan::opening(bit_rate, listen_only).ok_or(OpenError::BitRate { bit_rate })?;
    let line = SerialLine::open(name, BAUD)?;
    let failed = |error: io::Error| OpenError::Failed { name: name.to_owned(), reason: error.to_string() };
    let writer = match listen_only {
        true => None,
        false => Some(Writer { name: name.to_owned(), line: line.try_clone().map_err(failed)? }),
    };
    let mut reader = Reader {
        name: name.to_owned(),
        line,
        listen_only,
        health: Arc::clone(health),
        decoder: AnswerDecoder::default(),
        chunk: vec![0; CHUNK],
        waiting: 0..0,
    };
    let mut answers = false;
    for tries_left in (0..TRIES).rev() {
        let (refused, answered) = reader.set_up(&commands).map_err(failed)?;
        answers = answered;
        match refused {
            None => break,
            Some(command) if tries_left == 0 => {
                return Err(OpenError::Refused { port: name.to_owned(), command: words(command) });
            }
            Some(_) => {}
        }
    }
    health.set_hint(hint(name, bit_rate, answers));
    Ok((reader, writer))
}

/// What to look at where nothing is received.
fn hint(name: &str, bit_rate: u32, answers: bool) -> String {
    if !answers {
        return format!(
            "{name} has not answered any command: check that it is an SLCAN adapter; some adapters never \
             answer, then check that the robot is on and uses {bit_rate} bit/s"
        );
    }
    format!(
        "no frames on {name} at {bit_rate} bit/s: check that the robot is on and uses this bit rate, and the termination \
         at both ends; motors reply only to queries"
    )
}

/// A command without its end.
fn words(command: &Command) -> String {
    String::from_utf8_lossy(&command.encode()).trim_end().to_owned()
}

impl Reader {
    /// Sends the commands in turn: the one that was refused, if any, and whether any was answered.
    fn set_up<'a>(&mut self, commands: &'a [Command]) -> io::Result<(Option<&'a Command>, bool)> {
        let mut answers = false;
        for command in commands {
            if *command == Command::Close {
                answers |= self.close_first()?;
                continue;
            }
            let answer = self.ask(command)?;
            answers |= answer.is_some();
            if answer == Some(Answer::Refused) {
                return Ok((Some(command), answers));
            }
        }
        Ok((None, answers))
    }

    /// Closes an adapter, which may refuse where it is closed already, and lets go all that comes meanwhile.
    fn close_first(&mut self) -> io::Result<bool> {
        self.line.write(&Command::Close.encode())?;
        let (clock, mut answers) = (Clock::start(), false);
        while clock.now() < SETTLE_TIME {
            while let Some(answer) = self.next_answer()? {
                answers |= matches!(answer, Answer::Done | Answer::Refused);
            }
            self.line.wait(SETTLE_TIME.saturating_sub(clock.now()))?;
        }
        Ok(answers)
    }

    /// Sends a command and waits for done or refused; frames of an adapter that was left open are let go.
    fn ask(&mut self, command: &Command) -> io::Result<Option<Answer>> {
        self.line.write(&command.encode())?;
        let clock = Clock::start();
        while clock.now() < ANSWER_TIME {
            while let Some(answer) = self.next_answer()? {
                if matches!(answer, Answer::Done | Answer::Refused) {
                    return Ok(Some(answer));
                }
            }
            self.line.wait(ANSWER_TIME.saturating_sub(clock.now()))?;
        }
        Ok(None)
    }

    /// The next answer of all that has come.
    fn next_answer(&mut self) -> io::Result<Option<Answer>> {
        loop {
            let mut input = &self.chunk[self.waiting.clone()];
            let answer = self.decoder.next(&mut input);
            self.waiting.start = self.waiting.end - input.len();
            if answer.is_some() {
                return Ok(answer);
            }
            let count = self.line.read(&mut self.chunk)?;
            self.waiting = 0..count;
            if count == 0 {
                return Ok(None);
            }
        }
    }

    /// Counts what is no frame.
    fn note(&self, answer: &Answer) {
        match answer {
            Answer::Status(status) => self.health.set_state(match status.state {
                slcan::BusState::Active => BusState::ErrorActive,
                slcan::BusState::Warning => BusState::ErrorWarning,
                slcan::BusState::Passive => BusState::ErrorPassive,
                slcan::BusState::Off => BusState::BusOff,
            }),
            Answer::Errors(errors) => {
                self.health.add_error();
                // How many were lost, the adapter does not tell.
                self.health.add_dropped(u64::from(errors.names().any(|name| name == "receive overrun")));
                self.health.set_hint(format!(
                    "{} reports bus errors ({}): check bit rate, wiring and termination",
                    self.name,
                    errors.names().collect::<Vec<_>>().join(", ")
                ));
            }
            Answer::Damaged | Answer::Refused => self.health.add_error(),
            Answer::Frame { .. }
            | Answer::Done
            | Answer::Taken { .. }
            | Answer::Version(_)
            | Answer::Firmware(_)
            | Answer::SerialNumber(_)
            | Answer::Flags(_) => {}
        }
    }

    fn gone(&self, error: &io::Error) -> BusError {
        BusError::Gone { name: self.name.clone(), reason: error.to_string() }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // An adapter that is gone needs no closing.
        self.line.write_last(&Command::Close.encode()).unwrap_or(());
    }
}

impl Bus for Reader {
    /// The other half sends, if any may.
    fn send(&mut self, _: Duration, _: &Frame) -> Result<(), BusError> {
        Err(BusError::ListensOnly { name: self.name.clone() })
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        while let Some(answer) = self.next_answer().map_err(|error| self.gone(&error))? {
            if let Answer::Frame { frame, .. } = answer {
                return Ok(Some(StampedFrame { time: now, direction: Direction::Received, frame }));
            }
            self.note(&answer);
        }
        Ok(None)
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), BusError> {
        self.line.wait(timeout).map_err(|error| self.gone(&error))?;
        if self.listen_only {
            std::thread::sleep(GATHER.min(timeout));
        }
        Ok(())
    }
}

impl Bus for Writer {
    fn send(&mut self, _: Duration, frame: &Frame) -> Result<(), BusError> {
        let name = || self.name.clone();
        if frame.kind() == FrameKind::Error {
            return Err(BusError::Failed {
                name: name(),
                reason: "only interfaces send error frames".to_owned(),
            });
        }
        self.line.write(&Command::Send(*frame).encode()).map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock => BusError::Full { name: self.name.clone() },
            _ => BusError::Gone { name: self.name.clone(), reason: error.to_string() },
        })
    }

    /// What comes is the other half's.
    fn receive(&mut self, _: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(None)
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        Ok(())
    }
}
