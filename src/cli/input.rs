//! Command-line inputs: files and times.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use flqr_core::model::{Model, RobotModel};
use flqr_core::model_file::renamed_keys;

use super::output::{Failure, complain};

/// Largest text file that is read whole, bytes: a Riccati equation with 500 states is smaller.
const LARGEST_TEXT: u64 = 64 << 20;

/// Reads a whole text file of at most 64 MiB; the limit also ends devices that never do.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(LARGEST_TEXT + 1).read_to_string(&mut text));
    match read {
        Ok(bytes) if bytes as u64 > LARGEST_TEXT => Err(Failure::Input(format!(
            "{}: the file is larger than the limit of {} MiB for text: check the path",
            path.display(),
            LARGEST_TEXT >> 20
        ))),
        Ok(_) => Ok(text),
        Err(error) => Err(unreadable(path, &error)),
    }
}

/// Opens a file for buffered reading; also returns its size in bytes for progress.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64), Failure> {
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let about = file.metadata().map_err(|error| unreadable(path, &error))?;
    if about.is_dir() {
        return Err(unreadable(path, &io::ErrorKind::IsADirectory.into()));
    }
    Ok((BufReader::with_capacity(1 << 16, file), about.len()))
}

/// Loads a model file; warns of values in an implausible unit and notes renamed keys.
pub(crate) fn load_model(path: &Path) -> Result<Model, Failure> {
    let text = read_text(path)?;
    let model = Model::from_toml(&text, &path.display().to_string()).map_err(Failure::from_input)?;
    for key in renamed_keys(&text) {
        complain(&format!("note: {}: {key}", path.display()));
    }
    for warning in model.warnings() {
        complain(&format!("warning: {}: {warning}", path.display()));
    }
    Ok(model)
}

/// Returns the warnings of a model as text.
pub(crate) fn warnings_of(model: &Model) -> Vec<String> {
    model.warnings().iter().map(ToString::to_string).collect()
}

/// Loads a model file that must describe a robot.
pub(crate) fn load_robot(path: &Path) -> Result<(String, RobotModel), Failure> {
    robot_of(&load_model(path)?, path)
}

/// Returns name and robot of a loaded model that must describe a robot.
pub(crate) fn robot_of(model: &Model, path: &Path) -> Result<(String, RobotModel), Failure> {
    match model.robot() {
        Some(robot) => Ok((model.name.clone(), robot.clone())),
        None => Err(Failure::Input(format!(
            "{}: this command needs a robot, but the file describes a single axis: give a model with a [robot] table",
            path.display()
        ))),
    }
}

/// Parses a time in seconds.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.001..=1e6).contains(&seconds) => Ok(seconds),
        _ => Err("it must be a number of seconds from 0.001 to 1000000".to_owned()),
    }
}

fn unreadable(path: &Path, error: &io::Error) -> Failure {
    let problem = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file: check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied: check the permissions of the file".to_owned(),
        io::ErrorKind::IsADirectory => "this is a folder: give a file".to_owned(),
        io::ErrorKind::InvalidData => "this is not a text file: check the path".to_owned(),
        _ => format!("cannot read the file: {error}"),
    };
    Failure::Input(format!("{}: {problem}", path.display()))
}
