//! The one place where commands change the application.

use std::path::{Path, PathBuf};

use egui::{Context, Theme};
use flqr_core::control::gate::Verdict;
use flqr_core::device::{SessionOptions, Source as DeviceSource};
use flqr_core::model::{Model, Rig};
use flqr_core::model_file::{RenamedKey, presets, renamed_keys};

use super::persistence::{self, absolute};
use super::questions::{Question, Replacement};
use super::{App, ModelJob};
use crate::command::{Command, FilePurpose, Source, Target};
use crate::commands::Palette;
use crate::dialog::{Dialog, missing_portal};
use crate::document::Base;
use crate::friction::Fitted;
use crate::help::Help;
use crate::job::{Job, Outcome, Reporter};
use crate::layout::Layout;
use crate::live::LiveCommand;
use crate::messages::Severity;
use crate::pages::{Done, Page, PageCommand, Surroundings, Tab};
use crate::refine::{RESIDUAL_STACK, RefineCommand, RefineFile};
use crate::session::Session;
use crate::tour::Tour;
use crate::write_file::{Saved, save_file};

/// A model file larger than this is none.
const LARGEST_MODEL_BYTES: u64 = 1 << 20;
/// Time between batches of the running robot while its plots are not shown.
const HIDDEN_INTERVAL: std::time::Duration = std::time::Duration::from_millis(200);

/// Smallest and largest size of everything.
const ZOOMS: [f32; 2] = [0.5, 3.0];

/// Action for a selected file.
pub(super) fn chosen(purpose: FilePurpose, path: PathBuf) -> Command {
    match purpose {
        FilePurpose::OpenModel => Command::LoadModel(path),
        // The dialog has asked before replacing a file, though not about one with an extension added here.
        FilePurpose::SaveModel if path.extension().is_some() => Command::OverwriteModel(path),
        FilePurpose::SaveModel => Command::SaveModel(path),
        FilePurpose::OpenLog => Command::LoadLog(path),
        FilePurpose::OpenReplay => Command::ChooseReplay(path),
        FilePurpose::SaveRecording => Command::ChooseRecording(path),
        FilePurpose::SaveFigure(file) => Command::ChooseFigure(file, Ok(path)),
        FilePurpose::OpenSession => Command::OpenSession(path),
        // As with a model: the dialog has asked about the name as it was typed.
        FilePurpose::SaveSession => {
            let replace = persistence::with_ending(path.clone()) == path;
            Command::SaveSession { path, replace }
        }
        // The dialog knows one name as it was typed; what is written may have another or several.
        FilePurpose::Refine(RefineFile::Log) => RefineCommand::Load { path, held_out: false }.into(),
        FilePurpose::Refine(RefineFile::Save(saved_as)) => {
            RefineCommand::Save { saved_as, path, replace: false }.into()
        }
        FilePurpose::SaveExperiment(saved_as) => Command::SaveExperiment { saved_as, path, replace: false },
    }
}

impl App {
    pub(super) fn apply(&mut self, command: Command, ctx: &Context) {
        match command {
            Command::SelectTab(tab) => {
                self.tab = tab;
                self.layout.select(tab);
                self.look_for_interfaces();
            }
            Command::MoveTab(tab, side) => {
                self.layout.move_tab(tab, side);
                self.tab = tab;
            }
            Command::ResetLayout => {
                self.layout = Layout::new(self.tab);
                self.say("All pages are in one tile.");
            }
            Command::SetDark(dark) => ctx.set_theme(if dark { Theme::Dark } else { Theme::Light }),
            Command::SetZoom(zoom) => ctx.set_zoom_factor(zoom.clamp(ZOOMS[0], ZOOMS[1])),
            Command::ShowPalette => self.palette = Some(Palette::default()),
            Command::FocusWeights => {
                self.state.commands.send(Command::SelectTab(Tab::Tune));
                self.pages.tune.focus_weights();
            }
            Command::FocusPath => self.focus_path(),
            Command::Undo => self.go(false),
            Command::Redo => self.go(true),
            Command::ShowSteps => self.ask(Question::Steps),
            Command::StartTour => {
                self.tour = Some(Tour::default());
                self.state.commands.send(Command::SelectTab(Tab::Tune));
            }
            Command::ShowManual => match &mut self.help {
                Some(help) => help.show(self.tab),
                None => self.help = Some(Help::open(self.tab)),
            },
            Command::CopyLine => {
                let line = self.pages.all()[self.tab as usize].command_line(&self.state.context());
                self.copy_line(line, ctx);
            }
            Command::CopyLineOf(run) => self.copy_line(self.pages.runs.command_of(run), ctx),
            Command::AskFile(purpose) => self.ask_file(purpose),
            Command::OpenSession(path) => self.open_session(absolute(path)),
            Command::SaveSession { path, replace } => self.save_session(absolute(path), replace, ctx),
            Command::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Command::Stop => self.state.link.stop(),
            Command::SelectSource(source) => self.select_source(source),
            Command::SetWeights(weights) => {
                if let Some(robot) = self.state.session.robot_mut() {
                    robot.weights = Some(weights);
                }
            }
            Command::KeepReference => self.state.designer.keep(),
            Command::SwapReference => self.swap_reference(),
            Command::RestoreReference => self.restore_reference(),
            Command::ResetWeights => self.reset_weights(),
            Command::SetParameters(parameters) => {
                if let Some(robot) = self.state.session.robot_mut() {
                    robot.set_parameters(parameters);
                }
                self.state.designer.update(&self.state.session);
                self.send_robot();
            }
            Command::SetFriction(friction) => {
                if let Some(robot) = self.state.session.robot_mut() {
                    robot.friction = friction;
                }
                self.send_robot();
            }
            Command::SetTorqueLimit(limit) => {
                if let Some(robot) = self.state.session.robot_mut() {
                    robot.limits.torque_nm = limit;
                }
                self.send_robot();
            }
            Command::SetCompensation(compensation) => {
                if let Some(robot) = self.state.session.robot_mut() {
                    robot.compensation = Some(compensation);
                }
                self.send_controller();
            }
            Command::SetEffects(effects) => {
                self.undo.call("effects");
                match &mut self.state.session.rig {
                    Rig::Robot(robot) => robot.effects = effects,
                    Rig::Axis(axis) => axis.effects = effects,
                }
                self.state.designer.update(&self.state.session);
                self.send_robot();
            }
            Command::SetController(kind) => {
                self.state.session.controller = kind;
                self.send_controller();
            }
            Command::SetPaused(paused) => self.state.live.send(LiveCommand::Pause(paused)),
            Command::ResetSimulation => self.reset_live(),
            Command::Push { force_n, duration_s } => {
                self.state.live.send(LiveCommand::Push { force_n, duration_s });
            }
            Command::SetFrameInterval(interval) => {
                self.frame_interval = interval;
                self.set_live_interval();
            }
            Command::ShowDialog(purpose) => self.show_dialog(purpose),
            Command::LoadPreset(number) => self.ask_preset(number),
            Command::TakePreset(number) => self.load_preset(number),
            // A log that is opened as a model is loaded as a log.
            Command::LoadModel(path) if path.extension().is_some_and(|ending| ending == "csv") => {
                self.state.commands.send(Command::LoadLog(path));
                self.state.commands.send(Command::SelectTab(Tab::Friction));
            }
            Command::LoadModel(path) => self.load_model(absolute(path)),
            Command::SaveModel(path) => self.save_model(absolute(path), false),
            Command::OverwriteModel(path) => self.save_model(absolute(path), true),
            Command::LoadLog(path) => self.load_log(&absolute(path)),
            Command::CancelLoad => self.pages.friction.cancel_load(),
            Command::StartFit => self.start_fit(),
            Command::CancelFit => self.pages.friction.cancel_fit(),
            Command::UseFit(target) => self.use_fit(target),
            Command::StartExperiment => self.start_experiment(),
            Command::CancelExperiment => self.pages.experiments.cancel(),
            Command::SaveExperiment { saved_as, path, replace } => {
                if let Err(problem) = self.pages.experiments.save(saved_as, path, replace, ctx, &self.waker) {
                    self.fail(problem);
                }
            }
            Command::Page(command) => self.apply_to_page(&*command),
            Command::RefreshInterfaces => self.pages.robot.look(&self.state.link, &self.waker),
            Command::Connect => self.connect(),
            Command::Disconnect => self.disconnect(),
            Command::ApplyGains => self.apply_gains(),
            Command::ConfirmGains => self.confirm_gains(),
            Command::FollowGains(follow) => {
                self.state.link.transfer.follow = follow;
                self.send_controller();
            }
            Command::StopAndQuit => {
                self.state.link.stop();
                self.state.link.close(&self.waker);
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
            Command::Order(order) => self.state.link.send(order),
            Command::ChooseReplay(path) => self.pages.robot.form.replay = path.display().to_string(),
            Command::ChooseRecording(path) => self.pages.robot.note_recording_path(&path),
            Command::ChooseFigure(file, answer) => {
                if file.stack == RESIDUAL_STACK {
                    self.pages.refine.show_residual();
                }
                file.answer(ctx, answer);
            }
            Command::Say(text) => self.say(text),
            Command::Complain(text) => self.fail(text),
        }
        ctx.request_repaint();
    }

    fn focus_path(&mut self) {
        if !self.pages.all_mut()[self.tab as usize].focus_path() {
            self.state.commands.send(Command::SelectTab(Tab::Friction));
            self.pages.friction.focus_path();
        }
    }

    pub(super) fn set_live_interval(&mut self) {
        let interval = |shown: bool| if shown { self.frame_interval } else { HIDDEN_INTERVAL };
        let simulated = self.state.source == Source::Simulated;
        let live = interval(self.layout.shows(Tab::Tune) && simulated);
        let robot = self.layout.shows(Tab::Tune) || self.layout.shows(Tab::Robot);
        let link = interval(robot && !simulated);
        self.state.live.send(LiveCommand::Interval(live));
        self.state.link.set_interval(link);
    }

    /// What is plugged in changes: looked up whenever the list comes into view.
    fn look_for_interfaces(&mut self) {
        let wired = matches!(self.state.source, Source::Can | Source::Slcan);
        if self.tab == Tab::Robot && wired && !self.state.link.is_open() {
            self.pages.robot.look(&self.state.link, &self.waker);
        }
    }

    fn connect(&mut self) {
        if self.state.link.is_open() || self.state.link.is_opening() {
            return self.fail("A robot is already connected. Disconnect it first.");
        }
        let options =
            match self.pages.robot.form.options(self.state.source, &self.state.session, &self.state.designer)
            {
                Ok(options) => options,
                Err(problem) => return self.fail(problem),
            };
        self.note_connection(&options);
        self.pages.robot.begin(&options);
        self.pages.tune.reset_view();
        self.say(format!("Connecting to {}…", options.source));
        self.state.link.open(options, &self.waker);
        self.set_live_interval();
    }

    /// Remembers the connection for the next start of the program.
    fn note_connection(&mut self, options: &SessionOptions) {
        match &options.source {
            DeviceSource::Can { interface } => self.state.recent.can_interface.clone_from(interface),
            DeviceSource::Slcan { port, bit_rate } => {
                self.state.recent.slcan = [port.clone(), bit_rate.to_string()];
            }
            DeviceSource::Replay { file } => self.state.recent.note_recording(file),
            DeviceSource::Emulated => {}
        }
        if let Some(imu) = &options.imu {
            self.state.recent.imu = [imu.port.clone(), imu.baud.to_string()];
        }
        self.save_recent();
    }

    fn disconnect(&mut self) {
        self.state.link.close(&self.waker);
        self.say("Disconnected.");
        self.look_for_interfaces();
    }

    fn apply_gains(&mut self) {
        let verdict = self.state.link.transfer.pending().map(|pending| pending.verdict.clone());
        match verdict {
            None => self.say("The robot already uses the gains of the design."),
            Some(Verdict::Accept) => self.confirm_gains(),
            Some(Verdict::Ask(changes)) => self.ask(Question::Gains { changes }),
            Some(Verdict::Refuse(refusal)) => {
                self.fail(format!("Not applied, the previous gains remain active: {refusal}."));
            }
        }
    }

    fn confirm_gains(&mut self) {
        if self.state.link.apply_design() {
            self.say("New gains applied, blended over 0.2 s.");
        }
    }

    fn select_source(&mut self, source: Source) {
        if source == self.state.source {
            return;
        }
        if self.is_refused_while_hot("change the source") {
            return;
        }
        self.state.link.close(&self.waker);
        self.state.link.forget();
        self.pages.robot.leave_source();
        self.pages.tune.reset_view();
        if self.state.source == Source::Simulated {
            self.paused_before = self.state.live.status.paused;
            self.state.live.send(LiveCommand::Pause(true));
        }
        self.state.source = source;
        self.set_live_interval();
        if source == Source::Simulated {
            self.state.live.send(LiveCommand::Pause(self.paused_before));
            self.say("The plots show the simulated robot.");
        } else {
            self.say("The simulated robot is paused. Nothing is connected yet: see the Robot tab.");
        }
        self.look_for_interfaces();
    }

    fn restore_reference(&mut self) {
        let Some(reference) = self.state.designer.reference else { return };
        if let Some(robot) = self.state.session.robot_mut() {
            robot.weights = Some(reference.weights);
        }
        self.say(format!("The weights of {} are active.", self.state.designer.active.other().name()));
    }

    fn swap_reference(&mut self) {
        let Some(weights) = self.state.designer.swap() else { return };
        if let Some(robot) = self.state.session.robot_mut() {
            robot.weights = Some(weights);
        }
        self.say(format!("{} is active.", self.state.designer.active.name()));
    }

    fn reset_weights(&mut self) {
        let weights = self.state.saved.robot().and_then(|robot| robot.weights);
        if let Some(robot) = self.state.session.robot_mut() {
            robot.weights = weights;
        }
        self.say("The weights were reset to the loaded model.");
    }

    fn copy_line(&mut self, line: Result<String, String>, ctx: &Context) {
        match line {
            Ok(line) => {
                self.say(format!("Copied: {line}"));
                ctx.copy_text(line);
            }
            Err(problem) => self.fail(problem),
        }
    }

    /// A dialog, or a field for the path where the desktop has none.
    fn ask_file(&mut self, purpose: FilePurpose) {
        match missing_portal() {
            Some(reason) => self.ask_path(purpose, Some(format!("{reason}: type the path."))),
            None => {
                self.asks_path = true;
                self.show_dialog(purpose);
            }
        }
    }

    fn show_dialog(&mut self, purpose: FilePurpose) {
        if self.dialog.is_some() {
            self.say("A file dialog is already open.");
            return;
        }
        let name = self.state.model_path.as_deref().and_then(Path::file_name);
        let of_page = self.pages.all().into_iter().find_map(|page| page.suggested_name(purpose));
        let suggestion = of_page.unwrap_or_else(|| match purpose {
            FilePurpose::SaveFigure(file) => file.suggestion(),
            FilePurpose::SaveSession => format!("session.{}", crate::document::EXTENSION),
            _ => name.map_or_else(|| "model.toml".to_owned(), |name| name.to_string_lossy().into_owned()),
        });
        match Dialog::open(purpose, suggestion, &self.waker) {
            Ok(dialog) => self.dialog = Some(dialog),
            Err(error) => self.fail(format!("Cannot open a file dialog: {error}.")),
        }
    }

    fn load_preset(&mut self, number: usize) {
        let Some((name, text)) = presets::ALL.get(number) else { return };
        if self.model_file_is_busy() {
            return;
        }
        match Model::from_toml(text, name) {
            Ok(model) => drop(self.open_model(model, None)),
            Err(error) => self.fail(error.to_string()),
        }
    }

    /// Says whether the model was taken.
    pub(super) fn open_model(&mut self, model: Model, path: Option<PathBuf>) -> bool {
        if self.is_refused_while_hot("load another model") {
            return false;
        }
        // A robot is driven by the model that it was connected with, or not at all.
        self.state.link.close(&self.waker);
        let session = Session::new(model, self.state.session.controller);
        self.state.saved = session.clone();
        self.state.model_path = path;
        self.undo.call(format!("load “{}”", session.name));
        self.base = self.undo.add_base(Base { saved: session.clone(), path: self.state.model_path.clone() });
        self.show_model(session);
        if let Some(path) = self.state.model_path.clone() {
            self.state.recent.note_model(&path);
            self.save_recent();
        }
        self.say_loaded();
        true
    }

    pub(super) fn say_loaded(&mut self) {
        let filled_in = self.state.session.filled_in().map(|text| format!(" {text}")).unwrap_or_default();
        self.say(format!("“{}” is loaded.{filled_in}", self.state.session.name));
        for warning in self.state.session.model().warnings() {
            self.pages.log.add(Severity::Warning, warning.to_string());
        }
    }

    /// One file at a time: a later job must not be taken over by the end of an earlier one. Says so.
    fn model_file_is_busy(&mut self) -> bool {
        let busy = self.model_job.is_some();
        if busy {
            self.fail("A model file is still being read or written. Try again when it is finished.");
        }
        busy
    }

    fn load_model(&mut self, path: PathBuf) {
        if self.model_file_is_busy() {
            return;
        }
        let file = path.clone();
        match Job::start("load-model", &self.waker, move |_| read_model(&file)) {
            Ok(job) => self.model_job = Some(ModelJob::Load(path, job)),
            Err(error) => self.fail(format!("Cannot start loading the model: {error}.")),
        }
    }

    /// Replaces the file that was loaded, and another one only if `replace`.
    fn save_model(&mut self, path: PathBuf, replace: bool) {
        if self.model_file_is_busy() {
            self.leave_after_save = false;
            return;
        }
        let path = if path.extension().is_none() { path.with_extension("toml") } else { path };
        let replace = replace || self.state.model_path.as_ref() == Some(&path);
        let (file, model) = (path.clone(), self.state.session.model());
        let write = move |_: &Reporter<()>| {
            // Comments and order of the file that is replaced stay.
            let text = || match std::fs::read_to_string(&file) {
                Ok(existing) => model.to_toml_over(&existing),
                Err(_) => model.to_toml(),
            };
            save_file(&file, text, replace)
        };
        match Job::start("save-model", &self.waker, write) {
            Ok(job) => self.model_job = Some(ModelJob::Save(path, self.state.session.clone(), job)),
            Err(error) => {
                self.leave_after_save = false;
                self.fail(format!("Cannot start saving the model: {error}."));
            }
        }
    }

    pub(super) fn drain_model_job(&mut self) {
        match self.model_job.take() {
            None => {}
            Some(ModelJob::Load(path, mut job)) => match job.poll().1 {
                Outcome::Running => self.model_job = Some(ModelJob::Load(path, job)),
                Outcome::Done(Ok((model, renamed))) => {
                    if self.state.session != self.state.saved
                        && model != self.state.session.model()
                        && !self.state.link.is_hot()
                    {
                        self.ask_replacement(Replacement::Model(Box::new(model), path));
                    } else {
                        self.open_model(model, Some(path));
                    }
                    for key in renamed {
                        self.pages.log.add(Severity::Note, key.to_string());
                    }
                }
                Outcome::Done(Err(problem)) => {
                    self.pages.tune.note_file_problem(&problem);
                    self.fail(problem);
                }
                Outcome::Broken => self.fail("Loading the model failed: this is an internal error."),
            },
            Some(ModelJob::Save(path, session, mut job)) => match job.poll().1 {
                Outcome::Running => self.model_job = Some(ModelJob::Save(path, session, job)),
                Outcome::Done(Ok(Saved::Written)) => self.note_saved(path, session),
                Outcome::Done(Ok(Saved::AnotherIsThere)) => {
                    self.leave_after_save = false;
                    self.say(format!("{} exists and was not overwritten.", path.display()));
                    let save = Command::OverwriteModel(path.clone());
                    self.ask(Question::Overwrite { path, what: "model", save });
                }
                Outcome::Done(Err(problem)) => {
                    self.leave_after_save = false;
                    self.pages.tune.note_file_problem(&problem);
                    self.fail(problem);
                }
                Outcome::Broken => {
                    self.leave_after_save = false;
                    self.fail("Saving the model failed: this is an internal error.");
                }
            },
        }
    }

    pub(super) fn note_saved(&mut self, path: PathBuf, session: Session) {
        self.say(format!("Saved to {}.", path.display()));
        self.state.saved = session;
        self.state.recent.note_model(&path);
        self.pages.tune.note_saved(&path);
        self.undo.set_base(self.base, Base { saved: self.state.saved.clone(), path: Some(path.clone()) });
        self.state.model_path = Some(path);
        self.save_recent();
        if std::mem::take(&mut self.leave_after_save) {
            // What was edited while the file was written is in no file.
            match self.state.session == self.state.saved {
                true => self.leaving = true,
                false => self.ask(Question::Leave),
            }
        }
    }

    fn load_log(&mut self, path: &Path) {
        match self.pages.friction.load(path, &self.waker) {
            Ok(()) => {
                self.state.recent.note_log(path);
                self.save_recent();
            }
            Err(problem) => self.fail(problem),
        }
    }

    fn start_fit(&mut self) {
        let path = self.state.model_path_of_session().map(Path::to_owned);
        if let Err(problem) =
            self.pages.friction.start_fit(self.state.session.model(), path.as_deref(), &self.waker)
        {
            self.fail(problem);
        }
    }

    fn use_fit(&mut self, target: Target) {
        self.undo.call("use fit in model");
        let put = |fitted: Fitted| fitted.put_into(&mut self.state.session.rig, target);
        match self.pages.friction.fitted().and_then(put) {
            Ok(done) => self.say(done),
            Err(problem) => return self.fail(problem),
        }
        self.pages.tune.refresh(&self.state.session);
        self.send_robot();
    }

    fn apply_to_page(&mut self, command: &dyn PageCommand) {
        let model_path = self.state.model_path_of_session().map(Path::to_owned);
        let before = self.state.session.clone();
        let around = Surroundings { session: &mut self.state.session, model_path, waker: &self.waker };
        let Done { said, step, tab, log } = match command.apply(&mut self.pages, around) {
            Ok(done) => done,
            Err(problem) => return self.fail(problem),
        };
        if let Some(said) = said {
            self.say(said);
        }
        if let Some(log) = log {
            self.state.recent.note_log(&log);
            self.save_recent();
        }
        if let Some(tab) = tab {
            self.state.commands.send(Command::SelectTab(tab));
        }
        if self.state.session != before {
            self.undo.call(step);
            self.pages.tune.refresh(&self.state.session);
            self.state.designer.update(&self.state.session);
            self.send_robot();
        }
    }

    fn start_experiment(&mut self) {
        // The command line of a result names a file that holds the very same model.
        let path = self.state.model_path.clone().filter(|_| {
            self.state.session == self.state.saved
                && self.state.session.model_in_use() == self.state.session.model()
        });
        if let Err(problem) =
            self.pages.experiments.start(self.state.session.model_in_use(), path, &self.waker)
        {
            self.fail(problem);
        }
    }

    pub(super) fn take_dropped_files(&mut self, ctx: &Context) {
        let files = ctx.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect::<Vec<_>>()
        });
        let ends_with = |path: &Path, ending: &str| path.extension().is_some_and(|found| found == ending);
        let is_log =
            |path: &PathBuf| !ends_with(path, "toml") && !ends_with(path, crate::document::EXTENSION);
        if self.tab == Tab::Refine && files.iter().all(is_log) {
            for path in files {
                let path = absolute(path);
                self.state.commands.send(RefineCommand::Load { path, held_out: false });
            }
            return;
        }
        let Some(path) = files.into_iter().next() else { return };
        if ends_with(&path, crate::document::EXTENSION) {
            self.state.commands.send(Command::OpenSession(path));
        } else if ends_with(&path, "toml") {
            self.state.commands.send(Command::LoadModel(path));
        } else {
            self.state.commands.send(Command::SelectTab(Tab::Friction));
            self.state.commands.send(Command::LoadLog(path));
        }
    }
}

/// Reads a model file; the keys that have been renamed come along.
fn read_model(path: &Path) -> Result<(Model, Vec<RenamedKey>), String> {
    let problem =
        |error: std::io::Error| format!("{} could not be opened: {error}; check the path", path.display());
    let size = std::fs::metadata(path).map_err(problem)?.len();
    if size > LARGEST_MODEL_BYTES {
        return Err(format!(
            "{} is not a model file: it has {size} bytes, more than the limit of {LARGEST_MODEL_BYTES}; choose a TOML file",
            path.display()
        ));
    }
    let text = std::fs::read_to_string(path).map_err(problem)?;
    let model = Model::from_toml(&text, &path.display().to_string()).map_err(|error| error.to_string())?;
    Ok((model, renamed_keys(&text)))
}
