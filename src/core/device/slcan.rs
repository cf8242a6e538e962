//! CAN adapters on a serial port that speak SLCAN.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::time::Duration;

use serialport::SerialPort;

use super::bus_health::{BusHealth, BusState};
use super::open_error::OpenError;
use super::serial;
use crate::link::slcan::{self, Answer, AnswerDecoder, Command};
use crate::link::{Bus, BusError, Direction, Frame, StampedFrame};

/// Speed of the serial port; adapters on USB take any.
const BAUD: u32 = 115_200;
/// Longest wait of a read.
const TIMEOUT: Duration = Duration::from_millis(20);
/// Most bytes of one read: a full bus sends 180 bytes a millisecond.
const CHUNK: usize = 8192;

/// The half that reads.
pub(super) struct Reader {
    name: String,
    port: Box<dyn SerialPort>,
    health: Arc<BusHealth>,
    decoder: AnswerDecoder,
    chunk: Vec<u8>,
    frames: VecDeque<Frame>,
}

/// The half that sends.
pub(super) struct Writer {
    name: String,
    port: Box<dyn SerialPort>,
}

/// Opens an adapter; to listen only it is told so itself, and there is no half that sends.
pub(super) fn open(
    name: &str,
    bit_rate: u32,
    listen_only: bool,
    health: &Arc<BusHealth>,
) -> Result<(Reader, Option<Writer>), OpenError> {
    let opening = slcan::opening(bit_rate, listen_only).ok_or_else(|| OpenError::BitRate {
        bit_rate,
        allowed: "10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 or 1000000".to_owned(),
    })?;
    let mut port = serial::open(name, BAUD, TIMEOUT)?;
    let failed = |error: &dyn std::error::Error| OpenError::Failed {
        name: name.to_owned(),
        reason: error.to_string(),
    };
    for command in opening {
        port.write_all(&command.encode()).map_err(|error| failed(&error))?;
    }
    let writer = if listen_only {
        None
    } else {
        let port = port.try_clone().map_err(|error| failed(&error))?;
        Some(Writer { name: name.to_owned(), port })
    };
    health.set_hint(format!(
        "nothing is heard at {bit_rate} bit/s: check the bus's bit rate, wiring and termination; motors answer only \
         when they are asked"
    ));
    let reader = Reader {
        name: name.to_owned(),
        port,
        health: Arc::clone(health),
        decoder: AnswerDecoder::default(),
        chunk: vec![0; CHUNK],
        frames: VecDeque::new(),
    };
    Ok((reader, writer))
}

impl Reader {
    fn take(&mut self, count: usize) {
        let mut input = &self.chunk[..count];
        while let Some(answer) = self.decoder.next(&mut input) {
            match answer {
                Answer::Frame { frame, .. } => self.frames.push_back(frame),
                Answer::Status(status) => self.health.set_state(match status.state {
                    slcan::BusState::Active => BusState::ErrorActive,
                    slcan::BusState::Warning => BusState::ErrorWarning,
                    slcan::BusState::Passive => BusState::ErrorPassive,
                    slcan::BusState::Off => BusState::BusOff,
                }),
                // The close before the opening is refused by an adapter that is closed.
                Answer::Errors(_) | Answer::Damaged => self.health.add_error(),
                Answer::Refused
                | Answer::Done
                | Answer::Taken { .. }
                | Answer::Version(_)
                | Answer::Firmware(_)
                | Answer::SerialNumber(_)
                | Answer::Flags(_) => {}
            }
        }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // An adapter that is gone needs no closing.
        self.port.write_all(&Command::Close.encode()).unwrap_or(());
    }
}

impl Bus for Reader {
    fn send(&mut self, _: Duration, _: &Frame) -> Result<(), BusError> {
        Err(BusError::ListensOnly { name: self.name.clone() })
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        let frame = self.frames.pop_front();
        Ok(frame.map(|frame| StampedFrame { time: now, direction: Direction::Received, frame }))
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        match self.port.read(&mut self.chunk) {
            Ok(0) => {
                Err(BusError::Gone { name: self.name.clone(), reason: "the port was closed".to_owned() })
            }
            Ok(count) => {
                self.take(count);
                Ok(())
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(())
            }
            Err(error) => Err(BusError::Gone { name: self.name.clone(), reason: error.to_string() }),
        }
    }
}

impl Bus for Writer {
    fn send(&mut self, _: Duration, frame: &Frame) -> Result<(), BusError> {
        self.port.write_all(&Command::Send(*frame).encode()).map_err(|error| match error.kind() {
            io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => BusError::Full { name: self.name.clone() },
            _ => BusError::Gone { name: self.name.clone(), reason: error.to_string() },
        })
    }

    fn receive(&mut self, _: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(None)
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        Ok(())
    }
}
