//! The *Runs* page: the ledger of everything that was simulated, fitted, recorded and refined; rows over each
//! other, and what changed between two.

mod changes;
mod command;
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
use crate::panes::{Pane, panes_ui};
use crate::widgets::empty_page_ui;
use changes::Changes;
pub(crate) use command::RunsCommand;
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

    /// Changes the ledger; a sentence where there is something to say.
    pub(crate) fn apply(&mut self, command: RunsCommand) -> Option<String> {
        match command {
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
