//! A table with the paper's numbers and ours at the same places.

use serde::Serialize;

use super::phrases::sig;
use crate::report::{Cell, Column as ReportColumn, Table as ReportTable, number};

/// Ours next to theirs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Key for scripts, such as `table_5`.
    pub id: String,
    /// Title with the place in the paper.
    pub title: String,
    /// Quantities.
    pub columns: Vec<Column>,
    /// Names of the rows, with the unit where it differs from row to row.
    pub rows: Vec<String>,
    /// Ours, row by row; `None` if there is no such number.
    pub ours: Vec<Vec<Option<f64>>>,
    /// The paper's, row by row; `None` if it prints none.
    pub paper: Vec<Vec<Option<f64>>>,
    #[serde(skip)]
    pub(super) digits: Digits,
    #[serde(skip)]
    pub(super) note: String,
}

/// Head of a column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// Name of the quantity.
    pub name: String,
    /// Its unit; empty where it has none or the rows name it.
    pub unit: &'static str,
}

/// Number format of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Digits {
    Fixed(usize),
    Significant(usize),
    /// Three significant digits without zeros at the end.
    Short,
}

impl Digits {
    pub(super) fn show(self, value: f64) -> String {
        match self {
            Self::Fixed(decimals) => number::fixed(value, decimals),
            Self::Significant(digits) => number::significant(value, digits),
            Self::Short => sig(value),
        }
    }
}

impl Table {
    /// An empty table with these columns.
    pub(super) fn new(
        id: impl Into<String>,
        title: impl Into<String>,
        columns: &[(&str, &'static str)],
    ) -> Self {
        let column = |&(name, unit): &(&str, &'static str)| Column { name: name.to_owned(), unit };
        Self {
            id: id.into(),
            title: title.into(),
            columns: columns.iter().map(column).collect(),
            rows: Vec::new(),
            ours: Vec::new(),
            paper: Vec::new(),
            digits: Digits::Significant(3),
            note: String::new(),
        }
    }

    pub(super) fn digits(self, digits: Digits) -> Self {
        Self { digits, ..self }
    }

    pub(super) fn note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// Adds a row; what is not a finite number is none.
    pub(super) fn push(
        &mut self,
        name: impl Into<String>,
        paper: impl IntoIterator<Item = Option<f64>>,
        ours: impl IntoIterator<Item = Option<f64>>,
    ) {
        let whole = |values: Vec<Option<f64>>| {
            let mut values: Vec<_> =
                values.into_iter().map(|value| value.filter(|v| v.is_finite())).collect();
            values.resize(self.columns.len(), None);
            values
        };
        self.rows.push(name.into());
        self.paper.push(whole(paper.into_iter().collect()));
        self.ours.push(whole(ours.into_iter().collect()));
    }

    /// The table as a report shows it: the columns that the paper has any number in, then ours.
    pub(super) fn to_report(&self) -> ReportTable {
        let has = |values: &[Vec<Option<f64>>], column: usize| values.iter().any(|row| row[column].is_some());
        let grouped = (0..self.columns.len()).any(|column| has(&self.paper, column));
        let sides = [("paper", &self.paper), ("ours", &self.ours)];
        let shown: Vec<_> = sides
            .into_iter()
            .flat_map(|(side, values)| (0..self.columns.len()).map(move |column| (side, values, column)))
            .filter(|(_, values, column)| has(values, *column))
            .collect();
        let head = |&(side, _, column): &(&str, &Vec<Vec<Option<f64>>>, usize)| {
            let Column { name, unit } = &self.columns[column];
            match (grouped, self.columns.len()) {
                (false, _) => ReportColumn::new(name.as_str(), unit),
                // One column needs no heading over it.
                (true, 1) => ReportColumn::new(side, unit),
                (true, _) => ReportColumn::grouped(side, name.as_str(), unit),
            }
        };
        let cell = |value: Option<f64>| value.map_or(Cell::Empty, |v| Cell::Number(self.digits.show(v)));
        let row = |(row, name): (usize, &String)| {
            let cells = shown.iter().map(|(_, values, column)| cell(values[row][*column]));
            [Cell::text(name.as_str())].into_iter().chain(cells).collect()
        };
        ReportTable {
            caption: self.title.clone(),
            columns: [ReportColumn::new("", "")].into_iter().chain(shown.iter().map(head)).collect(),
            rows: self.rows.iter().enumerate().map(row).collect(),
            note: self.note.clone(),
        }
    }
}
