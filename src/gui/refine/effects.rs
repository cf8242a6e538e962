//! Identified effects and their use in the model.

use egui::{Frame, Grid, RichText, Ui};
use flqr_core::effects::Place;
use flqr_core::refine::{Found, NextExperiment, Refinement, Truth, Unexplained, Verdict};
use flqr_core::report::capitalised;
use flqr_core::simulate::Scenario;

use super::command::RefineCommand;
use super::run::verdict_text;
use super::strip::{StepState, Tone};
use crate::context::ViewContext;
use crate::theme::palette;
use crate::widgets::{hint_ui, mono, section_ui, shown, warning_ui};

/// State of this step.
pub(super) fn state(found: Option<&Refinement>, in_model: bool) -> StepState {
    let Some(found) = found else { return StepState::new("nothing yet", Tone::Open) };
    match (found.verdict, found.effects.len()) {
        (Verdict::DataUnfit, _) => StepState::new("log not suitable for identification", Tone::Error),
        (Verdict::UnexplainedResidual, _) => StepState::new("unexplained", Tone::Warning),
        (_, 0) => StepState::new("no missing effects", Tone::Good),
        (_, _) if in_model => StepState::new("in the model", Tone::Good),
        (_, 1) => StepState::new("1 effect found", Tone::Plain),
        (_, count) => StepState::new(format!("{count} effects found"), Tone::Plain),
    }
}

/// The answer in one line.
pub(super) fn verdict_ui(found: &Refinement, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    let color = match found.verdict {
        Verdict::ModelAdequate => colors.good,
        Verdict::EffectsFound => colors.accent,
        Verdict::UnexplainedResidual => colors.warning,
        Verdict::DataUnfit => colors.error,
    };
    let text = RichText::new(format!("{}.", verdict_text(found))).heading().color(color);
    ui.add(egui::Label::new(text).wrap());
}

/// Hidden effect of the demo robot.
pub(super) fn truth_ui(truth: &Truth, ui: &mut Ui) {
    let parameters = truth.effect.parameters().iter();
    let sizes: Vec<String> = parameters.map(|(key, value)| format!("{key} {}", shown(*value, 3))).collect();
    let verdict = if truth.named { "It was identified." } else { "It was not identified." };
    let id = truth.effect.id();
    hint_ui(ui, format!("The simulated robot has {id}: {}. {verdict}", sizes.join(", ")));
}

/// One effect: what it is, its size, what this log cannot tell from it, and whether it is to be added.
pub(super) fn effect_ui(found: &Found, added: &mut bool, ui: &mut Ui) {
    let kind = found.effect.kind();
    Frame::group(ui.style()).show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.horizontal_wrapped(|ui| {
            let help = "Only selected effects are added to the model";
            let tick = ui.checkbox(added, "add it").on_hover_text(help);
            tick.accessible_name(format!("add {}", kind.id));
            ui.label(RichText::new(kind.id).strong().size(15.0));
            if let Some(motor) = found.effect.motor() {
                ui.label(RichText::new(format!("{motor} motor")).small());
            }
            if found.error_drop_percent.is_finite() {
                let text = format!("held-out error reduced by {} %", shown(found.error_drop_percent, 3));
                ui.label(RichText::new(text).color(palette(ui.visuals()).good));
            }
        });
        hint_ui(ui, format!("{}. Acts: {}.", capitalised(kind.summary), place_text(kind.place)));
        sizes_ui(found, ui);
        if !found.ambiguous_with.is_empty() {
            let others: Vec<&str> = found.ambiguous_with.iter().map(|kind| kind.id).collect();
            let text = format!("This log cannot distinguish it from {}.", others.join(", "));
            warning_ui(ui, text).on_hover_text(kind.separated_by);
        }
    });
}

/// Unexplained structure; returns the selected variable.
pub(super) fn unexplained_ui(unexplained: &Unexplained, ui: &mut Ui) -> Option<String> {
    if unexplained.description.is_empty() {
        return None;
    }
    section_ui(ui, "Unexplained", |_| {});
    warning_ui(ui, format!("{}.", capitalised(&unexplained.description)));
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        for (index, variable) in unexplained.depends_on.iter().enumerate() {
            let share = unexplained.fractions.get(index).filter(|share| share.is_finite());
            let share = share.map_or_else(String::new, |share| format!(", {} %", shown(100.0 * share, 3)));
            let look = ui.button(format!("over {variable}{share}"));
            if look.on_hover_text("Plot the residual over this variable").clicked() {
                chosen = Some(variable.clone());
            }
        }
    });
    chosen
}

/// Next experiment.
pub(super) fn next_ui(context: &ViewContext<'_>, next: &NextExperiment, ui: &mut Ui) {
    section_ui(ui, "Next experiment", |_| {});
    ui.add(egui::Label::new(format!("{}.", capitalised(&next.summary))).wrap());
    if next.separation.is_finite() && next.separation > 0.0 {
        let separation = shown(next.separation, 3);
        hint_ui(ui, format!("The residuals would differ by {separation} standard deviations of the noise."));
    }
    ui.horizontal_wrapped(|ui| {
        let scenario = next.scenario.as_deref().and_then(|name| name.parse::<Scenario>().ok());
        if let Some(scenario) = scenario {
            let start = ui.button("Start on the simulated robot");
            let help = format!("Go to the experiments with “{}”", scenario.title());
            if start.on_hover_text(help).clicked() {
                context.commands.send(RefineCommand::Simulate(scenario));
            }
        }
        if let Some(command) = &next.command
            && ui.button("Copy its command").on_hover_text(command).clicked()
        {
            ui.ctx().copy_text(command.clone());
        }
    });
}

fn sizes_ui(found: &Found, ui: &mut Ui) {
    let id = (found.effect.id(), found.effect.motor().map(|motor| motor.to_string()));
    Grid::new(id).num_columns(4).striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
        hint_ui(ui, "parameter");
        hint_ui(ui, "value");
        hint_ui(ui, "95 % interval");
        hint_ui(ui, "unit");
        ui.end_row();
        let rows = found.effect.parameters().iter().zip(&found.ci95).zip(&found.units);
        for (((key, value), ci95), unit) in rows {
            ui.add(egui::Label::new(mono(key)).extend());
            ui.label(mono(shown(*value, 4)));
            let interval = ci95.map_or_else(
                || "–".to_owned(),
                |[low, high]| format!("{} … {}", shown(low, 4), shown(high, 4)),
            );
            ui.add(egui::Label::new(mono(interval)).extend());
            ui.label(if *unit == "1" { "" } else { *unit });
            ui.end_row();
        }
    });
}

/// Describes the location of an effect.
pub(super) fn place_text(place: Place) -> &'static str {
    match place {
        Place::Motor => "torque inside the motor",
        Place::Translation => "force on the robot",
        Place::Pitch => "torque on the body",
        Place::Actuator => "between the commanded torque and the shaft torque",
        Place::Sensor => "in the sensors",
        Place::Parameter => "in a declared parameter",
    }
}
