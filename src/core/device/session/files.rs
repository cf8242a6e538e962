//! Files that a session reads.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::record::recording::Names;
use crate::record::{ColumnMap, LogRows, Replay, ReplayFile};

/// Text that is read at once, bytes.
const BUFFER: usize = 1 << 16;

/// A file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct FileError {
    file: PathBuf,
    problem: String,
}

impl FileError {
    fn new(file: &Path, error: &io::Error) -> Self {
        let problem = match error.kind() {
            io::ErrorKind::NotFound => "there is no such file: check the path".to_owned(),
            io::ErrorKind::PermissionDenied => {
                "permission denied: check the permissions of the file".to_owned()
            }
            io::ErrorKind::IsADirectory => "this is a folder: give a file".to_owned(),
            _ => format!("cannot read the file: {error}"),
        };
        Self { file: file.to_owned(), problem }
    }
}

/// Opens a recording by the name of it or of one of its files: its robot log with the raw frames next to it, or raw
/// frames alone.
pub(super) fn open_recording(name: &Path) -> Result<Replay<BufReader<File>>, super::SessionError> {
    let names = Names::new(name);
    let named = if name.extension().is_none() && !name.exists() { &names.robot_log } else { name };
    let mut file = open(named)?;
    if holds_frames(&mut file.reader, named) {
        return Ok(Replay::new(None, Some(file), start_beside(&names, named))?);
    }
    let has_frames =
        names.robot_log == named && fs::metadata(&names.frames).is_ok_and(|about| about.len() > 0);
    let frames = if has_frames { Some(open(&names.frames)?) } else { None };
    Ok(Replay::new(Some(file), frames, None)?)
}

/// Reads a text file, of a longer one only so many bytes. What is not UTF-8 is taken as Latin-1, in which DBC files
/// write the sign of degrees.
pub(super) fn read_text(name: &Path, limit: usize) -> Result<String, FileError> {
    let mut bytes = Vec::new();
    let ReplayFile { reader, .. } = open(name)?;
    reader.take(limit as u64).read_to_end(&mut bytes).map_err(|error| FileError::new(name, &error))?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| error.as_bytes().iter().map(|byte| char::from(*byte)).collect()))
}

fn open(path: &Path) -> Result<ReplayFile<BufReader<File>>, FileError> {
    let opened = File::open(path).and_then(|file| {
        let is_folder = file.metadata()?.is_dir();
        if is_folder { Err(io::ErrorKind::IsADirectory.into()) } else { Ok(file) }
    });
    let file = opened.map_err(|error| FileError::new(path, &error))?;
    Ok(ReplayFile { name: path.display().to_string(), reader: BufReader::with_capacity(BUFFER, file) })
}

/// Whether this is raw frames, of an empty file by its name; a reader that fails now will fail again when it is read.
fn holds_frames(reader: &mut impl BufRead, name: &Path) -> bool {
    reader.fill_buf().is_ok_and(|text| match text {
        [] => name.extension().is_some_and(|ending| ending == "log"),
        text => text.trim_ascii_start().starts_with(b"("),
    })
}

/// What times count from in the robot log next to raw frames, where there is one.
fn start_beside(names: &Names, frames: &Path) -> Option<std::time::Duration> {
    if names.frames != frames {
        return None;
    }
    let ReplayFile { name, reader } = open(&names.robot_log).ok()?;
    let rows: Result<LogRows<'_, _>, _> = LogRows::new(reader, name, &ColumnMap::default());
    rows.ok()?.start()
}
