//! `flqr imu`: configures the IMU permanently.

use std::io::{self, IsTerminal};
use std::time::Duration;

use clap::Args;
use flqr_core::device::{Clock, ImuPort, SerialAddress, open_imu};
use flqr_core::link::jy901::{self, Content, Decoder, Kind, Reading};
use serde::Serialize;

use super::output::{Failure, Output, complain};

/// Shortest listening time.
const LISTEN: Duration = Duration::from_secs(2);
/// Longest silence, s: its slowest rate is 0.2 Hz.
const SILENT: Duration = Duration::from_secs(6);
/// Data received within this time may have been buffered in the port.
const OLD: Duration = Duration::from_millis(200);
/// Fraction of the rate that must be received afterwards.
const RATE_SHARE: f64 = 0.9;

/// Sets output rate, baud rate and content (acceleration, rate, angle) of a JY901 and saves them in the sensor.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port and current baud rate of the IMU, such as serial:/dev/ttyUSB0@9600
    port: SerialAddress,
    /// New output rate, Hz
    #[arg(long, value_name = "HZ")]
    rate: f64,
    /// New baud rate
    #[arg(long)]
    baud: u32,
    /// Write without confirmation
    #[arg(long)]
    yes: bool,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Report {
    before: Heard,
    after: Heard,
}

/// Data that an IMU sends.
#[derive(Clone, Serialize)]
struct Heard {
    baud: u32,
    /// Rate of the angles, Hz.
    rate_hz: f64,
    /// Types of packets.
    packets: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let &Arguments { ref port, rate, baud, yes } = arguments;
    // What the IMU has not is refused before anything is opened.
    jy901::configure(rate, baud, Content::BALANCE).map_err(Failure::from_error)?;
    let mut imu = open_imu(port).map_err(Failure::from_error)?;
    let before = listen(&mut imu, port.baud, LISTEN)?;
    complain(&format!("the IMU sends {}", before.text()));
    complain(&format!(
        "settings to write permanently: {rate} Hz of acceleration, rate and angle at {baud} baud"
    ));
    if !yes && !agreed()? {
        return Err(Failure::Message("nothing was written".to_owned()));
    }
    imu.configure(rate, baud, Content::BALANCE).map_err(Failure::from_error)?;
    let after = listen(&mut imu, baud, LISTEN.max(Duration::from_secs_f64(4.0 / rate)))?;
    if after.rate_hz < RATE_SHARE * rate {
        return Err(Failure::Message(format!(
            "the settings were written, but the IMU sends {}: power-cycle it, then try again",
            after.text()
        )));
    }
    let report = Report { before, after };
    output.result(&report, |out| {
        writeln!(out, "before: {}", report.before.text())?;
        writeln!(out, "now:    {}", report.after.text())
    })
}

fn agreed() -> Result<bool, Failure> {
    if !io::stdin().is_terminal() {
        let problem = "nothing was written, because there is no terminal for the confirmation: add --yes";
        return Err(Failure::Message(problem.to_owned()));
    }
    complain("write these settings? Type yes and press Enter");
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    Ok(answer.trim() == "yes")
}

/// Listens for a while, longer while nothing arrives.
fn listen(imu: &mut ImuPort, baud: u32, time: Duration) -> Result<Heard, Failure> {
    let clock = Clock::start();
    let mut decoder = Decoder::new();
    let mut kinds: Vec<Kind> = Vec::new();
    let mut angles: Vec<Duration> = Vec::new();
    while clock.now() < time || (kinds.is_empty() && clock.now() < SILENT) {
        let mut bytes = [0; 1024];
        let count = imu.read(&mut bytes).map_err(|error| {
            Failure::Message(format!("the port of the IMU is gone: {error}: reconnect it and try again"))
        })?;
        if clock.now() < OLD {
            continue;
        }
        decoder.push(clock.now(), &bytes[..count]);
        while let Some((time, packet)) = decoder.next() {
            if !kinds.contains(&packet.kind) {
                kinds.push(packet.kind);
            }
            if let Reading::Angle { .. } = packet.reading() {
                angles.push(time);
            }
        }
    }
    if kinds.is_empty() {
        return Err(Failure::Message(format!(
            "no data from the IMU at {baud} baud: check its cable and give its current baud rate \
             (factory setting 9600)"
        )));
    }
    kinds.sort_unstable();
    let packets = kinds.iter().map(|kind| format!("{kind:?}").to_lowercase()).collect();
    Ok(Heard { baud, rate_hz: rate_hz(&angles), packets })
}

/// Returns the mean rate between the first and the last reading, Hz.
fn rate_hz(times: &[Duration]) -> f64 {
    match times {
        [first, .., last] if last > first => (times.len() - 1) as f64 / (*last - *first).as_secs_f64(),
        _ => 0.0,
    }
}

impl Heard {
    fn text(&self) -> String {
        format!("{:.1} Hz of angles ({}) at {} baud", self.rate_hz, self.packets.join(", "), self.baud)
    }
}
