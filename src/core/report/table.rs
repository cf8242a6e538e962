//! Tables: columns with units, numbers aligned at their decimal points.

use super::number;

/// A table with one heading row and, where columns are grouped, a row of groups above it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Shown above the table.
    pub caption: String,
    /// From left to right; the first one names the rows.
    pub columns: Vec<Column>,
    /// One cell for each column.
    pub rows: Vec<Vec<Cell>>,
    /// A remark below the table; may be empty.
    pub note: String,
}

/// The head of a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the quantity.
    pub title: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// Neighbours of one group stand under one heading; empty for none.
    pub group: String,
}

/// Table cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words, aligned left.
    Text(String),
    /// A number as it is to be read, aligned at the decimal point.
    Number(String),
    /// Nothing.
    Empty,
}

impl Column {
    /// A column without a group.
    pub fn new(title: impl Into<String>, unit: &'static str) -> Self {
        Self { title: title.into(), unit, group: String::new() }
    }

    /// A column that stands under a common heading with its neighbours.
    pub fn grouped(group: impl Into<String>, title: impl Into<String>, unit: &'static str) -> Self {
        Self { group: group.into(), ..Self::new(title, unit) }
    }

    pub(super) fn label(&self) -> String {
        if self.unit.is_empty() { self.title.clone() } else { format!("{}, {}", self.title, self.unit) }
    }
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number with that many decimals.
    pub fn fixed(value: f64, decimals: usize) -> Self {
        Self::Number(number::fixed(value, decimals))
    }

    /// A number with that many significant digits.
    pub fn significant(value: f64, digits: usize) -> Self {
        Self::Number(number::significant(value, digits))
    }

    pub(super) fn shown(&self) -> &str {
        match self {
            Self::Text(text) | Self::Number(text) => text,
            Self::Empty => "",
        }
    }
}

impl Table {
    /// Returns whether a column holds numbers and nothing else.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        let mut cells =
            self.rows.iter().filter_map(|row| row.get(column)).filter(|cell| **cell != Cell::Empty);
        cells.clone().next().is_some() && cells.all(|cell| matches!(cell, Cell::Number(_)))
    }

    /// Groups of neighbouring columns as name and number of columns; `None` if no column has a group.
    pub(super) fn groups(&self) -> Vec<(&str, usize)> {
        let mut groups: Vec<(&str, usize)> = Vec::new();
        for column in &self.columns {
            match groups.last_mut() {
                Some((name, count)) if *name == column.group => *count += 1,
                _ => groups.push((&column.group, 1)),
            }
        }
        if groups.iter().all(|(name, _)| name.is_empty()) { Vec::new() } else { groups }
    }

    /// Characters that a number lacks behind its decimal point, so that all of its column end alike: whether the
    /// point itself, and how many digits.
    pub(super) fn padding(&self, column: usize, text: &str) -> (bool, usize) {
        let decimals = |text: &str| text.split_once('.').map(|(_, decimals)| decimals.chars().count());
        let numbers = self.rows.iter().filter_map(|row| match row.get(column) {
            Some(Cell::Number(number)) => decimals(number),
            _ => None,
        });
        match (numbers.max(), decimals(text)) {
            (None, _) => (false, 0),
            (Some(most), None) => (true, most),
            (Some(most), Some(own)) => (false, most - own.min(most)),
        }
    }
}
