//! The owner of everything: session, design, running robot, jobs. Views read it and send commands.

mod apply;
mod persistence;
mod questions;
mod shell;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::PathBuf;
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
use crate::context::AppState;
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
use crate::pages::{Pages, Tab};
use crate::recent::{Recent, RecentFile};
use crate::refine::{RefineCommand, RefineTab};
use crate::robot::{Link, RobotTab, sentence};
use crate::runs::{Ledger, RunsTab};
use crate::session::Session;
use crate::state_out::{ABOUT, StateOut};
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
    state: AppState,
    pages: Pages,
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
    /// The page that the user turned to last, which shortcuts refer to.
    tab: Tab,
    layout: Layout,
    palette: Option<Palette>,
    help: Option<Help>,
    /// State that the simulated robot resumes.
    paused_before: bool,
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
        let pages = Pages {
            tune: TuneTab::new(&session, options.model_path.as_deref()),
            friction: FrictionTab::new(column_map.clone()),
            refine: RefineTab::new(column_map),
            experiments,
            robot: RobotTab::default(),
            runs: RunsTab::default(),
            log: Messages::default(),
        };
        let state = AppState {
            saved: session.clone(),
            session,
            model_path: options.model_path,
            designer,
            source: Source::default(),
            live: Live::start(&waker, options.paused)?,
            history: History::default(),
            link: Link::new(options.devices),
            recent: Recent::default(),
            commands: Commands::default(),
        };
        let mut app = Self {
            state,
            pages,
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
            tab: options.tab,
            layout,
            palette: None,
            help: None,
            paused_before: options.paused,
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
            app.pages.log.stand(warning);
        }
        if let Some(log) = options.log {
            app.state.commands.send(match options.tab {
                Tab::Refine => RefineCommand::Load { path: log, held_out: false }.into(),
                _ => Command::LoadLog(log),
            });
        }
        if let Some(session) = options.session {
            app.state.commands.send(Command::OpenSession(session));
        }
        if let Some(imu) = &options.imu {
            app.pages.robot.form.fill_imu(imu);
        }
        if let Some(source) = &options.source {
            app.pages.robot.form.fill(source);
            app.state.commands.send(Command::SelectSource(source.into()));
            app.state.commands.send(Command::Connect);
        }
        if options.tab == Tab::Robot {
            app.state.commands.send(Command::RefreshInterfaces);
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
            self.pages.experiments.advance(ctx);
        }
        for command in self.state.commands.take() {
            self.apply(command, ctx);
        }
        let is_hot = self.state.link.is_hot();
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
        if !self.state.commands.is_empty() {
            // Drawn again in this same frame, after `logic` has applied them.
            ui.ctx().request_discard("commands change what is shown");
        }
    }

    /// Conditions for the availability of commands.
    fn situation(&self, ctx: &Context) -> Situation<'_> {
        Situation {
            tab: self.tab,
            source: self.state.source,
            paused: self.state.live.status.paused,
            replay_is_paused: self.state.link.replay_is_paused,
            has_robot: self.state.session.robot().is_some(),
            has_reference: self.state.designer.reference.is_some(),
            has_log: self.pages.friction.has_log(),
            fit_runs: self.pages.friction.fit_is_running(),
            refine_runs: self.pages.refine.is_running(),
            has_residual: self.pages.refine.has_residual(),
            experiment_runs: self.pages.experiments.is_running(),
            is_connected: self.state.link.options().is_some(),
            is_hot: self.state.link.is_hot(),
            gains_wait: self.state.link.transfer.pending().is_some(),
            controller: self.state.session.controller,
            model_path: self.state.model_path.as_deref(),
            can_undo: self.undo.peek(false).is_some(),
            can_redo: self.undo.peek(true).is_some(),
            is_dark: ctx.global_style().visuals.dark_mode,
            zoom: ctx.zoom_factor(),
            is_usual_layout: self.layout.node().is_alike(&Node::default()),
        }
    }

    fn page_ui(&mut self, ui: &mut Ui) {
        let context = self.state.context();
        let mut pages = self.pages.all_mut();
        let before = self.layout.shown().to_vec();
        let turned_to = self.layout.ui(ui, &mut |tab, ui| pages[tab as usize].ui(&context, ui));
        let front = || self.layout.shown().first().copied().filter(|_| !self.layout.shows(self.tab));
        if let Some(tab) = turned_to.or_else(front) {
            self.tab = tab;
        }
        if self.layout.shown() != before {
            self.set_live_interval();
        }
    }

    fn drain_live(&mut self) {
        let samples = self.state.live.poll();
        if !samples.is_empty() {
            self.state.history.extend(&samples);
        }
    }

    fn drain_link(&mut self) {
        let before = self.state.link.stage();
        let (updates, messages) = self.state.link.drain();
        for update in &updates {
            self.pages.robot.note(update);
        }
        // A recording that could not be started, for instance: said where it is seen from every page.
        let warning = |event: &&DeviceEvent| event.kind == EventKind::Warning;
        let mut warnings = updates.iter().flat_map(|update| &update.events).filter(warning);
        if let Some(warning) = warnings.next_back() {
            self.fail(sentence(&warning.text));
        }
        self.watch_recording();
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
                    self.pages.robot.look(&self.state.link, &self.waker);
                }
            }
        }
        self.say_stage(before);
    }

    /// A recording that has ended is a run.
    fn watch_recording(&mut self) {
        let status = self.state.link.status.as_ref().filter(|_| self.state.link.is_open());
        let recording = status.and_then(|status| status.recording.as_ref());
        self.pages.runs.watch(recording, self.state.source.name(), || self.state.session.model());
    }

    /// The status line must not say what was true of the stage before.
    fn say_stage(&mut self, before: Option<Stage>) {
        let stage = self.state.link.stage();
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
        self.pages.drain();
        if let Some((path, model)) = self.pages.refine.take_saved_model()
            && model == self.state.session.model()
        {
            self.note_saved(persistence::absolute(path), self.state.session.clone());
        }
        if let Some(job) = &mut self.recent_job {
            match job.poll().1 {
                Outcome::Running => {}
                Outcome::Done(read) => {
                    if !self.pages.refine.has_logs() {
                        self.pages.friction.suggest_column_map(&read.column_map);
                    }
                    self.pages.robot.suggest(&read);
                    if self.tour_is_due && !read.tour_done {
                        self.tour = Some(Tour::default());
                    }
                    self.state.recent = read;
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
            Answer::Chosen(path) => self.state.commands.send(apply::chosen(purpose, path)),
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
                for page in self.pages.all_mut() {
                    page.note_dialog_problem(purpose, &problem);
                }
                if let FilePurpose::SaveFigure(file) = purpose {
                    self.state.commands.send(Command::ChooseFigure(file, Err(problem)));
                }
            }
        }
    }

    fn save_recent(&mut self) {
        self.state.recent.column_map = self.pages.friction.column_map();
        if let Some(file) = &mut self.recent_file {
            file.save(&self.state.recent, &self.waker);
        }
    }

    fn say(&mut self, text: impl Into<String>) {
        self.pages.log.add(Severity::Note, text);
    }

    fn fail(&mut self, text: impl Into<String>) {
        self.pages.log.add(Severity::Error, text);
    }

    /// What has to be seen stays in the status line until a key or button is pressed; an answer to a question is
    /// a part of what it is about.
    fn release_status(&mut self, ctx: &Context) {
        let is_press = |event: &Event| {
            matches!(event, Event::Key { pressed: true, .. } | Event::PointerButton { pressed: true, .. })
        };
        if self.question.is_none() && ctx.input(|input| input.events.iter().any(is_press)) {
            self.pages.log.release();
        }
    }

    /// Returns whether `action` must wait because the motors may have torque, after showing that.
    fn is_refused_while_hot(&mut self, action: &str) -> bool {
        let is_hot = self.state.link.is_hot();
        if is_hot {
            let remedy = match self.state.link.awaits_motors_off() {
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
        let started = self.state.designer.in_force.is_some();
        if self.state.designer.update(&self.state.session) {
            if started {
                self.send_controller();
            } else {
                self.reset_live();
            }
        }
    }

    fn reset_live(&mut self) {
        self.state.history.clear();
        self.pages.tune.reset_view();
        self.state.live.send(match self.robot_and_controller() {
            Some((robot, controller)) => LiveCommand::Reset(Box::new(robot), controller),
            // The robot of before must not run on under another model's name.
            None => LiveCommand::Clear,
        });
    }

    fn send_robot(&mut self) {
        if let Some((robot, controller)) = self.robot_and_controller() {
            self.state.link.set_design(controller.clone());
            self.state.live.send(LiveCommand::Robot(Box::new(robot), controller));
        }
    }

    fn send_controller(&mut self) {
        if let Some((_, controller)) = self.robot_and_controller() {
            self.state.link.set_design(controller.clone());
            self.state.live.send(LiveCommand::Controller(controller));
        }
    }

    fn robot_and_controller(
        &self,
    ) -> Option<(flqr_core::model::RobotModel, flqr_core::control::BalanceController)> {
        let gain = self.state.designer.in_force?.design.gain;
        Some((self.state.session.robot()?.clone(), self.state.session.balance_controller(gain)?))
    }

    fn write_state(&mut self, ctx: &Context) {
        let Some(out) = &mut self.state_out else { return };
        if let Some(problem) = out.problem() {
            self.pages.log.add(Severity::Error, problem);
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
        let weights = self.state.session.weights();
        let design = self.state.designer.in_force.map(|designed| designed.design);
        let controller = match self.state.session.controller {
            ControllerKind::Lqr => "lqr",
            ControllerKind::Flqr => "flqr",
        };
        let gain = design.map(|d| [0, 1].map(|row| [0, 1, 2, 3].map(|column| d.gain[(row, column)])));
        let poles = design.map(|d| d.poles.map(|pole| [pole.re, pole.im]));
        let friction =
            [0, 1].map(|motor| self.state.session.friction(motor).map(|curve| *curve.parameters()));
        let mut state = serde_json::json!({
            "about": ABOUT,
            "model": self.state.session.name,
            "unsaved_changes": self.state.session != self.state.saved,
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
            "source": self.state.source.key(),
            "controller": controller,
            "q_diagonal": weights.q.diagonal().as_slice(),
            "r_diagonal": weights.r.diagonal().as_slice(),
            "gain": gain,
            "poles": poles,
            "design_problem": self.state.designer.problem,
            "friction": friction,
            "simulation": {
                "paused": self.state.live.status.paused,
                "fell": self.state.live.status.fell,
                "seconds": self.state.history.end_s().floor(),
                "lost_samples": self.state.live.status.lost_samples,
                "displacement_mm": self.state.history.last(Channel::Displacement).map(|x_m| (1e3 * x_m).round()),
            },
            "message": self.pages.log.status().map(|(_, text)| text),
            "message_severity": self.pages.log.status().map(|(severity, _)| severity.word()),
        });
        let context = self.state.context();
        for (tab, page) in Tab::ALL.into_iter().zip(self.pages.all()) {
            state[format!("{}_tab", tab.key())] = page.snapshot(&context);
        }
        state
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
