//! CAN interfaces and serial ports of this machine, and how to make one where there is none.

mod advice;
mod serial;
#[cfg(target_os = "linux")]
mod sysfs;

use serde::Serialize;

use super::bus_health::BusState;
pub use advice::Advice;
pub use serial::SerialPort;
pub(super) use serial::{stable_name, why_no_port};
#[cfg(target_os = "linux")]
pub(super) use sysfs::{bit_rate, require_up, why_no_interface};

/// All there is to connect to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Interfaces {
    /// CAN interfaces by name; Linux alone has them.
    pub can: Vec<CanInterface>,
    /// Serial ports by name: SLCAN adapters and IMUs are among them.
    pub serial: Vec<SerialPort>,
    /// What makes an interface, for this system; those that help most come first.
    pub advice: Vec<Advice>,
}

/// A CAN interface.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CanInterface {
    /// Its name, such as `can0`.
    pub name: String,
    /// Whether it is switched on.
    pub up: bool,
    /// Whether there is no hardware behind it: vcan, or slcan of an older kernel.
    pub is_virtual: bool,
    /// State of its controller, if its driver tells.
    pub state: Option<BusState>,
    /// Bit rate, bit/s, if it has one.
    pub bit_rate: Option<u32>,
    /// Error counters of the controller, if its driver tells: sending.
    pub send_errors: Option<u16>,
    /// Receiving.
    pub receive_errors: Option<u16>,
    /// Frames received since it was made.
    pub received: u64,
    /// Frames sent.
    pub sent: u64,
    /// Frames with errors, both ways.
    pub errors: u64,
    /// Frames that the driver dropped, both ways.
    pub dropped: u64,
    /// What brings it up; `None` if it is.
    pub command: Option<String>,
}

/// Looks for all there is.
pub fn interfaces() -> Interfaces {
    #[cfg(target_os = "linux")]
    let can = sysfs::can_interfaces();
    #[cfg(not(target_os = "linux"))]
    let can = Vec::new();
    let serial = serial::serial_ports();
    let advice = advice::advice(&can, &serial);
    Interfaces { can, serial, advice }
}

/// A list in words: "is a", "are a and b", or "is none".
fn present(names: &[String]) -> String {
    match names {
        [] => "is none".to_owned(),
        [name] => format!("is {name}"),
        [first @ .., last] => format!("are {} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_read_as_words() {
        let names = ["can0", "can1", "vcan0"].map(str::to_owned);
        let words: Vec<_> = (0..=3).map(|count| present(&names[..count])).collect();
        assert_eq!(words, ["is none", "is can0", "are can0 and can1", "are can0, can1 and vcan0"]);
    }
}
