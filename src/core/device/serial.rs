//! Serial ports of the system, and why one cannot be opened.

use std::io;
use std::time::Duration;

use serialport::{ErrorKind, SerialPort};

use super::open_error::OpenError;

/// Opens a port. A pseudo-terminal takes any speed.
pub(super) fn open(port: &str, baud: u32, timeout: Duration) -> Result<Box<dyn SerialPort>, OpenError> {
    serialport::new(port, baud).timeout(timeout).open().map_err(|error| why_closed(port, &error))
}

fn why_closed(port: &str, error: &serialport::Error) -> OpenError {
    let text = error.to_string();
    match error.kind() {
        ErrorKind::NoDevice if text.contains("busy") => {
            OpenError::InUse { port: port.to_owned(), user: "another program".to_owned() }
        }
        ErrorKind::NoDevice | ErrorKind::Io(io::ErrorKind::NotFound) => {
            OpenError::NoPort { port: port.to_owned(), present: present() }
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => OpenError::NoPermission {
            name: port.to_owned(),
            mend: "join the group of serial ports with `sudo usermod -aG dialout $USER` and log in anew"
                .to_owned(),
        },
        ErrorKind::Io(io::ErrorKind::ResourceBusy) => {
            OpenError::InUse { port: port.to_owned(), user: "another program".to_owned() }
        }
        _ => OpenError::Failed { name: port.to_owned(), reason: text },
    }
}

fn present() -> String {
    let ports = super::interfaces().serial;
    if ports.is_empty() {
        return "is none".to_owned();
    }
    format!("are {}", ports.into_iter().map(|port| port.port).collect::<Vec<_>>().join(", "))
}
