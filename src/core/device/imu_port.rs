//! The serial line of the IMU.

use std::io;
use std::thread;
use std::time::Duration;

use super::clock::Clock;
use super::interfaces;
use super::open_error::OpenError;
use super::retry::Retry;
use super::serial::SerialLine;
use super::session::SerialAddress;
use crate::link::jy901::{self, ConfigureError, Content, RegisterWrite};

/// Longest time that a read waits.
const READ_TIME: Duration = Duration::from_millis(20);

/// Time that the IMU has for each write to a register.
const WRITE_TIME: Duration = Duration::from_millis(100);

/// An open line, which is opened anew by itself where it is lost. Nothing is sent unless [`ImuPort::configure`] is
/// requested.
pub struct ImuPort {
    address: SerialAddress,
    clock: Clock,
    line: Option<SerialLine>,
    retry: Retry,
    reconnects: u64,
}

/// Opens the line of an IMU. A port that has a separate name permanently is found by that again.
///
/// # Errors
/// [`OpenError`]: what is wrong with the port, and the remedy.
pub fn open_imu(address: &SerialAddress) -> Result<ImuPort, OpenError> {
    let line = SerialLine::open(&address.port, address.baud)?;
    let port = interfaces::stable_name(&address.port).unwrap_or_else(|| address.port.clone());
    let address = SerialAddress { port, baud: address.baud };
    Ok(ImuPort { address, clock: Clock::start(), line: Some(line), retry: Retry::default(), reconnects: 0 })
}

impl ImuPort {
    /// Reads what has come, after a wait of at most 20 ms; 0 bytes where nothing has, and while the port is looked
    /// for.
    ///
    /// # Errors
    /// The port is gone; told once.
    pub fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let Some(line) = &mut self.line else {
            self.look();
            return Ok(0);
        };
        let read = line.wait(READ_TIME).and_then(|()| line.read(bytes));
        if read.is_err() {
            self.line = None;
            self.retry.after_loss(self.clock.now());
        }
        read
    }

    /// Times the port was lost and came back.
    pub fn reconnects(&self) -> u64 {
        self.reconnects
    }

    /// Whether the port is open just now.
    pub fn is_open(&self) -> bool {
        self.line.is_some()
    }

    /// Sets rate, baud rate and content of the IMU permanently; from then on the line has that baud rate.
    ///
    /// # Errors
    /// [`ImuConfigureError`].
    pub fn configure(&mut self, rate_hz: f64, baud: u32, content: Content) -> Result<(), ImuConfigureError> {
        for write in jy901::configure(rate_hz, baud, content)? {
            let line = self.line.as_mut().ok_or(ImuConfigureError::Lost)?;
            line.write(&write).map_err(|error| ImuConfigureError::Failed { reason: error.to_string() })?;
            thread::sleep(WRITE_TIME);
            if sets_baud(&write) && baud != self.address.baud {
                self.line = None;
                self.address.baud = baud;
                self.line = Some(SerialLine::open(&self.address.port, baud)?);
            }
        }
        Ok(())
    }

    fn look(&mut self) {
        thread::sleep(self.retry.time_left(self.clock.now()).min(READ_TIME));
        if !self.retry.is_due(self.clock.now()) {
            return;
        }
        self.line = SerialLine::open(&self.address.port, self.address.baud).ok();
        match self.line {
            Some(_) => {
                self.retry = Retry::default();
                self.reconnects += 1;
            }
            None => self.retry.after_failure(self.clock.now()),
        }
    }
}

/// Whether this is the write after which the IMU speaks at another speed.
fn sets_baud(write: &[u8; 5]) -> bool {
    let mut decoder = jy901::RegisterWriteDecoder::default();
    decoder.next(&mut &write[..]).and_then(|write: RegisterWrite| write.baud()).is_some()
}

/// Why an IMU could not be configured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImuConfigureError {
    /// A setting that it has not.
    #[error(transparent)]
    Setting(#[from] ConfigureError),
    /// The port cannot be opened at the new speed.
    #[error(transparent)]
    Port(#[from] OpenError),
    /// The port is lost.
    #[error("the port of the IMU is gone: reconnect it and try again")]
    Lost,
    /// What the system says.
    #[error("cannot write to the port of the IMU: {reason}")]
    Failed {
        /// What the system said.
        reason: String,
    },
}
