//! One row of the ledger, and what differs from it to another.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use flqr_core::model::Model;
use flqr_core::model_file::Entry;
use serde::{Deserialize, Serialize};

use super::Sources;

/// Kind of run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum RunKind {
    /// A run of the simulated robot or bench.
    Experiment,
    /// Friction from a log.
    Fit,
    /// Rows of a robot, written to a file.
    Recording,
    /// A model refined with logs.
    Refinement,
}

impl RunKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Experiment => "experiment",
            Self::Fit => "fit",
            Self::Recording => "recording",
            Self::Refinement => "refinement",
        }
    }
}

/// A number or a word of what a run was made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Value {
    Number(f64),
    Text(String),
}

/// A signal of a run, in the core's unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) values: Vec<f64>,
}

/// Time series of a run; not saved.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Series {
    pub(crate) time_s: Vec<f64>,
    pub(crate) channels: Vec<Channel>,
}

impl Series {
    /// Number of values, including times.
    pub(super) fn size(&self) -> usize {
        self.time_s.len() * (1 + self.channels.len())
    }
}

/// One row. Its number is the ledger's to give.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Run {
    /// From 1 on, never given twice.
    pub(crate) number: u64,
    /// When it ended, seconds since 1970 (UTC).
    pub(crate) unix_s: u64,
    pub(crate) kind: RunKind,
    /// Short description.
    pub(crate) title: String,
    pub(crate) seed: Option<u64>,
    /// Of the model's text and of the logs' columns; the same sources have the same hash on any machine.
    pub(crate) sources: String,
    /// All values that it was made with: those of the model, of the settings.
    pub(crate) made_with: BTreeMap<String, Value>,
    /// Command line that repeats it.
    #[serde(default)]
    pub(crate) command: Option<String>,
    /// Result in one line.
    pub(crate) result: String,
    /// The user's own words.
    pub(crate) note: String,
    #[serde(skip)]
    pub(crate) series: Option<Arc<Series>>,
}

impl Run {
    /// A run that has just ended, made with `model` and `sources`.
    pub(crate) fn new(
        kind: RunKind,
        title: impl Into<String>,
        model: Option<&Model>,
        sources: Sources,
    ) -> Self {
        let made_with = model.map(Model::entries).unwrap_or_default().into_iter().map(|(key, entry)| {
            let value = match entry {
                Entry::Number(number) => Value::Number(number),
                Entry::Text(text) => Value::Text(text),
            };
            (key, value)
        });
        Self {
            number: 0,
            unix_s: 0,
            kind,
            title: title.into(),
            seed: None,
            sources: sources.hex().to_owned(),
            command: None,
            made_with: made_with.collect(),
            result: String::new(),
            note: String::new(),
            series: None,
        }
    }

    /// Adds a setting.
    pub(crate) fn with(mut self, key: &str, value: Value) -> Self {
        // A file has no numbers that are not finite.
        let value = match value {
            Value::Number(number) if !number.is_finite() => Value::Text(number.to_string()),
            value => value,
        };
        self.made_with.insert(key.to_owned(), value);
        self
    }

    /// Diagonals of Q and R, where the model has weights.
    pub(crate) fn weights(&self) -> String {
        let entry = |key: String| match self.made_with.get(&key) {
            Some(Value::Number(number)) => Some(crate::widgets::plain(*number, 3)),
            _ => None,
        };
        let diagonal = |letter: &str, size: usize| -> Vec<String> {
            let of = |index: usize| {
                entry(format!("lqr.{letter}_diagonal[{index}]"))
                    .or_else(|| entry(format!("lqr.{letter}[{index}][{index}]")))
            };
            (1..=size).filter_map(of).collect()
        };
        let (q, r) = (diagonal("q", 4), diagonal("r", 2));
        if q.is_empty() { String::new() } else { format!("{} | {}", q.join(" "), r.join(" ")) }
    }

    /// Command line that repeats it.
    ///
    /// # Errors
    /// A sentence says why nothing does.
    pub(super) fn command_line(&self) -> Result<String, String> {
        self.command.clone().ok_or_else(|| match self.kind {
            RunKind::Recording => {
                format!("Run {} is a recording and cannot be repeated by a command.", self.number)
            }
            _ => format!("The command of run {} is unknown.", self.number),
        })
    }

    /// The file that its curves can be read from.
    pub(super) fn file(&self) -> Option<&Path> {
        match self.made_with.get(super::watch::FILE) {
            Some(Value::Text(file)) if self.kind == RunKind::Recording => Some(Path::new(file)),
            _ => None,
        }
    }

    /// Returns whether its curves are in memory, or in a file.
    pub(super) fn can_be_drawn(&self) -> bool {
        self.series.is_some() || self.file().is_some()
    }

    /// One-line description in exports.
    pub(crate) fn provenance(&self) -> String {
        let seed = self.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
        format!("run {}: {}{seed}, sources {}", self.number, self.title, self.sources)
    }
}

/// A difference between what two runs were made with.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    pub(crate) key: String,
    pub(crate) old: Option<Value>,
    pub(crate) new: Option<Value>,
}

/// Changes from `old` to `new`, in the order of the names.
pub(crate) fn differences(old: &Run, new: &Run) -> Vec<Difference> {
    let keys: std::collections::BTreeSet<_> = old.made_with.keys().chain(new.made_with.keys()).collect();
    let difference = |key: &String| {
        let (old, new) = (old.made_with.get(key), new.made_with.get(key));
        (old != new).then(|| Difference { key: key.clone(), old: old.cloned(), new: new.cloned() })
    };
    keys.into_iter().filter_map(difference).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use flqr_core::model_file::presets;

    use super::*;

    pub(in crate::runs) fn run(number: u64, model: &Model) -> Run {
        Run {
            number,
            ..Run::new(RunKind::Experiment, "flat, LQR", Some(model), Sources::new(Some(model), []))
        }
    }

    #[test]
    fn what_changed_is_what_differs_in_the_files() {
        let mut model = presets::paper();
        let old = run(1, &model).with("setting.seconds", Value::Number(60.0));
        if let flqr_core::model::Rig::Robot(robot) = &mut model.rig {
            robot.parameters.wheel_mass_kg = 1.5;
            robot.limits.torque_nm = None;
        }
        let found = differences(&old, &run(2, &model));
        let number = |value| Some(Value::Number(value));
        let expected = [
            ("limits.torque_nm", number(2.42), None),
            ("robot.wheel_mass_kg", number(1.0), number(1.5)),
            ("setting.seconds", number(60.0), None),
        ];
        let expected = expected.map(|(key, old, new)| Difference { key: key.to_owned(), old, new });
        assert_eq!(found, expected);
        assert!(differences(&old, &old).is_empty());
    }

    #[test]
    fn full_and_diagonal_weights_are_described() {
        assert_eq!(run(1, &presets::paper()).weights(), "2 0.01 58.5 0.01 | 1 1");
    }
}
