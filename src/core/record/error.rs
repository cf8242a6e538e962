//! Reason why a log could not be read.

use std::fmt;

use serde::Serialize;

use super::LogKind;

/// A row or a cell that could not be used; the rest of the log was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LineProblem {
    /// Line of the file, from 1; comments and the header count.
    pub line: u64,
    /// The file's column, or nothing where the whole row is meant.
    pub column: String,
    /// Problem there, and its handling.
    pub problem: String,
}

impl fmt::Display for LineProblem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "line {}", self.line)?;
        if !self.column.is_empty() {
            write!(f, ", column `{}`", self.column)?;
        }
        write!(f, ": {}", self.problem)
    }
}

/// Describes the locations of `count` problems, of which these are stored.
pub(super) fn places(problems: &[LineProblem], count: usize) -> String {
    const LINES: usize = 4;
    let mut columns: Vec<(&str, Vec<u64>)> = Vec::new();
    for problem in problems {
        match columns.iter_mut().find(|(column, _)| *column == problem.column) {
            Some((_, lines)) => lines.push(problem.line),
            None => columns.push((&problem.column, vec![problem.line])),
        }
    }
    let told = columns.iter().map(|(column, lines)| {
        let what = if column.is_empty() { "whole rows".to_owned() } else { format!("`{column}`") };
        let shown = lines.iter().take(LINES).map(u64::to_string).collect::<Vec<_>>().join(", ");
        let word = if lines.len() == 1 { "line" } else { "lines" };
        let more = if lines.len() > LINES { ", …" } else { "" };
        format!("{what} at {word} {shown}{more}")
    });
    let told = told.collect::<Vec<_>>().join(", ");
    if count > problems.len() { format!("the first {} of them {told}", problems.len()) } else { told }
}

/// Reason why a log could not be read; `file` is its name as given by the user.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The reader failed.
    #[error("{file}: reading stopped after line {line} ({problem}): check the disk or copy the file again")]
    Io {
        /// The file.
        file: String,
        /// Last line that was read.
        line: u64,
        /// Message of the system.
        problem: String,
    },
    /// A folder in place of a file.
    #[error("{file} is a folder: give the CSV file in it")]
    Folder {
        /// The folder.
        file: String,
    },
    /// The caller said stop.
    #[error("{file}: reading was cancelled at line {line}")]
    Cancelled {
        /// The file.
        file: String,
        /// Line at which it was cancelled.
        line: u64,
    },
    /// Nothing but blank lines and comments.
    #[error(
        "{file} is empty: a log needs a header line such as time_s,motor_angle_rad,torque_nm and rows of numbers"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// A header without rows.
    #[error("{file}:{line}: there is a header but no row of numbers below it: record the log again")]
    HeaderOnly {
        /// The file.
        file: String,
        /// Line of the header.
        line: u64,
    },
    /// Bytes that no CSV has.
    #[error("{file}:{line} is not CSV text ({found}): export the log as comma-separated UTF-8 text")]
    NotText {
        /// The file.
        file: String,
        /// Line at which it shows.
        line: u64,
        /// Apparent format.
        found: &'static str,
    },
    /// The first row holds numbers.
    #[error(
        "{file}:{line}: the first row contains numbers instead of column names: add a header \
         line without a leading #"
    )]
    NoHeader {
        /// The file.
        file: String,
        /// Line of the first row.
        line: u64,
    },
    /// Two columns of one name that matters.
    #[error("{file}:{line}: two columns are named `{column}`: rename one of them")]
    DuplicateColumn {
        /// The file.
        file: String,
        /// Line of the header.
        line: u64,
        /// The name.
        column: String,
    },
    /// The columns are not complete for any kind of log.
    #[error(
        "{file}: a {kind} needs `{missing}`, but the file has {present}: map its column with --map {example}"
    )]
    MissingColumns {
        /// The file.
        file: String,
        /// The kind that the columns come nearest to.
        kind: LogKind,
        /// The required columns that are missing, separated by commas.
        missing: String,
        /// The columns that are there.
        present: String,
        /// An entry of a column map that might remedy it.
        example: String,
    },
    /// The column map names a column that the file does not have.
    #[error(
        "{file}: the column map `{mapping}` reads `{theirs}`, but the file has {present}: correct the name"
    )]
    MappedColumnMissing {
        /// The file.
        file: String,
        /// The entry of the column map.
        mapping: String,
        /// The file's column that it names.
        theirs: String,
        /// The columns that are there.
        present: String,
    },
    /// Most rows could not be used.
    #[error(
        "{file}: {bad} of {rows} rows cannot be used, the first at {problems}: correct them, or record the log again"
    )]
    MostlyBad {
        /// The file.
        file: String,
        /// Rows that cannot be used.
        bad: usize,
        /// Rows of the file.
        rows: usize,
        /// The first problem, and where those are that were kept.
        problems: String,
    },
    /// Time repeats or runs back too often to drop the rows.
    #[error(
        "{file}:{line}: column `time_s` goes from {from_s} s to {to_s} s; {rows} rows in total \
         do not increase in time: {remedy}"
    )]
    TimeRunsBack {
        /// The file.
        file: String,
        /// First line that does not follow.
        line: u64,
        /// Time of the row before, s.
        from_s: f64,
        /// Time of that line, s.
        to_s: f64,
        /// Rows that would have to be dropped.
        rows: usize,
        /// Remedy.
        remedy: &'static str,
    },
    /// More numbers than the limit.
    #[error(
        "{file}:{line}: the log has more than {limit} numbers ({mebibytes} MiB): split the \
         file, or remove unused columns and rows"
    )]
    TooLarge {
        /// The file.
        file: String,
        /// Line at which the limit was reached.
        line: u64,
        /// The limit, numbers.
        limit: usize,
        /// The memory that they take.
        mebibytes: usize,
    },
    /// One row that does not end.
    #[error(
        "{file}:{line}: this row is longer than {limit} bytes: look for an unclosed quote or a missing line end"
    )]
    RowTooLong {
        /// The file.
        file: String,
        /// Line at which the row starts.
        line: u64,
        /// The limit, bytes.
        limit: usize,
    },
}
