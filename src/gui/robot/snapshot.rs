//! State of the page for `--state-out`.

use flqr_core::control::drive::{CheckResult, Stage};
use flqr_core::device::{Connection, DriveStatus, Status};
use serde_json::{Value, json};

use super::{Link, RobotTab};

impl RobotTab {
    /// Returns the state of the page.
    pub(super) fn to_value(&self, link: &Link) -> Value {
        let status = link.status.as_ref();
        let last_event = self.events.last().map(|event| &event.text);
        json!({
            "session": session_name(link),
            "source": link.options().map(|options| options.source.to_string()),
            "may_drive": link.may_drive(),
            "connection": status.filter(|_| link.is_open()).map(|status| connection_name(&status.connection)),
            "stage": stage_name(link.stage()),
            "stop_reason": match link.stage() {
                Some(Stage::Stopped(reason)) => Some(reason.name()),
                _ => None,
            },
            "motors_off": link.drive().map(|drive| drive.motors_off),
            "end_problems": link.end_problems(),
            "may_arm": link.may_arm(),
            "gains": link.transfer.snapshot(),
            "checks": status.and_then(|status| status.drive.as_ref()).map(checks),
            "rows": link.rows,
            "rows_hz": link.rows_hz(),
            "end_s": link.history.end_s(),
            "skipped_rows": link.history.skipped(),
            "dropped_rows": link.history.dropped(),
            "status": status.map(numbers),
            "frames_shown": self.frames.shown(),
            "events": self.events.len(),
            "last_event": last_event,
            "interfaces": self.found,
            "message": link.problem,
        })
    }
}

fn session_name(link: &Link) -> &'static str {
    if link.is_opening() {
        "opening"
    } else if link.is_open() {
        "open"
    } else if link.is_closing() {
        "closing"
    } else {
        "closed"
    }
}

fn connection_name(connection: &Connection) -> &'static str {
    match connection {
        Connection::Connected => "connected",
        Connection::Silent { .. } => "silent",
        Connection::Lost { .. } => "lost",
        Connection::Ended => "ended",
    }
}

fn stage_name(stage: Option<Stage>) -> &'static str {
    match stage {
        None => "disconnected",
        Some(Stage::Listening) => "listening",
        Some(Stage::Checking) => "checking",
        Some(Stage::Driving) => "driving",
        Some(Stage::Stopped(_)) => "stopped",
    }
}

fn checks(drive: &DriveStatus) -> Value {
    let result = |result| match result {
        CheckResult::Passed => "passed",
        CheckResult::Waiting => "waiting",
        CheckResult::Failed => "failed",
    };
    let check = |check: &flqr_core::control::drive::Check| json!({ "name": check.name, "result": result(check.result), "text": check.text });
    drive.checks.iter().map(check).collect()
}

fn numbers(status: &Status) -> Value {
    let (counters, timing) = (&status.counters, &status.timing);
    json!({
        "time_s": status.time.as_secs_f64(),
        "motors": status.motors.each_ref().map(|motor| json!({
            "rate_hz": motor.rate_hz,
            "age_s": motor.age.map(|age| age.as_secs_f64()),
            "missed": motor.missed,
            "temperature_c": motor.temperature_c,
            "current_a": motor.current_a,
            "voltage_v": motor.health.and_then(|health| health.voltage_v),
            "round_trip_s": motor.health.and_then(|health| health.round_trip).map(|time| time.as_secs_f64()),
            "errors": motor.health.map(|health| health.errors.to_string()),
        })),
        "imu": {
            "rate_hz": status.imu.rate_hz,
            "age_s": status.imu.age.map(|age| age.as_secs_f64()),
            "packets": status.imu.packets,
            "corrupted": status.imu.corrupted,
            "stray_bytes": status.imu.stray_bytes,
        },
        "counters": {
            "received": counters.received,
            "sent": counters.sent,
            "received_hz": counters.received_hz,
            "bus_load": counters.bus_load,
            "dropped": counters.dropped,
            "lost": counters.lost,
            "errors": counters.errors,
            "late": counters.late,
            "reconnects": counters.reconnects,
        },
        "timing": {
            "ticks": timing.ticks,
            "median_s": timing.median_s,
            "p99_s": timing.p99_s,
            "greatest_s": timing.greatest_s,
            "skipped": timing.skipped,
        },
        "recording": status.recording.as_ref().map(|recording| json!({
            "file": recording.file.display().to_string(),
            "rows": recording.rows,
            "frames": recording.frames,
            "bytes": recording.bytes,
            "problem": recording.problem,
        })),
    })
}
