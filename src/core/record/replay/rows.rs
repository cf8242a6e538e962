//! The robot log of a recording that is played.

use std::io::BufRead;
use std::time::Duration;

use super::{LATEST, ReplayError, ReplayFile, ReplayItem};
use crate::record::recording::{OPTIONAL_COLUMNS, Row};
use crate::record::{ColumnMap, LogError, LogItem, LogKind, LogRows, Sample};

/// Rows and events of a robot log, in its order.
pub(super) struct RowTrack<R> {
    name: String,
    rows: LogRows<'static, R>,
    columns: [usize; Sample::COLUMNS.len()],
    optional: [Option<usize>; OPTIONAL_COLUMNS.len()],
    /// Start of the log before its time zero, s.
    before_zero_s: f64,
    last: Duration,
    next: Option<(Duration, ReplayItem)>,
    failed: Option<LogError>,
}

impl<R: BufRead> RowTrack<R> {
    pub(super) fn new(file: ReplayFile<R>) -> Result<Self, ReplayError> {
        let ReplayFile { name, reader } = file;
        let rows =
            LogRows::new(reader, name.clone(), &ColumnMap::default()).map_err(|error| match error {
                LogError::MissingColumns { file, missing, .. } => ReplayError::NotRobot { file, missing },
                error => error.into(),
            })?;
        let place = |wanted: &str| rows.columns().position(|name| name == wanted);
        let missing = LogKind::Robot.required().iter().filter(|name| place(name).is_none());
        let missing = missing.copied().collect::<Vec<_>>().join("`, `");
        if !missing.is_empty() {
            return Err(ReplayError::NotRobot { file: name, missing });
        }
        let columns = Sample::COLUMNS.map(|name| place(name).expect("none is missing"));
        let optional = OPTIONAL_COLUMNS.map(place);
        let (last, next, failed) = (Duration::ZERO, None, None);
        let mut track = Self { name, rows, columns, optional, before_zero_s: 0.0, last, next, failed };
        track.advance();
        match track.failed.take() {
            Some(error) => Err(error.into()),
            None => Ok(track),
        }
    }

    /// Time zero since 1970, if given.
    pub(super) fn start(&self) -> Option<Duration> {
        self.rows.start()
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next.as_ref().map(|(time, _)| *time)
    }

    pub(super) fn take(&mut self) -> Result<Option<(Duration, ReplayItem)>, LogError> {
        let Some(next) = self.next.take() else { return self.failed.take().map_or(Ok(None), Err) };
        self.advance();
        Ok(Some(next))
    }

    pub(super) fn damaged(&self) -> u64 {
        self.rows.dropped()
    }

    pub(super) fn problem(&self) -> Option<String> {
        self.rows.problems().0.first().map(|problem| format!("{}: {problem}", self.name))
    }

    fn advance(&mut self) {
        let optional = &self.optional;
        let item = match self.rows.next_item() {
            Ok(Some(LogItem::Row(values))) => {
                let cell = |place: Option<usize>| place.map(|at| values[at]).filter(|value| !value.is_nan());
                let sample = Sample::from_row(self.columns.map(|at| values[at]));
                (sample.time_s, ReplayItem::Row(Row::new(sample, optional.map(cell))))
            }
            Ok(Some(LogItem::Event(time, text))) => (time.as_secs_f64(), ReplayItem::Event(text)),
            Ok(None) => return,
            Err(error) => return self.failed = Some(error),
        };
        let (time_s, item) = item;
        if matches!(item, ReplayItem::Row(_)) && time_s < -self.before_zero_s && self.last.is_zero() {
            self.before_zero_s = -time_s;
        }
        let time = Duration::try_from_secs_f64((time_s + self.before_zero_s).max(0.0)).unwrap_or(LATEST);
        // An event may have been noted with a time before the row above it.
        self.last = self.last.max(time.min(LATEST));
        self.next = Some((self.last, item));
    }
}
