//! The *Friction* page: a log at the left, its picture and the fit in the middle, the result at the right.

mod charts;
mod fit;
mod fitted;
mod motion_chart;
mod preview;
mod result;
mod source;

use std::path::Path;

use egui::Ui;
use flqr_core::model::Model;
use serde_json::{Value, json};

use crate::column_map::ColumnMapForm;
use crate::command::FilePurpose;
use crate::context::ViewContext;
use crate::job::Waker;
use crate::load::Loader;
use crate::messages::Said;
use crate::pages::Page;
use crate::panes::{Pane, panes_ui};
use crate::runs::{Run, RunsTab};
use fit::FitRun;
pub(crate) use fitted::Fitted;
use preview::Preview;
use source::SourceForm;

/// State of the page.
pub(crate) struct FrictionTab {
    source: SourceForm,
    loader: Loader,
    preview: Preview,
    fit: FitRun,
}

impl FrictionTab {
    pub(crate) fn new(column_map: ColumnMapForm) -> Self {
        Self {
            source: SourceForm::new(column_map),
            loader: Loader::default(),
            preview: Preview::default(),
            fit: FitRun::default(),
        }
    }

    pub(crate) fn column_map(&self) -> String {
        self.source.column_map.text()
    }

    /// Fills the column map in, unless the user has typed one.
    pub(crate) fn suggest_column_map(&mut self, map: &str) {
        if self.loader.log().is_none() && !self.loader.is_running() {
            self.source.column_map.suggest(map);
        }
    }

    /// Starts loading; the log of before and its fit stay until the new one is complete.
    pub(crate) fn load(&mut self, path: &Path, waker: &Waker) -> Result<(), String> {
        self.source.path = path.display().to_string();
        self.source.dialog_problem = None;
        let map = self.source.column_map.parse()?;
        self.loader.start(path, map, waker)
    }

    pub(crate) fn cancel_load(&self) {
        self.loader.cancel();
    }

    /// `path` is the file that holds `model`.
    pub(crate) fn start_fit(
        &mut self,
        model: Model,
        path: Option<&Path>,
        waker: &Waker,
    ) -> Result<(), String> {
        let command = self.fit_command(path).ok();
        let Some(loaded) = self.loader.log() else {
            return Err("There is no log to fit. Load one first.".to_owned());
        };
        self.fit.start(loaded, model, command, waker)
    }

    pub(crate) fn cancel_fit(&self) {
        self.fit.cancel();
    }

    /// Source of the log.
    pub(crate) fn log_path(&self) -> Option<&Path> {
        self.loader.log().map(|loaded| &*loaded.path)
    }

    /// The command that makes the fit of the loaded log.
    fn fit_command(&self, model: Option<&Path>) -> Result<String, String> {
        let log = self.log_path().ok_or("There is no log to fit. Load one first.")?;
        let map = self.source.column_map.parse()?;
        Ok(self.fit.command_line(log, map.entries(), model))
    }

    pub(crate) fn has_log(&self) -> bool {
        self.loader.log().is_some()
    }

    pub(crate) fn fit_is_running(&self) -> bool {
        self.fit.is_running()
    }

    /// Values of the last fit for a model, or the reason why there are none.
    pub(crate) fn fitted(&self) -> Result<Fitted, String> {
        self.fit.fitted()
    }

    /// Gives a fit that has just ended its row.
    pub(crate) fn note_run(&mut self, ledger: &mut RunsTab) {
        if let Some(row) = self.fit.finished.take() {
            self.fit.row = Some(Run { number: ledger.note(row.clone()), ..row });
        }
    }

    /// The log above what the fit makes of it.
    fn plots_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let half = 0.5 * ui.available_height();
        ui.allocate_ui(egui::vec2(ui.available_width(), half), |ui| {
            ui.set_min_height(half);
            let row = self.fit.row.as_ref().filter(|_| self.fit.report.is_some());
            self.preview.ui(context, &self.loader, row, ui);
        });
        let row = self.fit.row.clone();
        if let Some(chart) = &mut self.fit.motion {
            let sources = self.loader.log().map(|loaded| preview::sources(loaded, row.as_ref()));
            return chart.ui(context, sources.unwrap_or_default(), ui);
        }
        let kind = self.loader.log().and_then(|loaded| loaded.kind.as_ref().ok().copied());
        charts::ui(context, &self.fit, kind, ui);
    }
}

impl Page for FrictionTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let panes = [
            Pane::left(Part::Log, "Log and fit", 330.0, 280.0..=480.0).in_front(self.source.focus_path),
            Pane::middle(Part::Plots, "Plots", 380.0).at_least(540.0),
            Pane::right(Part::Result, "Result", 300.0, 250.0..=460.0),
        ];
        panes_ui(ui, "friction", &panes, |part, ui| match part {
            Part::Log => {
                self.source.ui(context, &self.loader, ui);
                source::health_ui(&self.loader, ui);
                self.fit.options_ui(context, self.loader.log(), ui);
            }
            Part::Plots => self.plots_ui(context, ui),
            Part::Result => result::ui(context, &self.fit, ui),
        });
    }

    fn snapshot(&self, _: &ViewContext<'_>) -> Value {
        json!({ "log": self.loader.snapshot(), "fit": self.fit.snapshot() })
    }

    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String> {
        self.fit_command(context.model_path)
    }

    fn drain(&mut self) -> Vec<Said> {
        let generation = |loader: &Loader| loader.log().map(|loaded| loaded.generation);
        let before = generation(&self.loader);
        let loaded = self.loader.drain("“Data health” on the Friction page");
        if generation(&self.loader) != before {
            self.fit.discard();
            self.preview = Preview::default();
        }
        self.fit.drain().or(loaded).into_iter().collect()
    }

    fn focus_path(&mut self) -> bool {
        self.source.focus_path = true;
        true
    }

    fn note_dialog_problem(&mut self, purpose: FilePurpose, problem: &str) {
        if purpose == FilePurpose::OpenLog {
            self.source.dialog_problem = Some(problem.to_owned());
        }
    }
}

/// The panes of the page.
#[derive(Clone, Copy)]
enum Part {
    Log,
    Plots,
    Result,
}
