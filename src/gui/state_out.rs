//! `--state-out FILE`: what the window shows, as JSON for scripts that drive it.

use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::write_file::write_file;

/// The file is written at most this often.
const INTERVAL: Duration = Duration::from_millis(200);

/// Writes snapshots on a thread, so that a slow disk never holds the window up.
pub(crate) struct StateOut {
    sender: SyncSender<String>,
    last: Value,
    last_time: Option<Instant>,
}

impl StateOut {
    /// Starts writing to `path`.
    pub(crate) fn start(path: PathBuf) -> std::io::Result<Self> {
        let (sender, receiver) = sync_channel::<String>(4);
        std::thread::Builder::new().name("state-out".to_owned()).spawn(move || {
            for text in receiver {
                // A full disk must not end the window; the script sees an old file.
                write_file(&path, text.as_bytes()).ok();
            }
        })?;
        Ok(Self { sender, last: Value::Null, last_time: None })
    }

    /// Returns whether a snapshot would be taken now, or how long until then.
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
