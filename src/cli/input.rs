//! Files that commands read.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use flqr_core::model_file::{Model, RobotModel};

use super::output::Failure;

/// Reads a whole small text file.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| unreadable(path, &error))
}

/// Opens a file for buffered reading; its size in bytes comes along for progress.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64), Failure> {
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let bytes = file.metadata().map_err(|error| unreadable(path, &error))?.len();
    Ok((BufReader::with_capacity(1 << 16, file), bytes))
}

/// Loads a model file.
pub(crate) fn load_model(path: &Path) -> Result<Model, Failure> {
    Model::from_toml(&read_text(path)?, &path.display().to_string()).map_err(Failure::from_error)
}

/// Loads a model file that must describe a robot.
pub(crate) fn load_robot(path: &Path) -> Result<(String, RobotModel), Failure> {
    let model = load_model(path)?;
    match model.robot() {
        Some(robot) => Ok((model.name.clone(), *robot)),
        None => Err(Failure::Message(format!(
            "{}: this command needs a robot, but the file describes a single axis: give a model with a [robot] table",
            path.display()
        ))),
    }
}

fn unreadable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Message(format!("{}: cannot read the file: {error}", path.display()))
}
