//! `flqr imu`: sets the IMU up for balancing, for good.

use std::io::{self, IsTerminal};
use std::time::Duration;

use clap::Args;
use flqr_core::device::{Clock, ImuPort, SerialAddress, open_imu};
use flqr_core::link::jy901::{self, Content, Decoder, Kind, Reading};
use serde::Serialize;

use super::output::{Failure, Output, complain};

/// How long the IMU is listened to at least.
const LISTEN: Duration = Duration::from_secs(2);
/// How long it may be silent, s: its slowest rate is 0.2 Hz.
const SILENT: Duration = Duration::from_secs(6);
/// What comes within this time may have been sent before, and waited in the port.
const OLD: Duration = Duration::from_millis(200);
/// Share of the rate that has to be heard afterwards.
const RATE_SHARE: f64 = 0.9;

/// Sets rate, baud rate and content (acceleration, rate and angle) of a JY901, and saves them in it.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port with the baud rate that the IMU has now, as in serial:/dev/ttyUSB0@9600
    port: SerialAddress,
    /// Readings a second that it is to send
    #[arg(long, value_name = "HZ")]
    rate: f64,
    /// Baud rate that it is to have
    #[arg(long)]
    baud: u32,
    /// Do not ask before writing
    #[arg(long)]
    yes: bool,
}

/// Keys of the JSON object.
#[derive(Serialize)]
struct Report {
    before: Heard,
    after: Heard,
}

/// What an IMU sends.
#[derive(Clone, Serialize)]
struct Heard {
    baud: u32,
    /// Angles a second.
    rate_hz: f64,
    /// Kinds of packets.
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
        "to be written, for good: {rate} readings a second of acceleration, rate and angle, {baud} baud"
    ));
    if !yes && !agreed()? {
        return Err(Failure::Message("nothing was written".to_owned()));
    }
    imu.configure(rate, baud, Content::BALANCE).map_err(Failure::from_error)?;
    let after = listen(&mut imu, baud, LISTEN.max(Duration::from_secs_f64(4.0 / rate)))?;
    if after.rate_hz < RATE_SHARE * rate {
        return Err(Failure::Message(format!(
            "the settings were written, but the IMU sends {}: switch it off and on, then try again",
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
        let problem = "nothing was written, because there is no terminal to ask on: give --yes";
        return Err(Failure::Message(problem.to_owned()));
    }
    complain("write this? Type yes and Enter");
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    Ok(answer.trim() == "yes")
}

/// Listens for a while, longer where nothing comes.
fn listen(imu: &mut ImuPort, baud: u32, time: Duration) -> Result<Heard, Failure> {
    let clock = Clock::start();
    let mut decoder = Decoder::new();
    let mut kinds: Vec<Kind> = Vec::new();
    let mut angles: Vec<Duration> = Vec::new();
    while clock.now() < time || (kinds.is_empty() && clock.now() < SILENT) {
        let mut bytes = [0; 1024];
        let count = imu.read(&mut bytes).map_err(|error| {
            Failure::Message(format!("the IMU's port is lost: {error}: plug it in and try again"))
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
            "nothing is heard from the IMU at {baud} baud: look at its cable, and give the baud rate that it has now \
             (9600 as delivered)"
        )));
    }
    kinds.sort_unstable();
    let packets = kinds.iter().map(|kind| format!("{kind:?}").to_lowercase()).collect();
    Ok(Heard { baud, rate_hz: rate_hz(&angles), packets })
}

/// Readings a second between the first one and the last one.
fn rate_hz(times: &[Duration]) -> f64 {
    match times {
        [first, .., last] if last > first => (times.len() - 1) as f64 / (*last - *first).as_secs_f64(),
        _ => 0.0,
    }
}

impl Heard {
    fn text(&self) -> String {
        format!("{:.1} angles a second ({}) at {} baud", self.rate_hz, self.packets.join(", "), self.baud)
    }
}
