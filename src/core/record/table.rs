//! Rows of numbers on their way to columns.

use super::cells::{Cells, Problems};
use super::error::places;
use super::plan::Plan;
use super::text::{Header, Row};
use super::time::{Misfits, misfits};
use super::{Column, Log, LogError, RowLines};

/// The columns read so far.
pub(super) struct Table {
    cells: Cells,
    columns: Vec<Vec<f64>>,
    lines: RowLines,
    dropped: usize,
    max_values: usize,
}

impl Table {
    pub(super) fn new(plan: Plan, header: Header, max_values: usize) -> Self {
        let columns = plan.targets.iter().map(|_| Vec::new()).collect();
        let lines = RowLines::default();
        Self { cells: Cells::new(plan, header), columns, lines, dropped: 0, max_values }
    }

    /// Rows read, dropped ones included.
    pub(super) fn rows(&self) -> usize {
        self.kept() + self.dropped
    }

    fn kept(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Takes a row in, or drops it and notes why.
    pub(super) fn push(&mut self, row: &Row, file: &str) -> Result<(), LogError> {
        if self.cells.read(row) {
            self.keep(row.line, file)
        } else {
            self.dropped += 1;
            Ok(())
        }
    }

    fn keep(&mut self, line: u64, file: &str) -> Result<(), LogError> {
        let row = self.kept();
        if (row + 1) * self.columns.len() > self.max_values {
            let (file, limit) = (file.to_owned(), self.max_values);
            return Err(LogError::TooLarge { file, line, limit, mebibytes: limit / (1 << 17) });
        }
        for (index, column) in self.columns.iter_mut().enumerate() {
            column.push(self.cells.value(index));
        }
        self.lines.push(row, line);
        Ok(())
    }

    fn line_of(&self, row: usize) -> u64 {
        self.lines.line(row).expect("every kept row has its line")
    }

    /// The log, once every row is in.
    pub(super) fn into_log(mut self, file: &str) -> Result<Log, LogError> {
        self.drop_rows_out_of_time(file)?;
        let (rows, dropped_rows) = (self.rows(), self.dropped);
        self.cells.problems.kept.sort_by_key(|problem| problem.line);
        let Problems { kept: problems, count: problem_count } = self.cells.problems;
        match problems.first() {
            Some(first) if dropped_rows * 2 > rows => {
                let problems = match problems.len() {
                    1 => first.to_string(),
                    _ => format!("{first}; {} in total", places(&problems, problem_count)),
                };
                return Err(LogError::MostlyBad { file: file.to_owned(), bad: dropped_rows, rows, problems });
            }
            _ if rows == 0 => {
                return Err(LogError::HeaderOnly { file: file.to_owned(), line: self.cells.header.line });
            }
            _ => {}
        }
        let names = self.cells.plan.targets.into_iter().map(|target| target.name);
        let columns = names.zip(self.columns).map(|(name, values)| Column { name, values }).collect();
        let lines = self.lines;
        Ok(Log { source: file.to_owned(), columns, dropped_rows, problems, problem_count, lines })
    }

    fn drop_rows_out_of_time(&mut self, file: &str) -> Result<(), LogError> {
        let is_time = |target: &super::plan::Target| target.name == "time_s";
        let Some(column) = self.cells.plan.targets.iter().position(is_time) else { return Ok(()) };
        let Some(Misfits { rows, from_s, to_s, first }) = misfits(&self.columns[column]) else {
            return Ok(());
        };
        // A glitch of the recorder is a few rows; more is a file of another making.
        if rows.len() > 3.max(self.kept() / 100) {
            let (file, line, rows) = (file.to_owned(), self.line_of(first), rows.len());
            return Err(LogError::TimeRunsBack {
                file,
                line,
                from_s,
                to_s,
                rows,
                remedy: remedy(from_s, to_s),
            });
        }
        for &row in &rows {
            let time = self.columns[column][row];
            let line = self.line_of(row);
            let name = &self.cells.header.names[self.cells.plan.targets[column].from];
            self.cells.problems.add(line, name, || {
                format!("{time} s is not between the times around it; the row was skipped")
            });
        }
        let mut lines: Vec<u64> = (0..self.kept()).map(|row| self.line_of(row)).collect();
        remove_rows(&mut lines, &rows);
        self.lines = RowLines::default();
        lines.into_iter().enumerate().for_each(|(row, line)| self.lines.push(row, line));
        for values in &mut self.columns {
            remove_rows(values, &rows);
        }
        self.dropped += rows.len();
        Ok(())
    }
}

fn remedy(from_s: f64, to_s: f64) -> &'static str {
    if from_s == to_s {
        "write the time with more digits, or keep one row for each time"
    } else {
        "split the file where the time restarts"
    }
}

/// Removes rows, given in rising order.
fn remove_rows<T>(values: &mut Vec<T>, rows: &[usize]) {
    let mut rest = rows.iter().peekable();
    let mut index = 0;
    values.retain(|_| {
        let remove = rest.next_if(|&&row| row == index).is_some();
        index += 1;
        !remove
    });
}
