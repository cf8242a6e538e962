//! File dialogs on a separate thread, and an honest word when the desktop has none.
//!
//! Without a desktop portal the dialog library returns the same "nothing chosen" as for Cancel, at once. So
//! the portal is looked for first, and an answer faster than a person can give counts as a failure.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::command::FilePurpose;
use crate::document::EXTENSION;
use crate::job::{Job, Waker};
use crate::refine::RefineFile;

/// Nobody sees and cancels a dialog faster than this.
const FASTEST_PERSON: Duration = Duration::from_millis(150);

/// Advice if no dialog opens.
fn instead(purpose: FilePurpose) -> &'static str {
    match purpose {
        FilePurpose::SaveModel
        | FilePurpose::SaveFigure(_)
        | FilePurpose::SaveExperiment(_)
        | FilePurpose::Refine(RefineFile::Save(_)) => "type a path above and press Save",
        FilePurpose::SaveRecording => "type a path above and press Record",
        FilePurpose::OpenReplay => "type the path above",
        FilePurpose::SaveSession => "type a path and press OK",
        FilePurpose::OpenModel
        | FilePurpose::OpenLog
        | FilePurpose::OpenSession
        | FilePurpose::Refine(RefineFile::Log) => "type the path instead, or drop the file onto the window",
    }
}

/// Result of a dialog.
#[derive(Debug, PartialEq)]
pub(crate) enum Answer {
    Chosen(PathBuf),
    Cancelled,
    /// No dialog appeared; one sentence says why and what to do.
    Unavailable(String),
}

/// An open dialog.
pub(crate) struct Dialog {
    pub(crate) purpose: FilePurpose,
    pub(crate) job: Job<(), Answer>,
}

impl Dialog {
    /// Opens a dialog; `suggestion` is the file name offered for saving.
    pub(crate) fn open(purpose: FilePurpose, suggestion: String, waker: &Waker) -> std::io::Result<Self> {
        let job = Job::start("file-dialog", waker, move |_| ask(purpose, &suggestion))?;
        Ok(Self { purpose, job })
    }
}

fn ask(purpose: FilePurpose, suggestion: &str) -> Answer {
    if let Some(problem) = missing_portal() {
        return Answer::Unavailable(format!("{problem}: {}.", instead(purpose)));
    }
    let start = Instant::now();
    let dialog = rfd::FileDialog::new();
    let chosen = match purpose {
        FilePurpose::OpenModel => dialog.set_title("Open a model").add_filter("Model", &["toml"]).pick_file(),
        FilePurpose::SaveModel => dialog.set_title("Save the model").set_file_name(suggestion).save_file(),
        FilePurpose::SaveExperiment(saved_as) => {
            dialog.set_title(saved_as.title()).set_file_name(suggestion).save_file()
        }
        FilePurpose::SaveRecording => {
            dialog.set_title("Record to").add_filter("Log", &["csv"]).set_file_name(suggestion).save_file()
        }
        FilePurpose::SaveFigure(_) => {
            dialog.set_title("Save the figure").set_file_name(suggestion).save_file()
        }
        FilePurpose::OpenSession => {
            dialog.set_title("Open a session").add_filter("Session", &[EXTENSION]).pick_file()
        }
        FilePurpose::SaveSession => {
            dialog.set_title("Save the session").set_file_name(suggestion).save_file()
        }
        FilePurpose::OpenReplay => {
            dialog.set_title("Replay a recording").add_filter("Recording", &["csv", "log"]).pick_file()
        }
        FilePurpose::Refine(RefineFile::Save(saved_as)) => {
            dialog.set_title(saved_as.title()).set_file_name(suggestion).save_file()
        }
        FilePurpose::OpenLog | FilePurpose::Refine(RefineFile::Log) => {
            dialog.set_title("Open a log").add_filter("Log", &["csv", "txt"]).pick_file()
        }
    };
    match chosen {
        Some(path) => Answer::Chosen(path),
        None if start.elapsed() < FASTEST_PERSON => Answer::Unavailable(format!(
            "The desktop's file dialog did not open (its portal may be missing or broken): {}.",
            instead(purpose)
        )),
        None => Answer::Cancelled,
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn missing_portal() -> Option<&'static str> {
    None
}

/// Reason why no dialog is available: no session bus, or nothing on it that offers one.
#[cfg(target_os = "linux")]
pub(crate) fn missing_portal() -> Option<&'static str> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let on_path = |program: &str| {
        set("PATH").is_some_and(|path| std::env::split_paths(&path).any(|dir| dir.join(program).is_file()))
    };
    if on_path("zenity") {
        return None;
    }
    let bus = set("DBUS_SESSION_BUS_ADDRESS").is_some()
        || set("XDG_RUNTIME_DIR").is_some_and(|dir| PathBuf::from(dir).join("bus").exists());
    if !bus {
        return Some("There is no file dialog here (no session bus for a desktop portal)");
    }
    let directories =
        set("XDG_DATA_DIRS").unwrap_or_else(|| std::ffi::OsString::from("/usr/local/share:/usr/share"));
    let service = "dbus-1/services/org.freedesktop.portal.Desktop.service";
    (!std::env::split_paths(&directories).any(|dir| dir.join(service).is_file()))
        .then_some("There is no file dialog here (xdg-desktop-portal is not installed)")
}
