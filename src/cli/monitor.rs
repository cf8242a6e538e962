//! `flqr monitor`: monitors a robot without sending any frame.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use flqr_core::device::{Connection, Described, SerialAddress, Session, SessionMode, SessionOptions, Source};
use flqr_core::link::dbc::Choice;
use flqr_core::model_file::presets;

use super::input;
use super::interrupt::{Duty, Interrupt};
use super::output::{Failure, Output};
use super::robot_lines::{End, Lines, Outcome, died};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Source: can:INTERFACE, slcan:PORT@BITRATE, emulated, replay:FILE
    source: Source,
    #[command(flatten)]
    wire: Wire,
    /// Model file of the robot, for its [link] settings [default: the paper's robot]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// DBC file that describes the frames of a robot without LK motors; with --signal
    #[arg(long, value_name = "FILE", requires = "signal")]
    dbc: Option<PathBuf>,
    /// Column of the robot log (unit optional) for a signal of the DBC file, such as pitch=Imu.Pitch or
    /// torque_left=CurrentLeft*0.32; repeatable
    #[arg(long, value_name = "COLUMN=[MESSAGE.]SIGNAL[*FACTOR]", requires = "dbc")]
    signal: Vec<Choice>,
    /// Duration, s [default: until Ctrl+C or the end of the recording]
    #[arg(long, value_parser = input::seconds)]
    seconds: Option<f64>,
    /// Replay speed factor; 0 is as fast as possible
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Random seed of an emulated robot's noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Arguments {
    fn described(&self) -> Option<Described> {
        self.dbc.clone().map(|file| Described { file, signals: self.signal.clone() })
    }
}

/// Options common to `monitor` and `drive`.
#[derive(Args)]
pub(super) struct Wire {
    /// Serial port of the IMU, such as serial:/dev/ttyUSB0@115200
    #[arg(long, value_name = "serial:DEV@BAUD")]
    pub(super) imu: Option<SerialAddress>,
    /// Record the robot log to this file and the raw frames to a file of the same name ending in .log
    #[arg(long, value_name = "OUT.csv")]
    pub(super) record: Option<PathBuf>,
}

fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(0.0) => Ok(f64::INFINITY),
        Ok(speed) if (0.01..=1000.0).contains(&speed) => Ok(speed),
        _ => Err("it must be a number from 0.01 to 1000, or 0".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments, output: &Output) -> Result<(), Failure> {
    let robot = match &arguments.model {
        Some(path) => input::load_robot(path)?.1,
        None => presets::paper().robot().cloned().expect("the preset of the paper describes a robot"),
    };
    let options = SessionOptions {
        source: arguments.source.clone(),
        imu: arguments.wire.imu.clone(),
        dbc: arguments.described(),
        robot,
        mode: SessionMode::Listen,
        record: arguments.wire.record.clone(),
        seed: arguments.seed,
        replay_speed: arguments.speed,
    };
    let interrupt = Interrupt::watch(Duty::Monitor)?;
    // A recording can wait for whoever reads its lines, a robot cannot.
    let is_replay = matches!(options.source, Source::Replay { .. });
    let mut session = Session::open(options, Arc::new(|| {})).map_err(Failure::from_error)?;
    let mut lines = if is_replay { Lines::patient(output, &interrupt)? } else { Lines::start(output)? };
    let mut time = Duration::ZERO;
    let end = arguments.seconds.map_or(Duration::MAX, Duration::from_secs_f64);
    let reason = loop {
        if interrupt.came() {
            break Some(End::Interrupt);
        }
        if time >= end {
            break Some(End::Time);
        }
        // Asked before, so that the last updates of a thread that has ended are read.
        let is_over = session.has_died();
        let Some(update) = session.wait(Duration::from_millis(100)) else {
            if is_over {
                break None;
            }
            continue;
        };
        time = update.status.time;
        lines.update(&update)?;
        if update.status.connection == Connection::Ended {
            break Some(End::Recording);
        }
    };
    let recording = session.close().and_then(|ending| ending.recording);
    let problem = match reason {
        None => Some(died()),
        Some(_) => recording.as_ref().and_then(|recording| recording.problem.clone()),
    };
    let signal = interrupt.signal();
    let outcome = Outcome { problem: problem.clone(), signal, motors_off: None, recording };
    lines.end(time, reason.as_ref(), outcome)?;
    lines.finish(&interrupt)?;
    problem.map_or(Ok(()), |problem| Err(Failure::Message(problem)))
}
