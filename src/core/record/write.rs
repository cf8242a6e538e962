//! Writing logs.

use std::borrow::Cow;
use std::io::{self, Write};

use super::Log;

/// Line end of the last row of a log that flqr computed; all others end in LF. Readers of CSV take either, and
/// nothing else writes both, so that such a log is distinguished from a measured one of the same columns.
const LAST_LINE_END: [u8; 2] = *b"\r\n";

/// Writes a computed log as CSV, every number with the fewest digits that read back to the same number; an empty cell
/// for NaN. [`super::read_log`] reads it back to the same columns, and [`is_written_log`] recognises it.
///
/// # Errors
/// Errors of the writer.
///
/// ```
/// use flqr_core::record::{Log, write_log};
///
/// let log = Log::from_columns("pairs.csv", [("speed_rad_s", vec![1.0]), ("torque_nm", vec![0.25])]);
/// let mut text = Vec::new();
/// write_log(&log, &mut text)?;
/// assert_eq!(String::from_utf8(text)?.lines().next(), Some("speed_rad_s,torque_nm"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_log(log: &Log, mut writer: impl Write) -> io::Result<()> {
    let row = |row: usize| log.columns.iter().map(move |column| column.values[row]);
    let mut rows = LogWriter::new(&mut writer, log.columns.iter().map(|column| &*column.name))?;
    let Some(last) = log.rows().checked_sub(1) else { return rows.finish() };
    (0..last).try_for_each(|number| rows.push(row(number)))?;
    rows.finish()?;
    let csv = csv::WriterBuilder::new().terminator(csv::Terminator::CRLF).from_writer(writer);
    let mut end = LogWriter { csv, cell: String::new() };
    end.push(row(last))?;
    end.finish()
}

/// Returns whether a file that begins and ends with these bytes was written by [`write_log`] and not changed since.
pub fn is_written_log(opening: &[u8], ending: [u8; 2]) -> bool {
    let header = opening.split(|&byte| byte == b'\n').next().unwrap_or_default();
    ending == LAST_LINE_END && header.starts_with(b"time_s,") && !header.ends_with(b"\r")
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
    /// Errors of the writer.
    pub fn new<'n>(writer: W, names: impl Iterator<Item = &'n str>) -> io::Result<Self> {
        let mut csv = csv::Writer::from_writer(writer);
        for name in names {
            csv.write_field(&*text_cell(name))?;
        }
        csv.write_record(None::<&[u8]>)?;
        Ok(Self { csv, cell: String::new() })
    }

    /// Writes a row: one value for each name.
    ///
    /// # Errors
    /// Errors of the writer, and a wrong number of values.
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
    /// Errors of the writer.
    pub fn finish(mut self) -> io::Result<()> {
        self.csv.flush()
    }
}

/// A text as a cell of CSV that no spreadsheet takes for a formula: an apostrophe goes before one that begins as such.
pub(crate) fn text_cell(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}").into() } else { text.into() }
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
