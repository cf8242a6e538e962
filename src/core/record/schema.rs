//! The columns that a log may have, and the kinds of logs that they make.

use std::fmt;

use serde::Serialize;

use super::recording::{self, ROW_COLUMNS};
use super::sample::{SAMPLE_COLUMNS, Sample};

/// Kind of a log, recognised from its columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LogKind {
    /// One motor: [`BENCH`].
    Bench,
    /// One linear axis: [`LINEAR_AXIS`].
    LinearAxis,
    /// The wheel-legged robot: [`ROBOT`].
    Robot,
    /// One row for each pair of speed and friction torque: [`FRICTION_PAIRS`].
    FrictionPairs,
}

/// Required columns of a bench log.
pub const BENCH: &[&str] = &["time_s", "motor_angle_rad", "torque_nm"];
/// Required columns of a linear axis log.
pub const LINEAR_AXIS: &[&str] = &["time_s", "position_m", "force_n"];
/// Required columns of a robot log.
pub const ROBOT: [&str; 11] = Sample::COLUMNS;
/// Required columns of a file of friction pairs.
pub const FRICTION_PAIRS: &[&str] = &["speed_rad_s", "torque_nm"];
/// Columns that a log of an axis may have next to the required ones.
const OPTIONAL: [&str; 4] =
    ["motor_speed_rad_s", "motor_temperature_c", "target_speed_rad_s", "velocity_m_s"];

/// Column of a log: its name, which ends in the unit, and the place of its value in a row.
pub(super) struct Column<Row, Value> {
    pub(super) name: &'static str,
    /// Topic and field in an MCAP file; `None` for the topic of all other columns.
    pub(super) topic: Option<(&'static str, &'static str)>,
    pub(super) place: fn(&mut Row) -> &mut Value,
}

/// Names of some columns.
pub(super) const fn names<Row, Value, const N: usize>(
    columns: &[Column<Row, Value>; N],
) -> [&'static str; N] {
    let mut names = [""; N];
    let mut at = 0;
    while at < N {
        names[at] = columns[at].name;
        at += 1;
    }
    names
}

/// Topic and field of a robot log's column in an MCAP file.
pub(super) fn topic(name: &str) -> Option<(&'static str, &'static str)> {
    let of_sample = SAMPLE_COLUMNS.iter().find(|column| column.name == name).map(|column| column.topic);
    let of_row = || ROW_COLUMNS.iter().find(|column| column.name == name).map(|column| column.topic);
    of_sample.or_else(of_row).flatten()
}

impl LogKind {
    /// Every kind, in the order in which a file is tried.
    pub const ALL: [Self; 4] = [Self::Robot, Self::Bench, Self::LinearAxis, Self::FrictionPairs];

    /// The columns that a log of this kind must have.
    pub fn required(self) -> &'static [&'static str] {
        match self {
            Self::Bench => BENCH,
            Self::LinearAxis => LINEAR_AXIS,
            Self::Robot => &ROBOT,
            Self::FrictionPairs => FRICTION_PAIRS,
        }
    }

    /// Returns whether a file with these columns can be read as this kind.
    ///
    /// Rows with a time stamp are samples of a motion, so `speed_rad_s` and `torque_nm` next to `time_s`
    /// are not friction pairs.
    pub fn fits(self, has: impl Fn(&str) -> bool) -> bool {
        self.required().iter().all(|name| has(name)) && !(self == Self::FrictionPairs && has("time_s"))
    }

    /// The kind of a file with these columns, if they are complete for one.
    ///
    /// ```
    /// use flqr_core::record::LogKind;
    ///
    /// let columns = ["time_s", "position_m", "force_n", "velocity_m_s"];
    /// assert_eq!(LogKind::recognise(|name| columns.contains(&name)), Some(LogKind::LinearAxis));
    /// ```
    pub fn recognise(has: impl Fn(&str) -> bool) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.fits(&has))
    }

    /// The kind that a file with these columns most probably was meant to be: the largest fraction of
    /// required columns, the kind with fewer columns first. Time alone says nothing; speeds without time are
    /// pairs.
    pub(crate) fn nearest(has: impl Fn(&str) -> bool) -> Self {
        if has("speed_rad_s") && !has("time_s") {
            return Self::FrictionPairs;
        }
        let share = |kind: Self| {
            let required = kind.required().iter().filter(|&&name| name != "time_s");
            let present = required.clone().filter(|name| has(name)).count();
            present * 100 / required.count()
        };
        let mut nearest = Self::Bench;
        for kind in [Self::LinearAxis, Self::Robot] {
            if share(kind) > share(nearest) {
                nearest = kind;
            }
        }
        nearest
    }
}

impl fmt::Display for LogKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Bench => "bench log",
            Self::LinearAxis => "linear axis log",
            Self::Robot => "robot log",
            Self::FrictionPairs => "file of friction pairs",
        })
    }
}

/// Returns whether a name is one of the schema.
pub fn is_known(name: &str) -> bool {
    known().any(|known| known == name)
}

/// Every name of the schema, each once.
pub fn known() -> impl Iterator<Item = &'static str> {
    let later = |names: &'static [&'static str]| names.iter().copied().filter(|&name| name != "time_s");
    ROBOT
        .iter()
        .copied()
        .chain(later(BENCH))
        .chain(later(LINEAR_AXIS))
        .chain(["speed_rad_s"])
        .chain(OPTIONAL)
        .chain(recording::OPTIONAL_COLUMNS)
}
