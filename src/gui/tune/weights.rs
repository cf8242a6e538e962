//! The Q/R editor: one row a weight, with the deviation that it makes count as 1.

use egui::{Response, Slider, SliderClamping, Ui};
use flqr_core::lqr::Weights;

use super::matrices::matrices_ui;
use crate::command::Command;
use crate::context::ViewContext;
use crate::widgets::{hint_ui, mono, number_ui, section_ui, shown};

/// What one weight is about.
struct Row {
    name: &'static str,
    /// Unit of the deviation, and its size in SI.
    unit: &'static str,
    unit_si: f64,
    help: &'static str,
}

/// Range of the sliders; fields take any number.
const SMALLEST: f64 = 1e-4;
const LARGEST: f64 = 1e4;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

const Q_ROWS: [Row; 4] = [
    Row { name: "displacement", unit: "m", unit_si: 1.0, help: "Q₁₁, 1/m²" },
    Row { name: "velocity", unit: "m/s", unit_si: 1.0, help: "Q₂₂, s²/m²" },
    Row { name: "pitch", unit: "°", unit_si: DEGREE, help: "Q₃₃, 1/rad²" },
    Row { name: "pitch rate", unit: "°/s", unit_si: DEGREE, help: "Q₄₄, s²/rad²" },
];

const R_ROWS: [Row; 2] = [
    Row { name: "left torque", unit: "N m", unit_si: 1.0, help: "R₁₁, 1/(N m)²" },
    Row { name: "right torque", unit: "N m", unit_si: 1.0, help: "R₂₂, 1/(N m)²" },
];

/// State of the editor.
pub(super) struct WeightEditor {
    full_matrices: bool,
    link_motors: bool,
    pub(super) focus_first: bool,
}

impl Default for WeightEditor {
    fn default() -> Self {
        Self { full_matrices: false, link_motors: true, focus_first: false }
    }
}

impl WeightEditor {
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Weights", |ui| {
            let help = "Back to the weights of the loaded model";
            if ui.small_button("Reset weights").on_hover_text(help).clicked() {
                context.commands.send(Command::ResetWeights);
            }
        });
        let before = context.session.weights();
        let mut weights = before;
        self.rows_ui(context, ui, &mut weights);
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.link_motors, "Same for both motors")
                .on_hover_text("Both torques have the same weight, so both rows of K are equal");
            ui.checkbox(&mut self.full_matrices, "Full matrices")
                .on_hover_text("Edit the entries off the diagonals too");
        });
        if !self.full_matrices && !before.is_diagonal() {
            hint_ui(ui, "Entries off the diagonals follow these weights: see “Full matrices”.");
        }
        if self.full_matrices {
            matrices_ui(context, ui, &mut weights);
        }
        if weights != before {
            context.commands.send(Command::SetWeights(weights));
        }
    }

    fn rows_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui, weights: &mut Weights) {
        egui::Grid::new("weights").num_columns(4).spacing([8.0, 4.0]).show(ui, |ui| {
            ui.label("");
            hint_ui(ui, "weight");
            ui.label("");
            hint_ui(ui, "counts as 1").on_hover_text(
                "Bryson's rule: the deviation whose square, times the weight, is 1. Choose the largest deviation that you accept.",
            );
            ui.end_row();
            for (index, row) in Q_ROWS.iter().enumerate() {
                let focus = index == 0 && std::mem::take(&mut self.focus_first);
                let before = weights.q[(index, index)];
                let mut weight = before;
                row_ui(context, ui, row, &mut weight, focus);
                if weight != before {
                    weights.set_state_weight(index, weight);
                }
            }
            let old = [weights.r[(0, 0)], weights.r[(1, 1)]];
            for (index, row) in R_ROWS.iter().enumerate() {
                row_ui(context, ui, row, &mut weights.r[(index, index)], false);
            }
            if self.link_motors {
                link(weights, old);
            }
        });
    }
}

/// The motor that was not changed follows the one that was.
fn link(weights: &mut Weights, old: [f64; 2]) {
    let changed = usize::from(weights.r[(0, 0)] == old[0]);
    if weights.r[(changed, changed)] != old[changed] {
        let value = weights.r[(changed, changed)];
        weights.r[(1 - changed, 1 - changed)] = value;
    }
}

fn row_ui(context: &ViewContext<'_>, ui: &mut Ui, row: &Row, weight: &mut f64, focus: bool) {
    ui.label(row.name).on_hover_text(row.help);
    let slider = Slider::new(weight, SMALLEST..=LARGEST)
        .logarithmic(true)
        .smallest_positive(SMALLEST)
        .clamping(SliderClamping::Never)
        .show_value(false);
    let slider = ui.add(slider).accessible_name(format!("{} weight slider", row.name));
    begin_drag(context, &slider);
    slider.on_hover_text(row.help);
    let field = number_ui(ui, weight, &format!("{} weight", row.name), 58.0);
    begin_drag(context, &field);
    if field.gained_focus() {
        context.commands.send(Command::BeginWeightDrag);
    }
    if focus {
        field.request_focus();
    }
    field.on_hover_text(row.help);
    let deviation = 1.0 / weight.sqrt() / row.unit_si;
    let text = if deviation.is_finite() { shown(deviation, 3) } else { "–".to_owned() };
    ui.label(mono(format!("{text} {}", row.unit)));
    ui.end_row();
}

fn begin_drag(context: &ViewContext<'_>, response: &Response) {
    if response.drag_started() {
        context.commands.send(Command::BeginWeightDrag);
    }
}
