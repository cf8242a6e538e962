//! Names of a recording's files.

use std::path::{Path, PathBuf};

use crate::model::Motor;

/// Names of a recording's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The robot log.
    pub robot_log: PathBuf,
    /// The raw frames.
    pub frames: PathBuf,
    /// Bench logs of the left and the right motor.
    pub bench: [PathBuf; 2],
}

impl Names {
    /// The files of a recording called `name`, which may be said with the ending of the robot log or of the
    /// frames.
    pub fn new(name: &Path) -> Self {
        // Without a slash at the end.
        let name = name.components().as_path();
        let stem = if is_part(name) { name.with_extension("") } else { name.to_owned() };
        let with = |ending: &str| {
            let mut path = stem.as_os_str().to_owned();
            path.push(ending);
            PathBuf::from(path)
        };
        let bench = [Motor::Left, Motor::Right].map(|motor| with(&format!(".{motor}.csv")));
        Self { robot_log: with(".csv"), frames: with(".log"), bench }
    }
}

fn is_part(name: &Path) -> bool {
    name.extension().is_some_and(|ending| ["csv", "log"].iter().any(|part| ending.eq_ignore_ascii_case(part)))
}
