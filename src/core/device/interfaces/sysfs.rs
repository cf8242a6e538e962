//! CAN interfaces as the kernel shows them: `/sys/class/net`, and netlink for what a controller says of itself.

use std::fs;
use std::path::Path;

use socketcan::nl::CanState;
use socketcan::{CanSocket, Socket};

use super::{BusState, CanInterface, present};
use crate::device::open_error::OpenError;

const NET: &str = "/sys/class/net";

/// `ARPHRD_CAN`.
const CAN_TYPE: u64 = 280;

pub(super) fn can_interfaces() -> Vec<CanInterface> {
    let mut all = in_folder(Path::new(NET));
    all.iter_mut().for_each(ask_controller);
    all
}

/// Refuses an interface that is down.
pub(in crate::device) fn require_up(name: &str) -> Result<(), OpenError> {
    match one(Path::new(NET), name).and_then(|interface| interface.command) {
        Some(command) => Err(OpenError::Down { interface: name.to_owned(), command }),
        None => Ok(()),
    }
}

/// Bit rate of an interface, bit/s; none of a virtual one.
pub(in crate::device) fn bit_rate(name: &str) -> Option<u32> {
    let mut interface = one(Path::new(NET), name)?;
    ask_controller(&mut interface);
    interface.bit_rate
}

/// Why no CAN interface of that name could be opened.
pub(in crate::device) fn why_no_interface(name: &str) -> OpenError {
    let interface = name.to_owned();
    // Bound to all interfaces: only a kernel without CAN refuses that.
    let all_interfaces = 0;
    if CanSocket::open_iface(all_interfaces).is_err() {
        return OpenError::NoCan { interface };
    }
    let names: Vec<_> = in_folder(Path::new(NET)).into_iter().map(|interface| interface.name).collect();
    let present = present(&names);
    if Path::new(NET).join(name).exists() {
        return OpenError::NotCan { interface, present };
    }
    OpenError::NoInterface { interface, present }
}

fn in_folder(net: &Path) -> Vec<CanInterface> {
    let entries = fs::read_dir(net).into_iter().flatten().flatten();
    let mut names: Vec<_> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names.iter().filter_map(|name| one(net, name)).collect()
}

fn one(net: &Path, name: &str) -> Option<CanInterface> {
    const UP: u64 = 1;
    let folder = net.join(name);
    if number(&folder.join("type"))? != CAN_TYPE {
        return None;
    }
    let up = number(&folder.join("flags"))? & UP != 0;
    let is_virtual =
        fs::read_link(&folder).is_ok_and(|target| target.to_string_lossy().contains("/virtual/"));
    let count = |file: &str| number(&folder.join("statistics").join(file)).unwrap_or_default();
    Some(CanInterface {
        name: name.to_owned(),
        up,
        is_virtual,
        state: None,
        bit_rate: None,
        send_errors: None,
        receive_errors: None,
        received: count("rx_packets"),
        sent: count("tx_packets"),
        errors: count("rx_errors") + count("tx_errors"),
        dropped: count("rx_dropped") + count("tx_dropped"),
        command: (!up).then(|| up_command(name, is_virtual)),
    })
}

/// What only netlink tells; a virtual interface has no controller and says nothing.
fn ask_controller(interface: &mut CanInterface) {
    let details = socketcan::CanInterface::open(&interface.name).and_then(|netlink| netlink.details());
    let Ok(details) = details else { return };
    interface.bit_rate = details.can.bit_timing.map(|timing| timing.bitrate).filter(|rate| *rate > 0);
    interface.state = details.can.state.and_then(state);
    interface.send_errors = details.can.berr_counter.map(|counters| counters.txerr);
    interface.receive_errors = details.can.berr_counter.map(|counters| counters.rxerr);
}

fn state(state: CanState) -> Option<BusState> {
    match state {
        CanState::ErrorActive => Some(BusState::ErrorActive),
        CanState::ErrorWarning => Some(BusState::ErrorWarning),
        CanState::ErrorPassive => Some(BusState::ErrorPassive),
        CanState::BusOff => Some(BusState::BusOff),
        CanState::Stopped | CanState::Sleeping => None,
    }
}

fn up_command(name: &str, is_virtual: bool) -> String {
    let bit_rate = if is_virtual { "" } else { " type can bitrate 1000000 restart-ms 100" };
    format!("sudo ip link set {name} up{bit_rate}")
}

/// A number in a file, decimal or hexadecimal with 0x.
fn number(file: &Path) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    match text.trim().strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.trim().parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::{env, process};

    use super::*;

    /// A folder that looks like the kernel's.
    struct Net(PathBuf);

    impl Net {
        fn new() -> Self {
            let folder = env::temp_dir().join(format!("flqr-sysfs-{}", process::id()));
            fs::create_dir_all(&folder).unwrap();
            Self(folder)
        }

        fn interface(&self, name: &str, files: &[(&str, &str)]) {
            let folder = self.0.join(name);
            fs::create_dir_all(folder.join("statistics")).unwrap();
            files.iter().for_each(|(file, text)| fs::write(folder.join(file), format!("{text}\n")).unwrap());
        }
    }

    impl Drop for Net {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).unwrap();
        }
    }

    #[test]
    fn interfaces_of_type_can_are_listed_with_counts_and_what_brings_them_up() {
        let net = Net::new();
        net.interface("eth0", &[("type", "1"), ("flags", "0x1003")]);
        let counts =
            [("statistics/rx_packets", "12"), ("statistics/rx_errors", "3"), ("statistics/tx_errors", "4")];
        net.interface("can1", &[&[("type", "280"), ("flags", "0x400c1")], &counts[..]].concat());
        net.interface("can0", &[("type", "280"), ("flags", "0x40080")]);
        let found = in_folder(&net.0);
        assert_eq!(found.iter().map(|can| can.name.as_str()).collect::<Vec<_>>(), ["can0", "can1"]);
        let command = "sudo ip link set can0 up type can bitrate 1000000 restart-ms 100";
        assert_eq!((found[0].up, found[0].command.as_deref()), (false, Some(command)));
        assert_eq!((found[1].up, found[1].command.as_deref()), (true, None));
        assert_eq!((found[1].received, found[1].sent, found[1].errors), (12, 0, 7));
    }
}
