//! The *Runs* page: the ledger of everything that was simulated, fitted, recorded and refined; rows over each
//! other, and what changed between two.

mod changes;
mod command;
mod curves;
mod overlay;
mod run;
mod table;
mod watch;

use std::collections::BTreeSet;
use std::time::{SystemTime, UNIX_EPOCH};

use egui::{CentralPanel, Frame, Margin, Panel, Ui};
use flqr_core::device::RecordingStatus;
use flqr_core::model_file::Model;

use crate::context::ViewContext;
use crate::job::Waker;
use crate::panes::{Pane, panes_ui};
use crate::widgets::empty_page_ui;
use changes::Changes;
pub(crate) use command::RunsCommand;
use curves::Reading;
use overlay::Overlay;
pub(crate) use run::{Channel, Ledger, Run, RunKind, Series, Sources, Value};
use table::RunTable;
use watch::RecordingWatch;

/// The ledger and how it is looked at.
#[derive(Default)]
pub(crate) struct RunsTab {
    ledger: Ledger,
    /// What was taken out, newest last.
    deleted: Vec<Vec<Run>>,
    /// Rows that are drawn.
    ticked: BTreeSet<u64>,
    table: RunTable,
    overlay: Overlay,
    changes: Changes,
    recording: RecordingWatch,
    reading: Vec<Reading>,
}

impl RunsTab {
    /// Adds a row; its number is for everything that is exported of the run.
    pub(crate) fn note(&mut self, run: Run) -> u64 {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        self.ledger.add(run, now)
    }

    /// Takes note of how the recording stands; adds a row once it has ended. `model` is that of now.
    pub(crate) fn watch(&mut self, now: Option<&RecordingStatus>, source: &str, model: impl Fn() -> Model) {
        if let Some(row) = self.recording.note(now, source, model) {
            self.note(row);
        }
    }

    /// Takes in curves that have been read; a sentence for each recording that could not be.
    pub(crate) fn drain(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        for mut reading in std::mem::take(&mut self.reading) {
            match reading.drain() {
                None => self.reading.push(reading),
                Some(Ok(series)) => self.ledger.set_series(reading.number, series),
                Some(Err(problem)) => {
                    self.ticked.remove(&reading.number);
                    problems.push(format!("Run {} cannot be drawn: {problem}.", reading.number));
                }
            }
        }
        problems
    }

    fn read_curves(&mut self, number: u64, waker: &Waker) -> Option<String> {
        let file = self.ledger.row(number)?.file()?;
        if self.reading.iter().any(|reading| reading.number == number) {
            return None;
        }
        match Reading::start(number, file, waker) {
            Ok(reading) => {
                self.reading.push(reading);
                None
            }
            Err(problem) => Some(problem),
        }
    }

    /// The command that makes a row again.
    ///
    /// # Errors
    /// A sentence says why nothing does.
    pub(crate) fn command_of(&self, number: u64) -> Result<String, String> {
        self.ledger.row(number).ok_or("There is no such run.")?.command_line()
    }

    /// Changes the ledger; a sentence where there is something to say.
    pub(crate) fn apply(&mut self, command: RunsCommand, waker: &Waker) -> Option<String> {
        match command {
            RunsCommand::ReadCurves(number) => self.read_curves(number, waker),
            RunsCommand::Delete(numbers) => {
                let rows: Vec<Run> =
                    numbers.iter().filter_map(|number| self.ledger.remove(*number)).collect();
                self.ticked.retain(|number| !numbers.contains(number));
                if rows.is_empty() {
                    return None;
                }
                let text = format!(
                    "Deleted {}: Undo delete brings it back.",
                    listed(rows.iter().map(|row| row.number))
                );
                self.deleted.push(rows);
                Some(text)
            }
            RunsCommand::UndoDelete => {
                let rows = self.deleted.pop()?;
                let text = format!("{} is back.", listed(rows.iter().map(|row| row.number)));
                rows.into_iter().for_each(|row| self.ledger.put_back(row));
                Some(text)
            }
            RunsCommand::SetNote(number, note) => {
                self.ledger.row_mut(number)?.note = note;
                None
            }
        }
    }

    /// All rows.
    pub(crate) fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Shows other rows; gives back those of before.
    pub(crate) fn take(&mut self, mut ledger: Ledger) -> Ledger {
        ledger.take_series(&self.ledger);
        let before = std::mem::replace(&mut self.ledger, ledger);
        self.ticked.retain(|number| self.ledger.row(*number).is_some());
        self.deleted.clear();
        before
    }

    /// The command that makes the ticked row again, or the newest where none is ticked.
    ///
    /// # Errors
    /// A sentence says why there is none.
    pub(crate) fn command_line(&self) -> Result<String, String> {
        let run = match self.ticked.len() {
            0 => self.ledger.rows().last().map(|run| &**run),
            1 => self.ticked.first().and_then(|number| self.ledger.row(*number)),
            _ => return Err("Several rows are ticked: tick the one whose command is wanted.".to_owned()),
        };
        run.ok_or("There is no run yet.")?.command_line()
    }

    /// What the page shows, as `--state-out` writes it.
    pub(crate) fn snapshot(&self) -> serde_json::Value {
        let rows: Vec<_> = self
            .ledger
            .rows()
            .iter()
            .map(|run| {
                serde_json::json!({
                    "number": run.number,
                    "kind": run.kind,
                    "title": run.title,
                    "seed": run.seed,
                    "sources": run.sources,
                    "weights": run.weights(),
                    "result": run.result,
                    "note": run.note,
                    "command": run.command,
                    "values": run.series.as_ref().map_or(0, |series| series.size()),
                })
            })
            .collect();
        serde_json::json!({
            "rows": rows,
            "shown": self.ticked,
            "shifts_s": self.overlay.shifts_s(),
            "can_undo_delete": !self.deleted.is_empty(),
        })
    }

    pub(crate) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let frame = Frame::central_panel(ui.style()).inner_margin(Margin::symmetric(10, 6));
        if self.ledger.rows().is_empty() && self.deleted.is_empty() {
            let hint = "Every experiment, fit, refinement and recording becomes a row here, with a number that goes with all that is exported of it.";
            CentralPanel::default()
                .frame(frame)
                .show(ui, |ui| empty_page_ui(ui, "No run yet.", hint, |_| {}));
            return;
        }
        let height = (0.42 * ui.available_height()).max(140.0);
        Panel::top("run table")
            .frame(frame)
            .resizable(true)
            .default_size(height)
            .size_range(110.0..=900.0)
            .show(ui, |ui| {
                let undo = !self.deleted.is_empty();
                self.table.ui(context, &self.ledger, &mut self.ticked, undo, ui);
            });
        let panes = [
            Pane::middle(Part::Overlay, "Runs over each other", 390.0),
            Pane::right(Part::Changes, "What changed", 360.0, 240.0..=640.0),
        ];
        panes_ui(ui, "runs", &panes, |part, ui| match part {
            Part::Overlay => self.overlay.ui(&self.ledger, &self.ticked, context.commands, ui),
            Part::Changes => self.changes.ui(&self.ledger, ui),
        });
    }
}

/// The panes under the table.
#[derive(Clone, Copy)]
enum Part {
    Overlay,
    Changes,
}

fn listed(numbers: impl Iterator<Item = u64>) -> String {
    let numbers: Vec<String> = numbers.map(|number| number.to_string()).collect();
    format!("{} {}", if numbers.len() == 1 { "run" } else { "runs" }, numbers.join(", "))
}
