//! Lines of a recording's logs.

use std::fmt::Write;
use std::time::Duration;

use super::{FIRST_LINE, Row};
use crate::model::Motor;
use crate::record::{BenchSample, write::push_number};

/// Source of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct About {
    /// Source of the frames, as named by the user.
    pub source: String,
    /// Interface under which the frames are written, such as `can0`.
    pub interface: String,
    /// Start of the session, since 1970.
    pub start: Duration,
}

/// Header of the robot log.
pub fn robot_header(about: &About) -> String {
    header("robot log", about, Row::columns())
}

/// Header of a motor's bench log.
pub fn bench_header(about: &About, motor: Motor) -> String {
    header(&format!("bench log of the {motor} motor"), about, BenchSample::COLUMNS.into_iter())
}

fn header(kind: &str, about: &About, columns: impl Iterator<Item = &'static str>) -> String {
    let columns = columns.collect::<Vec<_>>().join(",");
    let source = one_line(&about.source);
    let (seconds, micros) = (about.start.as_secs(), about.start.subsec_micros());
    format!("{FIRST_LINE}: {kind} of {source}\n{START}{seconds}.{micros:06} s after 1970\n{columns}\n")
}

/// First words of the comment with the start time of a recording.
const START: &str = "# time_s counts from ";

/// Start of a recording since 1970, if this comment of its log says so.
pub fn parse_start(comment: &str) -> Option<Duration> {
    let (seconds, micros) = comment.strip_prefix(START)?.strip_suffix(" s after 1970")?.split_once('.')?;
    let micros: u32 = (micros.len() == 6).then(|| micros.parse().ok())??;
    let seconds: u32 = seconds.parse().ok()?;
    Some(Duration::new(seconds.into(), 0) + Duration::from_micros(micros.into()))
}

/// Adds a row to the robot log.
pub fn push_row(text: &mut String, row: &Row) {
    push_cells(text, row.sample.to_row().map(Some).into_iter().chain(row.optional()));
}

/// Adds a row to the bench log of a motor.
pub fn push_bench_row(text: &mut String, sample: &BenchSample, motor: Motor) {
    push_cells(text, sample.to_row(motor).map(Some).into_iter());
}

fn push_cells(text: &mut String, cells: impl Iterator<Item = Option<f64>>) {
    for (index, cell) in cells.enumerate() {
        if index > 0 {
            text.push(',');
        }
        push_number(text, cell.unwrap_or(f64::NAN));
    }
    text.push('\n');
}

/// Adds a comment that says what happened and when.
pub fn push_event(text: &mut String, time: Duration, what: &str) {
    let written = writeln!(text, "# {:.3} s {}", time.as_secs_f64(), one_line(what));
    written.expect("writing to a string cannot fail");
}

/// Returns the event and its time from a comment of a recording.
pub fn parse_event(comment: &str) -> Option<(Duration, &str)> {
    let (time, what) = comment.strip_prefix("# ")?.split_once(" s ")?;
    Some((Duration::try_from_secs_f64(time.parse().ok()?).ok()?, what))
}

/// A comment ends with its line.
fn one_line(text: &str) -> String {
    text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}
