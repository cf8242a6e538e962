//! The *Experiments* page: what to run at the left, both runs' plots in the middle, the robot and the statistics
//! at the right.

mod dials;
mod form;
mod ledger;
mod playback;
mod plots;
mod preflight;
mod report;
mod run;
mod runs;
mod save;
mod scene;
mod side_view;
mod signals;
mod table;

use std::path::PathBuf;

use egui::{Color32, Context, Rect, RichText, Ui, Vec2, vec2};
use flqr_core::model::{Model, RobotModel};
use flqr_core::simulate::{Scenario, Summary};
use serde_json::{Value, json};

use crate::command::{Commands, FilePurpose};
use crate::context::ViewContext;
use crate::job::Waker;
use crate::messages::{Said, said};
use crate::pages::Page;
use crate::panes::{MARGIN, Pane, panes_ui};
use crate::plot::Marks;
use crate::runs::RunsTab;
use crate::save_form::{FileKind, SaveForm};
use crate::theme::palette;
use crate::widgets::{empty_page_ui, error_ui, hint_ui, section_ui, warning_ui};
use dials::{Dials, GREATEST_HEIGHT};
use form::Limited;
use playback::Playback;
use plots::Plots;
use preflight::Preflight;
pub(crate) use run::Settings;
use run::Variant;
use runs::{Comparison, Runs};
use save::Extent;
pub(crate) use save::SavedAs;
use side_view::{SideView, subject};
use table::{Choice, StatisticsTable};

/// A step of the target is shown over its first seconds: the rest is the steady state.
const STEP_VIEW_S: f64 = 2.0;

/// State of the page.
pub(crate) struct ExperimentsTab {
    /// Settings of the next runs.
    settings: Settings,
    limited: Limited,
    preflight: Preflight,
    runs: Runs,
    plots: Plots,
    marks: Marks,
    playback: Playback,
    table: StatisticsTable,
    saver: SaveForm<SavedAs>,
    /// Areas of plots, robot and statistics.
    page: Rect,
    /// Height of the statistics when they were drawn last.
    table_height: f32,
}

impl Default for ExperimentsTab {
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            limited: Limited::default(),
            preflight: Preflight::default(),
            runs: Runs::default(),
            plots: Plots::default(),
            marks: Marks::new([0.0, 0.0]),
            playback: Playback::default(),
            table: StatisticsTable::default(),
            saver: SaveForm::default(),
            page: Rect::NOTHING,
            table_height: 290.0,
        }
    }
}

impl ExperimentsTab {
    /// Settings of the next runs.
    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(crate) fn set_settings(&mut self, settings: Settings) {
        self.settings = settings;
        self.limited = Limited::default();
    }

    /// For a session file.
    pub(crate) fn to_value(&self) -> Value {
        self.settings.to_value()
    }

    /// From a session file.
    pub(crate) fn take_value(&mut self, value: &Value) -> Result<(), String> {
        self.set_settings(Settings::from_value(value)?);
        Ok(())
    }

    /// Starts both runs on `model`, which `path` holds if it is saved.
    pub(crate) fn start(&mut self, model: Model, path: Option<PathBuf>, waker: &Waker) -> Result<(), String> {
        self.saver.problem = None;
        self.runs
            .start(&self.settings, model, path, waker)
            .map_err(|error| format!("Cannot start the runs: {error}."))
    }

    /// Saves the runs that are shown.
    pub(crate) fn save(
        &mut self,
        saved_as: SavedAs,
        path: PathBuf,
        replace: bool,
        ctx: &Context,
        waker: &Waker,
    ) -> Result<(), String> {
        let Some(comparison) = self.runs.comparison() else {
            return Err("There is no run to save. Run an experiment first.".to_owned());
        };
        let visible_s = self.plots.stack.view.range();
        let extent = Extent { range_s: self.table.range(comparison, visible_s), visible_s };
        save::start(&mut self.saver, comparison, extent, (saved_as, path, replace), self.page, ctx, waker)
    }

    /// Another scenario for the next runs.
    pub(crate) fn choose(&mut self, scenario: Scenario) {
        self.settings.choose(scenario);
        self.limited = Limited::default();
    }

    /// Gives the runs that have just ended their rows in the ledger.
    pub(crate) fn note_runs(&self, runs: &mut RunsTab) {
        if let Some(comparison) = self.runs.comparison() {
            comparison.note_in(runs);
        }
    }

    pub(crate) fn cancel(&self) {
        self.runs.cancel();
    }

    pub(crate) fn is_running(&self) -> bool {
        self.runs.is_running()
    }

    /// Lets the time run while it plays.
    pub(crate) fn advance(&mut self, ctx: &Context) {
        self.playback.advance(ctx, &mut self.marks);
    }

    fn form_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let form = (&mut self.settings, &mut self.limited);
        form::ui(context, form, &mut self.preflight, &self.runs, ui);
        self.outcome_ui(context, ui);
        if self.runs.comparison().is_some() {
            save::ui(&mut self.saver, context, ui);
        }
    }

    /// Falls, warnings and refusals of the last runs, and whether they are still those of the form.
    fn outcome_ui(&self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(comparison) = self.runs.comparison() else { return };
        if comparison.settings != self.settings {
            hint_ui(ui, "The plots show runs with other settings. Run again to update them.");
        } else if comparison.model.rig != context.session.model_in_use().rig {
            warning_ui(ui, "The model has changed since these runs. Run again to update them.");
        }
        for (title, sentence) in comparison.failures() {
            let sentence = format!("{title}: {sentence}");
            if !self.preflight.says(&sentence) {
                error_ui(ui, sentence);
            }
        }
        for (titles, warning) in comparison.warnings() {
            // What is said before the next run need not be said of the last one.
            if !self.preflight.says(&warning) {
                warning_ui(ui, format!("{titles}: {warning}."));
            }
        }
        commands_ui(comparison, ui);
    }

    fn robot_ui(&mut self, comparison: &Comparison, ui: &mut Ui) {
        // What is in view: the pane scrolls, so that what is available has no end.
        let room = ui.clip_rect().height();
        let count = comparison.recorded().count().max(1) as f32;
        let spacing = ui.spacing().item_spacing.y;
        let height = ((room - self.table_height) / count - spacing).clamp(96.0, 420.0);
        let size = vec2(ui.available_width(), height);
        match comparison.model.robot() {
            Some(robot) if comparison.settings.scenario.on_ground() => {
                side_views_ui(comparison, robot, self.marks.cursor, ui, size);
            }
            _ => dials_ui(comparison, self.marks.cursor, ui, size.min(vec2(size.x, GREATEST_HEIGHT))),
        }
        let tables = ui.scope(|ui| {
            table::tracking_ui(ui, comparison);
            self.table.ui(ui, comparison, &self.marks);
        });
        self.table_height = tables.response.rect.height() + spacing;
    }

    fn plots_ui(&mut self, comparison: &Comparison, commands: &Commands, ui: &mut Ui) {
        ui.horizontal(|ui| self.head_ui(comparison, ui));
        ui.horizontal_wrapped(|ui| self.plots.tools_ui(ui, comparison));
        let transport = ui.spacing().interact_size.y + ui.spacing().item_spacing.y;
        let size = vec2(ui.available_width(), (ui.available_height() - transport).max(1.0));
        let moved = ui.allocate_ui(size, |ui| {
            ui.set_min_height(size.y);
            self.plots.ui(ui, comparison, commands, &mut self.marks)
        });
        if moved.inner.cursor {
            self.playback.playing = false;
        }
        if moved.inner.range {
            self.table.choice = Choice::Chosen(self.marks.range);
        }
        self.playback.ui(ui, &mut self.marks);
    }

    fn head_ui(&mut self, comparison: &Comparison, ui: &mut Ui) {
        let settings = &comparison.settings;
        // The list at the left reports it too.
        if ui.available_width() >= 420.0 {
            ui.label(RichText::new(settings.scenario.title()).heading().strong());
        }
        let colors = palette(ui.visuals());
        for (variant, _) in comparison.recorded() {
            legend_ui(ui, variant.title(settings.scenario), colors.runs[variant as usize]);
        }
        if ui.available_width() >= 420.0 {
            hint_ui(ui, comparison.numbers_text()).on_hover_text("Rows of these runs on the Runs tab");
        }
        if comparison.signals(false).iter().any(|signal| signal.has_target) {
            legend_ui(ui, "target", colors.reference);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.button("Whole run").on_hover_text("Show the run from start to end (double click)").clicked()
            {
                self.plots.stack.view.show_all(self.marks.limits);
            }
        });
    }

    /// Takes in what the workers have brought; a sentence if something ended.
    fn drain_runs(&mut self) -> Option<String> {
        let generation = |runs: &Runs| runs.comparison().map(|comparison| comparison.generation);
        let before = generation(&self.runs);
        let message = self.runs.drain();
        if generation(&self.runs) != before
            && let Some(comparison) = self.runs.comparison()
        {
            let limits = [0.0, comparison.end_s()];
            self.marks = Marks::new(limits);
            let step = comparison.recorded().any(|(_, run)| run.tracking().is_some());
            let shown_s = if step { STEP_VIEW_S.min(limits[1]) } else { limits[1] };
            self.plots.stack.view.show_all([0.0, shown_s]);
            self.table.choice = match self.table.choice {
                Choice::Chosen(range) if range[1] <= limits[1] => Choice::Chosen(range),
                _ => Choice::Usual,
            };
            self.playback.playing = false;
        }
        message
    }
}

impl Page for ExperimentsTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let arrows = !self.plots.stack.has_cursors();
        self.playback.keys(ui, arrows, &mut self.marks);
        let form = Pane::left(Part::Form, "Experiment", 260.0, 240.0..=420.0).in_front(self.saver.focus_path);
        let Some(comparison) = self.runs.comparison().cloned() else {
            let panes = [form, Pane::middle(Part::Plots, "Plots", 300.0)];
            panes_ui(ui, "no experiment", &panes, |part, ui| match part {
                Part::Form => self.form_ui(context, ui),
                _ => {
                    let hint = "Choose an experiment on the left and run it. Both controllers are shown here side by side.";
                    empty_page_ui(ui, "No run yet.", hint, |_| {});
                }
            });
            return;
        };
        self.marks.range = self.table.range(&comparison, self.plots.stack.view.range());
        self.marks.shade = self.table.choice != Choice::Visible && self.marks.range != self.marks.limits;
        let page = ui.available_rect_before_wrap();
        self.page = page;
        let width = (0.29 * ui.ctx().content_rect().width()).clamp(372.0, 560.0);
        let panes = [
            form,
            Pane::middle(Part::Plots, "Plots", 400.0),
            Pane::right(Part::Robot, "Robot and statistics", width, 300.0..=900.0),
        ];
        panes_ui(ui, "experiments", &panes, |part, ui| match part {
            Part::Form => self.form_ui(context, ui),
            Part::Plots => {
                // A picture of the page leaves the form out.
                self.page = page.with_min_x(ui.max_rect().left() - MARGIN);
                self.plots_ui(&comparison, context.commands, ui);
            }
            Part::Robot => self.robot_ui(&comparison, ui),
        });
    }

    fn snapshot(&self, _: &ViewContext<'_>) -> Value {
        let runs = self.runs.comparison().map(|comparison| {
            let range = self.table.range(comparison, self.plots.stack.view.range());
            let found = comparison.statistics_between(range);
            let runs = Variant::ALL.iter().zip(&comparison.runs).zip(found);
            runs.map(|((variant, run), statistics)| snapshot_of(comparison, *variant, run, statistics))
                .collect::<Vec<_>>()
        });
        json!({
            "scenario": self.settings.scenario.name(),
            "seconds": self.settings.seconds,
            "seed": self.settings.seed,
            "running": self.is_running(),
            "runs": runs.unwrap_or_default(),
            "range_s": self.runs.comparison().map(|_| self.marks.range),
            "cursor_s": self.marks.cursor,
            "playing": self.playback.playing,
        })
    }

    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String> {
        Ok(run::command_line(&self.settings, Variant::Compensated, context.model_path))
    }

    fn drain(&mut self) -> Vec<Said> {
        let results = self.drain_runs().map(Ok).into_iter().chain(self.saver.drain());
        results.map(said).collect()
    }

    fn focus_path(&mut self) -> bool {
        self.saver.focus_path = true;
        true
    }

    fn suggested_name(&self, purpose: FilePurpose) -> Option<String> {
        match purpose {
            FilePurpose::SaveExperiment(saved_as) => {
                Some(format!("{}.{}", self.settings.scenario.name(), saved_as.extension()))
            }
            _ => None,
        }
    }

    fn note_dialog_problem(&mut self, purpose: FilePurpose, problem: &str) {
        if matches!(purpose, FilePurpose::SaveExperiment(_)) {
            self.saver.problem = Some(problem.to_owned());
        }
    }
}

fn legend_ui(ui: &mut Ui, name: &str, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 12.0), egui::Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.5, color));
    ui.label(RichText::new(name).strong().color(color));
}

fn side_views_ui(comparison: &Comparison, robot: &RobotModel, time_s: f64, ui: &mut Ui, size: Vec2) {
    let runs = comparison.recorded().map(|(_, run)| run);
    let subject = subject(runs, &robot.parameters, robot.surroundings.slope_rad);
    let grounds = comparison.settings.scenario.grounds(robot);
    let colors = palette(ui.visuals()).runs;
    for (variant, run) in comparison.recorded() {
        let view = SideView {
            title: variant.title(comparison.settings.scenario),
            color: colors[variant as usize],
            run,
            grounds: &grounds,
            parameters: &robot.parameters,
            subject: &subject,
            time_s,
        };
        view.ui(ui, size);
    }
}

fn dials_ui(comparison: &Comparison, time_s: f64, ui: &mut Ui, size: Vec2) {
    let signals = comparison.signals(false);
    let speeds = signals.iter().enumerate().filter(|(_, signal)| signal.has_target);
    let speeds: Vec<_> = speeds.map(|(column, signal)| (signal.quantity.name, column)).collect();
    let colors = palette(ui.visuals()).runs;
    for (variant, run) in comparison.recorded() {
        let title = variant.title(comparison.settings.scenario);
        let dials = Dials { title, color: colors[variant as usize], run, speeds: &speeds, time_s };
        dials.ui(ui, size);
    }
}

/// The panes of the page.
#[derive(Clone, Copy)]
enum Part {
    Form,
    Plots,
    Robot,
}

fn snapshot_of(
    comparison: &Comparison,
    variant: Variant,
    run: &Result<Box<run::Recorded>, String>,
    statistics: Option<Vec<Summary>>,
) -> Value {
    let controller = variant.name(comparison.settings.scenario);
    let run = match run {
        Err(problem) => return json!({ "controller": controller, "problem": problem }),
        Ok(run) => run,
    };
    let keys = comparison.signals(false).into_iter().map(|signal| signal.key.to_owned());
    let statistics =
        statistics.map(|all| keys.zip(all.into_iter().map(|s| json!(s))).collect::<serde_json::Map<_, _>>());
    json!({
        "controller": controller,
        "statistics": statistics,
        "settled": run.settled(),
        "fell_s": run.fall().map(|fall| fall.time_s),
        "tracking": run.tracking(),
        "end_s": run.end_s(),
        "warnings": run.warnings(),
        "command": comparison.command_line(variant),
        "run": comparison.provenance(variant),
    })
}

/// Copies the commands that make these runs again.
fn commands_ui(comparison: &Comparison, ui: &mut Ui) {
    section_ui(ui, "Command", |ui| {
        for variant in Variant::ALL.into_iter().rev() {
            let name = format!("Copy {}", variant.title(comparison.settings.scenario));
            let line = comparison.command_line(variant);
            if ui.button(name).on_hover_text(&line).clicked() {
                ui.ctx().copy_text(line);
            }
        }
    });
    if comparison.model_path.is_none() {
        hint_ui(ui, "The model of these runs is unsaved: save it and replace MODEL.toml by its path.");
    }
}
