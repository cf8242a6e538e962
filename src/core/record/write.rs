//! Writing logs.

use std::io::{self, Write};

use super::Log;

/// Writes a log as CSV, every number with the fewest digits that read back to the same number; an empty cell
/// for NaN. [`super::read_log`] reads it back to the same columns.
///
/// # Errors
/// What the writer reports.
pub fn write_log(log: &Log, writer: impl Write) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(writer);
    csv.write_record(log.columns.iter().map(|column| column.name.as_bytes()))?;
    let mut cell = String::new();
    for row in 0..log.rows() {
        for column in &log.columns {
            cell.clear();
            push_number(&mut cell, column.values[row]);
            csv.write_field(&cell)?;
        }
        csv.write_record(None::<&[u8]>)?;
    }
    csv.flush()
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
