//! `--state-out FILE`: the state of the window as JSON, for scripts that control it.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::job::Waker;
use crate::write_file::{not_saved, write_file};

/// The file is written at most this often.
const INTERVAL: Duration = Duration::from_millis(200);
/// Value of `about`, the first member of the state, by which the file of an earlier window is recognised.
pub(crate) const ABOUT: &str = "flqr window state";

/// Writes snapshots on a thread, so that a slow disk never holds the window up.
pub(crate) struct StateOut {
    sender: SyncSender<String>,
    /// Outcomes of writing.
    written: Receiver<Result<(), String>>,
    is_failing: bool,
    last: Value,
    last_time: Option<Instant>,
}

impl StateOut {
    /// Starts writing to `path`.
    pub(crate) fn start(path: PathBuf, waker: Waker) -> std::io::Result<Self> {
        let (sender, receiver) = sync_channel::<String>(4);
        let (outcome, written) = sync_channel(4);
        std::thread::Builder::new().name("state-out".to_owned()).spawn(move || {
            for text in receiver {
                let result = write_file(&path, text.as_bytes()).map_err(|error| not_saved(&path, &error));
                let has_failed = result.is_err();
                // Full: the window has outcomes to take up already.
                outcome.try_send(result).ok();
                if has_failed {
                    waker();
                }
            }
        })?;
        Ok(Self { sender, written, is_failing: false, last: Value::Null, last_time: None })
    }

    /// Returns the problem if writing has begun to fail since the last call.
    pub(crate) fn problem(&mut self) -> Option<String> {
        let mut problem = None;
        for outcome in self.written.try_iter() {
            let was_failing = std::mem::replace(&mut self.is_failing, outcome.is_err());
            problem = outcome.err().filter(|_| !was_failing).or(problem);
        }
        problem
    }

    /// Time until the next snapshot may be taken; `None` if it may be now.
    pub(crate) fn wait(&self) -> Option<Duration> {
        let elapsed = self.last_time?.elapsed();
        INTERVAL.checked_sub(elapsed)
    }

    /// Writes `state` if it is new.
    pub(crate) fn write(&mut self, state: Value) {
        if state == self.last {
            return;
        }
        let text = format!("{state:#}\n");
        if self.sender.try_send(text).is_ok() {
            self.last = state;
            self.last_time = Some(Instant::now());
        }
    }
}

/// Returns whether a file that begins with `opening` was written for `--state-out`.
pub fn is_opening_of_state(opening: &[u8]) -> bool {
    opening.starts_with(format!("{{\n  \"about\": \"{ABOUT}\",\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::json;

    use super::*;

    /// Waits until the file holds `text`.
    fn until(path: &std::path::Path, text: &str) -> String {
        loop {
            let found = std::fs::read_to_string(path).unwrap_or_default();
            if found.contains(text) {
                return found;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_written_state_is_recognised_and_a_failure_is_reported_once() {
        let folder = std::env::temp_dir().join(format!("flqr-state-out-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("state.json");
        let (woken, wakes) = std::sync::mpsc::channel();
        let waker: Waker = Arc::new(move || woken.send(()).unwrap());
        let mut out = StateOut::start(path.clone(), waker).unwrap();
        out.write(json!({ "about": ABOUT, "abc": 1, "tab": "tune" }));
        let text = until(&path, "tune");
        assert!(is_opening_of_state(text.as_bytes()), "{text}");
        assert!(!is_opening_of_state(b"{\n  \"about\": \"my notes\",\n") && out.problem().is_none());
        // A folder in the place of the file.
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        for (index, is_new) in [(0, true), (1, false)] {
            out.write(json!({ "index": index }));
            wakes.recv().unwrap();
            let problem = out.problem();
            assert_eq!(problem.is_some(), is_new, "{problem:?}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
