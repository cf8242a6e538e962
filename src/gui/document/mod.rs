//! The session document: all of the window that a file keeps, its undo, and where it is kept.
//!
//! The file is JSON with one member for each part. A part that cannot be read is left out and named; the others
//! are used. So a file that was cut off, or comes from another version, never stops the start.

mod members;
mod store;
mod undo;

use std::path::PathBuf;

use flqr_core::control::ControllerKind;
use flqr_core::model::Model;
use serde_json::{Value, json};

use crate::command::Source;
use crate::layout::Node;
use crate::pages::Tab;
use crate::runs::Ledger;
use members::members;
pub use store::default_folder;
pub(crate) use store::{Left, Opened, Store, open, put_aside};
pub(crate) use undo::{Base, Content, Undo, words};

const FORMAT: &str = "flqr-session";
const VERSION: u64 = 1;
/// Message for a file that is not a session.
pub(crate) const NO_SESSION: &str = "it is not a session file of flqr";
/// Ending of the files.
pub(crate) const EXTENSION: &str = "flqr-session";
/// A session file larger than this is none.
pub(crate) const LARGEST_BYTES: u64 = 64 << 20;

/// Contents of a session file; `None` for missing parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Document {
    pub(crate) model: Option<Model>,
    /// The model as its file has it; `None` if that is `model`.
    pub(crate) saved_model: Option<Model>,
    pub(crate) model_path: Option<PathBuf>,
    pub(crate) controller: Option<ControllerKind>,
    pub(crate) experiment: Option<Value>,
    pub(crate) column_map: Option<String>,
    pub(crate) log: Option<PathBuf>,
    /// Logs of the *Refine* page, and whether each is held out.
    pub(crate) refine_logs: Option<Vec<(PathBuf, bool)>>,
    pub(crate) source: Option<Source>,
    pub(crate) connection: Option<Value>,
    pub(crate) layout: Option<Node>,
    pub(crate) tab: Option<Tab>,
    pub(crate) dark: Option<bool>,
    pub(crate) zoom: Option<f32>,
    pub(crate) degrees: Option<bool>,
    pub(crate) runs: Option<Ledger>,
}

impl Document {
    /// Returns whether the model has changes that its file has not.
    pub(crate) fn has_unsaved_model(&self) -> bool {
        self.saved_model.is_some() && self.saved_model != self.model
    }

    /// As above, of a file that may have lost what its model's own file has.
    pub(crate) fn may_have_unsaved_model(&self, problems: &[String]) -> bool {
        self.has_unsaved_model() || (self.model.is_some() && !problems.is_empty())
    }

    /// Leaves out of how the window looks and what its forms hold whatever differs between `start` and `now`.
    pub(crate) fn leave_out_changes(&mut self, start: &Self, now: &Self) {
        fn part<T: PartialEq>(part: &mut Option<T>, start: &Option<T>, now: &Option<T>) {
            if start != now {
                *part = None;
            }
        }
        part(&mut self.experiment, &start.experiment, &now.experiment);
        part(&mut self.column_map, &start.column_map, &now.column_map);
        part(&mut self.connection, &start.connection, &now.connection);
        part(&mut self.layout, &start.layout, &now.layout);
        part(&mut self.dark, &start.dark, &now.dark);
        part(&mut self.zoom, &start.zoom, &now.zoom);
        part(&mut self.degrees, &start.degrees, &now.degrees);
    }

    /// The text of the file.
    pub(crate) fn to_json(&self) -> String {
        let path = |path: &Option<PathBuf>| path.as_ref().and_then(|path| path.to_str().map(str::to_owned));
        let controller = self.controller.map(|kind| match kind {
            ControllerKind::Lqr => "lqr",
            ControllerKind::Flqr => "flqr",
        });
        let value = json!({
            "format": FORMAT,
            "version": VERSION,
            "model": self.model.as_ref().map(Model::to_toml),
            "saved_model": self.saved_model.as_ref().map(Model::to_toml),
            "model_path": path(&self.model_path),
            "controller": controller,
            "experiment": self.experiment,
            "column_map": self.column_map,
            "log": path(&self.log),
            "refine_logs": self.refine_logs.as_ref().map(|logs| {
                let log = |(path, held_out): &(PathBuf, bool)| json!({ "path": path.to_str(), "held_out": held_out });
                logs.iter().map(log).collect::<Vec<_>>()
            }),
            "source": self.source.map(Source::key),
            "connection": self.connection,
            "layout": self.layout.as_ref().map(Node::to_value),
            "tab": self.tab.map(Tab::key),
            "theme": self.dark.map(|dark| if dark { "dark" } else { "light" }),
            "zoom": self.zoom,
            "angles": self.degrees.map(|degrees| if degrees { "deg" } else { "rad" }),
            "runs": self.runs.as_ref().map(Ledger::to_value),
        });
        format!("{value:#}\n")
    }

    /// Parses a session file; also returns a sentence for each part that could not be read.
    pub(crate) fn from_json(text: &str) -> (Self, Vec<String>) {
        let mut document = Self::default();
        let mut problems = Vec::new();
        let (parts, cut) = members(text);
        let part =
            |name: &str| parts.iter().find(|(key, _)| key == name).and_then(|(_, value)| value.as_ref());
        if part("format").and_then(Value::as_str) != Some(FORMAT) {
            problems.push(NO_SESSION.to_owned());
            return (document, problems);
        }
        match part("version").and_then(Value::as_u64) {
            Some(VERSION) => {}
            Some(version) if version > VERSION => problems.push(format!(
                "it was written by a newer version of flqr (format {version}, supported {VERSION}): unknown parts are ignored"
            )),
            None if cut => {}
            _ => problems.push("its version cannot be read".to_owned()),
        }
        for (key, value) in &parts {
            let Some(value) = value else {
                problems.push(format!("“{key}” cannot be read"));
                continue;
            };
            if !value.is_null()
                && let Err(problem) = document.take(key, value)
            {
                problems.push(problem);
            }
        }
        if cut {
            problems.push(ends_early(&parts));
        }
        (document, problems)
    }

    fn take(&mut self, key: &str, value: &Value) -> Result<(), String> {
        let unread = || format!("“{key}” cannot be read");
        let text = || value.as_str().ok_or_else(unread);
        let path = || text().map(PathBuf::from);
        let model = || -> Result<Model, String> {
            Model::from_toml(text()?, key).map_err(|error| format!("“{key}” is refused: {error}"))
        };
        match key {
            "format" | "version" => {}
            "model" => self.model = Some(model()?),
            "saved_model" => self.saved_model = Some(model()?),
            "model_path" => self.model_path = Some(path()?),
            "controller" => {
                self.controller = Some(match text()? {
                    "lqr" => ControllerKind::Lqr,
                    "flqr" => ControllerKind::Flqr,
                    _ => return Err(unread()),
                });
            }
            "experiment" => self.experiment = Some(value.clone()),
            "column_map" => self.column_map = Some(text()?.to_owned()),
            "log" => self.log = Some(path()?),
            "refine_logs" => {
                let log = |log: &Value| {
                    let path = PathBuf::from(log.get("path")?.as_str()?);
                    Some((path, log.get("held_out")?.as_bool()?))
                };
                let logs = value.as_array().ok_or_else(unread)?;
                self.refine_logs = Some(logs.iter().map(log).collect::<Option<_>>().ok_or_else(unread)?);
            }
            "source" => {
                let all = Source::ALL.into_iter().map(|(source, ..)| source);
                let named = text().map(|name| all.into_iter().find(|source| source.key() == name))?;
                self.source = Some(named.ok_or_else(unread)?);
            }
            "connection" => self.connection = Some(value.clone()),
            "layout" => self.layout = Some(Node::from_value(value).ok_or_else(unread)?),
            "tab" => self.tab = Some(Tab::from_key(text()?).ok_or_else(unread)?),
            "theme" => self.dark = Some(text()? == "dark"),
            "zoom" => {
                let zoom = value.as_f64().filter(|zoom| zoom.is_finite()).ok_or_else(unread)?;
                self.zoom = Some(zoom as f32);
            }
            "angles" => self.degrees = Some(text()? == "deg"),
            "runs" => {
                let (runs, problem) = Ledger::from_value(value)?;
                self.runs = Some(runs);
                return problem.map_or(Ok(()), Err);
            }
            _ => return Err(format!("“{key}” is unknown and was ignored")),
        }
        Ok(())
    }
}

/// That a file ends early, and which parts it would have had behind that.
fn ends_early(parts: &[(String, Option<Value>)]) -> String {
    let whole = members(&Document::default().to_json()).0;
    let is_there = |key: &str| parts.iter().any(|(name, _)| name == key);
    let lost: Vec<_> =
        whole.iter().filter(|(key, _)| !is_there(key)).map(|(key, _)| format!("“{key}”")).collect();
    match lost.is_empty() {
        true => "it is truncated".to_owned(),
        false => format!("it is truncated, without {}", lost.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use flqr_core::model_file::presets;

    use super::*;
    use crate::layout::Side;
    use crate::runs::{Run, RunKind, Sources};

    fn whole() -> Document {
        let mut edited = presets::paper();
        edited.name = "“edited” \\ \n model".to_owned();
        let mut runs = Ledger::default();
        runs.add(Run::new(RunKind::Fit, "a fit", Some(&edited), Sources::new(Some(&edited), [])), 7);
        Document {
            model: Some(edited),
            saved_model: Some(presets::paper()),
            model_path: Some("/a/model.toml".into()),
            controller: Some(ControllerKind::Lqr),
            experiment: Some(json!({ "scenario": "slope", "seconds": 12.5, "seed": 3 })),
            column_map: Some("a=b*2".to_owned()),
            log: Some("/a/log.csv".into()),
            refine_logs: Some(vec![("/a/run.csv".into(), false), ("/a/held.csv".into(), true)]),
            source: Some(Source::Can),
            connection: Some(json!({ "interface": "can1" })),
            layout: Some(Node::default().moved(Tab::Robot, Side::Right)),
            tab: Some(Tab::Friction),
            dark: Some(false),
            zoom: Some(1.5),
            degrees: Some(true),
            runs: Some(runs),
        }
    }

    #[test]
    fn a_document_survives_its_file() {
        let (read, problems) = Document::from_json(&whole().to_json());
        assert_eq!(problems, Vec::<String>::new());
        assert_eq!(read, whole());
        assert!(read.has_unsaved_model());
    }

    /// Whatever is cut off, what stands before the cut is used, and the loss is said.
    #[test]
    fn a_file_that_was_cut_anywhere_gives_what_stands_before_the_cut() {
        let text = whole().to_json();
        let full = whole();
        let ends = |end: usize| text.is_char_boundary(end);
        for end in (0..text.trim_end().len()).filter(|end| ends(*end)) {
            let (read, problems) = Document::from_json(&text[..end]);
            assert!(!problems.is_empty(), "cut at {end}");
            assert!(read.model.is_none() || read.model == full.model, "cut at {end}");
            assert!(read.layout.is_none() || read.layout == full.layout, "cut at {end}");
            let lost = problems.last().map(String::as_str).unwrap_or_default();
            let named = |key: &str| text.find(&format!("\n  \"{key}\":")).is_some_and(|at| end < at);
            if lost != NO_SESSION {
                for key in ["saved_model", "tab", "theme", "zoom", "runs"] {
                    assert!(!named(key) || lost.contains(&format!("“{key}”")), "cut at {end}: {lost}");
                }
            }
            let behind = |key: &str| text.find(key).is_some_and(|at| end > at);
            if behind("\"saved_model\"") {
                assert_eq!(read.model, full.model, "cut at {end}");
            }
            if behind("\"tab\"") {
                assert_eq!(read.layout, full.layout, "cut at {end}");
            }
        }
    }

    #[test]
    fn a_bad_part_is_named_and_the_others_are_used() {
        let text = whole().to_json();
        for (old, new, named) in [
            ("1.5", "NaN", "“zoom” cannot be read"),
            ("1.5", "1e999", "“zoom” cannot be read"),
            ("\"lqr\"", "\"pid\"", "“controller” cannot be read"),
            ("\"lqr\"", "17", "“controller” cannot be read"),
            ("\"version\": 1", "\"version\": 2", "newer version of flqr (format 2"),
            ("\"version\": 1", "\"version\": null", "its version cannot be read"),
            ("\"theme\"", "\"colours\": [], \"theme\"", "“colours” is unknown"),
            ("body_mass_kg = 13.0", "body_mass_kg = nan", "“model” is refused"),
            ("12.5", "-Infinity", "“experiment” cannot be read"),
        ] {
            let changed = text.replacen(old, new, 1);
            assert_ne!(changed, text, "{old}");
            let (read, problems) = Document::from_json(&changed);
            assert!(problems.iter().any(|p| p.contains(named)), "{named}: {problems:?}");
            assert_eq!(read.layout, whole().layout, "{named}");
            assert_eq!(read.column_map, whole().column_map, "{named}");
        }
    }

    #[test]
    fn what_is_no_session_file_is_said_to_be_none() {
        for text in ["", "{", "[]", "null", "\u{0}\u{1}", "{\"format\": \"other\"}", "name = \"x\""] {
            let (read, problems) = Document::from_json(text);
            assert_eq!(read, Document::default(), "{text:?}");
            assert_eq!(problems, ["it is not a session file of flqr"], "{text:?}");
        }
        // Random bytes never do harm either.
        let mut seed = 7_u64;
        for _ in 0..2000 {
            let mut text = whole().to_json().into_bytes();
            for _ in 0..8 {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let at = (seed >> 33) as usize % text.len();
                text[at] = (seed >> 24) as u8;
            }
            Document::from_json(&String::from_utf8_lossy(&text));
        }
    }
}
