//! Where the running session is kept: one slot for each window that is open at the same time.
//!
//! A slot is a file and a lock that the system lets go of when the program ends, however it ends. A file in a slot
//! that nobody holds is what a window left behind that was not closed.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{EXTENSION, LARGEST_BYTES};
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::write_file::write_file;

/// Windows that are kept at the same time.
const SLOTS: usize = 8;
/// The session is looked at this often, while something happens.
const INTERVAL: Duration = Duration::from_secs(1);

/// Where sessions are usually kept; none where the system names no folder for it.
pub fn default_folder() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let state = if cfg!(windows) {
        folder("LOCALAPPDATA")?
    } else if cfg!(target_os = "macos") {
        folder("HOME")?.join("Library/Application Support")
    } else {
        folder("XDG_STATE_HOME").or_else(|| Some(folder("HOME")?.join(".local/state")))?
    };
    Some(state.join("flqr"))
}

/// What was found at the start.
pub(crate) struct Opened {
    /// Its slot; none where all are taken or the folder cannot be used.
    pub(crate) store: Option<Store>,
    /// What a window left behind that was not closed: where it is now, and its text.
    pub(crate) left: Option<(PathBuf, String)>,
    /// The session of the window that was closed last.
    pub(crate) last: Option<String>,
    /// Why nothing will be kept.
    pub(crate) problem: Option<String>,
}

/// Takes a slot and looks for what was left. May wait for a disk.
pub(crate) fn open(folder: &Path) -> Opened {
    let mut opened = Opened { store: None, left: None, last: read(&last_file(folder)), problem: None };
    let problem = |error: &std::io::Error| {
        Some(format!("The session will not be kept: {} cannot be used ({error}).", folder.display()))
    };
    if let Err(error) = std::fs::create_dir_all(folder) {
        opened.problem = problem(&error);
        return opened;
    }
    for slot in 0..SLOTS {
        let path = folder.join(format!("running-{slot}.{EXTENSION}"));
        let lock = match File::create(folder.join(format!("running-{slot}.lock"))) {
            Ok(lock) => lock,
            Err(error) => {
                opened.problem = problem(&error);
                return opened;
            }
        };
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => continue,
            // A file system without locks: one window at a time is kept.
            Err(TryLockError::Error(_)) => {}
        }
        if opened.left.is_none() && path.exists() {
            opened.left = put_aside(folder, &path);
        }
        if opened.store.is_none() && !path.exists() {
            opened.store = Some(Store::new(folder.to_owned(), path, lock));
        }
    }
    opened
}

/// Takes what was left out of its slot, so that it is overwritten by nobody.
fn put_aside(folder: &Path, path: &Path) -> Option<(PathBuf, String)> {
    let text = read(path)?;
    let aside = (0..)
        .map(|number| folder.join(format!("left-{number}.{EXTENSION}")))
        .find(|aside| !aside.exists())
        .expect("there are more numbers than files");
    std::fs::rename(path, &aside).ok()?;
    Some((aside, text))
}

fn last_file(folder: &Path) -> PathBuf {
    folder.join(format!("last.{EXTENSION}"))
}

fn read(path: &Path) -> Option<String> {
    let size = std::fs::metadata(path).ok()?.len();
    if size > LARGEST_BYTES {
        return None;
    }
    Some(String::from_utf8_lossy(&std::fs::read(path).ok()?).into_owned())
}

/// The slot of this window.
pub(crate) struct Store {
    folder: PathBuf,
    path: PathBuf,
    /// Held until the program ends.
    _lock: File,
    written: String,
    looked: Option<Instant>,
    job: Option<Job<(), Result<(), String>>>,
    failed: bool,
}

impl Store {
    fn new(folder: PathBuf, path: PathBuf, lock: File) -> Self {
        Self { folder, path, _lock: lock, written: String::new(), looked: None, job: None, failed: false }
    }

    /// How long until the session is to be looked at; none for now.
    pub(crate) fn wait(&self) -> Option<Duration> {
        INTERVAL.checked_sub(self.looked?.elapsed()).filter(|wait| !wait.is_zero())
    }

    /// Keeps `text` if it is new, on a thread.
    pub(crate) fn keep(&mut self, text: String, waker: &Waker) {
        self.looked = Some(Instant::now());
        if text == self.written || self.job.is_some() {
            return;
        }
        let (path, content) = (self.path.clone(), text.clone());
        let write = move |_: &Reporter<()>| {
            write_file(&path, content.as_bytes()).map_err(|error| {
                format!(
                    "The session could not be kept in {}: {error}; what was kept last is still there. Make room or save to another disk.",
                    path.display()
                )
            })
        };
        if let Ok(job) = Job::start("keep-session", waker, write) {
            self.job = Some(job);
            self.written = text;
        }
    }

    /// What to say of the last write: why it failed, once, or that it is well again.
    pub(crate) fn drain(&mut self) -> Option<Result<String, String>> {
        let result = match self.job.as_mut()?.poll().1 {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Keeping the session failed: this is a defect of flqr.".to_owned()),
        };
        self.job = None;
        let failed_before = std::mem::replace(&mut self.failed, result.is_err());
        match result {
            Err(problem) => {
                // Tried again at the next look.
                self.written.clear();
                (!failed_before).then_some(Err(problem))
            }
            Ok(()) => failed_before.then(|| Ok("The session is kept again.".to_owned())),
        }
    }

    /// The window is closed: its session becomes the last one, and the slot is free.
    pub(crate) fn close(&mut self, text: &str) {
        // A job that still writes would bring the file back.
        while self.job.as_mut().is_some_and(|job| matches!(job.poll().1, Outcome::Running)) {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.job = None;
        if write_file(&last_file(&self.folder), text.as_bytes()).is_ok() {
            std::fs::remove_file(&self.path).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("flqr-store-{name}-{}", std::process::id()));
            std::fs::remove_dir_all(&path).ok();
            Self(path)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            std::fs::remove_dir_all(&self.0).ok();
        }
    }

    fn keep(store: &mut Store, text: &str) -> Option<Result<String, String>> {
        let waker: Waker = std::sync::Arc::new(|| {});
        store.keep(text.to_owned(), &waker);
        while store.job.is_some() {
            if let Some(said) = store.drain() {
                return Some(said);
            }
            std::thread::yield_now();
        }
        None
    }

    #[test]
    fn a_closed_window_leaves_its_session_as_the_last_and_nothing_behind() {
        let folder = Folder::new("closed");
        let mut opened = open(&folder.0);
        assert!(opened.left.is_none() && opened.last.is_none() && opened.problem.is_none());
        let store = opened.store.as_mut().unwrap();
        assert_eq!(keep(store, "one"), None);
        store.close("two");
        drop(opened);
        let again = open(&folder.0);
        assert_eq!((again.left, again.last.as_deref()), (None, Some("two")));
    }

    #[test]
    fn what_a_window_left_behind_is_found_once_and_put_aside() {
        let folder = Folder::new("left");
        let mut opened = open(&folder.0);
        keep(opened.store.as_mut().unwrap(), "unsaved");
        drop(opened);
        let found = open(&folder.0);
        let (path, text) = found.left.clone().unwrap();
        assert_eq!((text.as_str(), std::fs::read_to_string(&path).unwrap().as_str()), ("unsaved", "unsaved"));
        assert!(found.store.is_some());
        drop(found);
        assert!(open(&folder.0).left.is_none(), "it is offered once, and stays where it was put");
        assert!(path.exists());
    }

    #[test]
    fn windows_at_the_same_time_have_slots_of_their_own() {
        let folder = Folder::new("slots");
        let mut first = open(&folder.0);
        let mut second = open(&folder.0);
        keep(first.store.as_mut().unwrap(), "first");
        keep(second.store.as_mut().unwrap(), "second");
        let third = open(&folder.0);
        assert!(third.left.is_none(), "both are running: {:?}", third.left);
        drop(second);
        assert_eq!(open(&folder.0).left.map(|(_, text)| text).as_deref(), Some("second"));
    }

    #[test]
    fn a_folder_that_cannot_be_used_is_said_and_a_failing_write_once() {
        let folder = Folder::new("refused");
        std::fs::create_dir_all(&folder.0).unwrap();
        let file = folder.0.join("file");
        std::fs::write(&file, "no folder").unwrap();
        let refused = open(&file.join("inside"));
        assert!(refused.store.is_none() && refused.problem.unwrap().contains("will not be kept"));

        let mut opened = open(&folder.0.join("state"));
        let store = opened.store.as_mut().unwrap();
        // A folder in the place of the file refuses every write, also for an administrator.
        std::fs::create_dir_all(store.path.join("inside")).unwrap();
        assert!(keep(store, "one").unwrap().unwrap_err().contains("could not be kept"));
        assert_eq!(keep(store, "two"), None, "said once");
        std::fs::remove_dir_all(&store.path).unwrap();
        assert_eq!(keep(store, "two"), Some(Ok("The session is kept again.".to_owned())));
    }
}
