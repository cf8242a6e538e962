//! Storage of the running session: one slot for each window that is open at the same time.
//!
//! A slot is a file and a lock that the system lets go of when the program ends, however it ends. A file in a slot
//! that nobody holds is what a window left behind that was not closed.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{Document, EXTENSION, LARGEST_BYTES};
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::write_file::write_file;

/// Windows that are kept at the same time.
const SLOTS: usize = 8;
/// The session is looked at this often, while something happens.
const INTERVAL: Duration = Duration::from_secs(1);

/// Default folder of sessions; `None` if the system defines none.
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

/// Sessions found at start.
pub(crate) struct Opened {
    /// Its slot; `None` if all are taken or the folder cannot be used.
    pub(crate) store: Option<Store>,
    /// Session of a window that was not closed properly.
    pub(crate) left: Option<Left>,
    /// The session of the window that was closed last, and its text.
    pub(crate) last: Option<(PathBuf, String)>,
    /// Reason why the session will not be saved.
    pub(crate) problem: Option<String>,
}

/// A session in a slot that nobody held. It stays there, found again at each start, until somebody has said what
/// becomes of it.
#[derive(Debug)]
pub(crate) struct Left {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
    /// Held, so that no other window offers it too.
    _lock: File,
}

impl Left {
    /// Takes it out of its slot, so that it is offered and overwritten by nobody; says where it is then.
    pub(crate) fn put_aside(self) -> PathBuf {
        put_aside(&self.path).unwrap_or(self.path)
    }
}

/// Takes a slot and looks for what was left. May wait for a disk.
pub(crate) fn open(folder: &Path) -> Opened {
    let last = last_file(folder);
    let last = read(&last).map(|text| (last, text));
    let mut opened = Opened { store: None, left: None, last, problem: None };
    let problem = |error: &std::io::Error| {
        Some(format!(
            "The session will not be saved automatically: {} cannot be used ({error}).",
            folder.display()
        ))
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
        if !path.exists() {
            if opened.store.is_none() {
                opened.store = Some(Store::new(folder.to_owned(), path, lock));
            }
        } else if opened.left.is_none() {
            opened.left = read(&path).map(|text| Left { path, text, _lock: lock });
        }
    }
    if opened.store.is_none() {
        opened.problem = Some(format!(
            "The session will not be saved automatically: all {SLOTS} slots in {} are in use. Close other windows, or move the running-*.{EXTENSION} files there to another folder.",
            folder.display()
        ));
    }
    opened
}

/// Gives a file a name under which nobody overwrites it.
pub(crate) fn put_aside(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let aside = (0..)
        .map(|number| folder.join(format!("left-{number}.{EXTENSION}")))
        .find(|aside| !aside.exists())
        .expect("there are more numbers than files");
    std::fs::rename(path, &aside).ok()?;
    Some(aside)
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

type Writing = Job<(), Result<(), String>>;

/// The slot of this window.
pub(crate) struct Store {
    folder: PathBuf,
    path: PathBuf,
    /// Held until the program ends.
    _lock: File,
    written: Option<Document>,
    looked: Option<Instant>,
    job: Option<Writing>,
    /// Reason why the last write could not start.
    not_begun: Option<String>,
    failed: bool,
    /// Files taken over by the session, removed after it is saved.
    taken: Vec<Left>,
    /// As above, and in what is being written.
    in_job: Vec<Left>,
}

impl Store {
    fn new(folder: PathBuf, path: PathBuf, lock: File) -> Self {
        Self {
            folder,
            path,
            _lock: lock,
            written: None,
            looked: None,
            job: None,
            not_begun: None,
            failed: false,
            taken: Vec::new(),
            in_job: Vec::new(),
        }
    }

    /// The session of now contains what was left: its file goes as soon as the session has been written.
    pub(crate) fn take_over(&mut self, left: Left) {
        self.taken.push(left);
        // Written at the next look, whatever is there already.
        self.written = None;
        self.looked = None;
    }

    /// Time until the next save; `None` if none is due.
    pub(crate) fn wait(&self) -> Option<Duration> {
        INTERVAL.checked_sub(self.looked?.elapsed()).filter(|wait| !wait.is_zero())
    }

    /// Keeps a session if it is new, on a thread: a long ledger takes its time to be put into words.
    pub(crate) fn keep(&mut self, document: Document, waker: &Waker) {
        self.looked = Some(Instant::now());
        if self.job.is_some() || self.written.as_ref() == Some(&document) {
            return;
        }
        let (path, content) = (self.path.clone(), document.clone());
        let write = move |_: &Reporter<()>| {
            write_file(&path, content.to_json().as_bytes()).map_err(|error| {
                format!(
                    "The session could not be saved automatically in {}: {error}. The last saved state is still there. Free disk space or save to another disk.",
                    path.display()
                )
            })
        };
        self.begun(Job::start("keep-session", waker, write), document);
        if self.not_begun.is_some() {
            waker();
        }
    }

    fn begun(&mut self, job: std::io::Result<Writing>, document: Document) {
        match job {
            Ok(job) => {
                self.job = Some(job);
                self.written = Some(document);
                self.in_job.append(&mut self.taken);
            }
            Err(error) => {
                self.not_begun = Some(format!(
                    "The session could not be saved automatically ({error}). Close other programs."
                ));
            }
        }
    }

    /// Message about the last write: why it failed, once, or that it is well again.
    pub(crate) fn drain(&mut self) -> Option<Result<String, String>> {
        let result = match self.not_begun.take() {
            Some(problem) => Err(problem),
            None => match self.job.as_mut()?.poll().1 {
                Outcome::Running => return None,
                Outcome::Done(result) => result,
                Outcome::Broken => {
                    Err("Saving the session automatically failed: this is an internal error.".to_owned())
                }
            },
        };
        self.job = None;
        let failed_before = std::mem::replace(&mut self.failed, result.is_err());
        match result {
            Err(problem) => {
                // They are saved again at the next attempt.
                self.written = None;
                self.taken.append(&mut self.in_job);
                (!failed_before).then_some(Err(problem))
            }
            Ok(()) => {
                remove(&mut self.in_job);
                failed_before.then(|| Ok("The session is saved automatically again.".to_owned()))
            }
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
            remove(&mut self.taken);
            remove(&mut self.in_job);
        }
    }
}

fn remove(all: &mut Vec<Left>) {
    for left in all.drain(..) {
        std::fs::remove_file(&left.path).ok();
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
        store.keep(Document { column_map: Some(text.to_owned()), ..Document::default() }, &waker);
        while store.job.is_some() {
            if let Some(said) = store.drain() {
                return Some(said);
            }
            std::thread::yield_now();
        }
        None
    }

    /// Returns the session in the text of a file.
    fn kept(text: &str) -> String {
        Document::from_json(text).0.column_map.unwrap()
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
        assert!(again.left.is_none());
        assert_eq!(again.last.map(|(_, text)| text).as_deref(), Some("two"));
    }

    #[test]
    fn what_a_window_left_behind_is_offered_until_it_is_answered() {
        let folder = Folder::new("left");
        let mut opened = open(&folder.0);
        keep(opened.store.as_mut().unwrap(), "unsaved");
        drop(opened);
        for _ in 0..2 {
            let mut found = open(&folder.0);
            assert_eq!(kept(&found.left.as_ref().unwrap().text), "unsaved");
            assert!(open(&folder.0).left.is_none(), "not by two windows at a time");
            found.store.as_mut().unwrap().close("nothing");
        }
        let path = open(&folder.0).left.unwrap().put_aside();
        assert_eq!(kept(&std::fs::read_to_string(&path).unwrap()), "unsaved");
        assert!(open(&folder.0).left.is_none(), "it was answered, and stays where it was put");
        assert!(path.exists());
    }

    #[test]
    fn what_was_taken_over_is_removed_only_when_it_is_on_the_disk_again() {
        let folder = Folder::new("taken");
        let mut opened = open(&folder.0);
        keep(opened.store.as_mut().unwrap(), "unsaved");
        drop(opened);
        let mut found = open(&folder.0);
        let left = found.left.take().unwrap();
        let path = left.path.clone();
        let store = found.store.as_mut().unwrap();
        keep(store, "unsaved and more");
        std::fs::remove_file(&store.path).unwrap();
        std::fs::create_dir_all(store.path.join("inside")).unwrap();
        store.take_over(left);
        assert!(keep(store, "unsaved and more").unwrap().is_err());
        assert!(path.exists(), "the only copy");
        std::fs::remove_dir_all(&store.path).unwrap();
        assert!(keep(store, "unsaved and more").unwrap().is_ok());
        assert!(!path.exists());
    }

    #[test]
    fn a_window_without_a_slot_is_reported() {
        let folder = Folder::new("full");
        let mut windows: Vec<_> = (0..SLOTS).map(|_| open(&folder.0)).collect();
        assert!(windows.iter().all(|window| window.problem.is_none()));
        assert!(open(&folder.0).problem.unwrap().contains("are in use"));
        windows.pop();
        assert!(open(&folder.0).problem.is_none());
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
        assert_eq!(kept(&open(&folder.0).left.unwrap().text), "second");
    }

    #[test]
    fn a_folder_that_cannot_be_used_is_said_and_a_failing_write_once() {
        let folder = Folder::new("refused");
        std::fs::create_dir_all(&folder.0).unwrap();
        let file = folder.0.join("file");
        std::fs::write(&file, "no folder").unwrap();
        let refused = open(&file.join("inside"));
        assert!(refused.store.is_none() && refused.problem.unwrap().contains("will not be saved"));

        let mut opened = open(&folder.0.join("state"));
        let store = opened.store.as_mut().unwrap();
        // A folder in the place of the file refuses every write, also for an administrator.
        std::fs::create_dir_all(store.path.join("inside")).unwrap();
        assert!(keep(store, "one").unwrap().unwrap_err().contains("could not be saved"));
        assert_eq!(keep(store, "two"), None, "said once");
        std::fs::remove_dir_all(&store.path).unwrap();
        assert_eq!(keep(store, "two"), Some(Ok("The session is saved automatically again.".to_owned())));
    }

    #[test]
    fn a_write_that_cannot_begin_is_said_once() {
        let folder = Folder::new("threads");
        let mut opened = open(&folder.0);
        let store = opened.store.as_mut().unwrap();
        let mut refuse = || {
            store.begun(Err(std::io::ErrorKind::WouldBlock.into()), Document::default());
            store.drain()
        };
        assert!(refuse().unwrap().unwrap_err().contains("Close other programs"));
        assert_eq!(refuse(), None, "said once");
        // The document that was refused is not taken for written.
        assert_eq!(keep(store, "one"), Some(Ok("The session is saved automatically again.".to_owned())));
        assert_eq!(kept(&std::fs::read_to_string(&store.path).unwrap()), "one");
    }
}
