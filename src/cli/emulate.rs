//! `flqr emulate`: a simulated robot that speaks the real robot's protocols.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use flqr_core::emulator::{EmulatorSettings, TimedFault};
use flqr_core::link::protocol::protocol;
use flqr_core::model::LinkSettings;
use flqr_core::model_file::presets;
use serde_json::Value;

use super::output::{Failure, Output};
use super::{controller, input};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Model file (TOML) of the robot [default: the paper's robot]
    model: Option<PathBuf>,
    #[command(flatten)]
    ports: Ports,
    /// Random seed of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Let the robot balance with its on-board controller (FLQR of its model), whose frames are on the bus, for
    /// listening
    #[arg(long, conflicts_with = "wheels_in_air")]
    balancing: bool,
    /// Hold the wheels off the ground on a stand
    #[arg(long)]
    wheels_in_air: bool,
    /// Base identifier of the motors' replies, 0x140 or 0x180 (+ motor number) with the LK protocol, whose
    /// documentation disagrees [default: 0x140]
    #[arg(long, value_name = "ID")]
    reply_id: Option<String>,
    /// Wiring that differs from the model's [link] table, such as current_steps_per_a=62.5
    /// or pitch_direction=backward; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    actual: Vec<Override>,
    /// Fault and its time, such as left-vanishes@10: {left|right}-vanishes, -returns, -errors=BITS,
    /// -temperature=C, -encoder-frozen, -encoder-returns, -torque-reversed, -commanded=BYTE, or voltage=V, imu-silent,
    /// imu-frozen, imu-angle-frozen, imu-rate-zero, imu-angle-off=RAD, imu-returns, torques-swapped, held, released,
    /// bus-off, bus-on, push=N; repeatable
    #[arg(long, value_name = "FAULT@SECONDS")]
    fault: Vec<TimedFault>,
    /// Background frames per second from other devices; the first four bytes of each are its number
    #[arg(long, value_name = "HZ", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=100_000))]
    flood: u32,
    /// Running time, s [default: until it is stopped, or until standard input closes if it is a pipe]
    #[arg(long, value_parser = input::seconds)]
    seconds: Option<f64>,
}

/// Ports of the robot. Default: --slcan --imu.
#[derive(Args)]
struct Ports {
    /// Motors on this CAN interface
    #[arg(long, value_name = "INTERFACE")]
    can: Option<String>,
    /// Motors on an SLCAN adapter on a pseudo-terminal
    #[arg(long)]
    slcan: bool,
    /// IMU on a pseudo-terminal
    #[arg(long)]
    imu: bool,
}

/// One key of `[link]` and its value.
#[derive(Clone)]
struct Override {
    key: String,
    value: Value,
}

impl FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("it must be KEY=VALUE, as in imu_rate_hz=100")?;
        let value = value.parse().unwrap_or_else(|_| Value::String(value.to_owned()));
        Ok(Self { key: key.to_owned(), value })
    }
}

/// Base identifier of the replies, one of those of the protocol.
fn reply_base(wiring: &LinkSettings, text: &str) -> Result<u16, Failure> {
    let bases = protocol(wiring.protocol).reply_bases;
    let number = text.strip_prefix("0x").and_then(|digits| u16::from_str_radix(digits, 16).ok());
    number.filter(|number| bases.contains(number)).ok_or_else(|| {
        let allowed = bases.iter().map(|base| format!("0x{base:X}")).collect::<Vec<_>>().join(" or ");
        let text = format!("--reply-id {text}: it must be {allowed}\n");
        Failure::Usage(clap::Error::raw(clap::error::ErrorKind::InvalidValue, text))
    })
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let (name, robot) = match &arguments.model {
        Some(path) => input::load_robot(path)?,
        None => {
            let model = presets::paper();
            let robot = model.robot().expect("the preset of the paper describes a robot").clone();
            (model.name, robot)
        }
    };
    let on_board = arguments.balancing.then(|| {
        controller::design(&robot, None).map_err(|problem| {
            Failure::Message(format!("--balancing needs a controller for {name}: {problem}"))
        })
    });
    let actual = actual(&robot.link, &arguments.actual)?;
    let wiring = actual.unwrap_or(robot.link);
    let reply_base = arguments.reply_id.as_ref().map(|text| reply_base(&wiring, text)).transpose()?;
    let settings = EmulatorSettings {
        seed: arguments.seed,
        wheels_in_air: arguments.wheels_in_air,
        on_board: on_board.transpose()?,
        actual,
        reply_base,
        flood_hz: arguments.flood,
        faults: arguments.fault.clone(),
    };
    serve::run(arguments, &name, &robot, settings, output)
}

/// Wiring with the differences from the model's; `None` without any.
fn actual(declared: &LinkSettings, overrides: &[Override]) -> Result<Option<LinkSettings>, Failure> {
    if overrides.is_empty() {
        return Ok(None);
    }
    let refused = |error: serde_json::Error| Failure::Message(format!("--actual: {error}"));
    let mut wiring = serde_json::to_value(declared).map_err(refused)?;
    for Override { key, value } in overrides {
        wiring[key] = value.clone();
    }
    serde_json::from_value(wiring).map(Some).map_err(refused)
}

#[cfg(unix)]
mod serve {
    use std::fs::File;
    use std::io::{self, Read, Write};
    use std::os::fd::AsFd;
    use std::os::unix::fs::FileTypeExt;
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use flqr_core::device::{EmulatorPorts, EmulatorServer};
    use flqr_core::emulator::{Emulator, EmulatorSettings};
    use flqr_core::model::RobotModel;
    use serde::Serialize;

    use super::Arguments;
    use crate::cli::output::{Failure, Output, complain};

    /// Keys of the JSON object; missing ports are left out.
    #[derive(Serialize)]
    struct Opened<'a> {
        #[serde(skip_serializing_if = "Option::is_none")]
        can: Option<&'a str>,
        #[serde(skip_serializing_if = "Option::is_none")]
        slcan: Option<&'a str>,
        #[serde(skip_serializing_if = "Option::is_none")]
        imu: Option<&'a str>,
        robot: &'a str,
        seed: u64,
    }

    pub(super) fn run(
        arguments: &Arguments,
        name: &str,
        robot: &RobotModel,
        settings: EmulatorSettings,
        output: &Output,
    ) -> Result<(), Failure> {
        let mut emulator = Emulator::new(robot, settings).map_err(Failure::from_error)?;
        let given = &arguments.ports;
        let none = given.can.is_none() && !given.slcan && !given.imu;
        let ports =
            EmulatorPorts { can: given.can.clone(), slcan: given.slcan || none, imu: given.imu || none };
        let mut server = EmulatorServer::open(&ports).map_err(Failure::from_error)?;
        let opened = Opened {
            can: given.can.as_deref(),
            slcan: server.slcan_port(),
            imu: server.imu_port(),
            robot: name,
            seed: arguments.seed,
        };
        output.result(&opened, |out| print(out, &opened, arguments))?;
        let input_ended = watch_input();
        let counts = server.run(&mut emulator, &mut |now| {
            arguments.seconds.is_some_and(|seconds| now.as_secs_f64() >= seconds)
                || input_ended.load(Ordering::Relaxed)
        });
        complain(&format!(
            "{} frames sent by the robot, {} not read by the SLCAN client, {} rejected by the CAN interface",
            counts.frames, counts.slcan_dropped, counts.can_refused
        ));
        Ok(())
    }

    fn print(out: &mut dyn Write, opened: &Opened, arguments: &Arguments) -> io::Result<()> {
        writeln!(out, "{}, seed {}", opened.robot, opened.seed)?;
        for (what, port) in [("CAN", opened.can), ("SLCAN", opened.slcan), ("IMU", opened.imu)] {
            port.map_or(Ok(()), |port| writeln!(out, "  {what:6}{port}"))?;
        }
        let motors = opened.can.map(|name| format!("can:{name}"));
        let motors = motors.or(opened.slcan.map(|port| format!("slcan:{port}")));
        let imu = opened.imu.map_or(String::new(), |port| format!(" --imu serial:{port}@115200"));
        let Some(motors) = motors else { return Ok(()) };
        // Motors answer only when they are asked, which a monitor does not do.
        let command = if arguments.balancing {
            format!("monitor {motors}")
        } else {
            let model = arguments.model.as_deref().unwrap_or(Path::new("presets/paper.toml"));
            format!("drive {motors} {}", model.display())
        };
        writeln!(out, "\nrun in another terminal: flqr {command}{imu}")
    }

    /// Signals the closing of standard input. Only a pipe is watched: a terminal ends its
    /// programs itself, and a file or /dev/null has no other end.
    fn watch_input() -> Arc<AtomicBool> {
        let ended = Arc::new(AtomicBool::new(false));
        let pipe = io::stdin().as_fd().try_clone_to_owned().map(File::from);
        let pipe = pipe.ok().filter(|file| {
            file.metadata().is_ok_and(|data| data.file_type().is_fifo() || data.file_type().is_socket())
        });
        if let Some(mut pipe) = pipe {
            let told = Arc::clone(&ended);
            let watch = move || {
                let mut bytes = [0; 256];
                while pipe.read(&mut bytes).is_ok_and(|count| count > 0) {}
                told.store(true, Ordering::Relaxed);
            };
            // Without the thread, the emulator runs until it is ended.
            if let Err(error) = thread::Builder::new().name("stdin".to_owned()).spawn(watch) {
                complain(&format!("warning: cannot watch standard input for its end: {error}"));
            }
        }
        ended
    }
}

#[cfg(not(unix))]
mod serve {
    use flqr_core::emulator::EmulatorSettings;
    use flqr_core::model::RobotModel;

    use super::Arguments;
    use crate::cli::output::{Failure, Output};

    pub(super) fn run(
        _: &Arguments,
        _: &str,
        _: &RobotModel,
        _: EmulatorSettings,
        _: &Output,
    ) -> Result<(), Failure> {
        let missing = "this system has neither pseudo-terminals nor SocketCAN: run `flqr emulate` on Linux \
                       or macOS, or use the source `emulated` in monitor, drive or the window";
        Err(Failure::Message(missing.to_owned()))
    }
}
