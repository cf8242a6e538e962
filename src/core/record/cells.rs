//! Cells of a row on their way to numbers.

use super::plan::{Need, Plan};
use super::text::{Header, Row, for_each_cell};
use super::{LineProblem, Log};

/// Largest magnitude of a measured value: far above any in SI units, and its fourth power is a finite number.
const LARGEST: f64 = 1e30;

/// The numbers of one row, and what was wrong with the rows so far.
pub(super) struct Cells {
    pub(super) plan: Plan,
    pub(super) header: Header,
    pub(super) problems: Problems,
    /// Values of the row that was read last, by the file's columns.
    row: Vec<f64>,
}

/// The first problems, and how many there are.
#[derive(Default)]
pub(super) struct Problems {
    pub(super) kept: Vec<LineProblem>,
    pub(super) count: usize,
}

impl Problems {
    pub(super) fn add(&mut self, line: u64, column: &str, problem: impl FnOnce() -> String) {
        self.count += 1;
        if self.kept.len() < Log::KEPT_PROBLEMS {
            self.kept.push(LineProblem { line, column: column.to_owned(), problem: problem() });
        }
    }
}

impl Cells {
    pub(super) fn new(plan: Plan, header: Header) -> Self {
        let row = vec![f64::NAN; header.names.len()];
        Self { plan, header, problems: Problems::default(), row }
    }

    /// Reads a row; false where it is to be dropped, and then the problems say why.
    pub(super) fn read(&mut self, row: &Row) -> bool {
        if row.torn {
            self.problems.add(row.line, "", || {
                "the recording ends in the middle of this row, which was skipped".to_owned()
            });
            return false;
        }
        self.parse(row) && self.scales(row.line)
    }

    /// Value of the log's column in the row that was read last; NaN where there is none.
    pub(super) fn value(&self, column: usize) -> f64 {
        let target = &self.plan.targets[column];
        let value = self.row[target.from] * target.factor;
        if is_usable(value) { value } else { f64::NAN }
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
            if !is_usable(*value) && is_damage(cell, *value, need) {
                usable &= need != Need::Required;
                problems.add(row.line, &header.names[index], || complaint(cell, need));
            }
            if !is_usable(*value) {
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
            format!("the row has {count} cells, but the header has {wanted}; it was skipped")
        });
        false
    }

    /// Returns whether the factors of the map leave every required value finite.
    fn scales(&mut self, line: u64) -> bool {
        let Self { plan, header, row, problems, .. } = self;
        let mut usable = true;
        for target in plan.targets.iter().filter(|target| target.factor != 1.0) {
            let (value, factor, need) = (row[target.from], target.factor, plan.needs[target.from]);
            if value.is_finite() && !is_usable(value * factor) && need != Need::Unknown {
                usable &= need != Need::Required;
                problems.add(line, &header.names[target.from], || {
                    format!("{value:e} times {factor:e} is too large for a measurement, {}", outcome(need))
                });
            }
        }
        usable
    }
}

fn is_usable(value: f64) -> bool {
    value.abs() <= LARGEST
}

fn parse_number(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

/// Returns whether a cell without a finite number is worth a problem. An empty cell, and NaN, is how a recorder says
/// that there is no value of an optional column.
fn is_damage(cell: &[u8], value: f64, need: Need) -> bool {
    match need {
        Need::Unknown => false,
        Need::Optional => !(cell.is_empty() || cell.eq_ignore_ascii_case(b"nan")) || value.abs() > LARGEST,
        Need::Required => true,
    }
}

fn complaint(cell: &[u8], need: Need) -> String {
    const SHOWN: usize = 24;
    let text = String::from_utf8_lossy(cell);
    let what = match &*text {
        "" => "the cell is empty".to_owned(),
        text => match text.parse::<f64>() {
            Ok(value) if value.is_finite() => format!("`{text}` is too large for a measurement"),
            Ok(_) => format!("`{text}` is not a finite number"),
            Err(_) if text.replacen(',', ".", 1).parse::<f64>().is_ok() => {
                format!("`{text}` has a decimal comma instead of a point")
            }
            Err(_) => format!("`{}` is not a number", text.chars().take(SHOWN).collect::<String>()),
        },
    };
    format!("{what}, {}", outcome(need))
}

/// Effect of damage on a row.
fn outcome(need: Need) -> &'static str {
    if need == Need::Required { "the row was skipped" } else { "the value is left out" }
}
