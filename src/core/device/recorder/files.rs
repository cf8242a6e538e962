//! The files of a recording as they grow.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{Item, RecorderError};
use crate::model::Motor;
use crate::record::recording::{self, About, Names};

/// Largest piece that is handed to the system at once, bytes.
const BLOCK: usize = 1 << 16;

/// The files of a recording; the bench logs only where they are wanted.
pub(super) struct Files {
    pub(super) robot_log: Part,
    pub(super) frames: Part,
    pub(super) bench: Vec<Part>,
}

impl Files {
    /// Makes all files, or none.
    pub(super) fn create(names: &Names, about: &About, bench: bool) -> Result<Self, RecorderError> {
        let mut made = Vec::new();
        let done = Self::create_each(names, about, bench, &mut made);
        if done.is_err() {
            for file in made {
                // What matters is the first error.
                fs::remove_file(file).unwrap_or(());
            }
        }
        done
    }

    fn create_each(
        names: &Names,
        about: &About,
        bench: bool,
        made: &mut Vec<PathBuf>,
    ) -> Result<Self, RecorderError> {
        let mut create = |file: &Path, header: String| {
            let part = Part::create(file, header)?;
            made.push(file.to_owned());
            Ok(part)
        };
        let robot_log = create(&names.robot_log, recording::robot_header(about))?;
        let frames = create(&names.frames, String::new())?;
        let motors = names.bench.iter().zip(Motor::BOTH).filter(|_| bench);
        let bench = motors.map(|(file, motor)| create(file, recording::bench_header(about, motor)));
        let bench = bench.collect::<Result<_, _>>()?;
        Ok(Self { robot_log, frames, bench })
    }

    pub(super) fn push(&mut self, about: &About, item: &Item) {
        match item {
            Item::Row(row) => {
                recording::push_row(&mut self.robot_log.text, row);
                self.robot_log.entries += 1;
            }
            Item::Bench(sample) => {
                for (part, motor) in self.bench.iter_mut().zip(Motor::BOTH) {
                    recording::push_bench_row(&mut part.text, sample, motor);
                }
            }
            Item::Frame(frame) => {
                recording::push_frame(&mut self.frames.text, about.start, &about.interface, frame);
                self.frames.entries += 1;
            }
            Item::ImuPacket(time, packet) => {
                recording::push_imu_packet(&mut self.frames.text, about.start, *time, packet);
                self.frames.entries += 1;
            }
            Item::Event(event) => {
                let what = format!("{}: {}", event.kind.name(), event.text);
                recording::push_event(&mut self.robot_log.text, event.time, &what);
            }
        }
    }

    fn parts(&mut self) -> impl Iterator<Item = &mut Part> {
        [&mut self.frames, &mut self.robot_log].into_iter().chain(&mut self.bench)
    }

    /// Hands the text in memory to the system; gives its length in bytes.
    pub(super) fn flush(&mut self) -> Result<u64, String> {
        self.parts().map(Part::flush).sum()
    }

    /// Puts the files on the disk itself, so that they outlast a loss of power.
    pub(super) fn sync(&mut self) -> Result<(), String> {
        self.parts().try_for_each(|part| part.file.sync().map_err(|error| part.problem(&error)))
    }

    /// Whether the files are still there. A deleted file takes text without complaint.
    pub(super) fn look(&mut self) -> Result<(), String> {
        self.parts().try_for_each(|part| part.file.look(&part.path).map_err(|error| part.problem(&error)))
    }
}

/// Where a file is written to.
pub(super) trait Disk: Write + Send {
    /// Waits until all that was written is on the disk itself.
    fn sync(&self) -> io::Result<()>;

    /// Fails where the file is no longer at its path.
    fn look(&self, path: &Path) -> io::Result<()>;
}

impl Disk for fs::File {
    fn sync(&self) -> io::Result<()> {
        match self.sync_data() {
            // Of a file system that has no disk.
            Err(error)
                if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) =>
            {
                Ok(())
            }
            done => done,
        }
    }

    fn look(&self, path: &Path) -> io::Result<()> {
        fs::metadata(path).map(drop)
    }
}

/// A file that grows.
pub(super) struct Part {
    pub(super) path: PathBuf,
    pub(super) file: Box<dyn Disk>,
    /// Text that is in memory only.
    pub(super) text: String,
    /// Entries in that text, a line each; and those that have been written.
    pub(super) entries: u64,
    pub(super) written: u64,
}

impl Part {
    fn create(path: &Path, header: String) -> Result<Self, RecorderError> {
        let open = fs::OpenOptions::new().write(true).create_new(true).open(path);
        let file = open.map_err(|error| not_created(path, error))?;
        Ok(Self { path: path.to_owned(), file: Box::new(file), text: header, entries: 0, written: 0 })
    }

    /// Hands the text to the system block by block; gives its length in bytes.
    fn flush(&mut self) -> Result<u64, String> {
        let mut done = 0;
        while done < self.text.len() {
            let end = self.text.len().min(done + BLOCK);
            match self.file.write(&self.text.as_bytes()[done..end]) {
                Ok(count) if count > 0 => done += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                failed => {
                    let error = failed.err().unwrap_or(io::ErrorKind::WriteZero.into());
                    // A line that is torn is lost.
                    let left = self.text.as_bytes()[done..].split(|byte| *byte == b'\n');
                    let left = left.filter(|line| !line.is_empty() && line[0] != b'#').count() as u64;
                    self.written += self.entries - left.min(self.entries);
                    self.entries = left.min(self.entries);
                    return Err(self.problem(&error));
                }
            }
        }
        self.written += std::mem::take(&mut self.entries);
        self.text.clear();
        Ok(done as u64)
    }

    fn problem(&self, error: &io::Error) -> String {
        let file = self.path.display();
        match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                format!(
                    "{file}: the disk is full and the recording has stopped: free disk space and start a new one"
                )
            }
            io::ErrorKind::NotFound => {
                format!(
                    "{file} is gone and the recording has stopped: do not move its folder, and start a new one"
                )
            }
            _ => {
                format!("{file}: {error}, and the recording has stopped: check the disk and start a new one")
            }
        }
    }
}

fn not_created(file: &Path, error: io::Error) -> RecorderError {
    let file = file.to_owned();
    match error.kind() {
        io::ErrorKind::AlreadyExists => RecorderError::Exists { file },
        io::ErrorKind::NotFound => {
            let folder = file.parent().unwrap_or(Path::new(".")).to_owned();
            RecorderError::NoFolder { file, folder }
        }
        _ => RecorderError::Failed { file, error },
    }
}
