//! Model files: preset, path, recent, open and save.

use std::path::{Path, PathBuf};

use egui::{TextEdit, Ui};
use flqr_core::model::Rig;
use flqr_core::model_file::{ModelWarning, presets};

use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::session::Session;
use crate::widgets::{error_ui, section_ui, warning_ui};

/// State of the file controls.
pub(super) struct ModelFiles {
    path: String,
    pub(super) problem: Option<String>,
    /// Values that look like a slip of the unit, and the model that has them.
    warnings: Option<(Rig, Vec<ModelWarning>)>,
}

impl ModelFiles {
    pub(super) fn new(path: Option<&Path>) -> Self {
        let path = path.map(|path| path.display().to_string()).unwrap_or_default();
        Self { path, problem: None, warnings: None }
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Model", |ui| {
            ui.menu_button("Recent", |ui| self.recent_ui(context, ui));
            ui.menu_button("Presets", |ui| {
                for (number, (name, _)) in presets::ALL.iter().enumerate() {
                    if ui.button(*name).clicked() {
                        context.commands.send(Command::LoadPreset(number));
                        ui.close();
                    }
                }
            });
        });
        let field = TextEdit::singleline(&mut self.path)
            .hint_text("path of a model file")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("model path");
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        field.on_hover_text("Type a path and press Enter to load it");
        ui.horizontal(|ui| self.buttons_ui(context, ui, entered));
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        for warning in self.warnings(context.session) {
            warning_ui(ui, warning.to_string());
        }
    }

    fn warnings(&mut self, session: &Session) -> &[ModelWarning] {
        if self.warnings.as_ref().is_none_or(|(rig, _)| *rig != session.rig) {
            self.warnings = Some((session.rig.clone(), session.model().warnings()));
        }
        self.warnings.as_ref().map_or(&[], |(_, warnings)| warnings)
    }

    fn buttons_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui, entered: bool) {
        let typed = !self.path.trim().is_empty();
        let path = PathBuf::from(self.path.trim());
        if ui.button("Open…").on_hover_text("Choose a model file (Ctrl+O)").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::OpenModel));
        }
        let load = ui.add_enabled(typed, egui::Button::new("Load")).on_hover_text("Load this path");
        if load.clicked() || (entered && typed) {
            self.problem = None;
            context.commands.send(Command::LoadModel(path.clone()));
        }
        let save = ui.add_enabled(typed, egui::Button::new("Save"));
        if save.on_hover_text("Save to this path; you are asked before another file is overwritten. Ctrl+S saves to the loaded file").clicked() {
            self.problem = None;
            context.commands.send(Command::SaveModel(path));
        }
        if ui.button("Save as…").on_hover_text("Choose where to save").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::SaveModel));
        }
    }

    fn recent_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        if context.recent.models.is_empty() {
            ui.weak("no model yet");
        }
        for path in &context.recent.models {
            if ui.button(path.display().to_string()).clicked() {
                self.path = path.display().to_string();
                context.commands.send(Command::LoadModel(path.clone()));
                ui.close();
            }
        }
    }
}
