//! The serial line of the IMU.

use std::io::{self, Read};
use std::time::Duration;

use serialport::SerialPort;

use super::open_error::OpenError;
use super::serial;
use super::session::SerialAddress;

/// Longest time that a read waits.
const TIMEOUT: Duration = Duration::from_millis(20);

/// An open line, which is opened anew by itself where it is lost.
pub struct ImuPort {
    address: SerialAddress,
    port: Option<Box<dyn SerialPort>>,
}

/// Opens the line of an IMU.
///
/// # Errors
/// [`OpenError`].
pub fn open_imu(address: &SerialAddress) -> Result<ImuPort, OpenError> {
    let port = serial::open(&address.port, address.baud, TIMEOUT)?;
    Ok(ImuPort { address: address.clone(), port: Some(port) })
}

impl ImuPort {
    /// Reads what has come, after a wait of at most 20 ms; 0 bytes where nothing has.
    ///
    /// # Errors
    /// What the system says; the next call tries to open the port anew.
    pub fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let port = match &mut self.port {
            Some(port) => port,
            None => {
                let opened = serial::open(&self.address.port, self.address.baud, TIMEOUT);
                self.port.insert(opened.map_err(io::Error::other)?)
            }
        };
        match port.read(bytes) {
            Ok(0) => {
                self.port = None;
                Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the port was closed"))
            }
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(0)
            }
            Err(error) => {
                self.port = None;
                Err(error)
            }
        }
    }
}
