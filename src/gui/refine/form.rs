//! Search settings: free parameters, seed, and the buttons that start and stop the search.

use egui::{Button, Grid, ProgressBar, RichText, TextEdit, Ui, vec2};
use flqr_core::model::{Motor, Rig};

use super::command::RefineCommand;
use super::run::{Question, Run, Settings, is_of_demo};
use super::sources::Sources;
use crate::context::ViewContext;
use crate::widgets::{choice_ui, entry_ui, error_ui, hint_ui, section_ui};

pub(super) fn ui(
    context: &ViewContext<'_>,
    settings: &mut Settings,
    sources: &Sources,
    run: &Run,
    ui: &mut Ui,
) {
    section_ui(ui, "Search", |_| {});
    ui.add_enabled_ui(run.running().is_none(), |ui| {
        let grid = Grid::new("refine settings").num_columns(2).spacing([12.0, 4.0]);
        grid.show(ui, |ui| settings_ui(context, settings, ui));
    });
    ui.add_space(2.0);
    run_ui(context, sources, run, ui);
    if let Some(problem) = &run.problem {
        error_ui(ui, problem);
    }
}

fn settings_ui(context: &ViewContext<'_>, settings: &mut Settings, ui: &mut Ui) {
    ui.label("model");
    ui.add(egui::Label::new(RichText::new(&context.session.name).strong()).truncate())
        .on_hover_text("Current model of this window");
    ui.end_row();
    if matches!(context.session.rig, Rig::Robot(_)) {
        ui.label("motor");
        ui.horizontal(|ui| {
            let help = "Motor that a bench log belongs to";
            choice_ui(ui, &mut settings.motor, &[(Motor::Left, "left", help), (Motor::Right, "right", help)]);
        });
        ui.end_row();
    }
    ui.label("free");
    let field = TextEdit::singleline(&mut settings.estimate).hint_text("none").desired_width(180.0);
    ui.add(field).accessible_name("free parameters").on_hover_text(
        "Parameters to estimate without prior: “all”, or names as in the model file, separated by commas. The others are estimated within their tolerances",
    );
    ui.end_row();
    ui.label("seed");
    entry_ui(ui, &mut settings.seed, "seed of the search", |field| field)
        .on_hover_text("The same model, logs and seed give the same result");
    ui.end_row();
}

fn run_ui(context: &ViewContext<'_>, sources: &Sources, run: &Run, ui: &mut Ui) {
    let send = |command| context.commands.send(command);
    if let Some((question, share)) = run.running() {
        if ui.button("Cancel search").on_hover_text("Stop it (Ctrl+Enter)").clicked() {
            send(RefineCommand::Cancel);
        }
        let name = match question {
            Question::Residual => "residual",
            Question::Refine => "search",
            Question::Demo => "demonstration",
        };
        let text = RichText::new(format!("{name} {:.0} %", 100.0 * share)).small();
        ui.add(ProgressBar::new(share as f32).text(text)).accessible_name("progress of the search");
        return;
    }
    let why_not = why_not(sources);
    let fill = ui.visuals().selection.bg_fill;
    let text = RichText::new("Find missing effects").strong();
    let size = vec2(ui.available_width(), 26.0);
    ui.add_enabled_ui(why_not.is_none(), |ui| {
        let search = ui.add_sized(size, Button::new(text).fill(fill));
        let help = "Find effects that the model lacks (Ctrl+Enter)";
        if search.on_hover_text(help).clicked() {
            send(RefineCommand::Start(Question::Refine));
        }
        let residual = ui.add_sized(size, Button::new("Compute residual"));
        if residual.on_hover_text("Residual only, without a search").clicked() {
            send(RefineCommand::Start(Question::Residual));
        }
    });
    if let Some(why_not) = why_not {
        hint_ui(ui, why_not);
    }
    demo_ui(context, sources, ui);
}

/// The whole loop without a file.
fn demo_ui(context: &ViewContext<'_>, sources: &Sources, ui: &mut Ui) {
    let ready = is_of_demo(&context.session.model()) && !sources.is_loading();
    let demo = ui.add_enabled(ready, Button::new("Try it on a demo robot"));
    let help = "Simulates a robot with a hidden effect, selected by the seed, and identifies it. Replaces the logs in the list";
    let why_not = "Needs the unchanged preset of the paper's robot: load it on the Tune page";
    if demo.on_hover_text(help).on_disabled_hover_text(why_not).clicked() {
        context.commands.send(RefineCommand::Start(Question::Demo));
    }
}

/// Reason why no search can start now.
pub(super) fn why_not(sources: &Sources) -> Option<&'static str> {
    if sources.is_loading() {
        return Some("A log is still being loaded.");
    }
    if sources.loaded().all(|(source, _)| source.held_out) {
        return Some("Needs a log that is not held out.");
    }
    None
}
