//! Source of the log: path, dialog, recent files, drop; and what is wrong with it.

use std::path::PathBuf;

use egui::{TextEdit, Ui};

use crate::column_map::ColumnMapForm;
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::health_card::{log_ui, progress_ui};
use crate::load::Loader;
use crate::widgets::{error_ui, hint_ui, section_ui, warning_ui};

/// Typed text.
pub(super) struct SourceForm {
    pub(super) path: String,
    pub(super) column_map: ColumnMapForm,
    pub(super) focus_path: bool,
    pub(super) dialog_problem: Option<String>,
}

impl SourceForm {
    pub(super) fn new(column_map: ColumnMapForm) -> Self {
        Self { path: String::new(), column_map, focus_path: false, dialog_problem: None }
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, loader: &Loader, ui: &mut Ui) {
        section_ui(ui, "Log", |ui| {
            ui.menu_button("Recent", |ui| self.recent_ui(context, ui));
        });
        let entered = self.path_ui(ui);
        self.column_map.ui(ui);
        ui.horizontal(|ui| self.buttons_ui(context, loader, ui, entered));
        if let Some(problem) = &self.dialog_problem {
            warning_ui(ui, problem);
        }
        if let Some(problem) = &loader.problem {
            error_ui(ui, problem);
            if loader.log().is_some() {
                hint_ui(ui, "The previous log is still loaded.");
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
        field.on_hover_text("Type a path and press Enter to load it (Ctrl+L)");
        entered
    }

    fn buttons_ui(&mut self, context: &ViewContext<'_>, loader: &Loader, ui: &mut Ui, entered: bool) {
        let typed = !self.path.trim().is_empty();
        if ui.button("Open…").on_hover_text("Choose a log (Ctrl+O)").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::OpenLog));
        }
        let help = "Load this path with the column map above";
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

/// Problems of the log and their remedies.
pub(super) fn health_ui(loader: &Loader, ui: &mut Ui) {
    let Some(loaded) = loader.log() else { return };
    section_ui(ui, "Data health", |_| {});
    log_ui(loaded, ui);
}
