//! Recordings of a robot, each a row once it has ended.

use flqr_core::device::RecordingStatus;
use flqr_core::model::Model;

use super::Sources;
use super::run::{Run, RunKind, Value};

/// The recording that was under way when it was looked at last.
#[derive(Default)]
pub(crate) struct RecordingWatch {
    last: Option<Recording>,
}

struct Recording {
    status: RecordingStatus,
    source: String,
    /// The model at its start: the one that the robot is driven with.
    model: Model,
    was_changed: bool,
}

impl RecordingWatch {
    /// Takes note of how the recording stands, and of the model of now; the row of the one before when that has
    /// ended.
    pub(crate) fn note(
        &mut self,
        now: Option<&RecordingStatus>,
        source: &str,
        model: impl Fn() -> Model,
    ) -> Option<Run> {
        let goes_on = |last: &RecordingStatus| {
            last.problem.is_some() || now.is_some_and(|now| now.file == last.file && now.problem.is_none())
        };
        let ended = self.last.take_if(|last| !goes_on(&last.status)).map(|mut last| {
            // Its last numbers come with its end, where it ended by a problem.
            if let Some(now) = now.filter(|now| now.file == last.status.file) {
                last.status = now.clone();
            }
            last
        });
        match (&mut self.last, now) {
            (_, None) => self.last = None,
            (Some(last), Some(now)) if last.status.file == now.file => {
                last.status.clone_from(now);
                last.was_changed = last.was_changed || model() != last.model;
            }
            (_, Some(now)) => {
                let (status, source) = (now.clone(), source.to_owned());
                self.last = Some(Recording { status, source, model: model(), was_changed: false });
            }
        }
        ended.map(|recording| recording.row())
    }
}

impl Recording {
    fn row(&self) -> Run {
        let Self { status, source, model, was_changed } = self;
        let name = status.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut result = format!("{} rows, {} frames", status.rows, status.frames);
        if *was_changed {
            result += ", the model was changed during the run";
        }
        if let Some(problem) = &status.problem {
            result += &format!(", ended early: {problem}");
        }
        let title = format!("{source}, {name}");
        let run = Run::new(RunKind::Recording, title, Some(model), Sources::new(Some(model), []));
        Run { result, ..run.with(FILE, Value::Text(status.file.display().to_string())) }
    }
}

/// Among what a recording was made with: its file.
pub(crate) const FILE: &str = "recording.file";

#[cfg(test)]
mod tests {
    use flqr_core::model_file::presets;

    use super::*;

    fn status(file: &str, rows: u64, problem: Option<&str>) -> RecordingStatus {
        RecordingStatus {
            file: file.into(),
            rows,
            rows_lost: 0,
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
            let ended = watch.note(now, "emulated", || model.clone());
            rows.extend(ended.map(|run| (run.title, run.result)));
        }
        let expected = [
            ("emulated, a.csv", "20 rows, 40 frames"),
            ("emulated, b.csv", "7 rows, 14 frames, ended early: the disk is full"),
        ];
        assert_eq!(rows, expected.map(|(title, result)| (title.to_owned(), result.to_owned())));
    }

    #[test]
    fn a_recording_was_made_with_the_model_of_its_start() {
        let heavy = |mass_kg: f64| {
            let mut model = presets::paper();
            if let flqr_core::model::Rig::Robot(robot) = &mut model.rig {
                robot.parameters.body_mass_kg = mass_kg;
            }
            model
        };
        let (first, second) = (status("a.csv", 10, None), status("b.csv", 10, None));
        let mut watch = RecordingWatch::default();
        let mut rows = Vec::new();
        for (now, mass_kg) in [
            (Some(&first), 1.0),
            (Some(&first), 2.0),
            (Some(&second), 3.0),
            (Some(&second), 3.0),
            // Another model was loaded, which ended it.
            (None, 4.0),
        ] {
            rows.extend(watch.note(now, "CAN", || heavy(mass_kg)));
        }
        let found =
            rows.iter().map(|row| (&row.made_with["robot.body_mass_kg"], row.result.contains("changed")));
        assert_eq!(found.collect::<Vec<_>>(), [(&Value::Number(1.0), true), (&Value::Number(3.0), false)]);
    }
}
