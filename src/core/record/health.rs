//! Data-health checks of a log.

mod clock;
mod excitation;
mod signals;
mod spikes;
mod units;

use serde::Serialize;

use super::{Log, LogError, LogKind, schema};
use crate::message;

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing.
    Info,
    /// Results may suffer.
    Warning,
    /// The log does not answer the question.
    Error,
}

/// One finding about a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HealthFinding {
    /// Severity.
    pub severity: Severity,
    /// The column, or nothing where the whole log is meant.
    pub column: String,
    /// Problem.
    pub problem: String,
    /// Remedy; empty if none is needed.
    pub remedy: String,
}

impl HealthFinding {
    /// A finding; its words, which may quote the file, are made fit to be shown.
    pub fn new(severity: Severity, column: &str, problem: impl AsRef<str>, remedy: impl AsRef<str>) -> Self {
        let [problem, remedy] = [problem.as_ref(), remedy.as_ref()].map(message::shown);
        Self { severity, column: column.to_owned(), problem, remedy }
    }
}

impl std::fmt::Display for HealthFinding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self.severity {
            Severity::Info => "note: ",
            Severity::Warning => "warning: ",
            Severity::Error => "error: ",
        })?;
        if !self.column.is_empty() {
            write!(f, "{}: ", self.column)?;
        }
        f.write_str(&self.problem)?;
        if self.remedy.is_empty() { Ok(()) } else { write!(f, "; {}", self.remedy) }
    }
}

/// Positions as a sensor measures them.
const POSITIONS: [&str; 5] =
    ["motor_angle_rad", "motor_angle_left_rad", "motor_angle_right_rad", "position_m", "x_m"];

/// Rows of a column that are far off the rows around them, each alone.
pub(crate) fn single_outliers(time: &[f64], values: &[f64]) -> Vec<usize> {
    let Some(row_s) = super::row_time_s(time) else { return Vec::new() };
    let rows = spikes::spikes(time, values, row_s).into_iter().map(|(row, _)| row);
    rows.filter(|&row| row > 0 && row + 1 < values.len()).collect()
}

/// The findings so far.
#[derive(Default)]
struct Findings(Vec<HealthFinding>);

impl Findings {
    fn add(&mut self, severity: Severity, column: &str, problem: impl AsRef<str>, remedy: impl AsRef<str>) {
        self.0.push(HealthFinding::new(severity, column, problem, remedy));
    }

    fn info(&mut self, column: &str, problem: impl AsRef<str>) {
        self.add(Severity::Info, column, problem, "");
    }

    fn warn(&mut self, column: &str, problem: impl AsRef<str>, remedy: impl AsRef<str>) {
        self.add(Severity::Warning, column, problem, remedy);
    }
}

/// Returns the problems of a log, the most severe first.
///
/// Looks at completeness, dropped rows, the clock (rate, jitter, gaps, order), each column of the schema
/// (missing values, held samples, steps, saturation, standstill, wrapped angles, spikes), units (degrees, revolutions,
/// raw counts) and at what the motion excites. A log without faults has infos only.
///
/// ```
/// use flqr_core::record::{Log, Severity, data_health};
///
/// let columns = [("time_s", vec![0.0, 0.001]), ("motor_angle_rad", vec![0.0, 0.1])];
/// let findings = data_health(&Log::from_columns("log.csv", columns));
/// assert!(findings.iter().any(|finding| finding.severity == Severity::Error)); // There is no torque.
/// ```
pub fn data_health(log: &Log) -> Vec<HealthFinding> {
    let mut findings = Findings::default();
    let kind = kind(log, &mut findings);
    dropped_rows(log, &mut findings);
    if log.rows() > 0 {
        let row_s = clock::check(log, &mut findings);
        for column in log.columns.iter().filter(|column| schema::is_known(&column.name)) {
            signals::check(log, &column.name, &column.values, row_s, &mut findings);
        }
        if let Some(row_s) = row_s {
            for name in POSITIONS {
                spikes::check(log, name, row_s, &mut findings);
            }
        }
        units::check(log, row_s, &mut findings);
        if let Some(kind) = kind {
            excitation::check(log, kind, &mut findings);
        }
    }
    let mut findings = findings.0;
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}

fn kind(log: &Log, findings: &mut Findings) -> Option<LogKind> {
    match log.kind() {
        Ok(kind) => Some(kind),
        Err(LogError::MissingColumns { kind, missing, example, .. }) => {
            let problem = format!("a {kind} needs `{missing}`, which the log does not have");
            let remedy = format!("map its column with --map {example}");
            findings.add(Severity::Error, &missing, problem, remedy);
            None
        }
        Err(error) => {
            findings.add(Severity::Error, "", error.to_string(), "read the log again");
            None
        }
    }
}

fn dropped_rows(log: &Log, findings: &mut Findings) {
    let Some(first) = log.problems.first() else { return };
    let unused = match log.problem_count {
        1 => "1 cell or row".to_owned(),
        count => format!("{count} cells or rows"),
    };
    let were = if log.dropped_rows == 1 { "was" } else { "were" };
    let rows = rows(log.rows() + log.dropped_rows);
    let problem = format!(
        "{unused} could not be used and {} of {rows} {were} skipped, the first at {first}",
        log.dropped_rows
    );
    findings.warn(&first.column, problem, "correct the damaged part of the file, or record it again");
}

/// A number of rows in words.
fn rows(count: usize) -> String {
    if count == 1 { "1 row".to_owned() } else { format!("{count} rows") }
}

fn finite(values: &[f64]) -> impl Iterator<Item = f64> + Clone + '_ {
    values.iter().copied().filter(|value| value.is_finite())
}

/// Smallest and largest finite value.
fn range(values: &[f64]) -> Option<[f64; 2]> {
    finite(values).fold(None, |range, value| match range {
        None => Some([value, value]),
        Some([low, high]) => Some([low.min(value), high.max(value)]),
    })
}

#[cfg(test)]
#[path = "health/tests.rs"]
mod tests;
