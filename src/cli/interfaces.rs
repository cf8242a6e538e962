//! `flqr interfaces`: lists CAN interfaces and serial ports.

use std::io::{self, Write};

use flqr_core::device::{self, CanInterface, Interfaces, SerialPort};

use super::output::{Failure, Output};

pub(crate) fn run(output: &Output) -> Result<(), Failure> {
    let found = device::interfaces();
    output.result(&found, |out| print(out, &found))
}

fn print(out: &mut dyn Write, found: &Interfaces) -> io::Result<()> {
    writeln!(out, "CAN interfaces{}", if found.can.is_empty() { ": none" } else { "" })?;
    for interface in &found.can {
        writeln!(out, "  {}", can_line(interface))?;
    }
    writeln!(out, "\nserial ports{}", if found.serial.is_empty() { ": none" } else { "" })?;
    for port in &found.serial {
        writeln!(out, "  {}", serial_line(port))?;
    }
    writeln!(out, "\nto set up a connection")?;
    for advice in &found.advice {
        writeln!(out, "  {}", advice.purpose)?;
        for command in &advice.commands {
            writeln!(out, "    {command}")?;
        }
    }
    Ok(())
}

fn can_line(interface: &CanInterface) -> String {
    let mut words =
        vec![format!("{:10}", interface.name), if interface.up { "up" } else { "down" }.to_owned()];
    words.extend(interface.is_virtual.then(|| "virtual".to_owned()));
    words.extend(interface.state.map(|state| state.to_string()));
    words.extend(interface.bit_rate.map(|rate| format!("{rate} bit/s")));
    if let (Some(send), Some(receive)) = (interface.send_errors, interface.receive_errors) {
        words.push(format!("error counters: transmit {send}, receive {receive}"));
    }
    let CanInterface { received, sent, errors, dropped, .. } = interface;
    words.push(format!("{received} received, {sent} sent, {errors} errors, {dropped} dropped"));
    words.join("  ")
}

fn serial_line(port: &SerialPort) -> String {
    let mut words = vec![format!("{:14}", port.port)];
    words.extend(port.description.clone());
    words.extend(port.driver.as_ref().map(|driver| format!("driver {driver}")));
    words.extend(port.stable_name.clone());
    words.join("  ")
}
