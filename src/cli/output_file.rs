//! Output files of commands.

use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::Once;

use clap::Args;
use flqr_core::device::{abandon_replacements, check_replaceable, real_path, replace_file};
use flqr_core::record::{self, mcap, recording};
use flqr_core::report::Document;

use super::output::Failure;

/// First line of the models that commands write.
const MODEL_LINE: &str = "# Written by flqr\n";
/// Length of the part of a file that identifies its writer, bytes.
const OPENING: u64 = 1 << 12;

/// Exit code after Ctrl+C or a termination signal, as in shells.
const INTERRUPTED: i32 = 130;

/// Overwriting of files.
#[derive(Args, Clone, Copy, Default, PartialEq)]
pub(crate) struct Force {
    /// Also overwrite recordings and files that flqr did not write. Without it, only earlier results of flqr
    /// and empty files are overwritten. An input is never overwritten
    #[arg(long)]
    force: bool,
}

/// Output file of a command.
#[derive(Clone, Copy)]
pub(crate) struct OutputFile<'a> {
    pub(crate) path: &'a Path,
    /// Its name in messages, such as "report".
    pub(crate) what: &'static str,
}

impl<'a> OutputFile<'a> {
    /// Creates an output that messages call `what`.
    pub(crate) fn new(path: &'a Path, what: &'static str) -> Self {
        Self { path, what }
    }

    /// Replaces the whole file.
    pub(crate) fn write(self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
        remove_temporary_files_at_interrupt();
        let buffered = |file: &mut File| {
            let mut file = BufWriter::with_capacity(1 << 16, file);
            content(&mut file)?;
            file.flush()
        };
        replace_file(self.path, buffered).map_err(|error| self.unwritable(&error))
    }

    /// Writes a model, marked as written by flqr.
    pub(crate) fn write_model(self, toml: &str) -> Result<(), Failure> {
        self.write(|out| write!(out, "{MODEL_LINE}{toml}"))
    }

    /// Renames an earlier result so that it is not mistaken for one of this run; returns its new name.
    pub(crate) fn put_aside(self) -> Result<Option<PathBuf>, Failure> {
        let named = |number: u32| {
            let mut name = self.path.as_os_str().to_owned();
            name.push(if number == 1 { ".old".to_owned() } else { format!(".old{number}") });
            PathBuf::from(name)
        };
        if !self.path.metadata().is_ok_and(|about| about.is_file()) {
            return Ok(None);
        }
        let free = (1..).map(named).find(|path| path.symlink_metadata().is_err()).unwrap_or_else(|| named(0));
        fs::rename(self.path, &free).map_err(|error| self.unwritable(&error))?;
        Ok(Some(free))
    }

    fn unwritable(self, error: &io::Error) -> Failure {
        let Self { path, what } = self;
        Failure::Output(format!(
            "{}: cannot write the {what}: {error}: check the folder, its permissions and the space on the disk",
            path.display()
        ))
    }

    fn refused(self, why: &str) -> Failure {
        Failure::Output(format!("{}: {why}", self.path.display()))
    }
}

/// Removes temporary files when the program is interrupted. Commands with a robot
/// have another handler and do not use this.
fn remove_temporary_files_at_interrupt() {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        // Without the handler a file may be left behind, which is no reason to write none.
        ctrlc::set_handler(|| abandon_replacements(|| process::exit(INTERRUPTED))).unwrap_or(());
    });
}

/// Checks the outputs of a command before its work starts. Refuses an input, one file for two outputs,
/// a missing or read-only folder, and without `force` a recording or a file that flqr did not write.
pub(crate) fn check(inputs: &[&Path], outputs: &[OutputFile], force: Force) -> Result<(), Failure> {
    let read: Vec<_> = inputs.iter().filter_map(|path| Identity::of(path)).collect();
    let mut written: Vec<(Identity, &str)> = Vec::new();
    for output in outputs {
        check_replaceable(output.path).map_err(|error| output.unwritable(&error))?;
        let Some(identity) = Identity::of(output.path) else { continue };
        if read.contains(&identity) {
            let why = format!("the {} would overwrite an input file: choose another name", output.what);
            return Err(output.refused(&why));
        }
        if let Some((_, other)) = written.iter().find(|(other, _)| *other == identity) {
            let why =
                format!("the {other} and the {} have the same name: give each a different name", output.what);
            return Err(output.refused(&why));
        }
        if !force.force {
            check_origin(*output)?;
        }
        written.push((identity, output.what));
    }
    Ok(())
}

/// Refuses to overwrite anything but an earlier result.
fn check_origin(output: OutputFile) -> Result<(), Failure> {
    let origin = match File::open(output.path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        opened => opened.and_then(Origin::of),
    };
    match origin.map_err(|error| output.unwritable(&error))? {
        Origin::Result => Ok(()),
        Origin::Recording => {
            Err(output
                .refused("this is a recording and is not overwritten: choose another name, or use --force"))
        }
        Origin::Unknown => Err(output.refused(
            "this file was not written by flqr and is not overwritten: choose another name, or use --force",
        )),
    }
}

/// Origin of a file.
#[derive(Debug, PartialEq)]
enum Origin {
    /// Result of a command of flqr, or empty.
    Result,
    /// Recording of flqr.
    Recording,
    Unknown,
}

impl Origin {
    fn of(mut file: File) -> io::Result<Self> {
        let mut opening = Vec::new();
        Read::by_ref(&mut file).take(OPENING).read_to_end(&mut opening)?;
        let mut ending = [0; 2];
        if opening.len() > ending.len() {
            file.seek(SeekFrom::End(-2))?;
            file.read_exact(&mut ending)?;
        }
        let is_result = opening.is_empty()
            || opening.starts_with(MODEL_LINE.as_bytes())
            || Document::is_opening_of_html(&opening)
            || mcap::is_opening(&opening)
            || flqr_gui::is_opening_of_state(&opening)
            || record::is_written_log(&opening, ending);
        Ok(match opening.starts_with(recording::FIRST_LINE.as_bytes()) {
            true => Self::Recording,
            false if is_result => Self::Result,
            false => Self::Unknown,
        })
    }
}

/// Identity of a file independent of its path. `None` for devices and pipes, which are not replaced.
#[derive(Debug, PartialEq)]
enum Identity {
    /// Device and inode of an existing file.
    #[cfg(unix)]
    Number(u64, u64),
    Path(PathBuf),
}

impl Identity {
    fn of(path: &Path) -> Option<Self> {
        let path = real_path(path).ok()?;
        match fs::metadata(&path) {
            Ok(about) if !about.is_file() => None,
            Ok(about) => Some(Self::of_file(path, &about)),
            Err(_) => Some(Self::Path(path)),
        }
    }

    #[cfg(unix)]
    fn of_file(_: PathBuf, about: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self::Number(about.dev(), about.ino())
    }

    #[cfg(not(unix))]
    fn of_file(path: PathBuf, _: &Metadata) -> Self {
        Self::Path(path)
    }
}
