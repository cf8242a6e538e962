//! The rows, newest first.

use std::collections::BTreeSet;

use egui::{Button, Checkbox, Grid, Label, Response, RichText, ScrollArea, Sense, TextEdit, Ui};

use super::ledger::Ledger;
use super::run::{Run, RunKind};
use super::{RunsCommand, overlay};
use crate::command::Command;
use crate::context::ViewContext;
use crate::theme::outline_boxes;
use crate::widgets::{hint_ui, mono, section_ui};

/// Height of a row, with the room below it.
const ROW_HEIGHT: f32 = 24.0;
const COLUMNS: [&str; 10] =
    ["show", "run", "UTC", "kind", "what", "seed", "Q | R", "sources", "result", "note"];
/// Places of what was run, the result and the note among the columns.
const TITLE: usize = 4;
const RESULT: usize = 8;
const NOTE: usize = 9;
const SPACING: f32 = 12.0;
const NOTE_WIDTH: f32 = 150.0;
/// Greatest width of what was run; a tip has all of it.
const TITLE_WIDTH: f32 = 260.0;
/// Least and greatest width of a result.
const RESULT_WIDTH: [f32; 2] = [160.0, 620.0];

/// Typed text.
#[derive(Default)]
pub(super) struct RunTable {
    filter: String,
    /// The first box is to take the keyboard.
    pub(super) focus_first: bool,
    /// The first box that is drawn in this frame takes it.
    focuses: bool,
    /// A note that is being typed.
    note: Option<(u64, String)>,
    /// Largest width that each column has had, so that they stay where they are when other rows come into view.
    widths: [f32; COLUMNS.len()],
}

impl RunTable {
    pub(super) fn ui(
        &mut self,
        context: &ViewContext<'_>,
        ledger: &Ledger,
        ticked: &mut BTreeSet<u64>,
        can_undo: bool,
        ui: &mut Ui,
    ) {
        section_ui(ui, "Runs", |ui| self.head_ui(context, ledger, ticked, can_undo, ui));
        let found: Vec<&Run> =
            ledger.rows().iter().rev().map(|run| &**run).filter(|run| self.finds(run)).collect();
        if found.is_empty() {
            hint_ui(ui, "No row matches.");
        }
        let others: f32 = self.widths.iter().map(|width| width + SPACING).sum::<f32>() - self.widths[RESULT];
        let result = (ui.available_width() - others).clamp(RESULT_WIDTH[0], RESULT_WIDTH[1]);
        self.widths[RESULT] = result;
        // The heads are the first row. Only what is in view is drawn.
        let mut rows = ScrollArea::both().id_salt("runs").auto_shrink(false);
        if std::mem::take(&mut self.focus_first) {
            rows = rows.vertical_scroll_offset(0.0);
            self.focuses = true;
        }
        rows.show_rows(ui, ROW_HEIGHT - ui.spacing().item_spacing.y, found.len() + 1, |ui, range| {
            let grid = Grid::new("run rows").num_columns(COLUMNS.len()).striped(true);
            let grid = grid.spacing([SPACING, 0.0]).min_row_height(ROW_HEIGHT).start_row(range.start);
            grid.show(ui, |ui| {
                for row in range {
                    match row.checked_sub(1).and_then(|index| found.get(index)) {
                        Some(run) => self.row_ui(context, run, ticked, ui),
                        None => self.heads_ui(ui),
                    }
                    ui.end_row();
                }
            });
        });
    }

    fn heads_ui(&mut self, ui: &mut Ui) {
        for (column, head) in COLUMNS.into_iter().enumerate() {
            self.cell_ui(column, ui, |ui| ui.label(RichText::new(head).small().weak()));
        }
    }

    /// A cell as wide as its column has been.
    fn cell_ui<R>(&mut self, column: usize, ui: &mut Ui, content: impl FnOnce(&mut Ui) -> R) -> R {
        let width = &mut self.widths[column];
        let cell = ui.horizontal(|ui| {
            ui.set_min_width(*width);
            content(ui)
        });
        if column != RESULT {
            *width = width.max(cell.response.rect.width());
        }
        cell.inner
    }

    /// From the right to the left.
    fn head_ui(
        &mut self,
        context: &ViewContext<'_>,
        ledger: &Ledger,
        ticked: &BTreeSet<u64>,
        can_undo: bool,
        ui: &mut Ui,
    ) {
        if ui.button("Copy rows").on_hover_text("Copy all rows as a table for a spreadsheet").clicked() {
            ui.ctx().copy_text(as_text(ledger));
        }
        let undo = ui.add_enabled(can_undo, Button::new("Undo delete"));
        if undo.on_hover_text("Restore the rows deleted last").clicked() {
            context.commands.send(RunsCommand::UndoDelete);
        }
        let delete = ui.add_enabled(!ticked.is_empty(), Button::new("Delete selected"));
        if delete.on_hover_text("Delete the selected rows").clicked() {
            context.commands.send(RunsCommand::Delete(ticked.iter().copied().collect()));
        }
        let none = ui.add_enabled(!ticked.is_empty(), Button::new("Clear selection"));
        if none.on_hover_text("Clear the selection").clicked() {
            context.commands.send(RunsCommand::UntickAll);
        }
        let field = TextEdit::singleline(&mut self.filter).hint_text("filter").desired_width(140.0);
        ui.add(field).accessible_name("filter of runs").on_hover_text("Rows that contain all of these words");
    }

    fn finds(&self, run: &Run) -> bool {
        if self.filter.trim().is_empty() {
            return true;
        }
        let text = format!("{} {} {} {} {}", run.number, run.kind.name(), run.title, run.result, run.note);
        let text = text.to_lowercase();
        self.filter.to_lowercase().split_whitespace().all(|word| text.contains(word))
    }

    fn row_ui(&mut self, context: &ViewContext<'_>, run: &Run, ticked: &mut BTreeSet<u64>, ui: &mut Ui) {
        let result = self.widths[RESULT];
        let hash = run.sources.get(..8).unwrap_or(&run.sources);
        let tick = self.cell_ui(0, ui, |ui| tick_ui(context, run, ticked, ui));
        if tick.enabled() && std::mem::take(&mut self.focuses) {
            tick.request_focus();
        }
        self.cell_ui(1, ui, |ui| number_ui(context, run.number, ui));
        self.cell_ui(2, ui, |ui| {
            ui.label(mono(clock(run.unix_s))).on_hover_text(format!("{} seconds since 1970", run.unix_s))
        });
        self.cell_ui(3, ui, |ui| ui.label(run.kind.name()));
        self.cell_ui(TITLE, ui, |ui| title_ui(context, run, ui));
        self.cell_ui(5, ui, |ui| ui.label(mono(run.seed.map_or("–".to_owned(), |seed| seed.to_string()))));
        self.cell_ui(6, ui, |ui| ui.label(mono(run.weights()).small()));
        self.cell_ui(7, ui, |ui| {
            ui.label(mono(hash).small().weak())
                .on_hover_text(format!("{}: hash of the model and of the log columns", run.sources))
        });
        self.cell_ui(RESULT, ui, |ui| {
            ui.set_max_width(result);
            ui.add(Label::new(RichText::new(&run.result).small()).truncate()).on_hover_text(&run.result)
        });
        let width = &mut self.widths[NOTE];
        *width = width.max(NOTE_WIDTH + 2.0 * ui.spacing().button_padding.x);
        self.note_ui(context, run, ui);
    }

    /// A note is taken when it is left, so that it is one change.
    fn note_ui(&mut self, context: &ViewContext<'_>, run: &Run, ui: &mut Ui) {
        let mut text = match &self.note {
            Some((number, text)) if *number == run.number => text.clone(),
            _ => run.note.clone(),
        };
        let field = TextEdit::singleline(&mut text).desired_width(NOTE_WIDTH).hint_text("note");
        let field = ui.add(field).accessible_name(format!("note of run {}", run.number));
        if field.changed() {
            self.note = Some((run.number, text));
        }
        if field.lost_focus()
            && let Some((number, text)) = self.note.take_if(|(number, _)| *number == run.number)
        {
            context.commands.send(RunsCommand::SetNote(number, text));
        }
    }
}

fn number_ui(context: &ViewContext<'_>, number: u64, ui: &mut Ui) {
    ui.label(mono(number.to_string()).strong());
    let delete = ui.add(Button::new("×").small().frame(false));
    let delete = delete.accessible_name(format!("delete run {number}"));
    if delete.on_hover_text("Delete this row; Undo delete restores it").clicked() {
        context.commands.send(RunsCommand::Delete(vec![number]));
    }
}

/// Returns whether a row is drawn: offered only where that shows something.
fn tick_ui(context: &ViewContext<'_>, run: &Run, ticked: &mut BTreeSet<u64>, ui: &mut Ui) -> Response {
    let number = run.number;
    let mut tick = ticked.contains(&number);
    let drawn = run.series.is_some();
    let help = match (drawn, run.file().is_some(), run.kind) {
        (true, ..) => "Overlay it below with the other selected rows",
        (_, true, _) => "Read the curves from its file and overlay them below",
        (_, _, RunKind::Fit | RunKind::Refinement) => "No time series. “Changes” compares its values",
        (_, _, RunKind::Experiment | RunKind::Recording) => {
            "Its curves are no longer in memory. “Changes” compares its values; its command repeats the run"
        }
    };
    outline_boxes(ui.visuals_mut());
    let check = ui.add_enabled(tick || run.can_be_drawn(), Checkbox::new(&mut tick, ""));
    let check = check.accessible_name(format!("show run {number}"));
    let check = check.on_hover_text(help).on_disabled_hover_text(help);
    if check.changed() {
        if !tick {
            ticked.remove(&number);
        } else if drawn {
            ticked.insert(number);
        } else {
            context.commands.send(RunsCommand::ReadCurves(number));
        }
    }
    if !tick && !drawn && run.file().is_none() {
        let is_curveless = matches!(run.kind, RunKind::Fit | RunKind::Refinement);
        let reason = if is_curveless { "no curves" } else { "curves not saved" };
        ui.label(RichText::new(reason).small().weak()).on_hover_text(help);
    }
    if tick && drawn {
        overlay::key_ui(ui, ticked, number);
    } else if tick && run.file().is_some() {
        ui.spinner();
    }
    check
}

/// Description of a row; a right click copies its command.
fn title_ui(context: &ViewContext<'_>, run: &Run, ui: &mut Ui) {
    ui.set_max_width(TITLE_WIDTH);
    let title =
        ui.add(Label::new(&run.title).truncate().show_tooltip_when_elided(false).sense(Sense::click()));
    let title = title.on_hover_text(match &run.command {
        Some(command) => format!("{}\n{command}\n(right click: copy as a command)", run.title),
        None => run.title.clone(),
    });
    title.context_menu(|ui| {
        let copy = ui.add_enabled(run.command.is_some(), Button::new("Copy as a command"));
        if copy.on_hover_text("Command line that repeats this run").clicked() {
            context.commands.send(Command::CopyLineOf(run.number));
            ui.close();
        }
    });
}

/// Time of day, UTC.
fn clock(unix_s: u64) -> String {
    let second = unix_s % 86_400;
    format!("{:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60)
}

/// All rows with tabs between the cells.
fn as_text(ledger: &Ledger) -> String {
    let mut text = "run\tunix_s\tkind\twhat\tseed\tq_and_r\tsources\tresult\tnote\n".to_owned();
    for run in ledger.rows() {
        let seed = run.seed.map(|seed| seed.to_string()).unwrap_or_default();
        let cells = [
            run.number.to_string(),
            run.unix_s.to_string(),
            run.kind.name().to_owned(),
            run.title.clone(),
            seed,
            run.weights(),
            run.sources.clone(),
            run.result.clone(),
            run.note.clone(),
        ];
        // A cell must not end a row.
        text += &cells.map(|cell| cell.replace(['\t', '\n', '\r'], " ")).join("\t");
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::Sources;

    #[test]
    fn rows_as_text_keep_their_columns_whatever_is_noted() {
        let mut ledger = Ledger::default();
        ledger.add(
            Run {
                note: "a\tb\nc".to_owned(),
                ..Run::new(RunKind::Fit, "friction", None, Sources::new(None, []))
            },
            86_399,
        );
        let text = as_text(&ledger);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|line| line.split('\t').count() == 9), "{text}");
        assert_eq!(clock(86_399), "23:59:59");
    }
}
