//! Serial ports.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::Serialize;
use serialport::SerialPortType;

use super::present;
use crate::device::open_error::OpenError;

/// A serial port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SerialPort {
    /// What it is opened by, such as `/dev/ttyACM0` or `COM3`.
    pub port: String,
    /// A name that stays the same when it is plugged in elsewhere (Linux, `/dev/serial/by-id`).
    pub stable_name: Option<String>,
    /// Maker and product of a USB adapter.
    pub description: Option<String>,
    /// Serial number of a USB adapter.
    pub serial_number: Option<String>,
    /// Driver in the kernel (Linux).
    pub driver: Option<String>,
    /// Whether it hangs on USB: adapters do.
    pub is_usb: bool,
}

impl SerialPort {
    fn new(port: String) -> Self {
        let stable_name = stable_name(&port);
        Self { port, stable_name, description: None, serial_number: None, driver: None, is_usb: false }
    }
}

/// What the library finds, and on Linux what the kernel has besides; ports without hardware are left out.
pub(super) fn serial_ports() -> Vec<SerialPort> {
    let listed = serialport::available_ports().unwrap_or_default();
    let mut ports: BTreeMap<String, SerialPort> = listed
        .into_iter()
        .map(|found| (found.port_name.clone(), described(found.port_name, found.port_type)))
        .collect();
    if cfg!(target_os = "linux") {
        for (name, driver) in with_drivers(Path::new("/sys/class/tty")) {
            let port = ports.entry(format!("/dev/{name}"));
            let port = port.or_insert_with_key(|path| SerialPort::new(path.clone()));
            port.is_usb |= name.starts_with("ttyUSB") || name.starts_with("ttyACM");
            port.driver = Some(driver);
        }
    }
    // USB adapters first: a robot's adapter and IMU are among them.
    let mut ports: Vec<_> = ports.into_values().collect();
    ports.sort_by_key(|port| !port.is_usb);
    ports
}

/// Why no port of that name could be opened.
pub(in crate::device) fn why_no_port(port: &str) -> OpenError {
    let names: Vec<_> = serial_ports().into_iter().map(|port| port.port).collect();
    OpenError::NoPort { port: port.to_owned(), present: present(&names) }
}

/// The name of a port that stays the same wherever it is plugged in.
pub(in crate::device) fn stable_name(port: &str) -> Option<String> {
    let target = fs::canonicalize(port).ok()?;
    let links = fs::read_dir("/dev/serial/by-id").ok()?.flatten().map(|entry| entry.path());
    let link = links.filter(|link| fs::canonicalize(link).is_ok_and(|path| path == target)).min()?;
    link.into_os_string().into_string().ok()
}

fn described(port: String, port_type: SerialPortType) -> SerialPort {
    let mut described = SerialPort::new(port);
    if let SerialPortType::UsbPort(usb) = port_type {
        described.is_usb = true;
        let words: Vec<_> = [usb.manufacturer, usb.product].into_iter().flatten().collect();
        described.description = (!words.is_empty()).then(|| words.join(" "));
        described.serial_number = usb.serial_number;
    }
    described
}

/// Terminals of the kernel that have a device with a driver; a UART without hardware behind it has type 0.
fn with_drivers(tty: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(tty).into_iter().flatten().flatten();
    let driver = |folder: &Path| {
        let driver = fs::read_link(folder.join("device/driver")).ok()?;
        let no_hardware = fs::read_to_string(folder.join("type")).is_ok_and(|kind| kind.trim() == "0");
        (!no_hardware).then(|| driver.file_name().map(|name| name.to_string_lossy().into_owned()))?
    };
    let mut found: Vec<_> = entries
        .filter_map(|entry| Some((entry.file_name().into_string().ok()?, driver(&entry.path())?)))
        .collect();
    found.sort();
    found
}
