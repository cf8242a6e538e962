//! Output of `monitor` and `drive`: one JSON object per line, or periodic lines of text.

use std::io::{self, Write};
use std::time::Duration;

use flqr_core::control::drive::{Check, CheckResult, StopReason};
use flqr_core::device::{
    Connection, Counters, ImuStatus, MotorStatus, RecordingStatus, Status, Timing, Update,
};
use flqr_core::record::Sample;
use serde::Serialize;

use super::interrupt::Interrupt;
use super::output::{Failure, Output};
use super::printer::Printer;

/// Time between two lines of JSON.
const JSON_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two lines of text.
const TEXT_INTERVAL: Duration = Duration::from_secs(1);

/// A session thread that has ended unexpectedly.
pub(super) fn died() -> Failure {
    let text = "the session thread has ended unexpectedly, an internal error: make sure that the motors are off, and report it";
    Failure::Defect(text.to_owned())
}

/// Prints updates.
pub(super) struct Lines<'a> {
    output: &'a Output,
    next: Duration,
    newest: Option<Sample>,
    checks: Vec<Check>,
    printer: Printer,
    /// If given, waits for a slow reader until this interrupt instead of dropping lines.
    patience: Option<Interrupt>,
}

/// Reason for the end.
pub(super) enum End {
    /// The robot was stopped.
    Stopped(StopReason),
    /// End of the recording.
    Recording,
    /// The requested time has passed.
    Time,
    /// Interrupted before the robot was driven.
    Interrupt,
    /// The checks have passed and arming was not requested.
    Checked,
}

impl End {
    fn text(&self) -> String {
        match self {
            Self::Stopped(reason) => reason.to_string(),
            Self::Recording => "end of recording".to_owned(),
            Self::Time => "time elapsed".to_owned(),
            Self::Interrupt => "interrupted".to_owned(),
            Self::Checked => "the checks have passed; add --arm to drive the robot".to_owned(),
        }
    }
}

/// A line of JSON.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Line<'a> {
    Status(Box<StatusLine>),
    Event {
        time_s: f64,
        kind: &'static str,
        text: &'a str,
    },
    Check {
        name: &'a str,
        result: &'static str,
        text: &'a str,
    },
    End {
        time_s: f64,
        stopped_by: Option<&'static str>,
        text: String,
        #[serde(flatten)]
        outcome: OutcomeLine,
        /// Number of dropped status lines.
        lines_dropped: u64,
    },
}

/// Outcome of a run besides the reason for its end.
#[derive(Default)]
pub(super) struct Outcome {
    /// Problem, if any.
    pub(super) problem: Option<String>,
    /// Signal that requested termination.
    pub(super) signal: Option<&'static str>,
    /// Confirmation that the motors are off, of a run that may drive.
    pub(super) motors_off: Option<bool>,
    /// Complete recording.
    pub(super) recording: Option<RecordingStatus>,
}

#[derive(Serialize)]
struct OutcomeLine {
    problem: Option<String>,
    signal: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    motors_off: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    recording: Option<RecordingLine>,
}

#[derive(Serialize)]
struct StatusLine {
    time_s: f64,
    connection: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    hint: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stage: Option<&'static str>,
    state: Option<StateLine>,
    motors: MotorLines,
    imu: ImuLine,
    bus: BusLine,
    #[serde(rename = "loop")]
    timing: TimingLine,
    #[serde(skip_serializing_if = "Option::is_none")]
    recording: Option<RecordingLine>,
}

#[derive(Serialize)]
struct StateLine {
    x_m: f64,
    x_dot_m_s: f64,
    pitch_rad: f64,
    pitch_rate_rad_s: f64,
    torque_left_nm: f64,
    torque_right_nm: f64,
}

#[derive(Serialize)]
struct MotorLines {
    left: MotorLine,
    right: MotorLine,
}

#[derive(Serialize)]
struct MotorLine {
    rate_hz: f64,
    age_s: Option<f64>,
    missed: u64,
    temperature_c: Option<f64>,
    current_a: Option<f64>,
    voltage_v: Option<f64>,
    round_trip_s: Option<f64>,
    errors: Vec<&'static str>,
}

#[derive(Serialize)]
struct ImuLine {
    rate_hz: f64,
    age_s: Option<f64>,
    packets: u64,
    corrupted: u64,
    stray_bytes: u64,
    temperature_c: Option<f64>,
}

#[derive(Serialize)]
struct BusLine {
    received: u64,
    sent: u64,
    received_hz: f64,
    load: Option<f64>,
    dropped: u64,
    lost: u64,
    errors: u64,
    late: u64,
    reconnects: u64,
}

#[derive(Serialize)]
struct TimingLine {
    ticks: u64,
    skipped: u64,
    p50_s: f64,
    p99_s: f64,
    max_s: f64,
}

#[derive(Serialize)]
struct RecordingLine {
    file: String,
    rows: u64,
    rows_lost: u64,
    frames: u64,
    bytes: u64,
    problem: Option<String>,
}

impl<'a> Lines<'a> {
    /// Creates a printer that never waits. A slow reader loses status lines only, which are counted.
    pub(super) fn start(output: &'a Output) -> Result<Self, Failure> {
        let printer = Printer::start(io::stdout())?;
        Ok(Self { output, next: Duration::ZERO, newest: None, checks: Vec::new(), printer, patience: None })
    }

    /// Creates a printer that waits for its reader until an interrupt.
    pub(super) fn patient(output: &'a Output, interrupt: &Interrupt) -> Result<Self, Failure> {
        Ok(Self { patience: Some(interrupt.clone()), ..Self::start(output)? })
    }

    /// Prints changed events and checks at once, the status periodically.
    pub(super) fn update(&mut self, update: &Update) -> Result<(), Failure> {
        for event in &update.events {
            let kind = event.kind.name();
            let line = Line::Event { time_s: event.time.as_secs_f64(), kind, text: &event.text };
            self.print(&line, |out| {
                writeln!(out, "{:9.3} s  {kind}: {}", event.time.as_secs_f64(), event.text)
            })?;
        }
        self.newest = update.samples.last().copied().or(self.newest);
        if let Some(drive) = &update.status.drive {
            self.checks(&drive.checks)?;
        }
        let now = update.status.time;
        if now >= self.next || update.status.connection == Connection::Ended {
            let interval = if self.output.is_json() { JSON_INTERVAL } else { TEXT_INTERVAL };
            // On a grid, so that a late line does not move all that follow.
            self.next = interval * (now.as_nanos() / interval.as_nanos() + 1) as u32;
            self.status(&update.status)?;
        }
        Ok(())
    }

    /// Prints the last line, also of a failed run; `end` is `None` if the problem of the outcome says
    /// it all.
    pub(super) fn end(&mut self, time: Duration, end: Option<&End>, outcome: Outcome) -> Result<(), Failure> {
        let stopped_by = if let Some(End::Stopped(reason)) = end { Some(reason.name()) } else { None };
        let time_s = time.as_secs_f64();
        let text = end.map(End::text).or(outcome.problem.clone()).unwrap_or_default();
        let lines_dropped = self.printer.dropped();
        let line =
            Line::End { time_s, stopped_by, text: text.clone(), outcome: outcome.into(), lines_dropped };
        self.print(&line, |out| {
            if lines_dropped > 0 {
                writeln!(
                    out,
                    "{time_s:9.3} s  {lines_dropped} lines were dropped, because they were not read in time"
                )?;
            }
            writeln!(out, "{time_s:9.3} s  end: {text}")
        })
    }

    /// Waits until all lines are printed; after an interrupt only while the reader still reads.
    pub(super) fn finish(self, interrupt: &Interrupt) -> Result<(), Failure> {
        self.printer.finish(interrupt)
    }

    fn print(
        &mut self,
        line: &Line,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let mut bytes = Vec::new();
        self.output.write(&mut bytes, line, text)?;
        if let Some(interrupt) = &self.patience {
            self.printer.wait_for_room(interrupt);
        }
        match line {
            Line::Status(_) => self.printer.offer(bytes),
            Line::Event { .. } | Line::Check { .. } | Line::End { .. } => self.printer.keep(bytes),
        }
    }

    fn checks(&mut self, checks: &[Check]) -> Result<(), Failure> {
        for check in checks {
            if self.checks.iter().any(|known| (known.name, known.result) == (check.name, check.result)) {
                continue;
            }
            let result = match check.result {
                CheckResult::Passed => "passed",
                CheckResult::Waiting => "waiting",
                CheckResult::Failed => "failed",
            };
            let line = Line::Check { name: check.name, result, text: &check.text };
            self.print(&line, |out| writeln!(out, "  {result:8}{}: {}", check.name, check.text))?;
        }
        self.checks = checks.to_vec();
        Ok(())
    }

    fn status(&mut self, status: &Status) -> Result<(), Failure> {
        let newest = self.newest;
        let line = Line::Status(Box::new(StatusLine::new(status, newest.as_ref())));
        self.print(&line, |out| text(out, status, newest.as_ref()))
    }
}

impl StatusLine {
    fn new(status: &Status, newest: Option<&Sample>) -> Self {
        let (connection, hint) = connection(&status.connection);
        let [left, right] = status.motors.map(MotorLine::new);
        Self {
            time_s: status.time.as_secs_f64(),
            connection,
            hint,
            stage: status.drive.as_ref().map(|drive| drive.stage.name()),
            state: newest.map(|sample| StateLine {
                x_m: sample.x_m,
                x_dot_m_s: sample.x_dot_m_s,
                pitch_rad: sample.pitch_rad,
                pitch_rate_rad_s: sample.pitch_rate_rad_s,
                torque_left_nm: sample.torque_left_nm,
                torque_right_nm: sample.torque_right_nm,
            }),
            motors: MotorLines { left, right },
            imu: ImuLine::new(&status.imu),
            bus: BusLine::new(&status.counters),
            timing: TimingLine::new(&status.timing),
            recording: status.recording.as_ref().map(RecordingLine::new),
        }
    }
}

impl RecordingLine {
    fn new(recording: &RecordingStatus) -> Self {
        Self {
            file: recording.file.display().to_string(),
            rows: recording.rows,
            rows_lost: recording.rows_lost,
            frames: recording.frames,
            bytes: recording.bytes,
            problem: recording.problem.clone(),
        }
    }
}

impl From<Outcome> for OutcomeLine {
    fn from(outcome: Outcome) -> Self {
        let Outcome { problem, signal, motors_off, recording } = outcome;
        Self { problem, signal, motors_off, recording: recording.as_ref().map(RecordingLine::new) }
    }
}

fn connection(connection: &Connection) -> (&'static str, Option<String>) {
    match connection {
        Connection::Connected => ("connected", None),
        Connection::Silent { hint } => ("silent", Some(hint.clone())),
        Connection::Lost { reason } => ("lost", Some(reason.clone())),
        Connection::Ended => ("ended", None),
    }
}

impl MotorLine {
    fn new(status: MotorStatus) -> Self {
        Self {
            rate_hz: status.rate_hz,
            age_s: status.age.map(|age| age.as_secs_f64()),
            missed: status.missed,
            temperature_c: status.temperature_c,
            current_a: status.current_a,
            voltage_v: status.health.and_then(|health| health.voltage_v),
            round_trip_s: status.health.and_then(|health| health.round_trip).map(|time| time.as_secs_f64()),
            errors: status.health.map_or(Vec::new(), |health| health.errors.names().collect()),
        }
    }
}

impl ImuLine {
    fn new(status: &ImuStatus) -> Self {
        Self {
            rate_hz: status.rate_hz,
            age_s: status.age.map(|age| age.as_secs_f64()),
            packets: status.packets,
            corrupted: status.corrupted,
            stray_bytes: status.stray_bytes,
            temperature_c: status.temperature_c,
        }
    }
}

impl BusLine {
    fn new(counters: &Counters) -> Self {
        Self {
            received: counters.received,
            sent: counters.sent,
            received_hz: counters.received_hz,
            load: counters.bus_load,
            dropped: counters.dropped,
            lost: counters.lost,
            errors: counters.errors,
            late: counters.late,
            reconnects: counters.reconnects,
        }
    }
}

impl TimingLine {
    fn new(timing: &Timing) -> Self {
        Self {
            ticks: timing.ticks,
            skipped: timing.skipped,
            p50_s: timing.median_s,
            p99_s: timing.p99_s,
            max_s: timing.greatest_s,
        }
    }
}

fn text(out: &mut dyn Write, status: &Status, newest: Option<&Sample>) -> io::Result<()> {
    write!(out, "{:9.3} s  ", status.time.as_secs_f64())?;
    match &status.connection {
        Connection::Connected => {}
        Connection::Silent { hint } => write!(out, "silent ({hint})  ")?,
        Connection::Lost { reason } => write!(out, "lost ({reason}), reconnecting  ")?,
        Connection::Ended => write!(out, "ended  ")?,
    }
    if let Some(drive) = &status.drive {
        write!(out, "{}  ", drive.stage.name())?;
    }
    if let Some(sample) = newest {
        write!(
            out,
            "x {:+.3} m  x_dot {:+.3} m/s  pitch {:+.4} rad  torque {:+.3} {:+.3} N m  ",
            sample.x_m, sample.x_dot_m_s, sample.pitch_rad, sample.torque_left_nm, sample.torque_right_nm
        )?;
    }
    let [left, right] = status.motors.map(|motor| motor.rate_hz);
    let round_trip = status.motors.iter().filter_map(|motor| motor.health?.round_trip).max();
    let round_trip = round_trip.map_or(String::new(), |time| format!(" {:.1} ms", 1e3 * time.as_secs_f64()));
    let Counters { received_hz, bus_load, dropped, lost, errors, late, reconnects, .. } = status.counters;
    let load = bus_load.map_or(String::new(), |load| format!(" ({:.0} % of the bus)", 100.0 * load));
    write!(
        out,
        "motors {left:.0} {right:.0} Hz{round_trip}  IMU {:.0} Hz  {received_hz:.0} frames/s{load}",
        status.imu.rate_hz
    )?;
    let counts = [
        ("dropped", dropped),
        ("lost", lost),
        ("late", late),
        ("errors", errors),
        ("reconnects", reconnects),
    ];
    for (name, count) in counts {
        if count > 0 {
            write!(out, "  {name} {count}")?;
        }
    }
    if let Some(problem) = status.recording.as_ref().and_then(|recording| recording.problem.as_ref()) {
        write!(out, "  recording stopped: {problem}")?;
    }
    writeln!(out)
}
