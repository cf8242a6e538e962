//! Log arguments and data-health output.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use flqr_core::model::Motor;
use flqr_core::record::{self, ColumnMap, HealthFinding, Log, Mapping, ReadOptions};

use super::input;
use super::output::Failure;
use super::progress::Progress;

/// Motor on the command line.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum MotorName {
    Left,
    Right,
}

impl From<MotorName> for Motor {
    fn from(name: MotorName) -> Self {
        match name {
            MotorName::Left => Self::Left,
            MotorName::Right => Self::Right,
        }
    }
}

/// Column mapping of logs.
#[derive(Args, Default, PartialEq)]
pub(crate) struct Columns {
    /// Take a signal from a column of the file, with an optional factor, such as torque_nm=current_a*0.32; repeatable
    #[arg(long, value_name = "SIGNAL=COLUMN[*FACTOR]")]
    pub(crate) map: Vec<Mapping>,
}

impl Columns {
    pub(crate) fn checked(&self) -> Result<ColumnMap, Failure> {
        ColumnMap::new(self.map.clone()).map_err(Failure::from_error)
    }

    /// Reads logs, each with a progress bar.
    pub(crate) fn read(&self, paths: &[PathBuf]) -> Result<Vec<Log>, Failure> {
        let map = self.checked()?;
        paths.iter().map(|path| read(path, &map)).collect()
    }
}

fn read(path: &Path, map: &ColumnMap) -> Result<Log, Failure> {
    let (reader, bytes) = input::open(path)?;
    let source = path.display().to_string();
    let bar = Progress::new(format!("reading {source}"));
    let options = ReadOptions::new(map);
    record::read_log(reader, &source, &options, &mut |progress| {
        bar.set(progress.bytes, bytes);
        ControlFlow::Continue(())
    })
    .map_err(Failure::from_input)
}

/// Options of commands that estimate parameters from logs.
#[derive(Args)]
pub(crate) struct Estimated {
    /// Motor that a bench log belongs to, for a robot model
    #[arg(long, value_enum, default_value = "left")]
    pub(crate) motor: MotorName,
    /// Parameters to estimate from the logs without prior: `all`, or names as in the model file
    #[arg(long, value_delimiter = ',', value_name = "NAME,...")]
    pub(crate) estimate: Vec<String>,
    #[command(flatten)]
    pub(crate) columns: Columns,
    /// Random seed
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

pub(crate) fn print_health(out: &mut dyn Write, findings: &[HealthFinding]) -> io::Result<()> {
    findings.iter().try_for_each(|finding| writeln!(out, "{finding}"))
}
