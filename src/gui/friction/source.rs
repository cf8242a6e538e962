//! Where the log comes from: path, dialog, recent files, drop; and what is wrong with it.

use std::path::PathBuf;

use egui::{ProgressBar, RichText, TextEdit, Ui};
use flqr_core::record::{ColumnMap, Mapping, Severity};

use super::load::{LoadedLog, Loader};
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::theme::palette;
use crate::widgets::{error_ui, hint_ui, section_ui, warning_ui};

/// Line problems that are shown one by one.
const SHOWN_PROBLEMS: usize = 3;

/// What has been typed.
pub(super) struct SourceForm {
    pub(super) path: String,
    pub(super) column_map: String,
    pub(super) focus_path: bool,
    pub(super) dialog_problem: Option<String>,
}

impl SourceForm {
    pub(super) fn new(column_map: &[Mapping]) -> Self {
        let column_map = column_map.iter().map(Mapping::to_string).collect::<Vec<_>>().join("; ");
        Self { path: String::new(), column_map, focus_path: false, dialog_problem: None }
    }

    /// The column map as typed: entries `ours=theirs*factor`, separated by `;` because names may have spaces.
    pub(super) fn parse_column_map(&self) -> Result<ColumnMap, String> {
        let entries = self.column_map.split(';').map(str::trim).filter(|entry| !entry.is_empty());
        let entries: Result<Vec<Mapping>, _> = entries.map(str::parse).collect();
        entries.and_then(ColumnMap::new).map_err(|error| format!("column map: {error}"))
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, loader: &Loader, ui: &mut Ui) {
        section_ui(ui, "Log", |ui| {
            ui.menu_button("Recent", |ui| self.recent_ui(context, ui));
        });
        let entered = self.path_ui(ui);
        self.map_ui(ui);
        ui.horizontal(|ui| self.buttons_ui(context, loader, ui, entered));
        if let Some(problem) = &self.dialog_problem {
            warning_ui(ui, problem);
        }
        if let Some(problem) = &loader.problem {
            error_ui(ui, problem);
            if loader.log().is_some() {
                hint_ui(ui, "The log of before is still there.");
            }
        }
        progress_ui(loader, ui);
    }

    fn path_ui(&mut self, ui: &mut Ui) -> bool {
        let field = TextEdit::singleline(&mut self.path)
            .hint_text("path of a CSV file, or drop one here")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("log path");
        if std::mem::take(&mut self.focus_path) {
            field.request_focus();
        }
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        field.on_hover_text("Type a path and press Enter to load it (Ctrl+L comes here)");
        entered
    }

    fn map_ui(&mut self, ui: &mut Ui) {
        let field = TextEdit::singleline(&mut self.column_map)
            .hint_text("column map: ours=theirs*factor; …")
            .desired_width(f32::INFINITY);
        ui.add(field).accessible_name("column map").on_hover_text(
            "For files with other column names or units: ours=theirs*factor, several separated by “;”.\nExample: torque_nm=current_a*0.32; motor_angle_rad=Angle (rad)",
        );
        if let Err(problem) = self.parse_column_map() {
            error_ui(ui, problem);
        }
    }

    fn buttons_ui(&mut self, context: &ViewContext<'_>, loader: &Loader, ui: &mut Ui, entered: bool) {
        let typed = !self.path.trim().is_empty();
        if ui.button("Open…").on_hover_text("Choose a log (Ctrl+O)").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::OpenLog));
        }
        let help = "Load the path above with the column map above";
        let load = ui.add_enabled(typed, egui::Button::new("Load")).on_hover_text(help);
        if load.clicked() || (entered && typed) {
            context.commands.send(Command::LoadLog(PathBuf::from(self.path.trim())));
        }
        if loader.is_running() && ui.button("Cancel").on_hover_text("Stop loading").clicked() {
            context.commands.send(Command::CancelLoad);
        }
    }

    fn recent_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        if context.recent.logs.is_empty() {
            ui.weak("no log yet");
        }
        for path in &context.recent.logs {
            if ui.button(path.display().to_string()).clicked() {
                context.commands.send(Command::LoadLog(path.clone()));
                ui.close();
            }
        }
    }
}

fn progress_ui(loader: &Loader, ui: &mut Ui) {
    if !loader.is_running() {
        return;
    }
    let text = loader.progress.map_or_else(
        || "opening".to_owned(),
        |p| format!("{} rows, {:.1} of {:.1} MB", p.rows, p.bytes as f64 / 1e6, p.total_bytes as f64 / 1e6),
    );
    let share = loader.progress.map_or(0.0, |p| p.bytes as f32 / p.total_bytes.max(1) as f32);
    ui.add(ProgressBar::new(share).text(RichText::new(text).small()));
}

/// What is wrong with the log, and the mend.
pub(super) fn health_ui(loader: &Loader, ui: &mut Ui) {
    let Some(loaded) = loader.log() else { return };
    section_ui(ui, "Data health", |_| {});
    let colors = palette(ui.visuals());
    if let Err(problem) = &loaded.kind {
        error_ui(ui, problem);
    }
    let harmless = loaded.health.iter().all(|finding| finding.severity == Severity::Info);
    if harmless && loaded.kind.is_ok() && loaded.log.problem_count == 0 {
        ui.label(RichText::new("nothing wrong was found").small().color(colors.good));
    }
    line_problems_ui(loaded, ui);
    for finding in &loaded.health {
        let (mark, color) = match finding.severity {
            Severity::Info => ("note", colors.measured),
            Severity::Warning => ("warning", colors.warning),
            Severity::Error => ("error", colors.error),
        };
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(RichText::new(mark).small().strong().color(color));
            if !finding.column.is_empty() {
                ui.label(RichText::new(&finding.column).small().monospace());
            }
            ui.label(RichText::new(&finding.problem).small());
            if !finding.mend.is_empty() {
                ui.label(RichText::new(format!("→ {}", finding.mend)).small().weak());
            }
        });
    }
}

/// The first rows and cells that could not be used, where they are in the file.
fn line_problems_ui(loaded: &LoadedLog, ui: &mut Ui) {
    let log = &loaded.log;
    if log.problem_count == 0 {
        return;
    }
    let count = format!("{} rows left out, {} problems in lines", log.dropped_rows, log.problem_count);
    warning_ui(ui, count);
    for problem in log.problems.iter().take(SHOWN_PROBLEMS) {
        ui.label(RichText::new(problem.to_string()).small().weak());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_handed_over_is_read_back_also_with_spaces_in_names() {
        let map: Vec<Mapping> = ["motor_angle_rad=Angle (rad)", "torque_nm=Motor current*0.32"]
            .map(|entry| entry.parse().unwrap())
            .to_vec();
        let form = SourceForm::new(&map);
        assert_eq!(form.column_map, "motor_angle_rad=Angle (rad); torque_nm=Motor current*0.32");
        assert_eq!(form.parse_column_map().unwrap().entries(), map);
    }

    #[test]
    fn empty_entries_are_none() {
        for text in ["", "  ", ";", " ; torque_nm=a ;"] {
            let form = SourceForm { column_map: text.to_owned(), ..SourceForm::new(&[]) };
            assert_eq!(
                form.parse_column_map().unwrap().entries().len(),
                usize::from(text.contains('=')),
                "{text:?}"
            );
        }
    }
}
