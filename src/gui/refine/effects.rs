//! What was found, and its way into the model.

use egui::{Frame, Grid, RichText, Ui};
use flqr_core::effects::Place;
use flqr_core::refine::{Found, Refinement, Verdict};

use super::run::verdict_text;
use super::strip::{StepState, Tone};
use crate::theme::palette;
use crate::widgets::{hint_ui, mono, shown};

/// How this step stands.
pub(super) fn state(found: Option<&Refinement>, in_model: bool) -> StepState {
    let Some(found) = found else { return StepState::new("nothing yet", Tone::Open) };
    match (found.verdict, found.effects.len()) {
        (Verdict::DataUnfit, _) => StepState::new("data unfit", Tone::Error),
        (Verdict::UnexplainedResidual, _) => StepState::new("unexplained", Tone::Warning),
        (_, 0) => StepState::new("nothing is missing", Tone::Good),
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

/// One effect: what it is, its size, and what this log cannot tell from it.
pub(super) fn effect_ui(found: &Found, ui: &mut Ui) {
    let kind = found.effect.kind();
    Frame::group(ui.style()).show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(kind.id).strong());
            if let Some(motor) = found.effect.motor() {
                ui.label(RichText::new(format!("{motor} motor")).small());
            }
            hint_ui(ui, place_text(kind.place));
            if found.error_drop_percent.is_finite() {
                let text = format!("held-out error lower by {} %", shown(found.error_drop_percent, 3));
                ui.label(RichText::new(text).color(palette(ui.visuals()).good));
            }
        });
        hint_ui(ui, format!("{}.", kind.summary));
        sizes_ui(found, ui);
        if !found.ambiguous_with.is_empty() {
            let others: Vec<&str> = found.ambiguous_with.iter().map(|kind| kind.id).collect();
            let text = format!("This log cannot tell it from {}.", others.join(", "));
            crate::widgets::warning_ui(ui, text).on_hover_text(kind.separated_by);
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

/// Where an effect sits, in words.
pub(super) fn place_text(place: Place) -> &'static str {
    match place {
        Place::Motor => "torque inside the motor",
        Place::Translation => "force on the robot",
        Place::Pitch => "torque on the body",
        Place::Actuator => "between the torque asked for and the one on the shaft",
        Place::Sensor => "in what the sensors say",
        Place::Parameter => "in a declared number",
    }
}
