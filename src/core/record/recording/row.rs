//! Rows of a recording's robot log.

use crate::record::Sample;
use crate::record::schema::{self, Column};

/// A row of a recording's robot log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Measured and commanded signals.
    pub sample: Sample,
    /// Newest temperature of the left and the right motor, °C.
    pub motor_temperature_c: [Option<f64>; 2],
    /// Newest voltage of the supply, V.
    pub bus_voltage_v: Option<f64>,
    /// Newest time from a query of a motor to its reply, of the slower motor, s.
    pub round_trip_s: Option<f64>,
}

/// Columns behind those of the sample; a row leaves out what is not known.
pub(in crate::record) const ROW_COLUMNS: [Column<Row, Option<f64>>; 4] = [
    Column {
        name: "motor_temperature_left_c",
        topic: Some(("/motors/left", "temperature_c")),
        place: |row| &mut row.motor_temperature_c[0],
    },
    Column {
        name: "motor_temperature_right_c",
        topic: Some(("/motors/right", "temperature_c")),
        place: |row| &mut row.motor_temperature_c[1],
    },
    Column {
        name: "bus_voltage_v",
        topic: Some(("/supply", "voltage_v")),
        place: |row| &mut row.bus_voltage_v,
    },
    Column { name: "round_trip_s", topic: None, place: |row| &mut row.round_trip_s },
];

/// Names of [`ROW_COLUMNS`].
pub(in crate::record) const OPTIONAL_COLUMNS: [&str; ROW_COLUMNS.len()] = schema::names(&ROW_COLUMNS);

impl Row {
    /// Names of the columns of a recording's robot log.
    pub fn columns() -> impl Iterator<Item = &'static str> {
        Sample::COLUMNS.into_iter().chain(OPTIONAL_COLUMNS)
    }

    /// A row of a sample and the values of [`OPTIONAL_COLUMNS`].
    pub(in crate::record) fn new(sample: Sample, optional: [Option<f64>; ROW_COLUMNS.len()]) -> Self {
        let mut row = Self::from(sample);
        for (column, value) in ROW_COLUMNS.iter().zip(optional) {
            *(column.place)(&mut row) = value;
        }
        row
    }

    /// Values of [`OPTIONAL_COLUMNS`].
    pub(in crate::record) fn optional(&self) -> [Option<f64>; ROW_COLUMNS.len()] {
        let mut row = *self;
        ROW_COLUMNS.map(|column| *(column.place)(&mut row))
    }
}

impl From<Sample> for Row {
    fn from(sample: Sample) -> Self {
        Self { sample, ..Self::default() }
    }
}
