//! Rows of cells on their way to columns of numbers.

use super::plan::{Need, Plan};
use super::text::{Header, Row, for_each_cell};
use super::time::{Misfits, misfits};
use super::{Column, LineProblem, Log, LogError, RowLines};

/// The columns read so far, and what was wrong with the rows.
pub(super) struct Table {
    plan: Plan,
    header: Header,
    columns: Vec<Vec<f64>>,
    /// Values of the row that is being read, by the file's columns.
    row: Vec<f64>,
    lines: RowLines,
    problems: Problems,
    dropped: usize,
    max_values: usize,
}

/// The first problems, and how many there are.
#[derive(Default)]
struct Problems {
    kept: Vec<LineProblem>,
    count: usize,
}

impl Problems {
    fn add(&mut self, line: u64, column: &str, problem: impl FnOnce() -> String) {
        self.count += 1;
        if self.kept.len() < Log::KEPT_PROBLEMS {
            self.kept.push(LineProblem { line, column: column.to_owned(), problem: problem() });
        }
    }
}

impl Table {
    pub(super) fn new(plan: Plan, header: Header, max_values: usize) -> Self {
        let columns = plan.targets.iter().map(|_| Vec::new()).collect();
        let row = vec![f64::NAN; header.names.len()];
        let lines = RowLines::default();
        Self { plan, header, columns, row, lines, problems: Problems::default(), dropped: 0, max_values }
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
        if self.parse(row) && self.scales(row.line) {
            self.keep(row.line, file)
        } else {
            self.dropped += 1;
            Ok(())
        }
    }

    /// Reads the cells; false where the row is to be dropped.
    fn parse(&mut self, row: &Row) -> bool {
        let Self { plan, header, row: values, problems, .. } = self;
        let before = problems.count;
        let (mut usable, mut spare) = (true, true);
        let count = for_each_cell(row.text, header.delimiter, |index, cell| {
            let Some(value) = values.get_mut(index) else {
                spare &= cell.is_empty();
                return;
            };
            let need = plan.needs[index];
            *value = parse_number(cell).unwrap_or(f64::NAN);
            if !value.is_finite() && is_damage(cell, *value, need) {
                usable &= need != Need::Required;
                problems.add(row.line, &header.names[index], || complaint(cell, need));
            }
            if !value.is_finite() {
                *value = f64::NAN;
            }
        });
        let wanted = header.names.len();
        if count >= wanted && spare {
            return usable;
        }
        // One problem for the row says more than those of its shifted cells.
        problems.kept.truncate(before);
        problems.count = before;
        problems.add(row.line, "", || {
            format!("the row has {count} cells where the header has {wanted}, it was dropped")
        });
        false
    }

    /// Whether the factors of the map leave every required value finite.
    fn scales(&mut self, line: u64) -> bool {
        let Self { plan, header, row, problems, .. } = self;
        let mut usable = true;
        for target in plan.targets.iter().filter(|target| target.factor != 1.0) {
            let (value, factor, need) = (row[target.from], target.factor, plan.needs[target.from]);
            if value.is_finite() && !(value * factor).is_finite() && need != Need::Unknown {
                usable &= need != Need::Required;
                problems.add(line, &header.names[target.from], || {
                    format!("{value:e} times {factor:e} is not a finite number, {}", outcome(need))
                });
            }
        }
        usable
    }

    fn keep(&mut self, line: u64, file: &str) -> Result<(), LogError> {
        let row = self.kept();
        if (row + 1) * self.columns.len() > self.max_values {
            let (file, limit) = (file.to_owned(), self.max_values);
            return Err(LogError::TooLarge { file, line, limit, mebibytes: limit / (1 << 17) });
        }
        for (column, target) in self.columns.iter_mut().zip(&self.plan.targets) {
            let value = self.row[target.from] * target.factor;
            column.push(if value.is_finite() { value } else { f64::NAN });
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
        self.problems.kept.sort_by_key(|problem| problem.line);
        let Problems { kept: problems, count: problem_count } = self.problems;
        match problems.first() {
            Some(first) if dropped_rows * 2 > rows => {
                let (file, first) = (file.to_owned(), first.clone());
                return Err(LogError::MostlyBad { file, bad: dropped_rows, rows, first });
            }
            _ if rows == 0 => {
                return Err(LogError::HeaderOnly { file: file.to_owned(), line: self.header.line });
            }
            _ => {}
        }
        let names = self.plan.targets.into_iter().map(|target| target.name);
        let columns = names.zip(self.columns).map(|(name, values)| Column { name, values }).collect();
        let lines = self.lines;
        Ok(Log { source: file.to_owned(), columns, dropped_rows, problems, problem_count, lines })
    }

    fn drop_rows_out_of_time(&mut self, file: &str) -> Result<(), LogError> {
        let is_time = |target: &super::plan::Target| target.name == "time_s";
        let Some(column) = self.plan.targets.iter().position(is_time) else { return Ok(()) };
        let Some(Misfits { rows, from_s, to_s, first }) = misfits(&self.columns[column]) else {
            return Ok(());
        };
        // A glitch of the recorder is a few rows; more is a file of another making.
        if rows.len() > 3.max(self.kept() / 100) {
            let (file, line, rows) = (file.to_owned(), self.line_of(first), rows.len());
            return Err(LogError::TimeRunsBack { file, line, from_s, to_s, rows, mend: mend(from_s, to_s) });
        }
        for &row in &rows {
            let time = self.columns[column][row];
            let line = self.line_of(row);
            let name = &self.header.names[self.plan.targets[column].from];
            self.problems.add(line, name, || {
                format!("{time} s does not fit between the times around it, the row was dropped")
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

fn mend(from_s: f64, to_s: f64) -> &'static str {
    if from_s == to_s {
        "write the time with more digits, or keep one row for each time"
    } else {
        "split the file where the time starts again"
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

fn parse_number(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

/// Whether a cell without a finite number is worth a problem. An empty cell, and NaN, is how a recorder says
/// that there is no value of an optional column.
fn is_damage(cell: &[u8], value: f64, need: Need) -> bool {
    match need {
        Need::Unknown => false,
        Need::Optional => !(cell.is_empty() || cell.eq_ignore_ascii_case(b"nan")) || value.is_infinite(),
        Need::Required => true,
    }
}

fn complaint(cell: &[u8], need: Need) -> String {
    const SHOWN: usize = 24;
    let text = String::from_utf8_lossy(cell);
    let what = match &*text {
        "" => "the cell is empty".to_owned(),
        text => match text.parse::<f64>() {
            Ok(_) => format!("`{text}` is not a finite number"),
            Err(_) if text.replacen(',', ".", 1).parse::<f64>().is_ok() => {
                format!("`{text}` has a decimal comma where a point belongs")
            }
            Err(_) => format!("`{}` is not a number", text.chars().take(SHOWN).collect::<String>()),
        },
    };
    format!("{what}, {}", outcome(need))
}

/// What damage does to a row.
fn outcome(need: Need) -> &'static str {
    if need == Need::Required { "the row was dropped" } else { "the value is left out" }
}
