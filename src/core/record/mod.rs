//! Logs: schema, reading, writing and health.
//!
//! A log is CSV with a header. Columns may come in any order; the unit is the ending of a column's name
//! ([`schema`] lists the names), other columns are kept and ignored. `#` starts a comment line. Where the
//! header has no comma, semicolons or tabs separate the cells.
//!
//! Handling of damaged input ([`read_log`]):
//! - A row with too few or too many cells, or with a cell that is not a finite number (of at most 1e30) in a required column,
//!   is dropped; [`Log::problems`] names line and column. Consumers may rely on required columns being finite.
//! - The same in an optional column of the schema leaves the row, with NaN as the value.
//! - An empty cell of an optional column and any text in a column outside the schema is NaN without a problem.
//! - Rows whose time does not follow are dropped, as few as possible (the longest rising sequence stays).
//! - The last row of a [`recording`] is dropped where its line end is missing: the program that wrote it was killed.
//! - A log in which every second row would be dropped, or time fails in more than one row of a hundred, is
//!   refused. A repeated header (recordings appended to one another) is such a dropped row.

mod align;
mod cells;
mod error;
mod health;
mod map;
pub mod mcap;
mod plan;
mod read;
mod readings;
pub mod recording;
mod replay;
mod rows;
pub(crate) mod runs;
mod sample;
pub mod schema;
mod table;
mod text;
mod time;
mod write;

pub use align::{Alignment, Signal, best_alignment, first_crossing_s};
pub use error::{LineProblem, LogError};
pub(crate) use health::single_outliers;
pub use health::{HealthFinding, Severity, data_health};
pub use map::{ColumnMap, MapError, Mapping};
pub use read::{ReadOptions, ReadProgress, read_log};
pub use readings::Readings;
pub use replay::{Replay, ReplayCounts, ReplayError, ReplayFile, ReplayItem};
pub use rows::{LogItem, LogRows};
pub use sample::{BenchSample, Sample};
pub use schema::LogKind;
pub use time::row_time_s;
pub(crate) use write::text_cell;
pub use write::{LogWriter, is_written_log, write_log};

/// One column of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name with unit, such as `torque_nm`.
    pub name: String,
    /// One value for each row; NaN where there is none.
    pub values: Vec<f64>,
}

/// A log in memory; every column has the same number of rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// The name that the user gave it, for messages.
    pub source: String,
    /// The file's columns in its order, then the mapped ones.
    pub columns: Vec<Column>,
    /// Rows of the file that were dropped.
    pub dropped_rows: usize,
    /// The first problems, at most [`Log::KEPT_PROBLEMS`].
    pub problems: Vec<LineProblem>,
    /// All problems, those beyond the kept ones included.
    pub problem_count: usize,
    /// Line numbers of the rows in the file; empty for a log that was not read from one.
    lines: RowLines,
}

/// Rows from which on the line number is the row's number plus an offset: (row, line − row).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct RowLines(Vec<(usize, u64)>);

impl RowLines {
    /// Notes the line of the next row.
    fn push(&mut self, row: usize, line: u64) {
        let offset = line - row as u64;
        if self.0.last().is_none_or(|&(_, last)| last != offset) {
            self.0.push((row, offset));
        }
    }

    fn line(&self, row: usize) -> Option<u64> {
        let run = self.0.partition_point(|&(start, _)| start <= row).checked_sub(1)?;
        Some(self.0[run].1 + row as u64)
    }
}

impl Log {
    /// Number of problems stored with line and column.
    pub const KEPT_PROBLEMS: usize = 100;

    /// A log of these columns; shorter ones are filled up with NaN.
    ///
    /// ```
    /// use flqr_core::record::{Log, LogKind};
    ///
    /// let log = Log::from_columns("pairs.csv", [("speed_rad_s", vec![1.0, 2.0]), ("torque_nm", vec![0.2, 0.3])]);
    /// assert_eq!((log.kind()?, log.rows()), (LogKind::FrictionPairs, 2));
    /// assert_eq!(log.column("torque_nm"), Some(&[0.2, 0.3][..]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_columns<N: Into<String>>(
        source: impl Into<String>,
        columns: impl IntoIterator<Item = (N, Vec<f64>)>,
    ) -> Self {
        let mut columns: Vec<Column> =
            columns.into_iter().map(|(name, values)| Column { name: name.into(), values }).collect();
        let rows = columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
        columns.iter_mut().for_each(|column| column.values.resize(rows, f64::NAN));
        Self { source: source.into(), columns, ..Self::default() }
    }

    /// The values of a column; the first one of that name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// Line of the file at which a row stands, from 1; nothing for a log that was not read from a file.
    pub fn line(&self, row: usize) -> Option<u64> {
        self.lines.line(row).filter(|_| row < self.rows())
    }

    /// Cells and rows that could not be read, by their columns and lines; nothing where all could.
    pub fn unread(&self) -> Option<String> {
        let cells = match self.problem_count {
            0 => return None,
            1 => "1 cell or row".to_owned(),
            count => format!("{count} cells or rows"),
        };
        Some(format!(
            "{cells} of {} could not be read, {}",
            self.source,
            error::places(&self.problems, self.problem_count)
        ))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Returns whether the columns are complete for a kind. A log may serve several kinds: a model then says which.
    pub fn serves(&self, kind: LogKind) -> bool {
        kind.fits(|name| self.column(name).is_some())
    }

    /// Returns the kind of log from its columns: the first of [`LogKind::ALL`] that is complete.
    ///
    /// # Errors
    /// [`LogError::MissingColumns`] for the kind that the columns come nearest to.
    pub fn kind(&self) -> Result<LogKind, LogError> {
        LogKind::recognise(|name| self.column(name).is_some())
            .ok_or_else(|| self.missing_for(LogKind::nearest(|name| self.column(name).is_some())))
    }

    /// A required column of a kind of log.
    ///
    /// # Errors
    /// [`LogError::MissingColumns`].
    pub fn required(&self, kind: LogKind, name: &str) -> Result<&[f64], LogError> {
        self.column(name).ok_or_else(|| self.missing_for(kind))
    }

    /// The error that says which columns of a kind are missing.
    pub fn missing_for(&self, kind: LogKind) -> LogError {
        let missing: Vec<&str> =
            kind.required().iter().copied().filter(|name| self.column(name).is_none()).collect();
        let names: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
        LogError::MissingColumns {
            file: self.source.clone(),
            kind,
            missing: missing.join("`, `"),
            present: listed(&names),
            example: map_example(&missing, &names),
        }
    }
}

/// Names in backquotes, the first twenty.
fn listed(names: &[&str]) -> String {
    const SHOWN: usize = 20;
    let mut text = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}

/// Column map entries for the missing columns that one of the file's columns resembles, each of the file's
/// columns once; up to two columns without one keep a place to fill in.
fn map_example(missing: &[&str], present: &[&str]) -> String {
    let mut free: Vec<&str> = present.iter().copied().filter(|name| !schema::is_known(name)).collect();
    let (mut entries, mut matched) = (Vec::new(), 0);
    for name in missing {
        let resembles = |other: &usize| resemblance(name, free[*other]);
        // The first of equals.
        let best = (0..free.len()).rev().max_by_key(resembles).filter(|best| resembles(best).1 > 0);
        matched += usize::from(best.is_some());
        let theirs = best.map_or("COLUMN", |best| free.remove(best));
        entries.push(format!("{name}={theirs}"));
    }
    if missing.len() > 2 {
        if matched > 0 {
            entries.retain(|entry| !entry.ends_with("=COLUMN"));
        } else {
            entries.truncate(1);
        }
    }
    entries.join(" --map ")
}

/// Similarity of a file's column to a signal: whether it is a measured one, and what they have in
/// common, a unit counting half a word.
fn resemblance(ours: &str, theirs: &str) -> (bool, usize) {
    const UNITS: [&str; 8] = ["rad_s", "m_s", "rad", "nm", "m", "s", "n", "c"];
    const WISHED: [&str; 9] =
        ["goal", "ref", "reference", "target", "cmd", "command", "desired", "des", "setpoint"];
    const PLACES: [&str; 3] = ["motor", "left", "right"];
    let words = |name: &str| -> (Vec<String>, &'static str) {
        let name = name.to_lowercase();
        let unit = UNITS.into_iter().find(|unit| name.ends_with(&format!("_{unit}"))).unwrap_or("");
        let stem = name.strip_suffix(unit).unwrap_or(&name);
        let words = stem.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        (words.map(str::to_owned).collect(), unit)
    };
    let ((wanted, unit), (found, other_unit)) = (words(ours), words(theirs));
    let common = |sort: bool| {
        let of_sort = found.iter().filter(|word| PLACES.contains(&word.as_str()) == sort);
        of_sort.filter(|word| wanted.contains(word)).count()
    };
    // Where it is measured tells two of a kind apart, not what it is.
    let what = 2 * common(false) + usize::from(!unit.is_empty() && unit == other_unit);
    let likeness = if what > 0 { 2 * what + common(true) } else { 0 };
    let measured = !found.iter().any(|word| WISHED.contains(&word.as_str()));
    (likeness > 0 && measured, likeness)
}
