//! A log of any length, row by row.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::BufRead;
use std::time::Duration;

use super::cells::Cells;
use super::plan::Plan;
use super::text::{Header, Line, Lines};
use super::{ColumnMap, LineProblem, LogError, LogKind, recording};

/// Reads a log row by row, so that its length is no matter. Damage is told as by [`super::read_log`], but which
/// rows do not follow in time is assessed by their neighbours only.
pub struct LogRows<'a, R> {
    lines: Lines<'a, R>,
    cells: Cells,
    time: usize,
    start: Option<Duration>,
    /// Values of a row that is handed out if the time of the next one allows it, and its line.
    waiting: Option<(Vec<f64>, u64)>,
    /// Values of the row that was handed out last.
    row: Vec<f64>,
    last_s: f64,
    /// Events behind the row that waits.
    later: VecDeque<(Duration, String)>,
    /// Events behind the row that was handed out last.
    due: VecDeque<(Duration, String)>,
    dropped: u64,
}

/// Contents of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum LogItem<'a> {
    /// A row: one value for each of [`LogRows::columns`], NaN where there is none; their times rise.
    Row(&'a [f64]),
    /// Something that happened while it was recorded.
    Event(Duration, String),
}

impl<'a, R: BufRead> LogRows<'a, R> {
    /// Reads the header; `source` is the log's name in messages.
    ///
    /// # Errors
    /// [`LogError`]; a log without `time_s` has no rows in time.
    pub fn new(reader: R, source: impl Into<Cow<'a, str>>, map: &ColumnMap) -> Result<Self, LogError> {
        let source = source.into();
        let mut lines = Lines::new(reader, source.clone());
        let mut start = None;
        let header = Header::read(&mut lines, |comment| {
            start = start.or(std::str::from_utf8(comment).ok().and_then(recording::parse_start));
        })?;
        let cells = Cells::new(Plan::new(&header, &source, map)?, header);
        let time = cells.plan.targets.iter().position(|target| target.name == "time_s");
        let Some(time) = time else { return Err(no_time(&source, &cells)) };
        let row = Vec::with_capacity(cells.plan.targets.len());
        let last_s = f64::NEG_INFINITY;
        let (later, due) = (VecDeque::new(), VecDeque::new());
        Ok(Self { lines, cells, time, start, waiting: None, row, last_s, later, due, dropped: 0 })
    }

    /// Names of the columns, in the order of the values of a row.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.cells.plan.targets.iter().map(|target| target.name.as_str())
    }

    /// Number of the column `time_s`.
    pub fn time_column(&self) -> usize {
        self.time
    }

    /// Time zero of `time_s` since 1970; recordings only.
    pub fn start(&self) -> Option<Duration> {
        self.start
    }

    /// Bytes read so far.
    pub fn bytes(&self) -> u64 {
        self.lines.bytes()
    }

    /// Rows that were dropped so far.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The first problems so far, and how many there are.
    pub fn problems(&self) -> (&[LineProblem], usize) {
        (&self.cells.problems.kept, self.cells.problems.count)
    }

    /// The next row or event.
    ///
    /// # Errors
    /// [`LogError`] of the reader or of a row without end.
    pub fn next_item(&mut self) -> Result<Option<LogItem<'_>>, LogError> {
        if let Some((time, what)) = self.due.pop_front() {
            return Ok(Some(LogItem::Event(time, what)));
        }
        while let Some(line) = self.lines.next_line()? {
            let row = match line {
                Line::Row(row) => row,
                Line::Comment(text) => {
                    let text = String::from_utf8_lossy(text);
                    let Some((time, what)) = recording::parse_event(&text) else { continue };
                    if self.waiting.is_none() {
                        return Ok(Some(LogItem::Event(time, what.to_owned())));
                    }
                    self.later.push_back((time, what.to_owned()));
                    continue;
                }
            };
            let line = row.line;
            if !self.cells.read(&row) {
                self.dropped += 1;
            } else if self.take_in(line) {
                self.due.append(&mut self.later);
                return Ok(Some(LogItem::Row(&self.row)));
            }
        }
        let Some((values, _)) = self.waiting.take() else { return Ok(None) };
        self.due.append(&mut self.later);
        self.row = values;
        Ok(Some(LogItem::Row(&self.row)))
    }

    /// Takes the row in the cells in; whether the one that waited may now be handed out.
    fn take_in(&mut self, line: u64) -> bool {
        let time_s = self.cells.value(self.time);
        let waiting_s = self.waiting.as_ref().map_or(self.last_s, |(values, _)| values[self.time]);
        if time_s <= self.last_s {
            self.drop_row(time_s, line);
            return false;
        }
        let follows = time_s > waiting_s;
        let count = self.cells.plan.targets.len();
        let values = (0..count).map(|column| self.cells.value(column)).collect();
        match self.waiting.replace((values, line)) {
            Some((before, _)) if follows => {
                self.last_s = waiting_s;
                self.row = before;
                true
            }
            // The one before was too far ahead.
            Some((_, line)) => {
                self.drop_row(waiting_s, line);
                false
            }
            None => false,
        }
    }

    fn drop_row(&mut self, time_s: f64, line: u64) {
        self.dropped += 1;
        self.cells.problems.add(line, "time_s", || {
            format!("{time_s} s is not between the times around it; the row was skipped")
        });
    }
}

fn no_time(source: &str, cells: &Cells) -> LogError {
    let names: Vec<&str> = cells.header.names.iter().map(String::as_str).collect();
    LogError::MissingColumns {
        file: source.to_owned(),
        kind: LogKind::nearest(|name| names.contains(&name)),
        missing: "time_s".to_owned(),
        present: super::listed(&names),
        example: super::map_example(&["time_s"], &names),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> (Vec<Vec<f64>>, Vec<String>, Vec<String>) {
        let map = ColumnMap::default();
        let mut log = LogRows::new(text.as_bytes(), "run.csv", &map).unwrap();
        let (mut rows, mut events) = (Vec::new(), Vec::new());
        while let Some(item) = log.next_item().unwrap() {
            match item {
                LogItem::Row(values) => rows.push(values.to_vec()),
                LogItem::Event(time, text) => events.push(format!("{time:?} {text}")),
            }
        }
        assert_eq!(log.dropped() as usize, log.problems().1);
        let problems = log.problems().0.iter().map(ToString::to_string).collect();
        (rows, events, problems)
    }

    #[test]
    fn rows_come_one_by_one_with_the_events_between_them() {
        let text = "# flqr recording: x\n# time_s counts from 7.000500 s after 1970\n\
                    time_s,motor_angle_rad,torque_nm\n0,1,2\n# 0.500 s stop: done\n# note\n1,3,4\n2,5,";
        let (rows, events, problems) = rows(text);
        assert_eq!(rows, [[0.0, 1.0, 2.0], [1.0, 3.0, 4.0]]);
        assert_eq!(events, ["500ms stop: done"]);
        assert_eq!(problems, ["line 8: the recording ends in the middle of this row, which was skipped"]);
        let map = ColumnMap::default();
        let log = LogRows::new(text.as_bytes(), "run.csv", &map).unwrap();
        assert_eq!(log.start(), Some(Duration::from_micros(7_000_500)));
        assert_eq!(log.columns().collect::<Vec<_>>(), ["time_s", "motor_angle_rad", "torque_nm"]);
    }

    #[test]
    fn a_row_out_of_time_goes_and_its_neighbours_stay() {
        for (times, kept) in [
            (&["0", "1", "2"][..], &[0.0, 1.0, 2.0][..]),
            (&["0", "1", "1", "2"], &[0.0, 1.0, 2.0]),
            // Either of the two may be the wrong one.
            (&["0", "1", "0.5", "2"], &[0.0, 0.5, 2.0]),
            (&["0", "1", "999", "2", "3"], &[0.0, 1.0, 2.0, 3.0]),
            (&["0", "1", "x", "2", "-4"], &[0.0, 1.0, 2.0]),
        ] {
            let lines: String = times.iter().map(|time| format!("{time},0,0\n")).collect();
            let (rows, _, problems) = rows(&format!("time_s,motor_angle_rad,torque_nm\n{lines}"));
            let found: Vec<f64> = rows.iter().map(|row| row[0]).collect();
            assert_eq!((found.as_slice(), problems.len()), (kept, times.len() - kept.len()), "{times:?}");
        }
    }

    #[test]
    fn a_log_without_time_is_refused() {
        let map = ColumnMap::default();
        let error = LogRows::new("speed_rad_s,torque_nm\n1,2\n".as_bytes(), "pairs.csv", &map).err().unwrap();
        let message = error.to_string();
        assert!(message.contains("needs `time_s`, but the file has `speed_rad_s`, `torque_nm`"), "{message}");
    }
}
