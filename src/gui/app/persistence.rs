//! Undo, the session's file, and the end of the window.

use std::path::{Path, PathBuf};

use egui::{Context, InputState, Key, Theme, ViewportCommand};
use flqr_core::model::Model;

use super::App;
use super::questions::{Question, Replacement};
use crate::command::Command;
use crate::document::{self, Base, Content, Document, Left, Opened};
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::plot::{degrees, set_degrees};
use crate::refine::RefineCommand;
use crate::session::Session;
use crate::write_file::{Saved, save_file};

/// A job on a session file: what was read of it, or that it was written.
pub(super) enum SessionJob {
    Open(PathBuf, Job<(), Result<String, String>>),
    Save(PathBuf, Job<(), Result<Saved, String>>),
}

/// A path that means the same wherever the program is started the next time.
pub(super) fn absolute(path: PathBuf) -> PathBuf {
    std::path::absolute(&path).unwrap_or(path)
}

/// The name of a session file: no other file is ever replaced by one.
pub(super) fn with_ending(path: PathBuf) -> PathBuf {
    if path.extension().is_some_and(|extension| extension == document::EXTENSION) {
        return path;
    }
    let mut name = path.into_os_string();
    name.push(format!(".{}", document::EXTENSION));
    name.into()
}

/// Looks for what was kept, on a thread.
pub(super) fn open_store(folder: Option<PathBuf>, waker: &Waker) -> std::io::Result<Option<Job<(), Opened>>> {
    folder.map(|folder| Job::start("open-session", waker, move |_| document::open(&folder))).transpose()
}

impl App {
    /// Takes in what was edited: each drag, held arrow key, typed value, load or use of a fit is one step.
    pub(super) fn watch_undo(&mut self, ctx: &Context) {
        let moves = [Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown];
        let is_moving =
            |input: &InputState| input.pointer.any_down() || moves.into_iter().any(|key| input.key_down(key));
        let settled = !ctx.input(is_moving);
        self.watch(settled);
    }

    fn watch(&mut self, settled: bool) {
        let layout = self.layout.node();
        let now = self.undo.now();
        let is_same = (now.base, now.ledger) == (self.base, self.ledger)
            && now.session == self.state.session
            && now.comparison == self.state.designer.comparison()
            && now.experiment == *self.pages.experiments.settings()
            && now.layout.is_alike(&layout);
        let other = (!is_same).then(|| self.content());
        self.undo.watch(other, settled);
    }

    /// One step back, or forth.
    pub(super) fn go(&mut self, redo: bool) {
        self.watch(true);
        let Some(content) = self.undo.peek(redo) else {
            return self.say(if redo { "There is nothing to redo." } else { "There is nothing to undo." });
        };
        if content.base != self.base && self.is_refused_while_hot("change the model") {
            return;
        }
        let Some((name, content)) = self.undo.go(redo) else { return };
        self.pages.experiments.set_settings(content.experiment);
        if !content.layout.is_alike(&self.layout.node()) {
            self.layout.set_node(&content.layout);
            self.layout.select(self.tab);
        }
        self.show_ledger(content.ledger);
        if content.base != self.base {
            self.take_base(content.base, content.session);
        } else if content.session != self.state.session {
            self.state.session = content.session;
            self.pages.tune.refresh(&self.state.session);
            self.state.designer.update(&self.state.session);
            self.send_robot();
        }
        self.state.designer.compare(content.comparison);
        self.say(format!("{}: {name}.", if redo { "Redone" } else { "Undone" }));
    }

    /// Shows one of the ledgers that were opened.
    fn show_ledger(&mut self, number: usize) {
        if number != self.ledger {
            let before = self.pages.runs.take(std::mem::take(&mut self.ledgers[number]));
            self.ledgers[std::mem::replace(&mut self.ledger, number)] = before;
        }
    }

    /// Goes to a model that was loaded before.
    fn take_base(&mut self, number: usize, session: Session) {
        let Some(Base { saved, path }) = self.undo.base(number).cloned() else { return };
        self.state.link.close(&self.waker);
        self.base = number;
        self.state.saved = saved;
        self.state.model_path = path;
        self.show_model(session);
    }

    /// Shows a session in place of the one before, from its start.
    pub(super) fn show_model(&mut self, session: Session) {
        self.state.session = session;
        self.pages.tune.load(&self.state.session, self.state.model_path.as_deref());
        self.state.designer = crate::design::Designer::default();
        self.state.designer.update(&self.state.session);
        self.reset_live();
    }

    /// All that a session file keeps.
    fn document(&self, ctx: &Context) -> Document {
        let changed = self.state.session != self.state.saved;
        let column_map = self.pages.friction.column_map();
        Document {
            model: Some(self.state.session.model()),
            saved_model: changed.then(|| self.state.saved.model()),
            model_path: self.state.model_path.clone(),
            controller: Some(self.state.session.controller),
            experiment: Some(self.pages.experiments.to_value()),
            column_map: (!column_map.is_empty()).then_some(column_map),
            log: self.pages.friction.log_path().map(Path::to_owned),
            refine_logs: Some(self.pages.refine.log_files()).filter(|logs| !logs.is_empty()),
            source: Some(self.state.source),
            connection: Some(self.pages.robot.form.to_value()),
            layout: Some(self.layout.node()),
            tab: Some(self.tab),
            dark: Some(ctx.global_style().visuals.dark_mode),
            zoom: Some(ctx.zoom_factor()),
            degrees: Some(degrees(ctx)),
            runs: Some(self.pages.runs.ledger().clone()),
        }
    }

    /// Takes over how the window looks and what its forms hold.
    fn take_surroundings(&mut self, document: &Document, ctx: &Context) -> Vec<String> {
        let mut problems = Vec::new();
        if let Some(layout) = &document.layout {
            self.layout.set_node(layout);
            self.layout.select(self.tab);
        }
        if let Some(dark) = document.dark {
            ctx.set_theme(if dark { Theme::Dark } else { Theme::Light });
        }
        if let Some(zoom) = document.zoom {
            self.state.commands.send(Command::SetZoom(zoom));
        }
        if let Some(degrees) = document.degrees {
            set_degrees(ctx, degrees);
        }
        if let Some(map) = &document.column_map {
            self.pages.friction.suggest_column_map(map);
        }
        if let Some(value) = &document.experiment {
            problems.extend(self.pages.experiments.take_value(value).err());
        }
        if let Some(value) = &document.connection {
            problems.extend(self.pages.robot.form.take_value(value).err());
        }
        problems
    }

    /// Takes over how the window of before looked: where this one begins, so nothing that can be undone.
    /// What was changed while the disk was read stays as it is.
    fn begin_as(&mut self, mut document: Document, ctx: &Context) {
        self.watch(true);
        if let Some(runs) = document.runs.take() {
            let renamed = self.pages.runs.begin_with(runs);
            if renamed > 0 {
                self.say(format!(
                    "The previous runs were read late, so the last {renamed} rows of this window have new numbers."
                ));
            }
        }
        if let Some(beginning) = self.beginning.take() {
            document.leave_out_changes(&beginning, &self.document(ctx));
        }
        for problem in self.take_surroundings(&document, ctx) {
            self.fail(format!("Previous session: {problem}."));
        }
        let now = self.content();
        self.undo.rebase(now);
    }

    /// State restored by undo.
    fn content(&self) -> Content {
        Content {
            session: self.state.session.clone(),
            base: self.base,
            ledger: self.ledger,
            comparison: self.state.designer.comparison(),
            experiment: self.pages.experiments.settings().clone(),
            layout: self.layout.node(),
        }
    }

    /// Takes over a session as a whole; nothing is connected by that. Says whether it was taken.
    pub(super) fn take_document(&mut self, name: &str, document: &Document, ctx: &Context) -> bool {
        if self.is_refused_while_hot("open another session") {
            return false;
        }
        self.undo.call(format!("open {name}"));
        if let Some(model) = document.model.clone() {
            let controller = document.controller.unwrap_or(self.state.session.controller);
            let saved = document.saved_model.clone().unwrap_or_else(|| model.clone());
            self.state.link.close(&self.waker);
            self.state.saved = Session::new(saved, controller);
            self.state.model_path.clone_from(&document.model_path);
            self.base = self
                .undo
                .add_base(Base { saved: self.state.saved.clone(), path: self.state.model_path.clone() });
            self.show_model(Session::new(model, controller));
        }
        if let Some(source) = document.source {
            self.state.commands.send(Command::SelectSource(source));
        }
        if let Some(log) = document.log.clone() {
            self.state.commands.send(Command::LoadLog(log));
        }
        if let Some(runs) = &document.runs {
            self.ledgers.push(runs.clone());
            self.show_ledger(self.ledgers.len() - 1);
        }
        self.state.commands.send(RefineCommand::Clear);
        for (path, held_out) in document.refine_logs.iter().flatten().cloned() {
            self.state.commands.send(RefineCommand::Load { path, held_out });
        }
        let unused = self.take_surroundings(document, ctx);
        if !unused.is_empty() {
            self.pages
                .log
                .stand(format!("The session of {name} was restored in part: {}.", unused.join("; ")));
        }
        if let Some(tab) = document.tab {
            self.state.commands.send(Command::SelectTab(tab));
        }
        self.state.commands.send(Command::Say(format!("The session of {name} is restored.")));
        true
    }

    /// Says what of a session file was not read, if anything; it stays in view until the user does something.
    pub(super) fn say_unread(&mut self, path: &Path, problems: &[String]) {
        let path = path.display();
        match problems {
            [] => {}
            [only] if only == document::NO_SESSION => {
                self.pages.log.stand(format!("{path} is not a session file of flqr. It is left unchanged."));
            }
            _ => {
                let problems = problems.join("; ");
                self.pages.log.stand(format!(
                    "The session was read in part: {problems}. The file {path} is left unchanged."
                ));
            }
        }
    }

    /// Keeps the session, and takes in what was kept.
    pub(super) fn keep_session(&mut self, ctx: &Context) {
        if self.opening.is_some() && self.beginning.is_none() {
            self.beginning = Some(Box::new(self.document(ctx)));
        }
        self.drain_opening(ctx);
        self.drain_session_job(ctx);
        let Some(store) = &mut self.store else { return };
        let said = store.drain();
        if let Some(wait) = store.wait() {
            if ctx.input(|input| !input.raw.events.is_empty()) {
                ctx.request_repaint_after(wait);
            }
        } else {
            let document = self.document(ctx);
            if let Some(store) = &mut self.store {
                store.keep(document, &self.waker);
            }
        }
        match said {
            None => {}
            Some(Ok(text)) => self.say(text),
            Some(Err(problem)) => self.fail(problem),
        }
    }

    fn drain_opening(&mut self, ctx: &Context) {
        let Some(job) = &mut self.opening else { return };
        let opened = match job.poll().1 {
            Outcome::Running => return,
            Outcome::Done(opened) => opened,
            Outcome::Broken => return self.opening = None,
        };
        self.opening = None;
        if let Some(problem) = opened.problem {
            self.fail(problem);
        }
        self.store = opened.store;
        let last = opened.last.map(|(path, text)| {
            let (document, problems) = Document::from_json(&text);
            if !problems.is_empty() {
                // This window replaces it when it is closed.
                self.say_unread(&document::put_aside(&path).unwrap_or(path), &problems);
            }
            document
        });
        let Some(left) = opened.left else {
            if let Some(document) = last {
                self.begin_as(document, ctx);
            }
            return;
        };
        let (document, problems) = Document::from_json(&left.text);
        self.begin_as(document.clone(), ctx);
        let whole = problems.is_empty();
        if document.may_have_unsaved_model(&problems) {
            self.say_unread(&left.path, &problems);
            self.ask(Question::Restore { left, document: Box::new(document), whole });
        } else if whole {
            self.take_over(left);
        } else {
            self.say_unread(&left.put_aside(), &problems);
        }
    }

    /// What was left is in this window: its file goes when this window's own has it.
    pub(super) fn take_over(&mut self, left: Left) {
        if let Some(store) = &mut self.store {
            store.take_over(left);
        }
    }

    pub(super) fn open_session(&mut self, path: PathBuf) {
        if self.session_job.is_some() {
            return self
                .fail("A session file is still being read or written. Try again when it is finished.");
        }
        let file = path.clone();
        let read = move |_: &Reporter<()>| {
            let problem = |error: std::io::Error| {
                format!("{} could not be opened: {error}; check the path", file.display())
            };
            let size = std::fs::metadata(&file).map_err(problem)?.len();
            if size > document::LARGEST_BYTES {
                return Err(format!("{} is not a session file: it has {size} bytes", file.display()));
            }
            let bytes = std::fs::read(&file).map_err(problem)?;
            Ok(String::from_utf8_lossy(&bytes).into_owned())
        };
        match Job::start("open-session", &self.waker, read) {
            Ok(job) => self.session_job = Some(SessionJob::Open(path, job)),
            Err(error) => self.fail(format!("Cannot start opening the session: {error}.")),
        }
    }

    /// Replaces what is there only if `replace`.
    pub(super) fn save_session(&mut self, path: PathBuf, replace: bool, ctx: &Context) {
        if self.session_job.is_some() {
            return self
                .fail("A session file is still being read or written. Try again when it is finished.");
        }
        let path = with_ending(path);
        let (file, document) = (path.clone(), self.document(ctx));
        let write = move |_: &Reporter<()>| save_file(&file, || document.to_json(), replace);
        match Job::start("save-session", &self.waker, write) {
            Ok(job) => self.session_job = Some(SessionJob::Save(path, job)),
            Err(error) => self.fail(format!("Cannot start saving the session: {error}.")),
        }
    }

    fn drain_session_job(&mut self, ctx: &Context) {
        // The session of the last window must not replace one that was opened meanwhile.
        if self.opening.is_some() {
            return;
        }
        match self.session_job.take() {
            None => {}
            Some(SessionJob::Open(path, mut job)) => match job.poll().1 {
                Outcome::Running => self.session_job = Some(SessionJob::Open(path, job)),
                Outcome::Done(Ok(text)) => {
                    let (document, problems) = Document::from_json(&text);
                    if document != Document::default() {
                        self.offer_session(document, path.clone(), ctx);
                    }
                    self.say_unread(&path, &problems);
                }
                Outcome::Done(Err(problem)) => self.fail(problem),
                Outcome::Broken => self.fail("Opening the session failed: this is an internal error."),
            },
            Some(SessionJob::Save(path, mut job)) => match job.poll().1 {
                Outcome::Running => self.session_job = Some(SessionJob::Save(path, job)),
                Outcome::Done(Ok(Saved::AnotherIsThere)) => {
                    self.say(format!("{} exists and was not overwritten.", path.display()));
                    let save = Command::SaveSession { path: path.clone(), replace: true };
                    self.ask(Question::Overwrite { path, what: "session", save });
                }
                Outcome::Done(Ok(Saved::Written)) => {
                    self.say(format!("Session saved to {}.", path.display()));
                    self.state.recent.note_session(&path);
                    self.save_recent();
                }
                Outcome::Done(Err(problem)) => self.fail(problem),
                Outcome::Broken => self.fail("Saving the session failed: this is an internal error."),
            },
        }
    }

    /// Takes over a session, after a question where changes of the model or runs would be replaced.
    fn offer_session(&mut self, document: Document, path: PathBuf, ctx: &Context) {
        let is_other = |model: &Model| *model != self.state.session.model();
        let loses_model =
            document.model.as_ref().is_some_and(is_other) && self.state.session != self.state.saved;
        let loses_runs =
            document.runs.as_ref().is_some_and(|runs| self.pages.runs.ledger().missing_in(runs) > 0);
        if (loses_model || loses_runs) && !self.state.link.is_hot() {
            self.ask_replacement(Replacement::Session(Box::new(document), path));
        } else {
            self.take_session(&path, &document, ctx);
        }
    }

    /// Takes over a session that was read from `path`. Says whether it was taken.
    pub(super) fn take_session(&mut self, path: &Path, document: &Document, ctx: &Context) -> bool {
        let taken = self.take_document(&path.display().to_string(), document, ctx);
        if taken {
            self.state.recent.note_session(path);
            self.save_recent();
        }
        taken
    }

    /// Asks before the window is closed while motors may have torque, or while the model has unsaved changes.
    pub(super) fn answer_close(&mut self, ctx: &Context) {
        let may_have_torque = self.state.link.is_driven() || self.state.link.awaits_motors_off();
        if self.leaving && !may_have_torque {
            ctx.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        let question = match () {
            () if may_have_torque => Question::LeaveDriven,
            () if self.state.session != self.state.saved => Question::Leave,
            () => return,
        };
        if self.leaving || ctx.input(|input| input.viewport().close_requested()) {
            self.leaving = false;
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.ask(question);
        }
    }

    /// Keeps the session of the window as the last one, and ends the connection to a robot. Returns the problem
    /// with which the last connection ended.
    pub fn end(&mut self) -> Option<String> {
        let text = self.document(&self.ctx.clone()).to_json();
        if let Some(store) = &mut self.store {
            store.close(&text);
        }
        let problems = self.state.link.end(&self.waker);
        (!problems.is_empty()).then(|| problems.join("; "))
    }
}
