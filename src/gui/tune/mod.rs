//! The *Tune* page: weights and gains at the left, the live robot in the middle, the model at the right.

mod compare;
mod effects;
mod gains;
mod live_plots;
mod margins;
mod matrices;
mod model;
mod parameters;
mod pole_plane;
mod predicted;
mod trials;
mod verdict;
mod weights;

use std::path::Path;

use egui::{CentralPanel, Frame, Margin, Panel, ScrollArea, Ui};
use serde_json::{Value, json};

use crate::command::{Command, FilePurpose, Source};
use crate::command_line;
use crate::context::ViewContext;
use crate::pages::{Page, Tab};
use crate::panes::{Pane, panes_ui};
use crate::robot::pending_ui;
use crate::session::Session;
use crate::widgets::hint_ui;
use live_plots::LivePlots;
use model::ModelFiles;
use parameters::ParameterEditor;
use predicted::Predicted;
use trials::Trials;
use weights::WeightEditor;

/// A page that is lower shows the robot and the prediction one at a time, each over its whole height.
const ROOM_FOR_BOTH: f32 = 600.0;

/// State of the page that is no part of the session.
pub(crate) struct TuneTab {
    weights: WeightEditor,
    plots: LivePlots,
    predicted: Predicted,
    trials: Trials,
    files: ModelFiles,
    parameters: ParameterEditor,
}

impl TuneTab {
    pub(crate) fn new(session: &Session, path: Option<&Path>) -> Self {
        Self {
            weights: WeightEditor::default(),
            plots: LivePlots::new(),
            predicted: Predicted::default(),
            trials: Trials::default(),
            files: ModelFiles::new(path),
            parameters: ParameterEditor::new(session),
        }
    }

    /// Another model was loaded.
    pub(crate) fn load(&mut self, session: &Session, path: Option<&Path>) {
        self.files = ModelFiles::new(path);
        self.refresh(session);
    }

    /// The session was changed from elsewhere.
    pub(crate) fn refresh(&mut self, session: &Session) {
        self.parameters = ParameterEditor::new(session);
    }

    pub(crate) fn reset_view(&mut self) {
        self.plots.reset_view();
    }

    pub(crate) fn focus_weights(&mut self) {
        self.weights.focus_first = true;
    }

    pub(crate) fn note_file_problem(&mut self, problem: &str) {
        self.files.problem = Some(problem.to_owned());
    }

    pub(crate) fn note_saved(&mut self, path: &Path) {
        self.files = ModelFiles::new(Some(path));
    }

    /// The left side: what runs is always in view, and below it the weights and what follows from them.
    fn design_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        compare::slots_ui(context, ui);
        gains::controller_ui(context, ui);
        pending_ui(context, ui);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            self.weights.ui(context, ui);
            gains::ui(context, ui);
            let peaks_nm = self.trials.shown_peaks_nm(context);
            compare::differences_ui(context, peaks_nm, ui);
            if let Some(designed) = &context.designer.in_force {
                margins::ui(designed, self.predicted.poles(context, &self.trials), ui);
            }
            self.trials.ui(context, ui);
        });
    }

    fn model_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        self.files.ui(context, ui);
        self.parameters.ui(context, ui);
        effects::ui(context, ui);
    }

    /// The live robot above what the design predicts.
    fn both_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let frame = Frame::NONE.inner_margin(Margin::symmetric(0, 6));
        Panel::bottom("predicted")
            .frame(frame)
            .resizable(true)
            .default_size(240.0)
            .size_range(160.0..=420.0)
            .show(ui, |ui| self.predicted.ui(context, &mut self.trials, ui));
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| self.plots_ui(context, ui));
    }

    fn plots_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        // What a session has brought stays in view after its end.
        let shown = context.source == Source::Simulated
            || context.link.is_open()
            || !context.history.time_s().is_empty();
        if shown { self.plots.ui(context, ui) } else { not_connected_ui(context, ui) }
    }
}

impl Page for TuneTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let model = Pane::right(Part::Model, "Model", 252.0, 220.0..=420.0);
        if context.session.robot().is_none() {
            let panes = [Pane::middle(Part::Plots, "Robot", 300.0), model];
            panes_ui(ui, "axis", &panes, |part, ui| match part {
                Part::Model => self.model_ui(context, ui),
                _ => no_robot_ui(context, ui),
            });
            return;
        }
        let weights = Pane::left(Part::Weights, "Weights and gains", 426.0, 420.0..=490.0)
            .fixed()
            .in_front(self.weights.focus_first);
        let show = |part: Part, ui: &mut Ui| match part {
            Part::Weights => self.design_ui(context, ui),
            Part::Both => self.both_ui(context, ui),
            Part::Plots => self.plots_ui(context, ui),
            Part::Predicted => self.predicted.ui(context, &mut self.trials, ui),
            Part::Model => self.model_ui(context, ui),
        };
        if ui.available_height() >= ROOM_FOR_BOTH {
            let both = Pane::middle(Part::Both, "Robot and prediction", 400.0);
            panes_ui(ui, "tune", &[weights, both, model], show);
        } else {
            let plots = Pane::middle(Part::Plots, "Robot", 400.0).at_least(180.0);
            let predicted = Pane::right(Part::Predicted, "Prediction", 400.0, 300.0..=700.0).fixed();
            panes_ui(ui, "tune", &[weights, plots, predicted, model], show);
        }
    }

    fn snapshot(&self, context: &ViewContext<'_>) -> Value {
        json!({
            "design": context.designer.active.name(),
            "other_design": context.designer.reference.map(|designed| designed.weights.q.diagonal().as_slice().to_vec()),
            "margins": context.designer.in_force.as_ref().map(margins::snapshot),
            "trials": self.trials.snapshot(),
        })
    }

    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String> {
        Ok(command_line::gains(context.model_path))
    }

    fn note_dialog_problem(&mut self, purpose: FilePurpose, problem: &str) {
        if matches!(purpose, FilePurpose::OpenModel | FilePurpose::SaveModel) {
            self.note_file_problem(problem);
        }
    }
}

/// The panes of the page.
#[derive(Clone, Copy)]
enum Part {
    Weights,
    /// The robot above the prediction.
    Both,
    Plots,
    Predicted,
    Model,
}

fn no_robot_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    ui.add_space(60.0);
    ui.vertical_centered(|ui| {
        ui.heading("This model is a single axis: there is nothing to balance");
        hint_ui(ui, "Fit its friction on the Friction tab, or load the model of a robot.");
        if ui.button("Load the paper's robot").clicked() {
            context.commands.send(Command::LoadPreset(0));
        }
    });
}

fn not_connected_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    ui.add_space(0.3 * ui.available_height());
    ui.vertical_centered(|ui| {
        ui.heading(format!("{}: not connected", context.source.name()));
        hint_ui(ui, "Connect a robot on the Robot tab to show measurements here.");
        hint_ui(ui, "The simulated robot is paused.");
        ui.add_space(8.0);
        if ui.button("Connect on the Robot tab").clicked() {
            context.commands.send(Command::SelectTab(Tab::Robot));
        }
        if ui.button("Back to the simulated robot").clicked() {
            context.commands.send(Command::SelectSource(Source::Simulated));
        }
    });
}
