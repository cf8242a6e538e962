//! A fit on a worker thread, with live convergence and cancel.

use std::path::Path;
use std::sync::Arc;

use egui::{ProgressBar, RichText, TextEdit, Ui};
use flqr_core::friction::{Stribeck, StribeckParameters};
use flqr_core::identify::{Bounds, FitError, FitOptions, FitProgress, FitReport, Method, fit};
use flqr_core::model::{AxisParameters, Model, Motor, Rig};
use flqr_core::record::{Log, LogKind, Mapping};

use super::fitted::Fitted;
use super::motion_chart::MotionChart;
use crate::command::Command;
use crate::context::ViewContext;
use crate::job::{Job, Outcome, Waker};
use crate::load::LoadedLog;
use crate::messages::{Said, Severity};
use crate::runs::{Run, RunKind, Sources, Value};
use crate::widgets::{choice_ui, entry_ui, error_ui, hint_ui, section_ui, shown};

/// One report of the optimiser.
#[derive(Clone, Copy)]
pub(super) struct Step {
    iteration: usize,
    iterations: usize,
    best_error: f64,
    best: Option<StribeckParameters>,
}

/// The result and what it was made from, or why there is none.
type Ended = Result<(FitReport, Sources), Said>;

/// Options, the running fit, and the last result.
pub(super) struct FitRun {
    motor: Motor,
    method: Method,
    bounds: Bounds,
    seed: u64,
    estimate: String,
    /// True if parameters that are not estimated are held at the open model's values.
    from_model: bool,
    /// `from_model` of the fit that runs or has ended.
    pub(super) held: bool,
    job: Option<Job<Step, Ended>>,
    /// Iteration and log10 of the best error, for the plot.
    pub(super) convergence: Vec<[f64; 2]>,
    last_step: Option<Step>,
    pub(super) report: Option<FitReport>,
    /// Comparison of a fit from motion with the log.
    pub(super) motion: Option<MotionChart>,
    made_with: Option<MadeWith>,
    /// The row of a fit that has ended, until the ledger takes it.
    pub(super) finished: Option<Run>,
    /// The row of the last fit.
    pub(super) row: Option<Run>,
    problem: Option<Said>,
}

impl Default for FitRun {
    fn default() -> Self {
        Self {
            motor: Motor::Left,
            method: Method::Best,
            bounds: Bounds::Data,
            seed: 1,
            estimate: String::new(),
            from_model: false,
            held: false,
            job: None,
            convergence: Vec::new(),
            last_step: None,
            report: None,
            motion: None,
            made_with: None,
            finished: None,
            row: None,
            problem: None,
        }
    }
}

/// Settings of a fit, for its row of the Runs page.
struct MadeWith {
    log: Arc<Log>,
    model: Option<Model>,
    /// Motor, if there is a choice.
    motor: Option<Motor>,
    options: FitOptions,
    command: Option<String>,
}

impl MadeWith {
    fn row(&self, report: &FitReport, sources: Sources) -> Run {
        let Self { log, model, motor, options, command } = self;
        let name = Path::new(&log.source)
            .file_name()
            .map_or(log.source.as_str().into(), |name| name.to_string_lossy());
        let of = motor.map_or(String::new(), |motor| format!("{motor}, "));
        let method = if options.method == Method::Best { "best" } else { "pso" };
        let mut row = Run::new(RunKind::Fit, format!("friction, {of}{name}"), model.as_ref(), sources)
            .with("fit.log", Value::Text(log.source.clone()))
            .with("fit.method", Value::Text(method.to_owned()))
            .with("fit.seed", Value::Number(options.seed as f64));
        if let Some(motor) = motor {
            row = row.with("fit.motor", Value::Text(motor.to_string()));
        }
        let mut result = format!("error {} {}", shown(report.rmse, 3), report.rmse_unit);
        for (key, estimate) in &report.parameters {
            row = row.with(&format!("result.{key}"), Value::Number(estimate.value));
            result += &format!(", {key} {}", shown(estimate.value, 3));
        }
        Run { seed: Some(options.seed), command: command.clone(), result, ..row }
    }
}

/// The session's model where it describes what the log records; a log of something else is fitted without.
fn fitting_model(kind: Option<LogKind>, model: Model) -> Option<Model> {
    let linear_model =
        matches!(&model.rig, Rig::Axis(axis) if matches!(axis.parameters, AxisParameters::Linear { .. }));
    (linear_model == (kind == Some(LogKind::LinearAxis))).then_some(model)
}

/// Returns whether there is a left and a right motor to choose from: in the log, or in the model next to the log of
/// one.
fn has_motors(kind: Option<LogKind>, rig: &Rig) -> bool {
    match kind {
        Some(LogKind::Robot) => true,
        Some(LogKind::LinearAxis) => false,
        Some(LogKind::Bench | LogKind::FrictionPairs) | None => matches!(rig, Rig::Robot(_)),
    }
}

/// Reason why there is no fit.
fn refusal(error: &FitError) -> Said {
    let is_asked = matches!(error, FitError::Cancelled { .. });
    (if is_asked { Severity::Note } else { Severity::Error }, error.to_string())
}

impl FitRun {
    pub(super) fn is_running(&self) -> bool {
        self.job.is_some()
    }

    /// `command` makes the same fit in a terminal.
    pub(super) fn start(
        &mut self,
        loaded: &LoadedLog,
        model: Model,
        command: Option<String>,
        waker: &Waker,
    ) -> Result<(), String> {
        self.discard();
        let log = Arc::clone(&loaded.log);
        let kind = loaded.kind.as_ref().ok().copied();
        let has_motors = has_motors(kind, &model.rig);
        let model = fitting_model(kind, model).filter(|_| self.from_model);
        self.held = model.is_some();
        let motor = self.motor;
        let options = self.options();
        let made_with = MadeWith {
            log: Arc::clone(&log),
            model: model.clone(),
            motor: has_motors.then_some(motor),
            options: options.clone(),
            command,
        };
        let work = move |reporter: &crate::job::Reporter<Step>| {
            let mut watch = |progress: &FitProgress| {
                reporter.progress(Step {
                    iteration: progress.iteration,
                    iterations: progress.iterations,
                    best_error: progress.best_error,
                    best: progress.best,
                })
            };
            let report = fit(std::slice::from_ref(&*log), model.as_ref(), motor, &options, &mut watch)
                .map_err(|error| refusal(&error))?;
            Ok((report, Sources::new(model.as_ref(), [&*log])))
        };
        self.job = Some(Job::start("fit", waker, work).map_err(|e| format!("Cannot start the fit: {e}."))?);
        self.made_with = Some(made_with);
        Ok(())
    }

    fn options(&self) -> FitOptions {
        FitOptions {
            method: self.method,
            bounds: self.bounds,
            estimate: self.names_to_estimate(),
            seed: self.seed,
        }
    }

    /// The command that makes this fit; `model` is the file that holds the session's model.
    pub(super) fn command_line(&self, log: &Path, map: &[Mapping], model: Option<&Path>) -> String {
        let model = self.from_model.then_some(model);
        crate::command_line::fit(log, map, self.motor, &self.options(), model)
    }

    fn names_to_estimate(&self) -> Vec<String> {
        self.estimate.split([',', ' ']).filter(|name| !name.is_empty()).map(str::to_owned).collect()
    }

    pub(super) fn cancel(&self) {
        if let Some(job) = &self.job {
            job.cancel();
        }
    }

    /// Ends the fit and forgets its result; the options stay.
    pub(super) fn discard(&mut self) {
        self.job = None;
        self.convergence.clear();
        self.last_step = None;
        self.report = None;
        self.motion = None;
        self.row = None;
        self.problem = None;
    }

    pub(super) fn drain(&mut self) -> Option<Said> {
        let (steps, outcome) = self.job.as_mut()?.poll();
        for step in steps {
            self.note_step(step);
        }
        let result = match outcome {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => {
                Err((Severity::Error, "The fit failed: this is an internal error.".to_owned()))
            }
        };
        self.job = None;
        Some(match result {
            Ok((report, sources)) => {
                let error = shown(report.rmse, 4);
                let text = format!("The fit ended with an error of {error} {}.", report.rmse_unit);
                self.show_history(&report);
                self.finished = self.made_with.take().map(|made_with| made_with.row(&report, sources));
                self.motion = MotionChart::new(&report);
                self.report = Some(report);
                (Severity::Note, text)
            }
            Err(problem) => {
                self.problem = Some(problem.clone());
                problem
            }
        })
    }

    fn note_step(&mut self, step: Step) {
        self.last_step = Some(step);
        let error = step.best_error.log10();
        if error.is_finite() {
            self.convergence.push([step.iteration as f64, error]);
        }
    }

    /// Reports may have been dropped on their way; the result has all of them.
    fn show_history(&mut self, report: &FitReport) {
        let points = report.history.iter().enumerate().map(|(i, error)| [i as f64, error.log10()]);
        let points: Vec<_> = points.filter(|point| point[1].is_finite()).collect();
        if !points.is_empty() {
            self.convergence = points;
        }
    }

    /// The fitted curve, of the result or of the best so far.
    pub(super) fn curve(&self) -> Option<Stribeck> {
        let parameters = match &self.report {
            Some(report) => report.stribeck(),
            None => self.last_step.and_then(|step| step.best),
        };
        Stribeck::new(parameters?).ok()
    }

    /// Values used in a model: the result, or the best so far.
    pub(super) fn fitted(&self) -> Result<Fitted, String> {
        if let Some(report) = &self.report {
            return Fitted::of(report);
        }
        let curve = self.curve().ok_or("There is no fitted curve yet. Run a fit to the end.")?;
        Ok(Fitted::Rotary { curve, inertia_kg_m2: None, gravity_torque_nm: None })
    }

    /// The motor whose friction is being fitted: 0 left, 1 right.
    pub(super) fn motor_index(&self) -> usize {
        usize::from(self.motor == Motor::Right)
    }

    pub(super) fn snapshot(&self) -> serde_json::Value {
        let parameters = self.report.as_ref().map(|report| {
            let pairs = report.parameters.iter();
            pairs.map(|(name, estimate)| ((*name).to_string(), serde_json::json!(estimate))).collect()
        });
        serde_json::json!({
            "running": self.is_running(),
            "problem": self.problem.as_ref().map(|(_, text)| text),
            "iteration": self.last_step.map(|step| step.iteration),
            "parameters": parameters.map(serde_json::Value::Object),
            "rmse": self.report.as_ref().map(|report| report.rmse),
        })
    }

    pub(super) fn options_ui(&mut self, context: &ViewContext<'_>, loaded: Option<&LoadedLog>, ui: &mut Ui) {
        section_ui(ui, "Fit", |_| {});
        let kind = loaded.and_then(|loaded| loaded.kind.as_ref().ok().copied());
        let motors = has_motors(kind, &context.session.rig);
        ui.add_enabled_ui(!self.is_running(), |ui| {
            let grid = egui::Grid::new("fit").num_columns(2).spacing([12.0, 4.0]);
            grid.show(ui, |ui| self.choices_ui(motors, ui));
        });
        ui.add_space(2.0);
        ui.horizontal(|ui| self.run_ui(context, loaded.is_some(), ui));
        match &self.problem {
            Some((Severity::Note, text)) => {
                hint_ui(ui, text);
            }
            Some((Severity::Warning | Severity::Error, text)) => {
                error_ui(ui, text);
            }
            None => {}
        }
    }

    fn choices_ui(&mut self, motors: bool, ui: &mut Ui) {
        if motors {
            ui.label("motor");
            ui.horizontal(|ui| {
                let help = "For a log of both motors: the motor to fit and to compare with";
                let choices = [(Motor::Left, "left", help), (Motor::Right, "right", help)];
                choice_ui(ui, &mut self.motor, &choices);
            });
            ui.end_row();
        }
        ui.label("method");
        ui.horizontal(|ui| {
            let choices = [
                (
                    Method::Best,
                    "PSO + local refinement",
                    "Particle swarm optimization followed by local refinement",
                ),
                (Method::Pso, "PSO only", "Particle swarm optimization as in Algorithm 1 of the paper"),
            ];
            choice_ui(ui, &mut self.method, &choices);
        });
        ui.end_row();
        ui.label("bounds");
        ui.horizontal(|ui| {
            let choices = [
                (Bounds::Data, "from the data", "Bounds from the measured torques and speeds"),
                (Bounds::Paper, "the paper's", "Table 3 as printed; excludes the optimum for small motors"),
            ];
            choice_ui(ui, &mut self.bounds, &choices);
        });
        ui.end_row();
        ui.label("seed");
        entry_ui(ui, &mut self.seed, "seed", |field| field)
            .on_hover_text("The same log and seed give the same result");
        ui.end_row();
        ui.label("estimate");
        let field = TextEdit::singleline(&mut self.estimate).hint_text("default").desired_width(180.0);
        let field = ui.add(field).accessible_name("parameters to estimate");
        field.on_hover_text(
            "Parameters to estimate in a fit from motion: “all”, or names as in the model file, separated by commas. Empty: all that the log identifies",
        );
        ui.end_row();
        ui.label("");
        ui.checkbox(&mut self.from_model, "use the open model")
            .on_hover_text("Parameters that are not estimated keep the model's values");
        ui.end_row();
    }

    fn run_ui(&self, context: &ViewContext<'_>, has_log: bool, ui: &mut Ui) {
        if self.is_running() {
            if ui.button("Cancel fit").on_hover_text("Stop the fit (Ctrl+Enter)").clicked() {
                context.commands.send(Command::CancelFit);
            }
            let share = self.last_step.map_or(0.0, |s| s.iteration as f32 / s.iterations.max(1) as f32);
            let text = self.last_step.map_or_else(
                || "starting".to_owned(),
                |s| format!("iteration {} of {}, error {:.2e}", s.iteration, s.iterations, s.best_error),
            );
            ui.add(ProgressBar::new(share).text(RichText::new(text).small()));
            return;
        }
        let start = ui.add_enabled(has_log, egui::Button::new("Start fit"));
        let start = start.on_hover_text("Fit the friction curve to the log (Ctrl+Enter)");
        if start.on_disabled_hover_text("Load a log first").clicked() {
            context.commands.send(Command::StartFit);
        }
        if !has_log {
            hint_ui(ui, "needs a log");
        }
    }
}
