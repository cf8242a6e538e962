//! Recordings of a robot, each a row once it has ended.

use flqr_core::device::RecordingStatus;
use flqr_core::model_file::Model;

use super::run::{Run, RunKind, Value};

/// The recording that was under way when it was looked at last.
#[derive(Default)]
pub(crate) struct RecordingWatch {
    last: Option<RecordingStatus>,
}

impl RecordingWatch {
    /// Takes note of how the recording stands; the one of before when it has ended.
    pub(crate) fn note(&mut self, now: Option<&RecordingStatus>) -> Option<RecordingStatus> {
        let goes_on = |last: &RecordingStatus| {
            last.problem.is_some() || now.is_some_and(|now| now.file == last.file && now.problem.is_none())
        };
        let ended = self.last.take_if(|last| !goes_on(last));
        // Its last numbers come with its end, where it ended by a problem.
        let ended = ended.map(|last| now.filter(|now| now.file == last.file).cloned().unwrap_or(last));
        if self.last.as_ref() != now {
            self.last = now.cloned();
        }
        ended
    }
}

/// The row of a recording that has ended.
pub(crate) fn row(recording: &RecordingStatus, source: &str, model: &Model) -> Run {
    let name = recording.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut result = format!("{} rows, {} frames", recording.rows, recording.frames);
    if let Some(problem) = &recording.problem {
        result = format!("{result}, ended early: {problem}");
    }
    let run = Run::new(RunKind::Recording, format!("{source}, {name}"), Some(model), &[]);
    Run { result, ..run.with("recording.file", Value::Text(recording.file.display().to_string())) }
}

#[cfg(test)]
mod tests {
    use flqr_core::model_file::presets;

    use super::*;

    fn status(file: &str, rows: u64, problem: Option<&str>) -> RecordingStatus {
        RecordingStatus {
            file: file.into(),
            rows,
            frames: 2 * rows,
            bytes: 1,
            problem: problem.map(str::to_owned),
        }
    }

    #[test]
    fn a_recording_is_a_row_once_when_it_ends_whatever_ended_it() {
        let model = presets::paper();
        let [going, more] = [10, 20].map(|rows| status("a.csv", rows, None));
        let (other, failed) = (status("b.csv", 5, None), status("b.csv", 7, Some("the disk is full")));
        let mut watch = RecordingWatch::default();
        let mut rows = Vec::new();
        for now in [None, Some(&going), Some(&more), Some(&other), Some(&failed), Some(&failed), None, None] {
            let ended = watch.note(now).map(|recording| row(&recording, "emulated", &model));
            rows.extend(ended.map(|run| (run.title, run.result)));
        }
        let expected = [
            ("emulated, a.csv", "20 rows, 40 frames"),
            ("emulated, b.csv", "7 rows, 14 frames, ended early: the disk is full"),
        ];
        assert_eq!(rows, expected.map(|(title, result)| (title.to_owned(), result.to_owned())));
    }
}
