//! Files used lately and the column map, kept in the user's configuration folder.
//!
//! The file is a convenience: whatever is wrong with it, the program starts, with an empty list.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::job::{Job, Outcome, Reporter, Waker};
use crate::write_file::write_file;

const VERSION: u32 = 1;
const LONGEST_LIST: usize = 8;

/// Files used lately, newest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Recent {
    version: u32,
    /// Logs.
    pub(crate) logs: Vec<PathBuf>,
    /// Models.
    pub(crate) models: Vec<PathBuf>,
    /// Recordings that were replayed.
    pub(crate) recordings: Vec<PathBuf>,
    /// The column map as typed last.
    pub(crate) column_map: String,
    /// CAN interface connected to last.
    pub(crate) can_interface: String,
    /// SLCAN adapter connected to last: port and bit rate.
    pub(crate) slcan: [String; 2],
    /// IMU connected to last: port and baud rate.
    pub(crate) imu: [String; 2],
    /// Session files.
    pub(crate) sessions: Vec<PathBuf>,
    /// True if the tour was seen or skipped.
    pub(crate) tour_done: bool,
}

impl Recent {
    /// The list in `text`; empty when it is damaged or of another version.
    pub(crate) fn from_json(text: &str) -> Self {
        let read: Self = serde_json::from_str(text).unwrap_or_default();
        if read.version == VERSION { read } else { Self::default() }
    }

    /// The list for its file.
    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string_pretty(&Self { version: VERSION, ..self.clone() })
            .expect("paths that came from text and strings always have a JSON form")
    }

    pub(crate) fn note_log(&mut self, path: &Path) {
        note(&mut self.logs, path);
    }

    pub(crate) fn note_recording(&mut self, path: &Path) {
        note(&mut self.recordings, path);
    }

    pub(crate) fn note_session(&mut self, path: &Path) {
        note(&mut self.sessions, path);
    }

    pub(crate) fn note_model(&mut self, path: &Path) {
        note(&mut self.models, path);
    }
}

fn note(list: &mut Vec<PathBuf>, path: &Path) {
    // A path that is not Unicode has no place in a JSON file.
    if path.to_str().is_none() {
        return;
    }
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    list.retain(|other| *other != path);
    list.insert(0, path);
    list.truncate(LONGEST_LIST);
}

/// Default path of the list; `None` if the system defines no folder.
pub(crate) fn default_file() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let config = if cfg!(windows) {
        folder("APPDATA")?
    } else if cfg!(target_os = "macos") {
        folder("HOME")?.join("Library/Application Support")
    } else {
        folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?
    };
    Some(config.join("flqr").join("recent.json"))
}

/// The file of the list. One write at a time, so that the last list wins; losing it is no reason to bother anyone.
pub(crate) struct RecentFile {
    path: PathBuf,
    job: Option<Job<(), ()>>,
    /// The newest list that came during a write.
    waiting: Option<String>,
}

impl RecentFile {
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path, job: None, waiting: None }
    }

    /// Writes the list on a thread, after the write that goes on.
    pub(crate) fn save(&mut self, recent: &Recent, waker: &Waker) {
        self.waiting = Some(recent.to_json());
        self.drain(waker);
    }

    /// Starts the write that waits, once the one of before has ended.
    pub(crate) fn drain(&mut self, waker: &Waker) {
        if self.job.as_mut().is_some_and(|job| matches!(job.poll().1, Outcome::Running)) {
            return;
        }
        let path = self.path.clone();
        self.job = self.waiting.take().and_then(|text| {
            let write = move |_: &Reporter<()>| {
                write_file(&path, text.as_bytes()).ok();
            };
            Job::start("save-recent", waker, write).ok()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_lists_the_last_is_kept() {
        let path = std::env::temp_dir().join(format!("flqr-recent-{}.json", std::process::id()));
        let waker: Waker = std::sync::Arc::new(|| {});
        let mut file = RecentFile::new(path.clone());
        let mut recent = Recent::default();
        for number in 0..200 {
            recent.note_log(Path::new(&format!("/{number}.csv")));
            file.save(&recent, &waker);
        }
        while file.job.is_some() {
            file.drain(&waker);
            std::thread::yield_now();
        }
        assert_eq!(Recent::from_json(&std::fs::read_to_string(&path).unwrap()).logs, recent.logs);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_damaged_or_newer_list_is_an_empty_one() {
        for text in ["", "{\"logs\": [", "[]", "{\"version\": 2, \"logs\": [\"a.csv\"]}", "\u{0}"] {
            assert_eq!(Recent::from_json(text), Recent::default(), "{text:?}");
        }
    }

    #[test]
    fn the_newest_comes_first_and_once() {
        let mut recent = Recent::default();
        for name in ["/a.csv", "/b.csv", "/a.csv"] {
            recent.note_log(Path::new(name));
        }
        assert_eq!(recent.logs, [PathBuf::from("/a.csv"), PathBuf::from("/b.csv")]);
        let read = Recent::from_json(&recent.to_json());
        assert_eq!(read.logs, recent.logs);
    }
}
