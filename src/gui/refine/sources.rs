//! The logs: where they come from, what they hold, and which of them are held out.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{RichText, TextEdit, Ui};
use flqr_core::record::{Log, Mapping};

use super::command::{RefineCommand, RefineFile};
use crate::column_map::ColumnMapForm;
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::health_card::progress_ui;
use crate::job::Waker;
use crate::load::{LoadedLog, Loader};
use crate::messages::Said;
use crate::widgets::{error_ui, hint_ui, section_ui, warning_ui};

/// A log of the list.
pub(super) struct Source {
    id: u64,
    pub(super) path: PathBuf,
    /// Takes no part in the estimates, and tells the error.
    pub(super) held_out: bool,
    /// True if it was made in this program, and no file has it.
    made: bool,
    /// The column map that it was loaded with.
    map: Vec<Mapping>,
    pub(super) loader: Loader,
}

impl Source {
    /// Returns whether no file has it.
    pub(super) fn is_made(&self) -> bool {
        self.made
    }
}

/// A log as a question takes it.
#[derive(Clone)]
pub(super) struct Input {
    pub(super) path: PathBuf,
    pub(super) held_out: bool,
    pub(super) map: Vec<Mapping>,
    pub(super) log: Arc<Log>,
    /// True if no file has it.
    pub(super) made: bool,
}

impl Input {
    /// A log that no file has.
    pub(super) fn made(loaded: &LoadedLog) -> Self {
        let (path, log) = (loaded.path.clone(), Arc::clone(&loaded.log));
        Self { path, held_out: false, map: Vec::new(), log, made: true }
    }
}

/// The very same log in the same part.
impl PartialEq for Input {
    fn eq(&self, other: &Self) -> bool {
        self.held_out == other.held_out && Arc::ptr_eq(&self.log, &other.log)
    }
}

/// Form and list.
pub(super) struct Sources {
    path: String,
    column_map: ColumnMapForm,
    pub(super) focus_path: bool,
    pub(super) dialog_problem: Option<String>,
    pub(super) list: Vec<Source>,
    next_id: u64,
}

impl Sources {
    pub(super) fn new(column_map: ColumnMapForm) -> Self {
        Self {
            path: String::new(),
            column_map,
            focus_path: false,
            dialog_problem: None,
            list: Vec::new(),
            next_id: 0,
        }
    }

    pub(super) fn focus_path(&mut self) {
        self.focus_path = true;
    }

    /// Loads a log next to the others; one that is in the list already is loaded again.
    pub(super) fn load(&mut self, path: &Path, held_out: bool, waker: &Waker) -> Result<(), String> {
        self.dialog_problem = None;
        let map = self.column_map.parse()?;
        let place = self.list.iter().position(|source| source.path == path).unwrap_or_else(|| {
            self.next_id += 1;
            self.list.push(Source {
                id: self.next_id,
                path: path.to_owned(),
                held_out,
                made: false,
                map: Vec::new(),
                loader: Loader::default(),
            });
            self.list.len() - 1
        });
        let source = &mut self.list[place];
        source.held_out |= held_out;
        source.map = map.entries().to_vec();
        source.loader.start(path, map, waker)?;
        self.path.clear();
        Ok(())
    }

    /// These logs, which no file has, in place of all others.
    pub(super) fn replace(&mut self, logs: Vec<LoadedLog>) {
        self.list.clear();
        for loaded in logs {
            self.next_id += 1;
            let (id, path) = (self.next_id, loaded.path.clone());
            let loader = Loader::holding(loaded);
            self.list.push(Source { id, path, held_out: false, made: true, map: Vec::new(), loader });
        }
    }

    pub(super) fn remove(&mut self, id: u64) {
        self.list.retain(|source| source.id != id);
    }

    pub(super) fn hold_out(&mut self, id: u64, held_out: bool) {
        if let Some(source) = self.list.iter_mut().find(|source| source.id == id) {
            source.held_out = held_out;
        }
    }

    /// Takes in what the workers have brought; the last sentence if some have ended.
    pub(super) fn drain(&mut self) -> Option<Said> {
        self.list
            .iter_mut()
            .filter_map(|source| source.loader.drain("the first step of the Refine page"))
            .last()
    }

    pub(super) fn is_loading(&self) -> bool {
        self.list.iter().any(|source| source.loader.is_running())
    }

    /// The logs that are in memory.
    pub(super) fn loaded(&self) -> impl Iterator<Item = (&Source, &LoadedLog)> {
        self.list.iter().filter_map(|source| Some((source, source.loader.log()?)))
    }

    /// Logs of a search, held-out logs last.
    pub(super) fn inputs(&self) -> Vec<Input> {
        let input = |(source, loaded): (&Source, &LoadedLog)| Input {
            path: source.path.clone(),
            held_out: source.held_out,
            map: source.map.clone(),
            log: Arc::clone(&loaded.log),
            made: source.made,
        };
        let mut inputs: Vec<Input> = self.loaded().map(input).collect();
        inputs.sort_by_key(|input| input.held_out);
        inputs
    }

    pub(super) fn snapshot(&self) -> serde_json::Value {
        let one = |source: &Source| {
            let mut shown = source.loader.snapshot();
            shown["path"] = source.path.display().to_string().into();
            shown["held_out"] = source.held_out.into();
            shown
        };
        self.list.iter().map(one).collect()
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Logs", |ui| {
            ui.menu_button("Recent", |ui| recent_ui(context, ui));
        });
        let entered = self.path_ui(ui);
        self.column_map.ui(ui);
        ui.horizontal_wrapped(|ui| self.buttons_ui(context, ui, entered));
        if let Some(problem) = &self.dialog_problem {
            warning_ui(ui, problem);
        }
        for source in &self.list {
            source.ui(context, ui);
        }
        if self.list.iter().any(|source| !source.held_out) && self.list.iter().all(|source| !source.held_out)
        {
            hint_ui(ui, "Without a held-out log, the last third of each log is held out.");
        }
    }

    fn path_ui(&mut self, ui: &mut Ui) -> bool {
        let field = TextEdit::singleline(&mut self.path)
            .hint_text("path of a CSV file, or drop files here")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("path of a log");
        if std::mem::take(&mut self.focus_path) {
            field.request_focus();
        }
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        field.on_hover_text("Type a path and press Enter to add it (Ctrl+L)");
        entered
    }

    fn buttons_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui, entered: bool) {
        let path = PathBuf::from(self.path.trim());
        let typed = !path.as_os_str().is_empty();
        let add = |held_out| {
            let path = path.clone();
            context.commands.send(RefineCommand::Load { path, held_out });
        };
        let fits = ui.add_enabled(typed, egui::Button::new("Add log"));
        if fits.on_hover_text("Used to refine the model").clicked() || (entered && typed) {
            add(false);
        }
        let held_out = ui.add_enabled(typed, egui::Button::new("Add held out"));
        if held_out.on_hover_text("Used for validation only").clicked() {
            add(true);
        }
        if ui.button("Open…").on_hover_text("Choose a log (Ctrl+O)").clicked() {
            context.commands.send(Command::ShowDialog(FilePurpose::Refine(RefineFile::Log)));
        }
    }
}

fn recent_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    if context.recent.logs.is_empty() {
        ui.weak("no log yet");
    }
    for path in &context.recent.logs {
        if ui.button(path.display().to_string()).clicked() {
            let path = path.clone();
            context.commands.send(RefineCommand::Load { path, held_out: false });
            ui.close();
        }
    }
}

impl Source {
    fn ui(&self, context: &ViewContext<'_>, ui: &mut Ui) {
        let path = self.path.display().to_string();
        let name = self.path.file_name().map_or_else(|| path.clone(), |name| name.to_string_lossy().into());
        let send = |command| context.commands.send(command);
        ui.horizontal(|ui| {
            let right = egui::Layout::right_to_left(egui::Align::Center);
            ui.with_layout(right, |ui| {
                let (word, help) = if self.loader.is_running() {
                    ("Cancel", "Stop loading it")
                } else {
                    ("Remove", "Remove from the list; the file is not deleted")
                };
                let remove = ui.small_button(word).on_hover_text(help);
                if remove.accessible_name(format!("{word} {name}")).clicked() {
                    send(RefineCommand::Remove(self.id));
                }
                let help = "Reload with the column map above";
                let again = ui.add_enabled(!self.made, egui::Button::new("Reload").small());
                let again = again.on_hover_text(help).on_disabled_hover_text("Not in a file");
                if again.accessible_name(format!("Reload {name}")).clicked() {
                    send(RefineCommand::Load { path: self.path.clone(), held_out: self.held_out });
                }
                let mut held_out = self.held_out;
                let tick = ui.checkbox(&mut held_out, RichText::new("held out").small());
                let tick = tick.on_hover_text("Used for validation only");
                if tick.accessible_name(format!("{name} held out")).changed() {
                    send(RefineCommand::HoldOut(self.id, held_out));
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.add(egui::Label::new(RichText::new(&name).strong()).truncate()).on_hover_text(path);
                });
            });
        });
        progress_ui(&self.loader, ui);
        if let Some(problem) = &self.loader.problem {
            error_ui(ui, problem);
            if self.loader.log().is_some() {
                hint_ui(ui, "The data read before are still used.");
            }
        }
        if let Some(loaded) = self.loader.log() {
            hint_ui(ui, loaded.summary());
        }
    }
}
