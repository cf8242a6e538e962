//! A first look at a log.

use super::Log;

/// First rows and the range of each column.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// One entry for each column, in their order.
    pub columns: Vec<ColumnSummary>,
    /// The first rows; one value for each column, NaN where there is none.
    pub rows: Vec<Vec<f64>>,
}

/// Range of a column; the numbers are NaN where it has no value.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnSummary {
    /// Name with unit.
    pub name: String,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean of the values.
    pub mean: f64,
    /// Rows without a value.
    pub missing: usize,
}

/// The first `rows` rows of a log and the range of each column.
pub fn preview(log: &Log, rows: usize) -> Preview {
    let row = |row: usize| log.columns.iter().map(|column| column.values[row]).collect();
    Preview {
        columns: log.columns.iter().map(|column| summary(&column.name, &column.values)).collect(),
        rows: (0..rows.min(log.rows())).map(row).collect(),
    }
}

fn summary(name: &str, values: &[f64]) -> ColumnSummary {
    let (mut min, mut max, mut sum, mut count) = (f64::NAN, f64::NAN, 0.0, 0_usize);
    for &value in values.iter().filter(|value| value.is_finite()) {
        // A comparison with NaN keeps the number.
        min = f64::min(min, value);
        max = f64::max(max, value);
        sum += value;
        count += 1;
    }
    ColumnSummary { name: name.to_owned(), min, max, mean: sum / count as f64, missing: values.len() - count }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_do_not_spoil_the_ranges() {
        let log = Log::from_columns("a", [("x_m", vec![f64::NAN, 1.0, -3.0]), ("y", vec![f64::NAN; 3])]);
        let preview = preview(&log, 2);
        assert_eq!(preview.rows.len(), 2);
        assert_eq!(preview.rows[1][0], 1.0);
        let x = &preview.columns[0];
        assert_eq!((x.min, x.max, x.mean, x.missing), (-3.0, 1.0, -1.0, 1));
        let y = &preview.columns[1];
        assert!(y.min.is_nan() && y.max.is_nan() && y.mean.is_nan() && y.missing == 3);
    }
}
