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
    /// DBC file that describes the frames of motors with another protocol than the model's; with --signal
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
    let watched = watch(&mut session, &mut lines, &mut time, |time| match () {
        () if interrupt.came() => Some(End::Interrupt),
        () if time >= end => Some(End::Time),
        () => None,
    });
    let recording = session.close().and_then(|ending| ending.recording);
    let mut problem = recording.as_ref().and_then(|recording| recording.problem.clone());
    let reason = match watched {
        Ok(reason) => Some(reason),
        Err(Failure::ReaderGone) => {
            let cut = recording.map(|recording| {
                let file = recording.file.display();
                format!(
                    "{file}: standard output was closed, which ended the recording at {:.1} s",
                    time.as_secs_f64()
                )
            });
            return Err(problem.or(cut).map_or(Failure::ReaderGone, Failure::Message));
        }
        Err(Failure::Defect(defect)) => {
            problem = Some(defect);
            None
        }
        Err(failure) => return Err(failure),
    };
    let outcome =
        Outcome { problem: problem.clone(), signal: interrupt.signal(), motors_off: None, recording };
    let printed = lines.end(time, reason.as_ref(), outcome).and_then(|()| lines.finish(&interrupt));
    match problem {
        None => printed,
        Some(defect) if reason.is_none() => Err(Failure::Defect(defect)),
        Some(problem) => Err(Failure::Message(problem)),
    }
}

/// Prints updates until `end` gives a reason to end, or the recording that is replayed does.
fn watch(
    session: &mut Session,
    lines: &mut Lines<'_>,
    time: &mut Duration,
    end: impl Fn(Duration) -> Option<End>,
) -> Result<End, Failure> {
    loop {
        if let Some(end) = end(*time) {
            return Ok(end);
        }
        // Asked before, so that the last updates of a thread that has ended are read.
        let is_over = session.has_died();
        match session.wait(Duration::from_millis(100)) {
            Some(update) => {
                *time = update.status.time;
                lines.update(&update)?;
                if update.status.connection == Connection::Ended {
                    return Ok(End::Recording);
                }
            }
            None if is_over => return Err(died()),
            None => {}
        }
    }
}
