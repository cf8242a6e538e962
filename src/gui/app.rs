//! The owner of everything: session, design, running robot, jobs. Views read it and send commands.

mod apply;
mod persistence;
mod questions;
mod shell;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Context, Event, Ui};
use flqr_core::control::{ControllerKind, drive::Stage};
use flqr_core::device::{Event as DeviceEvent, EventKind};
use flqr_core::model::Model;
use flqr_core::model_file::RenamedKey;

use crate::column_map::ColumnMapForm;
use crate::command::{Command, Commands, FilePurpose, Source};
use crate::commands::{Palette, Situation};
use crate::context::ViewContext;
use crate::design::Designer;
use crate::dialog::{Answer, Dialog};
use crate::document::{Base, Content, Document, Opened, Store, Undo};
use crate::experiments::ExperimentsTab;
use crate::frames::Frames;
use crate::friction::FrictionTab;
use crate::help::Help;
use crate::history::{Channel, History};
use crate::job::{Job, Outcome, Waker};
use crate::layout::{Layout, Node};
use crate::live::{Live, LiveCommand};
use crate::messages::{Messages, Severity};
use crate::recent::{Recent, RecentFile};
use crate::refine::{RefineCommand, RefineTab};
use crate::robot::{Link, RobotTab, sentence};
use crate::runs::{Ledger, RunsTab};
use crate::session::Session;
use crate::state_out::{ABOUT, StateOut};
use crate::tab::Tab;
use crate::tour::Tour;
use crate::tune::TuneTab;
use crate::window::WindowOptions;
use crate::write_file::Saved;

/// A model file job: what it is for, and its result.
enum ModelJob {
    Load(PathBuf, Job<(), Result<(Model, Vec<RenamedKey>), String>>),
    Save(PathBuf, Session, Job<(), Result<Saved, String>>),
}

/// The window's content.
pub struct App {
    session: Session,
    /// The session as loaded or saved last, for the mark of unsaved changes and for Reset.
    saved: Session,
    /// The number of the loaded model in the undo.
    base: usize,
    undo: Undo,
    /// Which of the ledgers is shown; its own place is empty.
    ledger: usize,
    /// All that were opened, for undo.
    ledgers: Vec<Ledger>,
    opening: Option<Job<(), Opened>>,
    store: Option<Store>,
    session_job: Option<persistence::SessionJob>,
    question: Option<questions::Question>,
    /// Questions for when that one is answered.
    waiting: VecDeque<questions::Question>,
    /// State before anything was read; `None` afterwards.
    beginning: Option<Box<Document>>,
    /// The answer that has the keyboard's focus.
    question_focus: Option<&'static str>,
    /// The file dialog was requested where no path field is in view.
    asks_path: bool,
    leave_after_save: bool,
    leaving: bool,
    was_hot: bool,
    tour: Option<Tour>,
    tour_is_due: bool,
    model_path: Option<PathBuf>,
    /// The page that the user turned to last: what keys are about.
    tab: Tab,
    layout: Layout,
    palette: Option<Palette>,
    help: Option<Help>,
    source: Source,
    /// State that the simulated robot resumes.
    paused_before: bool,
    designer: Designer,
    live: Live,
    history: History,
    tune: TuneTab,
    friction: FrictionTab,
    refine: RefineTab,
    experiments: ExperimentsTab,
    link: Link,
    robot: RobotTab,
    runs: RunsTab,
    commands: Commands,
    messages: Messages,
    recent: Recent,
    recent_file: Option<RecentFile>,
    recent_job: Option<Job<(), Recent>>,
    dialog: Option<Dialog>,
    model_job: Option<ModelJob>,
    state_out: Option<StateOut>,
    waker: Waker,
    ctx: Context,
    frame_interval: Duration,
    frame_cpu_s: Option<f32>,
    frames: Frames,
    /// Problem at the end of the window, for the exit code of the program.
    pub(crate) end_problem: Rc<RefCell<Option<String>>>,
}

impl App {
    /// Starts the window's threads.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn new(mut options: WindowOptions, ctx: &Context) -> std::io::Result<Self> {
        options.model_path = options.model_path.map(persistence::absolute);
        crate::theme::apply(ctx);
        let waker: Waker = {
            let ctx = ctx.clone();
            Arc::new(move || ctx.request_repaint())
        };
        let session = Session::new(options.model, ControllerKind::Flqr);
        let column_map = ColumnMapForm::new(&options.column_map);
        let state_out =
            options.state_out.map(|path| StateOut::start(path, Arc::clone(&waker))).transpose()?;
        let layout = Layout::new(options.tab);
        let experiments = ExperimentsTab::default();
        let base = Base { saved: session.clone(), path: options.model_path.clone() };
        let mut designer = Designer::default();
        designer.update(&session);
        let content = Content {
            session: session.clone(),
            base: 0,
            ledger: 0,
            comparison: designer.comparison(),
            experiment: experiments.settings().clone(),
            layout: layout.node(),
        };
        let mut app = Self {
            saved: session.clone(),
            base: 0,
            undo: Undo::new(content, base),
            ledger: 0,
            ledgers: vec![Ledger::default()],
            opening: persistence::open_store(options.state_folder, &waker)?,
            store: None,
            session_job: None,
            question: None,
            waiting: VecDeque::new(),
            beginning: None,
            question_focus: None,
            asks_path: false,
            leave_after_save: false,
            leaving: false,
            was_hot: false,
            tour: None,
            tour_is_due: options.tour,
            tune: TuneTab::new(&session, options.model_path.as_deref()),
            session,
            model_path: options.model_path,
            tab: options.tab,
            layout,
            palette: None,
            help: None,
            source: Source::default(),
            paused_before: options.paused,
            designer,
            live: Live::start(&waker, options.paused)?,
            history: History::default(),
            friction: FrictionTab::new(column_map.clone()),
            refine: RefineTab::new(column_map),
            experiments,
            link: Link::new(options.devices),
            robot: RobotTab::default(),
            runs: RunsTab::default(),
            commands: Commands::default(),
            messages: Messages::default(),
            recent: Recent::default(),
            recent_job: read_recent(options.recent_file.clone(), &waker)?,
            recent_file: options.recent_file.map(RecentFile::new),
            dialog: None,
            model_job: None,
            state_out,
            waker,
            ctx: ctx.clone(),
            frame_interval: Duration::from_millis(33),
            frame_cpu_s: None,
            frames: Frames::default(),
            end_problem: Rc::default(),
        };
        app.reset_live();
        app.say_loaded();
        if let Some(warning) = options.warning {
            app.messages.stand(warning);
        }
        if let Some(log) = options.log {
            app.commands.send(match options.tab {
                Tab::Refine => Command::Refine(RefineCommand::Load { path: log, held_out: false }),
                _ => Command::LoadLog(log),
            });
        }
        if let Some(session) = options.session {
            app.commands.send(Command::OpenSession(session));
        }
        if let Some(imu) = &options.imu {
            app.robot.form.fill_imu(imu);
        }
        if let Some(source) = &options.source {
            app.robot.form.fill(source);
            app.commands.send(Command::SelectSource(source.into()));
            app.commands.send(Command::Connect);
        }
        if options.tab == Tab::Robot {
            app.commands.send(Command::RefreshInterfaces);
        }
        Ok(app)
    }

    /// Applies the commands of views and takes the results of threads. Draws nothing.
    pub fn logic(&mut self, ctx: &Context) {
        self.release_status(ctx);
        self.drain_live();
        self.drain_link();
        self.drain_jobs();
        self.take_dropped_files(ctx);
        if self.layout.shows(Tab::Experiments) {
            self.experiments.advance(ctx);
        }
        for command in self.commands.take() {
            self.apply(command, ctx);
        }
        let is_hot = self.link.is_hot();
        if is_hot && !self.was_hot {
            self.palette = None;
        }
        self.was_hot = is_hot;
        self.follow_design();
        self.watch_undo(ctx);
        self.keep_session(ctx);
        self.answer_close(ctx);
        self.write_state(ctx);
    }

    /// Draws the window.
    pub fn ui(&mut self, ui: &mut Ui) {
        self.shell_ui(ui);
        if !self.commands.is_empty() {
            // Drawn again in this same frame, after `logic` has applied them.
            ui.ctx().request_discard("commands change what is shown");
        }
    }

    /// Conditions for the availability of commands.
    fn situation(&self, ctx: &Context) -> Situation<'_> {
        Situation {
            tab: self.tab,
            source: self.source,
            paused: self.live.status.paused,
            replay_is_paused: self.link.replay_is_paused,
            has_robot: self.session.robot().is_some(),
            has_reference: self.designer.reference.is_some(),
            has_log: self.friction.has_log(),
            fit_runs: self.friction.fit_is_running(),
            refine_runs: self.refine.is_running(),
            has_residual: self.refine.has_residual(),
            experiment_runs: self.experiments.is_running(),
            is_connected: self.link.options().is_some(),
            is_hot: self.link.is_hot(),
            gains_wait: self.link.transfer.pending().is_some(),
            controller: self.session.controller,
            model_path: self.model_path.as_deref(),
            can_undo: self.undo.peek(false).is_some(),
            can_redo: self.undo.peek(true).is_some(),
            is_dark: ctx.global_style().visuals.dark_mode,
            zoom: ctx.zoom_factor(),
            is_usual_layout: self.layout.node().is_alike(&Node::default()),
        }
    }

    fn page_ui(&mut self, ui: &mut Ui) {
        let context = ViewContext {
            session: &self.session,
            model_path: self.model_path.as_deref().filter(|_| self.session == self.saved),
            saved: &self.saved,
            designer: &self.designer,
            history: if self.source == Source::Simulated { &self.history } else { &self.link.history },
            live: &self.live.status,
            link: &self.link,
            recent: &self.recent,
            source: self.source,
            commands: &self.commands,
        };
        let (tune, friction, experiments) = (&mut self.tune, &mut self.friction, &mut self.experiments);
        let (refine, robot, messages) = (&mut self.refine, &mut self.robot, &mut self.messages);
        let runs = &mut self.runs;
        let mut stop = false;
        let before = self.layout.shown().to_vec();
        let turned_to = self.layout.ui(ui, &mut |tab, ui| match tab {
            Tab::Tune => tune.ui(&context, ui),
            Tab::Friction => friction.ui(&context, ui),
            Tab::Refine => refine.ui(&context, ui),
            Tab::Experiments => experiments.ui(&context, ui),
            Tab::Robot => stop |= robot.ui(&context, ui),
            Tab::Runs => runs.ui(&context, ui),
            Tab::Log => messages.ui(ui),
        });
        let front = || self.layout.shown().first().copied().filter(|_| !self.layout.shows(self.tab));
        if let Some(tab) = turned_to.or_else(front) {
            self.tab = tab;
        }
        if self.layout.shown() != before {
            self.set_live_interval();
        }
        if stop {
            self.link.stop();
        }
    }

    /// The file that holds the very model of the session, if there is one.
    fn model_path_of_session(&self) -> Option<&Path> {
        self.model_path.as_deref().filter(|_| self.session == self.saved)
    }

    fn drain_live(&mut self) {
        let samples = self.live.poll();
        if !samples.is_empty() {
            self.history.extend(&samples);
        }
    }

    fn drain_link(&mut self) {
        let before = self.link.stage();
        let (updates, messages) = self.link.drain();
        for update in &updates {
            self.robot.note(update);
        }
        // A recording that could not be started, for instance: said where it is seen from every page.
        let warning = |event: &&DeviceEvent| event.kind == EventKind::Warning;
        let mut warnings = updates.iter().flat_map(|update| &update.events).filter(warning);
        if let Some(warning) = warnings.next_back() {
            self.fail(sentence(&warning.text));
        }
        self.watch_recording();
        self.robot.drain();
        for message in messages {
            match message {
                Ok(message) => {
                    self.say(message);
                    // The design may have been edited while the session was opened.
                    self.send_controller();
                }
                Err(problem) => {
                    self.fail(problem);
                    // What is there may have changed.
                    self.robot.look(&self.link, &self.waker);
                }
            }
        }
        self.say_stage(before);
    }

    /// A recording that has ended is a run.
    fn watch_recording(&mut self) {
        let status = self.link.status.as_ref().filter(|_| self.link.is_open());
        let recording = status.and_then(|status| status.recording.as_ref());
        self.runs.watch(recording, self.source.name(), || self.session.model());
    }

    /// The status line must not say what was true of the stage before.
    fn say_stage(&mut self, before: Option<Stage>) {
        let stage = self.link.stage();
        let (Some(_), Some(now)) = (before, stage) else { return };
        if before == stage {
            return;
        }
        match now {
            Stage::Listening => self.say("Listening: nothing is sent."),
            Stage::Checking => self.say("Checking: querying the motors, without torque."),
            Stage::Driving => self.say("Driving: Esc and Space stop the robot."),
            Stage::Stopped(reason) => self.fail(format!("Stopped: {reason}.")),
        }
    }

    fn drain_jobs(&mut self) {
        for (severity, text) in [self.friction.drain(), self.refine.drain()].into_iter().flatten() {
            self.messages.add(severity, text);
        }
        if let Some(message) = self.experiments.drain() {
            self.say(message);
        }
        for problem in self.runs.drain() {
            self.fail(problem);
        }
        self.experiments.note_runs(&mut self.runs);
        self.friction.note_run(&mut self.runs);
        self.refine.note_run(&mut self.runs);
        for result in [self.experiments.drain_saver(), self.refine.drain_saver()].into_iter().flatten() {
            match result {
                Ok(message) => self.say(message),
                Err(problem) => self.fail(problem),
            }
        }
        if let Some((path, model)) = self.refine.take_saved_model()
            && model == self.session.model()
        {
            self.note_saved(persistence::absolute(path), self.session.clone());
        }
        if let Some(job) = &mut self.recent_job {
            match job.poll().1 {
                Outcome::Running => {}
                Outcome::Done(read) => {
                    if !self.refine.has_logs() {
                        self.friction.suggest_column_map(&read.column_map);
                    }
                    self.robot.suggest(&read);
                    if self.tour_is_due && !read.tour_done {
                        self.tour = Some(Tour::default());
                    }
                    self.recent = read;
                    self.recent_job = None;
                }
                Outcome::Broken => self.recent_job = None,
            }
        }
        if let Some(file) = &mut self.recent_file {
            file.drain(&self.waker);
        }
        self.drain_dialog();
        self.drain_model_job();
    }

    fn drain_dialog(&mut self) {
        let Some(dialog) = &mut self.dialog else { return };
        let purpose = dialog.purpose;
        let answer = match dialog.job.poll().1 {
            Outcome::Running => return,
            Outcome::Done(answer) => answer,
            Outcome::Broken => {
                Answer::Unavailable("The file dialog failed. Type the path instead.".to_owned())
            }
        };
        self.dialog = None;
        let asks_path = std::mem::take(&mut self.asks_path);
        match answer {
            Answer::Chosen(path) => self.commands.send(apply::chosen(purpose, path)),
            Answer::Cancelled => {}
            Answer::Unavailable(problem) => {
                match purpose {
                    // Its form says it, where the path is to be typed.
                    FilePurpose::SaveFigure(_) => {}
                    _ => self.fail(problem.clone()),
                }
                if asks_path {
                    self.ask_path(purpose, Some(problem.clone()));
                }
                self.tune.note_dialog_problem(purpose, &problem);
                self.friction.note_dialog_problem(purpose, &problem);
                self.experiments.note_dialog_problem(purpose, &problem);
                self.robot.note_dialog_problem(purpose, &problem);
                if let FilePurpose::Refine(purpose) = purpose {
                    self.refine.note_dialog_problem(purpose, &problem);
                }
                if let FilePurpose::SaveFigure(file) = purpose {
                    self.commands.send(Command::ChooseFigure(file, Err(problem)));
                }
            }
        }
    }

    fn save_recent(&mut self) {
        self.recent.column_map = self.friction.column_map();
        if let Some(file) = &mut self.recent_file {
            file.save(&self.recent, &self.waker);
        }
    }

    fn say(&mut self, text: impl Into<String>) {
        self.messages.add(Severity::Note, text);
    }

    fn fail(&mut self, text: impl Into<String>) {
        self.messages.add(Severity::Error, text);
    }

    /// What has to be seen stays in the status line until a key or button is pressed; an answer to a question is
    /// a part of what it is about.
    fn release_status(&mut self, ctx: &Context) {
        let is_press = |event: &Event| {
            matches!(event, Event::Key { pressed: true, .. } | Event::PointerButton { pressed: true, .. })
        };
        if self.question.is_none() && ctx.input(|input| input.events.iter().any(is_press)) {
            self.messages.release();
        }
    }

    /// Returns whether `action` must wait because the motors may have torque, after showing that.
    fn is_refused_while_hot(&mut self, action: &str) -> bool {
        let is_hot = self.link.is_hot();
        if is_hot {
            let remedy = match self.link.awaits_motors_off() {
                true => {
                    "The motors have not confirmed that they are off. Switch off their supply and disconnect"
                }
                false => "The robot may move. Stop it",
            };
            self.fail(format!("{remedy} before you {action}."));
        }
        is_hot
    }

    /// The running robot gets new gains; the first gains of a model start it.
    fn follow_design(&mut self) {
        let started = self.designer.in_force.is_some();
        if self.designer.update(&self.session) {
            if started {
                self.send_controller();
            } else {
                self.reset_live();
            }
        }
    }

    fn reset_live(&mut self) {
        self.history.clear();
        self.tune.reset_view();
        self.live.send(match self.robot_and_controller() {
            Some((robot, controller)) => LiveCommand::Reset(Box::new(robot), controller),
            // The robot of before must not run on under another model's name.
            None => LiveCommand::Clear,
        });
    }

    fn send_robot(&mut self) {
        if let Some((robot, controller)) = self.robot_and_controller() {
            self.link.set_design(controller.clone());
            self.live.send(LiveCommand::Robot(Box::new(robot), controller));
        }
    }

    fn send_controller(&mut self) {
        if let Some((_, controller)) = self.robot_and_controller() {
            self.link.set_design(controller.clone());
            self.live.send(LiveCommand::Controller(controller));
        }
    }

    fn robot_and_controller(
        &self,
    ) -> Option<(flqr_core::model::RobotModel, flqr_core::control::BalanceController)> {
        let gain = self.designer.in_force?.design.gain;
        Some((self.session.robot()?.clone(), self.session.balance_controller(gain)?))
    }

    fn write_state(&mut self, ctx: &Context) {
        let Some(out) = &mut self.state_out else { return };
        if let Some(problem) = out.problem() {
            self.messages.add(Severity::Error, problem);
        }
        if let Some(wait) = out.wait() {
            ctx.request_repaint_after(wait);
            return;
        }
        let mut state = self.snapshot();
        state["frames"] = self.frames.to_value();
        if let Some(out) = &mut self.state_out {
            out.write(state);
        }
    }

    /// State of the window for `--state-out`.
    pub fn snapshot(&self) -> serde_json::Value {
        let weights = self.session.weights();
        let design = self.designer.in_force.map(|designed| designed.design);
        let controller = match self.session.controller {
            ControllerKind::Lqr => "lqr",
            ControllerKind::Flqr => "flqr",
        };
        let gain = design.map(|d| [0, 1].map(|row| [0, 1, 2, 3].map(|column| d.gain[(row, column)])));
        let poles = design.map(|d| d.poles.map(|pole| [pole.re, pole.im]));
        let friction = [0, 1].map(|motor| self.session.friction(motor).map(|curve| *curve.parameters()));
        serde_json::json!({
            "about": ABOUT,
            "model": self.session.name,
            "unsaved_changes": self.session != self.saved,
            "tab": self.tab.key(),
            "shown": self.layout.shown().iter().map(|tab| tab.key()).collect::<Vec<_>>(),
            "questions_waiting": self.waiting.len(),
            "question": self.question.as_ref().map(questions::Question::key),
            "question_focus": self.question_focus,
            "undo": self.undo.undoable().collect::<Vec<_>>(),
            "redo": self.undo.redoable().collect::<Vec<_>>(),
            "tour": self.tour.map(Tour::number),
            "manual": self.help.as_ref().map(Help::snapshot),
            "leaving": self.leaving,
            "layout": self.layout.node().to_value(),
            "source": self.source.key(),
            "controller": controller,
            "q_diagonal": weights.q.diagonal().as_slice(),
            "r_diagonal": weights.r.diagonal().as_slice(),
            "gain": gain,
            "poles": poles,
            "design_problem": self.designer.problem,
            "friction": friction,
            "simulation": {
                "paused": self.live.status.paused,
                "fell": self.live.status.fell,
                "seconds": self.history.end_s().floor(),
                "lost_samples": self.live.status.lost_samples,
                "displacement_mm": self.history.last(Channel::Displacement).map(|x_m| (1e3 * x_m).round()),
            },
            "tune_tab": self.tune.snapshot(&self.designer),
            "friction_tab": self.friction.snapshot(),
            "refine_tab": self.refine.snapshot(&self.session),
            "experiments_tab": self.experiments.snapshot(),
            "runs_tab": self.runs.snapshot(),
            "robot_tab": self.robot.snapshot(&self.link),
            "message": self.messages.status().map(|(_, text)| text),
            "message_severity": self.messages.status().map(|(severity, _)| severity.word()),
        })
    }
}

fn read_recent(file: Option<PathBuf>, waker: &Waker) -> std::io::Result<Option<Job<(), Recent>>> {
    let read = |file: PathBuf| {
        let text = std::fs::read_to_string(file);
        text.map_or_else(|_| Recent::default(), |text| Recent::from_json(&text))
    };
    file.map(|file| Job::start("recent-files", waker, move |_| read(file))).transpose()
}

impl eframe::App for App {
    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        let problem = self.end();
        self.end_problem.replace(problem);
    }

    fn logic(&mut self, ctx: &Context, frame: &mut eframe::Frame) {
        self.frame_cpu_s = frame.info().cpu_usage;
        self.frames.note(Instant::now(), self.frame_cpu_s);
        Self::logic(self, ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        Self::ui(self, ui);
    }

    fn persist_egui_memory(&self) -> bool {
        false
    }
}
