//! Confirmations before data are lost or overwritten.

use std::path::{Path, PathBuf};

use egui::text::{CCursor, CCursorRange, LayoutJob, TextFormat};
use egui::{
    Button, Color32, Context, Grid, Id, Key, Modal, Modifiers, RichText, ScrollArea, Stroke, TextEdit,
    TextStyle, Ui, vec2,
};
use flqr_core::control::gate::{GainChange, LARGEST_FACTOR};
use flqr_core::model::Model;
use flqr_core::model_file::{Change, presets};

use super::{App, apply};
use crate::command::{Command, FilePurpose};
use crate::document::{Document, Left, words};
use crate::recent::Recent;
use crate::refine::RefineFile;
use crate::robot::{STOP_HEIGHT, change_rows_ui, stop_ui};
use crate::widgets::{hint_ui, mono, warning_ui};

/// Rows of a table of changes that are shown at once.
const LONGEST_TABLE: f32 = 340.0;

/// An open question.
pub(super) enum Question {
    /// The window is to be closed, and the model is not saved.
    Leave,
    /// The window is to be closed while the robot is driven or its motors have not confirmed that they are off.
    LeaveDriven,
    /// Gains that change by much are to be applied to the robot.
    Gains { changes: Vec<GainChange> },
    /// A preset is to replace the model.
    Preset { number: usize, name: &'static str, changes: Vec<Change> },
    /// A window was not closed.
    Restore { left: Left, document: Box<Document>, whole: bool },
    /// Replace a modified model.
    Replace { by: Replacement, changes: Vec<Change> },
    /// Command that overwrites a file.
    Overwrite { path: PathBuf, what: &'static str, save: Command },
    /// A path is wanted; why there is no dialog for it.
    Path { purpose: FilePurpose, text: String, reason: Option<String>, has_focus: bool },
    /// Undoable steps.
    Steps,
}

/// New model and its file.
pub(super) enum Replacement {
    Model(Box<Model>, PathBuf),
    Session(Box<Document>, PathBuf),
}

/// Outcome of a question in a frame.
struct Reply {
    answer: Answer,
    /// Name of the answer that has the keyboard's focus.
    focus: Option<&'static str>,
}

/// Action of an answer.
enum Answer {
    Open,
    Close,
    Send(Command),
    SaveAndLeave,
    Discard,
    Restore,
    StartAfresh,
    Replace,
    Undo(usize),
    Redo(usize),
}

impl Replacement {
    fn model(&self) -> Option<&Model> {
        match self {
            Self::Model(model, _) => Some(model),
            Self::Session(document, _) => document.model.as_ref(),
        }
    }
}

/// A preset by its number.
fn preset(number: usize) -> Option<Result<Model, String>> {
    let (name, text) = presets::ALL.get(number)?;
    Some(Model::from_toml(text, name).map_err(|error| error.to_string()))
}

impl Question {
    /// Returns whether it is put already by `other`.
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Leave, Self::Leave) | (Self::LeaveDriven, Self::LeaveDriven) => true,
            (Self::Steps, Self::Steps) | (Self::Gains { .. }, Self::Gains { .. }) => true,
            (Self::Preset { number, .. }, Self::Preset { number: other, .. }) => number == other,
            (Self::Path { purpose, .. }, Self::Path { purpose: other, .. }) => purpose == other,
            (Self::Overwrite { path, .. }, Self::Overwrite { path: other, .. }) => path == other,
            _ => false,
        }
    }

    /// For scripts.
    pub(super) fn key(&self) -> &'static str {
        match self {
            Self::Leave => "leave",
            Self::LeaveDriven => "leave-driven",
            Self::Gains { .. } => "gains",
            Self::Preset { .. } => "preset",
            Self::Restore { .. } => "restore",
            Self::Replace { .. } => "replace",
            Self::Overwrite { .. } => "overwrite",
            Self::Path { .. } => "path",
            Self::Steps => "steps",
        }
    }
}

impl App {
    /// Asks, as soon as what is asked already has been answered; at once where it is about the window's end.
    pub(super) fn ask(&mut self, question: Question) {
        let mut asked = self.question.iter().chain(&self.waiting);
        if asked.any(|asked| asked.is_same(&question)) {
            return;
        }
        match (&self.question, &question) {
            (None, _) => self.question = Some(question),
            (Some(open), Question::Leave | Question::LeaveDriven | Question::Restore { .. })
                if !matches!(open, Question::Restore { .. }) =>
            {
                self.waiting.extend(self.question.replace(question));
                self.waiting.rotate_right(1);
            }
            _ => self.waiting.push_back(question),
        }
    }

    /// The next question, with what would change as things are now.
    fn ask_next(&mut self) {
        self.question = self.waiting.pop_front();
        let by = match &self.question {
            Some(Question::Replace { by, .. }) => by.model().cloned(),
            Some(Question::Preset { number, .. }) => preset(*number).and_then(Result::ok),
            _ => None,
        };
        if let (Some(by), Some(Question::Replace { changes, .. } | Question::Preset { changes, .. })) =
            (by, &mut self.question)
        {
            *changes = self.state.session.model().changes_to(&by);
        }
    }

    /// Asks before a file replaces a model that has changes.
    pub(super) fn ask_replacement(&mut self, by: Replacement) {
        let changes =
            by.model().map(|model| self.state.session.model().changes_to(model)).unwrap_or_default();
        self.ask(Question::Replace { by, changes });
    }

    /// Asks before a preset replaces the model, with what changes.
    pub(super) fn ask_preset(&mut self, number: usize) {
        match preset(number) {
            None => {}
            Some(Ok(model)) => {
                let changes = self.state.session.model().changes_to(&model);
                self.ask(Question::Preset { number, name: presets::ALL[number].0, changes });
            }
            Some(Err(error)) => self.fail(error),
        }
    }

    /// Asks for a path, because there is no dialog or none is wanted.
    pub(super) fn ask_path(&mut self, purpose: FilePurpose, reason: Option<String>) {
        let text = match purpose {
            FilePurpose::SaveModel => self.state.model_path.as_deref(),
            _ => None,
        };
        let text = text.map(|path| path.display().to_string()).unwrap_or_default();
        self.ask(Question::Path { purpose, text, reason, has_focus: false });
    }

    /// Draws the open question.
    pub(super) fn question_ui(&mut self, ctx: &Context) {
        if self.question.is_none() {
            self.ask_next();
        }
        let Some(mut question) = self.question.take() else {
            self.question_focus = None;
            return;
        };
        let mut stop = false;
        let modal = Modal::new(egui::Id::unique("question")).show(ctx, |ui| {
            ui.set_width(560.0_f32.min(ctx.content_rect().width() - 40.0).max(0.0));
            // The one of the strip cannot be reached behind this.
            let size = vec2(ui.available_width(), STOP_HEIGHT);
            stop = self.state.link.is_hot() && stop_ui(ui, size).clicked();
            self.ask_ui(&mut question, ui)
        });
        if stop {
            self.state.link.stop();
        }
        if self.question_focus != modal.inner.focus {
            self.question_focus = modal.inner.focus;
            ctx.request_repaint();
        }
        let answer = match modal.inner.answer {
            Answer::Open if modal.should_close() && !matches!(question, Question::Restore { .. }) => {
                Answer::Close
            }
            answer => answer,
        };
        match answer {
            Answer::Open => return self.question = Some(question),
            Answer::Close => self.leave_after_save = false,
            Answer::Send(command) => self.state.commands.send(command),
            Answer::SaveAndLeave => {
                self.leave_after_save = true;
                match self.state.model_path.clone() {
                    Some(path) => self.state.commands.send(Command::SaveModel(path)),
                    None => self.ask_path(FilePurpose::SaveModel, None),
                }
            }
            Answer::Discard => {
                self.state.session = self.state.saved.clone();
                self.leaving = true;
            }
            Answer::Restore => {
                if let Question::Restore { left, mut document, whole } = question {
                    if !whole && document.saved_model.is_none() {
                        // What its file has is not known, so it counts as changed.
                        document.saved_model = Some(self.state.saved.model());
                    }
                    if !self.take_document(&document_name(&document), &document, ctx) {
                        self.question = Some(Question::Restore { left, document, whole });
                    } else if whole {
                        self.take_over(left);
                    } else {
                        self.say(format!("The saved session remains in {}.", left.put_aside().display()));
                    }
                }
            }
            Answer::StartAfresh => {
                self.pages.log.release();
                if let Question::Restore { left, .. } = question {
                    self.say(format!("The previous session remains in {}.", left.put_aside().display()));
                }
            }
            Answer::Replace => {
                if let Question::Replace { by, changes } = question {
                    let taken = match &by {
                        Replacement::Model(model, path) => {
                            self.open_model((**model).clone(), Some(path.clone()))
                        }
                        Replacement::Session(document, path) => self.take_session(path, document, ctx),
                    };
                    if !taken {
                        self.question = Some(Question::Replace { by, changes });
                    }
                }
            }
            Answer::Undo(count) => (0..count).for_each(|_| self.go(false)),
            Answer::Redo(count) => (0..count).for_each(|_| self.go(true)),
        }
        ctx.request_repaint();
    }

    fn ask_ui(&self, question: &mut Question, ui: &mut Ui) -> Reply {
        match question {
            Question::Leave => self.leave_ui(ui),
            Question::LeaveDriven => leave_driven_ui(self.state.link.awaits_motors_off(), ui),
            Question::Gains { changes } => gains_ui(changes, ui),
            Question::Preset { number, name, changes } => preset_ui(*number, name, changes, ui),
            Question::Restore { document, whole, .. } => restore_ui(document, *whole, ui),
            Question::Path { purpose, text, reason, has_focus } => {
                path_ui(*purpose, text, reason.as_deref(), has_focus, &self.state.recent, ui)
            }
            Question::Replace { by, changes } => self.replace_ui(by, changes, ui),
            Question::Overwrite { path, what, save } => overwrite_ui(path, what, save, ui),
            Question::Steps => self.steps_ui(ui),
        }
    }

    fn leave_ui(&self, ui: &mut Ui) -> Reply {
        ui.heading("Save the model?");
        ui.label(format!("“{}” has unsaved changes.", self.state.session.name));
        changes_ui(&self.state.saved.model().changes_to(&self.state.session.model()), ["saved", "now"], ui);
        answers_ui(
            ui,
            [
                (Key::S, "Save and close", "Save the model and close the window", Answer::SaveAndLeave),
                (Key::D, "Discard and close", "Close the window and lose the changes", Answer::Discard),
                (Key::C, "Cancel", "Continue", Answer::Close),
            ],
        )
    }

    fn replace_ui(&self, by: &Replacement, changes: &[Change], ui: &mut Ui) -> Reply {
        let (Replacement::Model(_, path) | Replacement::Session(_, path)) = by;
        ui.heading(format!("Open {}?", path.display()));
        let mut losses = Vec::new();
        let is_other = by.model().is_some_and(|model| *model != self.state.session.model());
        if is_other && self.state.session != self.state.saved {
            losses.push(format!("“{}” has unsaved changes.", self.state.session.name));
        }
        let runs = match by {
            Replacement::Session(document, _) => document.runs.as_ref(),
            Replacement::Model(..) => None,
        };
        let missing = runs.map_or(0, |runs| self.pages.runs.ledger().missing_in(runs));
        if missing > 0 {
            losses.push(format!(
                "{} of the Runs page that are not in the file are removed too.",
                listed(missing, "row")
            ));
        }
        if !changes.is_empty() {
            losses.push(format!("{} of the model change.", listed(changes.len(), "value")));
        }
        ui.label(format!("{} Undo restores the current state.", losses.join(" ")));
        changes_ui(changes, ["now", "then"], ui);
        answers_ui(
            ui,
            [
                (Key::R, "Replace it", "Open the file and replace the current session", Answer::Replace),
                (Key::K, "Keep it", "Change nothing", Answer::Close),
            ],
        )
    }

    fn steps_ui(&self, ui: &mut Ui) -> Reply {
        ui.heading("Steps");
        let mut answer = Answer::Open;
        ScrollArea::vertical().max_height(LONGEST_TABLE).show(ui, |ui| {
            let later: Vec<_> = self.undo.redoable().collect();
            for (index, name) in later.iter().enumerate().rev() {
                if ui.button(RichText::new(*name).weak()).on_hover_text("Redo up to this step").clicked() {
                    answer = Answer::Redo(index + 1);
                }
            }
            ui.label(RichText::new("now").strong());
            for (index, name) in self.undo.undoable().enumerate() {
                if ui.button(name).on_hover_text("Undo back to before this step").clicked() {
                    answer = Answer::Undo(index + 1);
                }
            }
        });
        let reply = answers_ui(ui, [(Key::C, "Close", "Back to the page", Answer::Close)]);
        match reply.answer {
            Answer::Open => Reply { answer, ..reply },
            _ => reply,
        }
    }
}

/// “1 row”, “2 rows”.
fn listed(count: usize, name: &str) -> String {
    format!("{count} {name}{}", if count == 1 { "" } else { "s" })
}

/// Describes a session in sentences.
fn document_name(document: &Document) -> String {
    document.model.as_ref().map_or_else(|| "before".to_owned(), |model| format!("“{}”", model.name))
}

/// The answers, each with the letter that gives it while no text is being typed.
fn answers_ui<const N: usize>(ui: &mut Ui, answers: [(Key, &'static str, &str, Answer); N]) -> Reply {
    ui.add_space(6.0);
    let mut reply = Reply { answer: Answer::Open, focus: None };
    let typing = ui.ctx().text_edit_focused();
    ui.horizontal(|ui| {
        for (key, name, help, answer) in answers {
            let button = ui.add(Button::new(with_letter(ui, key, name))).accessible_name(name);
            if button.has_focus() {
                reply.focus = Some(name);
            }
            let pressed = !typing && ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
            if button.on_hover_text(format!("{help} ({})", key.name())).clicked() || pressed {
                reply.answer = answer;
            }
        }
    });
    reply
}

/// `name` with the letter of `key` underlined where it comes first.
fn with_letter(ui: &Ui, key: Key, name: &str) -> LayoutJob {
    let font = TextStyle::Button.resolve(ui.style());
    let plain = TextFormat::simple(font, Color32::PLACEHOLDER);
    let line = Stroke::new(1.0, ui.visuals().widgets.inactive.fg_stroke.color);
    let marked = TextFormat { underline: line, ..plain.clone() };
    let at = name.to_uppercase().find(key.name()).unwrap_or(0);
    let mut job = LayoutJob::default();
    for (part, format) in [(&name[..at], &plain), (&name[at..=at], &marked), (&name[at + 1..], &plain)] {
        job.append(part, 0.0, format.clone());
    }
    job
}

fn leave_driven_ui(awaits_motors_off: bool, ui: &mut Ui) -> Reply {
    let stop = Answer::Send(Command::StopAndQuit);
    if awaits_motors_off {
        ui.heading("Close although the motors may have torque?");
        ui.label("The motors have not confirmed that they are off: switch off their supply.");
        let help = "Close the window and stop switching the motors off";
        return answers_ui(
            ui,
            [
                (Key::A, "Close anyway", help, stop),
                (Key::C, "Cancel", "Continue to switch the motors off", Answer::Close),
            ],
        );
    }
    ui.heading("Stop the robot and close?");
    ui.label("The robot is being driven. It will fall when stopped unless someone holds it.");
    answers_ui(
        ui,
        [
            (Key::S, "Stop and close", "Zero torque, motors off, then close the window", stop),
            (Key::C, "Cancel", "Continue driving", Answer::Close),
        ],
    )
}

fn gains_ui(changes: &[GainChange], ui: &mut Ui) -> Reply {
    ui.heading("Apply these gains to the robot being driven?");
    ui.label(format!("They differ by more than a factor of {LARGEST_FACTOR} from the last confirmed gains:"));
    Grid::new("large changes").num_columns(4).striped(true).spacing([24.0, 3.0]).show(ui, |ui| {
        for head in ["gain", "confirmed", "design", "change"] {
            hint_ui(ui, head);
        }
        ui.end_row();
        change_rows_ui(changes, ui);
    });
    let apply = Answer::Send(Command::ConfirmGains);
    answers_ui(
        ui,
        [
            (Key::A, "Apply them", "Blend to the new gains over 0.2 s", apply),
            (Key::K, "Keep the gains", "The robot continues with the previous gains", Answer::Close),
        ],
    )
}

fn preset_ui(number: usize, name: &str, changes: &[Change], ui: &mut Ui) -> Reply {
    ui.heading(format!("Load the preset “{name}”?"));
    if changes.is_empty() {
        ui.label("It is already loaded.");
    } else {
        ui.label(format!("{} values change. Undo restores the current ones.", changes.len()));
        changes_ui(changes, ["now", "then"], ui);
    }
    answers_ui(
        ui,
        [
            (Key::L, "Load the preset", "Replace the model", Answer::Send(Command::TakePreset(number))),
            (Key::K, "Keep the model", "Leave the model as it is", Answer::Close),
        ],
    )
}

fn overwrite_ui(path: &Path, what: &str, save: &Command, ui: &mut Ui) -> Reply {
    ui.heading("Replace the file?");
    ui.label(format!("The file {} exists.", path.display()));
    let help = format!("Overwrite it with the {what}");
    answers_ui(
        ui,
        [
            (Key::R, "Replace it", &help, Answer::Send(save.clone())),
            (Key::C, "Cancel", "Leave the file as it is", Answer::Close),
        ],
    )
}

/// Old and new values, key by key.
fn changes_ui(changes: &[Change], heads: [&str; 2], ui: &mut Ui) {
    if changes.is_empty() {
        return;
    }
    let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "–".to_owned());
    ScrollArea::vertical().max_height(LONGEST_TABLE).show(ui, |ui| {
        Grid::new("changes").num_columns(3).striped(true).spacing([24.0, 3.0]).show(ui, |ui| {
            for head in ["value", heads[0], heads[1]] {
                hint_ui(ui, head);
            }
            ui.end_row();
            for change in changes {
                ui.label(words(&change.key));
                ui.label(mono(value(&change.old)));
                ui.label(mono(value(&change.new)).strong());
                ui.end_row();
            }
        });
    });
}

fn restore_ui(document: &Document, whole: bool, ui: &mut Ui) -> Reply {
    ui.heading("flqr was not closed properly");
    ui.label(format!(
        "The session of {} was saved, with changes that are in no file:",
        document_name(document)
    ));
    if let (Some(saved), Some(model)) = (&document.saved_model, &document.model) {
        changes_ui(&saved.changes_to(model), ["saved", "kept"], ui);
    }
    if !whole {
        warning_ui(ui, "It could be read only in part, see the Log page.");
    }
    answers_ui(
        ui,
        [
            (Key::R, "Restore it", "Restore the model", Answer::Restore),
            (Key::S, "Start new", "Leave the saved session in its file", Answer::StartAfresh),
        ],
    )
}

fn path_ui(
    purpose: FilePurpose,
    text: &mut String,
    reason: Option<&str>,
    has_focus: &mut bool,
    recent: &Recent,
    ui: &mut Ui,
) -> Reply {
    ui.heading(title(purpose));
    if let Some(reason) = reason {
        warning_ui(ui, reason);
    }
    let id = Id::unique("path");
    let begins = !std::mem::replace(has_focus, true);
    if begins {
        // What is typed takes the place of what is offered.
        let mut state = TextEdit::load_state(ui.ctx(), id).unwrap_or_default();
        let all = CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count()));
        state.cursor.set_char_range(Some(all));
        TextEdit::store_state(ui.ctx(), id, state);
    }
    let field = TextEdit::singleline(text).id(id).hint_text("path of the file").desired_width(f32::INFINITY);
    let field = ui.add(field).accessible_name("path of the file");
    if begins {
        field.request_focus();
    }
    let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
    for path in recent_of(purpose, recent) {
        if ui.button(path.display().to_string()).on_hover_text("Used before").clicked() {
            *text = path.display().to_string();
            return Reply { answer: taken(purpose, text), focus: None };
        }
    }
    let exists = saves(purpose) && !text.trim().is_empty() && Path::new(text.trim()).exists();
    if exists {
        warning_ui(ui, "The file exists. You are asked before it is overwritten.");
    }
    let reply = answers_ui(
        ui,
        [
            (Key::O, "OK", "Use this path", Answer::Send(Command::Say(String::new()))),
            (Key::C, "Cancel", "Go back", Answer::Close),
        ],
    );
    let answer = match reply.answer {
        Answer::Send(_) => taken(purpose, text),
        Answer::Open if entered => taken(purpose, text),
        other => other,
    };
    Reply { answer, ..reply }
}

fn taken(purpose: FilePurpose, text: &str) -> Answer {
    match text.trim() {
        "" => Answer::Open,
        path if purpose == FilePurpose::SaveModel => Answer::Send(Command::SaveModel(path.into())),
        path if purpose == FilePurpose::SaveSession => {
            Answer::Send(Command::SaveSession { path: path.into(), replace: false })
        }
        path => Answer::Send(apply::chosen(purpose, path.into())),
    }
}

fn saves(purpose: FilePurpose) -> bool {
    matches!(purpose, FilePurpose::SaveModel | FilePurpose::SaveSession)
}

fn title(purpose: FilePurpose) -> &'static str {
    match purpose {
        FilePurpose::OpenModel => "Open a model",
        FilePurpose::SaveModel => "Save the model as",
        FilePurpose::OpenLog | FilePurpose::Refine(RefineFile::Log) => "Open a log",
        FilePurpose::Refine(RefineFile::Save(saved_as)) => saved_as.title(),
        FilePurpose::OpenReplay => "Open a recording to replay",
        FilePurpose::OpenSession => "Open a session",
        FilePurpose::SaveSession => "Save the session as",
        FilePurpose::SaveExperiment(_) => "Save the runs to",
        FilePurpose::SaveRecording => "Record to",
        FilePurpose::SaveFigure(_) => "Save the figure as",
    }
}

fn recent_of(purpose: FilePurpose, recent: &Recent) -> &[PathBuf] {
    match purpose {
        FilePurpose::OpenModel => &recent.models,
        FilePurpose::OpenLog | FilePurpose::Refine(RefineFile::Log) => &recent.logs,
        FilePurpose::OpenReplay => &recent.recordings,
        FilePurpose::OpenSession => &recent.sessions,
        _ => &[],
    }
}
