//! What `monitor` and `drive` print: one object a line, or a line of text now and then.

use std::io::{self, Write};
use std::time::Duration;

use flqr_core::control::drive::{Check, CheckResult, Stage};
use flqr_core::device::{Connection, Counters, ImuStatus, MotorStatus, Status, Timing, Update};
use flqr_core::record::Sample;
use serde::Serialize;

use super::output::{Failure, Output};

/// Time between two lines of JSON.
const JSON_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two lines of text.
const TEXT_INTERVAL: Duration = Duration::from_secs(1);

/// Prints updates.
pub(super) struct Lines<'a> {
    output: &'a Output,
    next: Duration,
    newest: Option<Sample>,
    checks: Vec<Check>,
    /// Whether a recording has come to its end.
    ended: bool,
}

/// A line of JSON.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Line<'a> {
    Status(Box<StatusLine>),
    Event { time_s: f64, kind: &'static str, text: &'a str },
    Check { name: &'a str, result: &'static str, text: &'a str },
    End { time_s: f64, stopped_by: Option<&'static str>, text: String },
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
    frames: u64,
    bytes: u64,
    problem: Option<String>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(output: &'a Output) -> Self {
        Self { output, next: Duration::ZERO, newest: None, checks: Vec::new(), ended: false }
    }

    /// Events and checks that have changed at once, the status when it is due.
    pub(super) fn update(&mut self, update: &Update) -> Result<(), Failure> {
        for event in &update.events {
            let kind = event.kind.name();
            let line = Line::Event { time_s: event.time.as_secs_f64(), kind, text: &event.text };
            self.output.result(&line, |out| {
                writeln!(out, "{:9.3} s  {kind}: {}", event.time.as_secs_f64(), event.text)
            })?;
        }
        self.newest = update.samples.last().copied().or(self.newest);
        if let Some(drive) = &update.status.drive {
            self.checks(&drive.checks)?;
        }
        let now = update.status.time;
        self.ended = update.status.connection == Connection::Ended;
        if now >= self.next || self.ended {
            let interval = if self.output.is_json() { JSON_INTERVAL } else { TEXT_INTERVAL };
            // On a grid, so that a late line does not move all that follow.
            self.next = interval * (now.as_nanos() / interval.as_nanos() + 1) as u32;
            self.status(&update.status)?;
        }
        Ok(())
    }

    /// The last line.
    pub(super) fn end(&self, time: Duration, stage: Option<Stage>) -> Result<(), Failure> {
        let (stopped_by, text) = match stage {
            Some(Stage::Stopped(reason)) => (Some(reason.name()), reason.to_string()),
            _ if self.ended => (None, "the recording is over".to_owned()),
            _ => (None, "the time is over".to_owned()),
        };
        let line = Line::End { time_s: time.as_secs_f64(), stopped_by, text: text.clone() };
        self.output.result(&line, |out| writeln!(out, "{:9.3} s  end: {text}", time.as_secs_f64()))
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
            self.output.result(&line, |out| writeln!(out, "  {result:8}{}: {}", check.name, check.text))?;
        }
        self.checks = checks.to_vec();
        Ok(())
    }

    fn status(&self, status: &Status) -> Result<(), Failure> {
        let line = Line::Status(Box::new(StatusLine::new(status, self.newest.as_ref())));
        self.output.result(&line, |out| text(out, status, self.newest.as_ref()))
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
            recording: status.recording.as_ref().map(|recording| RecordingLine {
                file: recording.file.display().to_string(),
                rows: recording.rows,
                frames: recording.frames,
                bytes: recording.bytes,
                problem: recording.problem.clone(),
            }),
        }
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
            voltage_v: status.health.map(|health| health.voltage_v),
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
        Connection::Lost { reason } => write!(out, "lost ({reason}), trying again  ")?,
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
    let Counters { received_hz, bus_load, dropped, lost, errors, late, reconnects, .. } = status.counters;
    let load = bus_load.map_or(String::new(), |load| format!(" ({:.0} % of the bus)", 100.0 * load));
    write!(
        out,
        "motors {left:.0} {right:.0} Hz  IMU {:.0} Hz  {received_hz:.0} frames/s{load}",
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
        write!(out, "  recording ended: {problem}")?;
    }
    writeln!(out)
}
