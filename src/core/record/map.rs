//! Column maps: how the columns of any CSV become those of the schema.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::schema;

/// One entry of a column map, written `ours=theirs` or `ours=theirs*factor`.
///
/// `theirs` is always the file's own column, also where the names coincide: `torque_nm=torque_nm*6.33`
/// multiplies the file's `torque_nm`.
///
/// ```
/// use flqr_core::record::Mapping;
/// let mapping: Mapping = "torque_nm=current_a*0.32".parse()?;
/// assert_eq!((mapping.theirs.as_str(), mapping.factor), ("current_a", 0.32));
/// # Ok::<(), flqr_core::record::MapError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mapping {
    /// A column of the schema, unit included.
    pub ours: String,
    /// The file's column.
    pub theirs: String,
    /// Factor from the file's values to the signal.
    pub factor: f64,
}

/// A column map: at most one entry for each of our columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Mapping>", into = "Vec<Mapping>")]
pub struct ColumnMap {
    entries: Vec<Mapping>,
}

/// Reason why a column map is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// No `=`, or nothing next to it.
    #[error(
        "column map `{entry}` must have the form signal=column or signal=column*factor, \
         such as torque_nm=current_a*0.32"
    )]
    Form {
        /// The entry as it was written.
        entry: String,
    },
    /// A factor that is not a usable number.
    #[error(
        "factor `{factor}` in the column map `{entry}` must be a finite number other than 0, such as *0.32"
    )]
    Factor {
        /// The entry as it was written.
        entry: String,
        /// Text after the `*`.
        factor: String,
    },
    /// A name on the left that no log has.
    #[error("column map for `{ours}`: unknown signal; the name on the left must be one of {known}")]
    UnknownColumn {
        /// The name on the left.
        ours: String,
        /// The names that are allowed.
        known: String,
    },
    /// Two entries for one of our columns.
    #[error("column map for `{ours}` is given twice: keep either `{first}` or `{second}`")]
    Twice {
        /// The name on the left.
        ours: String,
        /// First entry.
        first: String,
        /// Second entry.
        second: String,
    },
}

impl FromStr for Mapping {
    type Err = MapError;

    fn from_str(entry: &str) -> Result<Self, MapError> {
        let form = || MapError::Form { entry: entry.to_owned() };
        let (ours, right) = entry.split_once('=').ok_or_else(form)?;
        let (theirs, factor) = match right.rsplit_once('*') {
            Some((theirs, factor)) => (theirs, parse_factor(entry, factor.trim())?),
            None => (right, 1.0),
        };
        let (ours, theirs) = (ours.trim(), theirs.trim());
        if ours.is_empty() || theirs.is_empty() {
            return Err(form());
        }
        if !schema::is_known(ours) {
            let known = schema::known().collect::<Vec<_>>().join(", ");
            return Err(MapError::UnknownColumn { ours: ours.to_owned(), known });
        }
        Ok(Self { ours: ours.to_owned(), theirs: theirs.to_owned(), factor })
    }
}

fn parse_factor(entry: &str, factor: &str) -> Result<f64, MapError> {
    match factor.parse::<f64>() {
        Ok(value) if value.is_finite() && value != 0.0 => Ok(value),
        _ => Err(MapError::Factor { entry: entry.to_owned(), factor: factor.to_owned() }),
    }
}

impl fmt::Display for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}", self.ours, self.theirs)?;
        if self.factor == 1.0 { Ok(()) } else { write!(f, "*{}", self.factor) }
    }
}

impl ColumnMap {
    /// A map of these entries.
    ///
    /// # Errors
    /// Two entries for the same column of ours.
    pub fn new(entries: Vec<Mapping>) -> Result<Self, MapError> {
        for (index, second) in entries.iter().enumerate() {
            if let Some(first) = entries[..index].iter().find(|first| first.ours == second.ours) {
                return Err(MapError::Twice {
                    ours: second.ours.clone(),
                    first: first.to_string(),
                    second: second.to_string(),
                });
            }
        }
        Ok(Self { entries })
    }

    /// The entries, in the order in which they were given.
    pub fn entries(&self) -> &[Mapping] {
        &self.entries
    }
}

impl TryFrom<Vec<Mapping>> for ColumnMap {
    type Error = MapError;

    fn try_from(entries: Vec<Mapping>) -> Result<Self, MapError> {
        Self::new(entries)
    }
}

impl From<ColumnMap> for Vec<Mapping> {
    fn from(map: ColumnMap) -> Self {
        map.entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read_and_written_back() {
        for (text, ours, theirs, factor) in [
            ("torque_nm=current_a*0.32", "torque_nm", "current_a", 0.32),
            ("torque_nm=torque_nm*6.33", "torque_nm", "torque_nm", 6.33),
            (" motor_angle_rad = Angle (rad) ", "motor_angle_rad", "Angle (rad)", 1.0),
            ("force_n=a*b*-1e-3", "force_n", "a*b", -1e-3),
        ] {
            let mapping: Mapping = text.parse().unwrap();
            assert_eq!(mapping, Mapping { ours: ours.into(), theirs: theirs.into(), factor });
            assert_eq!(mapping.to_string().parse::<Mapping>().unwrap(), mapping);
        }
    }

    #[test]
    fn broken_entries_name_the_mend() {
        for (text, expected) in [
            ("torque_nm", "must have the form"),
            ("=current_a", "must have the form"),
            ("torque_nm=*2", "must have the form"),
            ("torque_nm=current_a*", "factor ``"),
            ("torque_nm=current_a*0", "must be a finite number other than 0"),
            ("torque_nm=current_a*two", "factor `two`"),
            ("torque_nm=current_a*inf", "must be a finite number"),
            ("torque=current_a", "must be one of time_s, x_m"),
        ] {
            let message = text.parse::<Mapping>().unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }

    #[test]
    fn one_column_cannot_be_mapped_twice() {
        let entries = ["torque_nm=a", "torque_nm=b*2"].map(|text| text.parse().unwrap());
        let message = ColumnMap::new(entries.to_vec()).unwrap_err().to_string();
        assert_eq!(
            message,
            "column map for `torque_nm` is given twice: keep either `torque_nm=a` or `torque_nm=b*2`"
        );
    }
}
