//! The *Refine* page: logs and search at the left, the steps of the loop above, one of them in the middle.

mod candidates;
mod command;
mod compare;
mod effects;
mod form;
mod health;
mod ledger;
mod residual;
mod run;
mod save;
mod sources;
mod strip;

use std::path::{Path, PathBuf};

use egui::{Frame, Margin, Panel, RichText, ScrollArea, Ui};
use flqr_core::model::Model;
use flqr_core::refine::{Refinement, Verdict};
use flqr_core::report::{Block, Tone as ReportTone};
use serde_json::{Value, json};

use crate::column_map::ColumnMapForm;
use crate::command::FilePurpose;
use crate::context::ViewContext;
use crate::messages::{Said, said};
use crate::pages::{Done, Page, PageCommand, Pages, Surroundings, Tab};
use crate::panes::{Pane, panes_ui};
use crate::runs::Run as LedgerRow;
use crate::save_form::{FileKind, SaveForm};
use crate::session::Session;
use crate::theme::palette;
use crate::widgets::{empty_page_ui, hint_ui, section_ui, warning_ui};
use crate::write_file::bytes;
pub(crate) use command::{RefineCommand, RefineFile};
pub(crate) use residual::RESIDUAL_STACK;
use residual::ResidualStep;
pub(crate) use run::Question;
use run::{Answered, Drained, Made, Run, Settings, is_of_demo};
pub(crate) use save::SavedAs;
use sources::Sources;
use strip::{Step, StepState, Tone};

/// State of the page.
pub(crate) struct RefineTab {
    sources: Sources,
    settings: Settings,
    run: Run,
    saver: SaveForm<SavedAs>,
    step: Step,
    residual: ResidualStep,
    /// Of each effect that was found, whether it is to be added.
    ticks: Vec<bool>,
    /// The answer that they belong to.
    ticked: u64,
    /// The refined model with the effects that are ticked.
    chosen: Option<Model>,
    /// The refinement that the ledger has.
    noted: Option<u64>,
    /// Its row.
    row: Option<LedgerRow>,
    /// The model that is being saved.
    saving: Option<Model>,
}

/// Relation of a result to the current inputs.
enum Standing {
    Fresh,
    /// The effects are in the model.
    InModel,
    /// Model, logs or settings are others now; a sentence says which.
    Stale(String),
}

impl RefineTab {
    pub(crate) fn new(column_map: ColumnMapForm) -> Self {
        Self {
            sources: Sources::new(column_map),
            settings: Settings::default(),
            run: Run::default(),
            saver: SaveForm::default(),
            step: Step::default(),
            residual: ResidualStep::default(),
            ticks: Vec::new(),
            ticked: 0,
            chosen: None,
            noted: None,
            row: None,
            saving: None,
        }
    }

    pub(crate) fn has_logs(&self) -> bool {
        !self.sources.list.is_empty()
    }

    /// The logs that are files, and whether each is held out.
    pub(crate) fn log_files(&self) -> Vec<(PathBuf, bool)> {
        let files = self.sources.list.iter().filter(|source| !source.is_made());
        files.map(|source| (source.path.clone(), source.held_out)).collect()
    }

    /// Returns whether there are plots of a residual.
    pub(crate) fn has_residual(&self) -> bool {
        residual::has_plots(self.run.refined.as_ref())
    }

    /// Goes to the plots of the residual.
    pub(crate) fn show_residual(&mut self) {
        self.step = Step::Residual;
    }

    pub(crate) fn is_running(&self) -> bool {
        self.run.running().is_some()
    }

    fn start(&mut self, question: Question, around: Surroundings<'_>) -> Result<(), String> {
        if let (Some(why_not), true) = (form::why_not(&self.sources), question != Question::Demo) {
            return Err(why_not.to_owned());
        }
        let made = self.made(around.session);
        if question == Question::Demo && !is_of_demo(&made.model) {
            return Err("The demo needs the unchanged preset of the paper's robot.".to_owned());
        }
        self.run.start(question, made, around.model_path, around.waker)
    }

    /// Inputs of a search started now.
    fn made(&self, session: &Session) -> Made {
        Made { model: session.model(), inputs: self.sources.inputs(), settings: self.settings.clone() }
    }

    fn standing<T>(&self, answered: &Answered<T>, refined: Option<&Model>, session: &Session) -> Standing {
        let now = self.made(session);
        let made = &answered.made;
        if made.inputs == now.inputs && made.settings == now.settings {
            return match () {
                () if made.model == now.model => Standing::Fresh,
                () if refined == Some(&now.model) => Standing::InModel,
                () => Standing::Stale("The model has changed since. Search again.".to_owned()),
            };
        }
        let what = if made.inputs == now.inputs { "settings" } else { "logs" };
        Standing::Stale(format!("This result was computed with other {what}. Search again."))
    }

    fn standing_of_refined(&self, session: &Session) -> Option<Standing> {
        let refined = self.run.refined.as_ref()?;
        Some(self.standing(refined, self.chosen.as_ref(), session))
    }

    fn found(&self) -> Option<&Refinement> {
        self.run.refined.as_ref().map(|refined| &*refined.answer)
    }

    fn put_into(&self, session: &mut Session) -> Result<String, String> {
        let Some(refined) = &self.run.refined else {
            return Err("There are no effects to use. Search first.".to_owned());
        };
        match self.standing_of_refined(session) {
            Some(Standing::Stale(why)) => return Err(why),
            Some(Standing::InModel) => return Err("The effects are already in the model.".to_owned()),
            Some(Standing::Fresh) | None => {}
        }
        let Some(chosen) = self.chosen.as_ref().filter(|chosen| **chosen != refined.made.model) else {
            return Err("No effect is selected. The model is unchanged.".to_owned());
        };
        session.rig = chosen.rig.clone();
        Ok("The effects were added to the model.".to_owned())
    }

    /// Ids of the effects that are found and not ticked.
    fn left_out(&self) -> Vec<&'static str> {
        let found = self.found().map_or(&[][..], |found| &found.effects);
        let left_out = found.iter().zip(&self.ticks).filter(|(_, tick)| !**tick);
        left_out.map(|(found, _)| found.effect.id()).collect()
    }

    fn save(
        &mut self,
        saved_as: SavedAs,
        path: PathBuf,
        replace: bool,
        around: &Surroundings<'_>,
    ) -> Result<(), String> {
        let Some(refined) = &self.run.refined else {
            return Err("There is nothing to save. Search first.".to_owned());
        };
        let remark = match self.standing(refined, self.chosen.as_ref(), around.session) {
            Standing::Stale(why) => Some(format!("Out of date when saved. {why}")),
            Standing::Fresh | Standing::InModel => None,
        };
        let mut document = refined.answer.document.clone();
        let model = self.chosen.clone().unwrap_or_else(|| refined.answer.model.clone());
        let said = remark.clone();
        let saving = (saved_as == SavedAs::Model).then(|| model.clone());
        let row = self.row.as_ref().map(LedgerRow::provenance);
        let left_out = self.left_out().join(", ");
        let content = move || match saved_as {
            SavedAs::Report => {
                if !left_out.is_empty() {
                    let text = format!("{left_out}: not added to the model");
                    document.blocks.insert(0, Block::notice(ReportTone::Note, "Left out", text));
                }
                if let Some(row) = row {
                    document.blocks.push(Block::paragraph(format!("Runs: {row}.")));
                }
                if let Some(remark) = said {
                    document.blocks.insert(0, Block::notice(ReportTone::Warning, "Stale", remark));
                }
                document.to_html()
            }
            SavedAs::Model => {
                let comments = row.into_iter().chain(said).map(|comment| format!("# {comment}\n"));
                comments.collect::<String>() + &model.to_toml()
            }
        };
        let path = self.saver.begin(saved_as, path);
        let files = move |path: &Path| Ok(vec![(path.to_owned(), bytes(content()))]);
        self.saver.write((saved_as, path, replace), files, remark, around.waker)?;
        self.saving = saving;
        Ok(())
    }

    /// A model that has been saved, and its file.
    pub(crate) fn take_saved_model(&mut self) -> Option<(PathBuf, Model)> {
        match self.saver.take_written()? {
            (SavedAs::Model, path) => Some((path, self.saving.take()?)),
            (SavedAs::Report, _) => None,
        }
    }

    fn step_pane_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        self.stale_ui(context, ui);
        if self.step == Step::Residual && (self.run.refined.is_some() || self.run.residual.is_some()) {
            let sources: Vec<String> = self.row.iter().map(LedgerRow::provenance).collect();
            let (refined, residual) = (self.run.refined.as_ref(), self.run.residual.as_ref());
            self.residual.ui(refined, residual, &sources, context.commands, ui);
        } else {
            ScrollArea::both().auto_shrink(false).show(ui, |ui| self.step_ui(context, ui));
        }
    }

    fn states(&self, session: &Session) -> [StepState; 5] {
        let found = self.found();
        let standing = self.standing_of_refined(session);
        let in_model = matches!(standing, Some(Standing::InModel));
        let mut states = [
            health::state(&self.run, &self.sources),
            residual::state(self.run.refined.as_ref(), self.run.residual.as_ref()),
            candidates::state(found),
            effects::state(found, in_model),
            compare::state(found),
        ];
        if let Some((question, share)) = self.run.running() {
            let step = if question == Question::Residual { Step::Residual } else { Step::Candidates };
            states[step as usize] = StepState::new(format!("computing, {:.0} %", 100.0 * share), Tone::Busy);
        }
        if let Some(Standing::Stale(_)) = standing {
            for state in &mut states[1..] {
                if state.tone != Tone::Busy && state.tone != Tone::Open {
                    *state = StepState::new(format!("{} · out of date", state.text), Tone::Warning);
                }
            }
        }
        states
    }

    fn stale_ui(&self, context: &ViewContext<'_>, ui: &mut Ui) {
        if let (Some(Standing::Stale(why)), true) =
            (self.standing_of_refined(context.session), self.step != Step::Health)
        {
            warning_ui(ui, format!("Out of date. {why}"));
        }
    }

    fn step_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        match (self.step, self.found()) {
            (Step::Health, _) => health::ui(&self.run, &self.sources, ui),
            (Step::Residual, _) | (_, None) => {
                let hint = "Add a log on the left and press “Find missing effects”.";
                empty_page_ui(ui, "No search yet.", hint, |_| {});
            }
            (Step::Candidates, Some(found)) => candidates::ui(found, ui),
            (Step::Add, Some(_)) => self.add_ui(context, ui),
            (Step::Compare, Some(found)) => compare::ui(found, ui),
        }
    }

    fn add_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let standing = self.standing_of_refined(context.session);
        let Some(refined) = &self.run.refined else { return };
        let found = &refined.answer;
        effects::verdict_ui(found, ui);
        if let Some(truth) = &self.run.truth {
            effects::truth_ui(truth, ui);
        }
        if !found.effects.is_empty() {
            use_ui(context, standing, self.ticks.contains(&true), ui);
        }
        let before = self.ticks.clone();
        for (effect, tick) in found.effects.iter().zip(&mut self.ticks) {
            effects::effect_ui(effect, tick, ui);
        }
        if self.ticks != before {
            self.chosen = Some(refined.made.refined_with(found, &self.ticks));
        }
        let look = effects::unexplained_ui(&found.unexplained, ui);
        if let Some(next) = &found.next_experiment {
            effects::next_ui(context, next, ui);
        }
        if let Some(variable) = look {
            self.residual.choose(&variable);
            self.step = Step::Residual;
        }
    }

    /// Copies the command that gives the same answer.
    fn commands_ui(&self, context: &ViewContext<'_>, ui: &mut Ui) {
        let made = self.made(context.session);
        if made.inputs.iter().all(|input| input.held_out) {
            return;
        }
        section_ui(ui, "Command", |ui| {
            for question in [Question::Residual, Question::Refine] {
                let line = made.command_line(question, context.model_path);
                let button = ui.button(format!("Copy {}", question.name())).on_hover_text(&line);
                if button.clicked() {
                    ui.ctx().copy_text(line);
                }
            }
        });
        if context.model_path.is_none() {
            hint_ui(ui, "This model is unsaved: save it and replace MODEL.toml by its path.");
        }
    }

    /// Takes in what the workers have brought; a sentence if something ended.
    fn drain_jobs(&mut self) -> Option<Said> {
        let loaded = self.sources.drain();
        let Some(Drained { question, said, answered, records }) = self.run.drain() else { return loaded };
        if let Some(records) = records {
            self.sources.replace(records);
        }
        if let Some(refined) = &self.run.refined
            && self.ticked != refined.generation
        {
            self.ticked = refined.generation;
            self.ticks = vec![true; refined.answer.effects.len()];
            self.chosen = Some(refined.answer.model.clone());
        }
        if answered {
            self.step = match (question, self.found().map(|found| found.verdict)) {
                (Question::Residual, _) => Step::Residual,
                (Question::Refine | Question::Demo, Some(Verdict::DataUnfit)) => Step::Health,
                (Question::Refine | Question::Demo, _) => Step::Add,
            };
        }
        Some(said)
    }
}

impl Page for RefineTab {
    fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let side = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(10, 6));
        let states = self.states(context.session);
        Panel::top("steps of the loop").frame(side).show(ui, |ui| strip::ui(&mut self.step, &states, ui));
        let panes = [
            Pane::left(Part::Sources, "Logs and search", 330.0, 280.0..=480.0)
                .in_front(self.sources.focus_path || self.saver.focus_path),
            Pane::middle(Part::Step, "Step of the loop", 380.0),
        ];
        panes_ui(ui, "refine", &panes, |part, ui| match part {
            Part::Sources => {
                self.sources.ui(context, ui);
                form::ui(context, &mut self.settings, &self.sources, &self.run, ui);
                self.commands_ui(context, ui);
                if self.run.refined.is_some() {
                    save::ui(&mut self.saver, context, ui);
                }
            }
            Part::Step => self.step_pane_ui(context, ui),
        });
    }

    fn snapshot(&self, context: &ViewContext<'_>) -> Value {
        let standing = self.standing_of_refined(context.session).map(|standing| match standing {
            Standing::Fresh => "fresh",
            Standing::InModel => "in_model",
            Standing::Stale(_) => "stale",
        });
        let command = self
            .run
            .refined
            .as_ref()
            .map(|refined| refined.made.command_line(Question::Refine, refined.model_path.as_deref()));
        json!({
            "step": self.step.key(),
            "logs": self.sources.snapshot(),
            "running": self.run.running().map(|(question, _)| question.name()),
            "problem": self.run.problem,
            "residual": self.run.residual.as_ref().map(|residual| &residual.answer),
            "refinement": self.found(),
            "ticks": self.ticks,
            "truth": self.run.truth,
            "standing": standing,
            "command": command,
        })
    }

    fn command_line(&self, context: &ViewContext<'_>) -> Result<String, String> {
        match form::why_not(&self.sources) {
            Some(why_not) => Err(why_not.to_owned()),
            None => Ok(self.made(context.session).command_line(Question::Refine, context.model_path)),
        }
    }

    fn drain(&mut self) -> Vec<Said> {
        self.drain_jobs().into_iter().chain(self.saver.drain().map(said)).collect()
    }

    fn focus_path(&mut self) -> bool {
        self.sources.focus_path();
        true
    }

    fn suggested_name(&self, purpose: FilePurpose) -> Option<String> {
        match purpose {
            FilePurpose::Refine(RefineFile::Save(saved_as)) => {
                Some(format!("refined.{}", saved_as.extension()))
            }
            _ => None,
        }
    }

    fn note_dialog_problem(&mut self, purpose: FilePurpose, problem: &str) {
        match purpose {
            FilePurpose::Refine(RefineFile::Log) => self.sources.dialog_problem = Some(problem.to_owned()),
            FilePurpose::Refine(RefineFile::Save(_)) => self.saver.problem = Some(problem.to_owned()),
            _ => {}
        }
    }
}

/// The panes under the steps.
#[derive(Clone, Copy)]
enum Part {
    Sources,
    Step,
}

/// The way into the session's model.
fn use_ui(context: &ViewContext<'_>, standing: Option<Standing>, ticked: bool, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        let ready = ticked && matches!(standing, Some(Standing::Fresh));
        let text = RichText::new("Use in the model").strong();
        let button = egui::Button::new(text).fill(ui.visuals().selection.bg_fill);
        let help = "Add the selected effects and the corrected parameters to the model of this window";
        if ui.add_enabled(ready, button).on_hover_text(help).clicked() {
            context.commands.send(RefineCommand::Use);
        }
        match standing {
            Some(Standing::InModel) => {
                let color = palette(ui.visuals()).good;
                ui.label(RichText::new("Already in the model of this window.").color(color));
            }
            Some(Standing::Fresh) if !ticked => {
                hint_ui(ui, "No effect is selected.");
            }
            _ => {}
        }
    });
}

impl PageCommand for RefineCommand {
    fn apply(&self, pages: &mut Pages, around: Surroundings<'_>) -> Result<Done, String> {
        let page = &mut pages.refine;
        let mut done = Done::default();
        match self.clone() {
            Self::Load { path, held_out } => {
                // A path that means the same wherever the session is opened.
                let path = std::path::absolute(&path).unwrap_or(path);
                page.sources.load(&path, held_out, around.waker)?;
                done.log = Some(path);
            }
            Self::Clear => page.sources.list.clear(),
            Self::Remove(id) => page.sources.remove(id),
            Self::HoldOut(id, held_out) => page.sources.hold_out(id, held_out),
            Self::Start(question) => page.start(question, around)?,
            Self::Cancel => page.run.cancel(),
            Self::Use => {
                done.said = Some(page.put_into(around.session)?);
                done.step = "use effects in model";
            }
            Self::Simulate(scenario) => {
                pages.experiments.choose(scenario);
                done.tab = Some(Tab::Experiments);
            }
            Self::Save { saved_as, path, replace } => page.save(saved_as, path, replace, &around)?,
        }
        Ok(done)
    }
}
