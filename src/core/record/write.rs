//! Writing logs.

use std::io::{self, Write};

use super::Log;

/// Writes a log as CSV, every number with the fewest digits that read back to the same number; an empty cell
/// for NaN. [`super::read_log`] reads it back to the same columns.
///
/// # Errors
/// What the writer reports.
pub fn write_log(log: &Log, writer: impl Write) -> io::Result<()> {
    let mut rows = LogWriter::new(writer, log.columns.iter().map(|column| &*column.name))?;
    for row in 0..log.rows() {
        rows.push(log.columns.iter().map(|column| column.values[row]))?;
    }
    rows.finish()
}

/// Writes a log row by row, as [`write_log`] does, so that its length is no matter.
pub struct LogWriter<W: Write> {
    csv: csv::Writer<W>,
    cell: String,
}

impl<W: Write> LogWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn new<'n>(writer: W, names: impl Iterator<Item = &'n str>) -> io::Result<Self> {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(names)?;
        Ok(Self { csv, cell: String::new() })
    }

    /// Writes a row: one value for each name.
    ///
    /// # Errors
    /// What the writer reports, and a number of values that differs from that of the names.
    pub fn push(&mut self, values: impl Iterator<Item = f64>) -> io::Result<()> {
        for value in values {
            self.cell.clear();
            push_number(&mut self.cell, value);
            self.csv.write_field(&self.cell)?;
        }
        self.csv.write_record(None::<&[u8]>)?;
        Ok(())
    }

    /// Hands all to the writer.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn finish(mut self) -> io::Result<()> {
        self.csv.flush()
    }
}

/// Plain digits for usual magnitudes, an exponent for the others: `1e-300` in place of 300 zeros.
pub(super) fn push_number(cell: &mut String, value: f64) {
    use std::fmt::Write;
    let plain = value == 0.0 || (1e-5..1e16).contains(&value.abs());
    let written = match value {
        _ if value.is_nan() => Ok(()),
        _ if plain => write!(cell, "{value}"),
        _ => write!(cell, "{value:e}"),
    };
    written.expect("writing to a string cannot fail");
}
