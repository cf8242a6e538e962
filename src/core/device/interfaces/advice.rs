//! The exact commands that make an interface.

use serde::Serialize;

use super::{CanInterface, SerialPort};

/// A way to an interface.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Advice {
    /// What for.
    pub purpose: String,
    /// Commands to be typed one after the other.
    pub commands: Vec<String>,
}

impl Advice {
    fn new(purpose: &str, commands: &[&str]) -> Self {
        Self {
            purpose: purpose.to_owned(),
            commands: commands.iter().map(|command| (*command).to_owned()).collect(),
        }
    }
}

/// What helps on the system that this was built for.
pub(super) fn advice(can: &[CanInterface], serial: &[SerialPort]) -> Vec<Advice> {
    let port = serial.iter().find(|port| port.is_usb).map_or(usual_port(), |port| port.port.as_str());
    let monitor = format!("flqr monitor slcan:{port}@1000000");
    let adapter = Advice::new("an SLCAN adapter on a serial port, without setup", &[&monitor]);
    let mut all: Vec<_> = can.iter().filter_map(bring_up).collect();
    if cfg!(target_os = "linux") {
        all.extend(linux(can, port));
    }
    all.push(adapter);
    all.push(Advice::new("the emulated robot, without hardware", &["flqr monitor emulated"]));
    all
}

fn bring_up(interface: &CanInterface) -> Option<Advice> {
    let command = interface.command.as_ref()?;
    Some(Advice::new(&format!("{} is down: bring it up", interface.name), &[command]))
}

fn linux(can: &[CanInterface], port: &str) -> Vec<Advice> {
    let mut all = Vec::new();
    if can.is_empty() {
        let up = "sudo ip link set can0 up type can bitrate 1000000 restart-ms 100";
        all.push(Advice::new(
            "a CAN adapter with a kernel driver (gs_usb, PEAK, Kvaser), after it is plugged in",
            &[up],
        ));
    }
    if !can.iter().any(|interface| interface.is_virtual) {
        let make =
            ["sudo modprobe vcan", "sudo ip link add dev vcan0 type vcan", "sudo ip link set vcan0 up"];
        all.push(Advice::new("a virtual CAN interface, for tests without hardware", &make));
    }
    let attach = format!("sudo slcand -o -c -s8 {port} slcan0");
    let as_interface = "an SLCAN adapter as a CAN interface, for several programs at once";
    all.push(Advice::new(as_interface, &[&attach, "sudo ip link set slcan0 up"]));
    all
}

fn usual_port() -> &'static str {
    if cfg!(windows) {
        "COM3"
    } else if cfg!(target_os = "macos") {
        "/dev/cu.usbmodem1"
    } else {
        "/dev/ttyACM0"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn where_nothing_is_there_every_way_is_told_with_its_commands() {
        let commands: Vec<_> = advice(&[], &[]).into_iter().flat_map(|advice| advice.commands).collect();
        for command in [
            "sudo ip link set can0 up type can bitrate 1000000 restart-ms 100",
            "sudo ip link add dev vcan0 type vcan",
            "sudo slcand -o -c -s8 /dev/ttyACM0 slcan0",
            "flqr monitor slcan:/dev/ttyACM0@1000000",
        ] {
            assert!(commands.iter().any(|told| told == command), "{command} is not in {commands:?}");
        }
    }
}
