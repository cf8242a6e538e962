//! The *Runs* page: the ledger of everything that was simulated, fitted, recorded and refined; rows over each
//! other, and what changed between two.

mod changes;
mod command;
mod curves;
mod ledger;
mod overlay;
mod run;
mod sources;
mod table;
mod watch;

use std::collections::BTreeSet;
use std::time::{SystemTime, UNIX_EPOCH};

use egui::{CentralPanel, Frame, Margin, Panel, Ui};
use flqr_core::device::RecordingStatus;
use flqr_core::model::Model;

use crate::context::ViewContext;
use crate::job::Waker;
use crate::messages::{Said, Severity};
use crate::pages::{Done, Page, PageCommand, Pages, Surroundings, Tab};
use crate::panes::{Pane, panes_ui};
use crate::widgets::empty_page_ui;
use changes::Changes;
pub(crate) use command::RunsCommand;
use curves::Reading;
pub(crate) use ledger::Ledger;
use overlay::Overlay;
pub(crate) use run::{Channel, Run, RunKind, Series, Value};
pub(crate) use sources::Sources;
use table::RunTable;
use watch::RecordingWatch;

/// The ledger and how it is looked at.
#[derive(Default)]
pub(crate) struct RunsTab {
    ledger: Ledger,
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

    fn read_curves(&mut self, number: u64, waker: &Waker) -> Option<String> {
        let row = self.ledger.row(number)?;
        let file = row.file()?;
        if self.reading.iter().any(|reading| reading.row.number == number) {
            self.ticked.insert(number);
            return None;
        }
        match Reading::start(row, file, waker) {
            Ok(reading) => {
                self.reading.push(reading);
                self.ticked.insert(number);
                None
            }
            Err(problem) => Some(problem),
        }
    }

    /// Ticks the last two rows of one kind that have curves; a sentence where there are none.
    fn overlay_last(&mut self, waker: &Waker) -> Option<String> {
        let Some(numbers) = self.ledger.last_alike(Run::can_be_drawn) else {
            return Some("There are no two runs of one kind with curves to overlay.".to_owned());
        };
        self.ticked.clear();
        let mut problem = None;
        for number in numbers {
            if self.ledger.row(number).is_some_and(|row| row.series.is_some()) {
                self.ticked.insert(number);
            } else {
                problem = self.read_curves(number, waker).or(problem);
            }
        }
        problem
    }

    /// The command that makes a row again.
    ///
    /// # Errors
    /// A sentence says why nothing does.
    pub(crate) fn command_of(&self, number: u64) -> Result<String, String> {
        self.ledger.row(number).ok_or("This run does not exist.")?.command_line()
    }

    /// All rows.
    pub(crate) fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Puts rows that were kept in a file before those that are there, which get new numbers; says how many those are.
    pub(crate) fn begin_with(&mut self, earlier: Ledger) -> usize {
        self.ticked.clear();
        self.reading.clear();
        self.ledger.begin_with(earlier)
    }

    /// Shows other rows, and those that have come since these were opened; gives back those of before.
    pub(crate) fn take(&mut self, mut ledger: Ledger) -> Ledger {
        ledger.take_series(&self.ledger);
        ledger.follow(&mut self.ledger);
        let before = std::mem::replace(&mut self.ledger, ledger);
        self.ticked.retain(|number| self.ledger.row(*number).is_some_and(|row| before.has(row)));
        self.reading.clear();
        before
    }
}

impl Page for RunsTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let frame = Frame::central_panel(ui.style()).inner_margin(Margin::symmetric(10, 6));
        if self.ledger.rows().is_empty() && !self.ledger.has_deleted() {
            let hint = "Every experiment, fit, refinement and recording is listed here, with a number that its exports carry.";
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
                let undo = self.ledger.has_deleted();
                self.table.ui(context, &self.ledger, &mut self.ticked, undo, ui);
            });
        let panes = [
            Pane::middle(Part::Overlay, "Overlay of runs", 390.0).at_least(320.0),
            Pane::right(Part::Changes, "Changes", 440.0, 240.0..=640.0),
        ];
        panes_ui(ui, "runs", &panes, |part, ui| match part {
            Part::Overlay => self.overlay.ui(&self.ledger, &self.ticked, context.commands, ui),
            Part::Changes => self.changes.ui(&self.ledger, &self.ticked, ui),
        });
    }

    fn snapshot(&self, _: &ViewContext<'_>) -> serde_json::Value {
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
            "can_undo_delete": self.ledger.has_deleted(),
        })
    }

    fn command_line(&self, _: &ViewContext<'_>) -> Result<String, String> {
        let run = match self.ticked.len() {
            0 => self.ledger.rows().last().map(|run| &**run),
            1 => self.ticked.first().and_then(|number| self.ledger.row(*number)),
            _ => return Err("Several rows are selected. Select one to copy its command.".to_owned()),
        };
        run.ok_or("There is no run yet.")?.command_line()
    }

    fn drain(&mut self) -> Vec<Said> {
        let mut problems = Vec::new();
        for mut reading in std::mem::take(&mut self.reading) {
            match reading.drain() {
                None => self.reading.push(reading),
                // The number may be another run's by now, of a session that was opened meanwhile.
                Some(_) if !self.ledger.has(&reading.row) => {}
                Some(Ok(series)) => self.ledger.set_series(reading.row.number, series),
                Some(Err(problem)) => {
                    self.ticked.remove(&reading.row.number);
                    let text = format!("Run {} cannot be drawn: {problem}.", reading.row.number);
                    problems.push((Severity::Error, text));
                }
            }
        }
        let (ledger, reading) = (&self.ledger, &self.reading);
        let is_read = |number| reading.iter().any(|reading| reading.row.number == number);
        let is_drawn = |number| ledger.row(number).is_some_and(|row| row.series.is_some());
        self.ticked.retain(|number| is_drawn(*number) || is_read(*number));
        problems
    }
}

/// The panes under the table.
#[derive(Clone, Copy)]
enum Part {
    Overlay,
    Changes,
}

fn listed(numbers: Vec<u64>) -> String {
    let numbers: Vec<String> = numbers.into_iter().map(|number| number.to_string()).collect();
    format!("{} {}", if numbers.len() == 1 { "run" } else { "runs" }, numbers.join(", "))
}

impl PageCommand for RunsCommand {
    fn apply(&self, pages: &mut Pages, around: Surroundings<'_>) -> Result<Done, String> {
        let page = &mut pages.runs;
        let tab = matches!(self, Self::OverlayLast | Self::FocusRows).then_some(Tab::Runs);
        let said = match self {
            Self::ReadCurves(number) => page.read_curves(*number, around.waker),
            Self::Delete(numbers) => {
                let deleted = page.ledger.delete(numbers);
                page.ticked.retain(|number| !numbers.contains(number));
                let text = |deleted| format!("Deleted {}. Undo delete restores it.", listed(deleted));
                (!deleted.is_empty()).then(|| text(deleted))
            }
            Self::FocusRows => {
                page.table.focus_first = true;
                None
            }
            Self::OverlayLast => page.overlay_last(around.waker),
            Self::UntickAll => {
                page.ticked.clear();
                None
            }
            Self::UndoDelete => page.ledger.undo_delete().map(|back| format!("{} is back.", listed(back))),
            Self::SetNote(number, note) => {
                if let Some(row) = page.ledger.row_mut(*number) {
                    row.note.clone_from(note);
                }
                None
            }
        };
        Ok(Done { said, tab, ..Done::default() })
    }
}
