//! A serial port whose reads and writes never wait, and why one cannot be opened.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serialport::{ErrorKind, SerialPortBuilder};

use super::clock::Clock;
use super::interfaces;
use super::open_error::OpenError;

#[cfg(target_os = "linux")]
use linux::Port;
#[cfg(not(target_os = "linux"))]
use portable::Port;

/// Longest time that a last line waits for the port to take it.
const LAST_LINE_TIME: Duration = Duration::from_millis(100);

/// An open port, and bytes that it has not taken yet; those are the same of all handles, so that lines stay whole.
pub(super) struct SerialLine {
    port: Port,
    unsent: Arc<Mutex<Vec<u8>>>,
}

impl SerialLine {
    /// Opens a port for this program alone; a pseudo-terminal takes any speed.
    pub(super) fn open(name: &str, baud: u32) -> Result<Self, OpenError> {
        let port =
            Port::open(name, &serialport::new(name, baud)).map_err(|error| why_closed(name, &error))?;
        Ok(Self { port, unsent: Arc::default() })
    }

    /// A second handle for another thread.
    pub(super) fn try_clone(&self) -> io::Result<Self> {
        Ok(Self { port: self.port.try_clone()?, unsent: Arc::clone(&self.unsent) })
    }

    /// Bytes that have come; 0 where none have.
    ///
    /// # Errors
    /// The port is gone.
    pub(super) fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.port.read(bytes) {
            Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the other end has hung up")),
            Err(error) if nothing_yet(&error) => Ok(0),
            done => done,
        }
    }

    /// Hands over a whole line; the part that the port does not take now goes with the next one.
    ///
    /// # Errors
    /// `WouldBlock` where the part of an earlier line still waits: this one was not taken. Otherwise the port is gone.
    pub(super) fn write(&mut self, line: &[u8]) -> io::Result<()> {
        let mut unsent = guard(&self.unsent);
        push(&mut self.port, &mut unsent)?;
        if !unsent.is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        unsent.extend_from_slice(line);
        push(&mut self.port, &mut unsent)
    }

    /// Hands over a last line behind all others, and waits a moment for the port to take them.
    pub(super) fn write_last(&mut self, line: &[u8]) -> io::Result<()> {
        let mut unsent = guard(&self.unsent);
        unsent.extend_from_slice(line);
        let clock = Clock::start();
        push(&mut self.port, &mut unsent)?;
        while !unsent.is_empty() && clock.now() < LAST_LINE_TIME {
            thread::sleep(Duration::from_millis(1));
            push(&mut self.port, &mut unsent)?;
        }
        Ok(())
    }

    /// Sleeps until something has come, at most for `timeout`.
    pub(super) fn wait(&mut self, timeout: Duration) -> io::Result<()> {
        self.port.wait(timeout)
    }
}

/// A panic while lines are handed over leaves whole lines, or the rest of one.
fn guard(unsent: &Mutex<Vec<u8>>) -> MutexGuard<'_, Vec<u8>> {
    unsent.lock().unwrap_or_else(PoisonError::into_inner)
}

fn push(port: &mut Port, unsent: &mut Vec<u8>) -> io::Result<()> {
    while !unsent.is_empty() {
        match port.write(unsent) {
            Ok(0) => break,
            Ok(count) => drop(unsent.drain(..count)),
            Err(error) if nothing_yet(&error) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn nothing_yet(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn why_closed(name: &str, error: &serialport::Error) -> OpenError {
    let port = name.to_owned();
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) if cfg!(windows) => OpenError::InUse { port },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => OpenError::NoPermission {
            name: port,
            remedy:
                "join the group of serial ports with `sudo usermod -aG dialout $USER`, then log out and in"
                    .to_owned(),
        },
        ErrorKind::Io(io::ErrorKind::NotFound) => interfaces::why_no_port(name),
        // The library says the same of a port that is locked and, on Windows, of one that is not there.
        ErrorKind::NoDevice if cfg!(windows) => interfaces::why_no_port(name),
        ErrorKind::NoDevice => OpenError::InUse { port },
        _ => OpenError::Failed { name: port, reason: error.to_string() },
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::File;
    use std::io::{self, Read, Write};
    use std::os::unix::fs::OpenOptionsExt;
    use std::time::Duration;

    use nix::libc::{O_NOCTTY, O_NONBLOCK};
    use serialport::TTYPort;

    use super::SerialPortBuilder;
    use crate::device::can::wait_readable;

    /// The library sets the port up and holds its lock; all bytes go through a handle that never waits.
    pub(super) struct Port {
        _lock: TTYPort,
        bytes: File,
    }

    impl Port {
        pub(super) fn open(name: &str, builder: &SerialPortBuilder) -> serialport::Result<Self> {
            // A lock of this program's own would keep the second handle out.
            let mut lock = TTYPort::open(&builder.clone().exclusive(false))?;
            let flags = O_NONBLOCK | O_NOCTTY;
            let bytes = File::options().read(true).write(true).custom_flags(flags).open(name)?;
            lock.set_exclusive(true)?;
            Ok(Self { _lock: lock, bytes })
        }

        pub(super) fn try_clone(&self) -> io::Result<Self> {
            Ok(Self { _lock: self._lock.try_clone_native()?, bytes: self.bytes.try_clone()? })
        }

        pub(super) fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.bytes.read(bytes)
        }

        pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.bytes.write(bytes)
        }

        pub(super) fn wait(&mut self, timeout: Duration) -> io::Result<()> {
            Ok(wait_readable(&self.bytes, timeout)?)
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod portable {
    use std::io;
    use std::thread;
    use std::time::{Duration, Instant};

    use serialport::SerialPort;

    use super::SerialPortBuilder;

    /// Longest wait of a write. A read never waits: on Windows it would hold up the other thread's writes.
    const TIMEOUT: Duration = Duration::from_millis(5);

    pub(super) struct Port(Box<dyn SerialPort>);

    impl Port {
        pub(super) fn open(_: &str, builder: &SerialPortBuilder) -> serialport::Result<Self> {
            Ok(Self(builder.clone().timeout(TIMEOUT).open()?))
        }

        pub(super) fn try_clone(&self) -> io::Result<Self> {
            Ok(Self(self.0.try_clone()?))
        }

        pub(super) fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            if self.0.bytes_to_read()? == 0 {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            self.0.read(bytes)
        }

        pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.write(bytes)
        }

        pub(super) fn wait(&mut self, timeout: Duration) -> io::Result<()> {
            let end = Instant::now() + timeout;
            while self.0.bytes_to_read()? == 0 && Instant::now() < end {
                thread::sleep(Duration::from_millis(1));
            }
            Ok(())
        }
    }
}
