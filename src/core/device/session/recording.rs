//! The recording of a session. Files are made and finished by a separate thread: the control loop never waits for a
//! disk.

use std::path::{Path, PathBuf};
use std::thread::{Builder, JoinHandle};

use super::types::{EventKind, RecordingStatus};
use crate::device::{Recorder, RecorderInput};
use crate::record::recording::About;

/// The recording, if one is made.
pub(super) struct Recording {
    pub(super) recorder: Option<Recorder>,
    pub(super) input: Option<RecorderInput>,
    about: About,
    /// Whether bench logs belong to it.
    bench: bool,
    work: Option<Work>,
}

/// What is done meanwhile.
enum Work {
    Begins(JoinHandle<Result<Recorder, String>>),
    Ends(JoinHandle<RecordingStatus>),
}

impl Recording {
    pub(super) fn new(about: About, bench: bool) -> Self {
        Self { recorder: None, input: None, about, bench, work: None }
    }

    /// Begins one at once, and waits for it.
    pub(super) fn start(&mut self, name: &Path) -> Result<(), String> {
        let recorder = begin(name, &self.about, self.bench)?;
        self.begun(recorder);
        Ok(())
    }

    fn begun(&mut self, recorder: Recorder) {
        self.input = Some(recorder.input());
        self.recorder = Some(recorder);
    }

    /// Whether rows and frames would soon be lost.
    pub(super) fn is_behind(&self) -> bool {
        self.input.as_ref().is_some_and(|input| !input.has_room())
    }

    /// Begins one, or ends it, without waiting; [`Recording::poll`] tells what came of it.
    pub(super) fn order(&mut self, name: Option<PathBuf>) -> Result<(), String> {
        if self.work.is_some() {
            return Err(
                "the last recording is still being started or stopped: try again in a moment".to_owned()
            );
        }
        let thread = Builder::new().name("recording".to_owned());
        let work = match (name, self.recorder.take()) {
            (Some(_), Some(recorder)) => {
                self.recorder = Some(recorder);
                return Err("a recording is already running: stop it first".to_owned());
            }
            (Some(name), None) => {
                let (about, bench) = (self.about.clone(), self.bench);
                thread.spawn(move || begin(&name, &about, bench)).map(Work::Begins)
            }
            (None, Some(recorder)) => {
                self.input = None;
                thread.spawn(move || recorder.finish()).map(Work::Ends)
            }
            (None, None) => return Ok(()),
        };
        self.work = Some(work.map_err(|error| format!("cannot start the recording thread: {error}"))?);
        Ok(())
    }

    /// What has come of the last order since it was last asked.
    pub(super) fn poll(&mut self) -> Option<(EventKind, String)> {
        let done = self.work.take_if(|work| match work {
            Work::Begins(thread) => thread.is_finished(),
            Work::Ends(thread) => thread.is_finished(),
        })?;
        self.take_up(done)
    }

    fn take_up(&mut self, done: Work) -> Option<(EventKind, String)> {
        let fault = || "the recording has stopped by an internal error".to_owned();
        match done {
            Work::Begins(thread) => match thread.join().unwrap_or_else(|_| Err(fault())) {
                Ok(recorder) => {
                    self.begun(recorder);
                    None
                }
                Err(problem) => Some((EventKind::Warning, problem)),
            },
            Work::Ends(thread) => {
                Some((EventKind::Note, thread.join().map_or_else(|_| fault(), |status| recorded(&status))))
            }
        }
    }

    /// Ends it, and waits until the files are whole.
    pub(super) fn end(&mut self) -> Option<RecordingStatus> {
        let ended = match self.work.take() {
            Some(Work::Ends(thread)) => thread.join().ok(),
            Some(begins) => {
                self.take_up(begins);
                None
            }
            None => None,
        };
        self.input = None;
        self.recorder.take().map(Recorder::finish).or(ended)
    }
}

fn begin(name: &Path, about: &About, bench: bool) -> Result<Recorder, String> {
    Recorder::start(name, about, bench).map_err(|error| error.to_string())
}

/// What was recorded, in a sentence.
fn recorded(status: &RecordingStatus) -> String {
    status.problem.clone().unwrap_or_else(|| {
        format!("{}: {} rows and {} frames were recorded", status.file.display(), status.rows, status.frames)
    })
}
