//! Reading logs.

use std::io::BufRead;
use std::ops::ControlFlow;

use super::plan::Plan;
use super::table::Table;
use super::text::{Header, Lines};
use super::{ColumnMap, Log, LogError};

/// Progress is reported about this often.
const WATCH_BYTES: u64 = 1 << 16;

/// Options for reading a log.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions<'a> {
    /// Column map.
    pub map: &'a ColumnMap,
    /// Largest number of values in memory, all columns together, 8 bytes each.
    pub max_values: usize,
}

impl<'a> ReadOptions<'a> {
    /// Default limit: 128 Mi values, 1 GiB.
    pub const MAX_VALUES: usize = 1 << 27;

    /// The default limit, with this map.
    pub fn new(map: &'a ColumnMap) -> Self {
        Self { map, max_values: Self::MAX_VALUES }
    }
}

/// Progress of reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadProgress {
    /// Bytes taken from the reader.
    pub bytes: u64,
    /// Rows read.
    pub rows: usize,
}

/// Reads a log from CSV text; `source` is its name in messages. `watch` is called about every 64 KiB and at
/// the end.
///
/// # Errors
/// See [`LogError`]; the head of [`crate::record`] says which damage is an error and which a problem of a line.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use flqr_core::record::{ColumnMap, ReadOptions, read_log};
///
/// let text = "time_s,motor_angle_rad,current_a\n0.000,0.0,0.5\n0.001,0.1,0.5\n";
/// let map = ColumnMap::new(vec!["torque_nm=current_a*0.32".parse()?])?;
/// let log = read_log(text.as_bytes(), "log.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()))?;
/// assert_eq!(log.column("torque_nm"), Some(&[0.16, 0.16][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_log(
    reader: impl BufRead,
    source: &str,
    options: &ReadOptions,
    watch: &mut dyn FnMut(ReadProgress) -> ControlFlow<()>,
) -> Result<Log, LogError> {
    let mut lines = Lines::new(reader, source);
    let header = Header::read(&mut lines, |_| ())?;
    let mut table = Table::new(Plan::new(&header, source, options.map)?, header, options.max_values);
    let mut watched = 0;
    let mut report = |bytes, rows, line| match watch(ReadProgress { bytes, rows }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(LogError::Cancelled { file: source.to_owned(), line }),
    };
    while let Some(row) = lines.next_row()? {
        table.push(&row, source)?;
        if lines.bytes() - watched >= WATCH_BYTES {
            watched = lines.bytes();
            report(watched, table.rows(), lines.line())?;
        }
    }
    report(lines.bytes(), table.rows(), lines.line())?;
    table.into_log(source)
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
