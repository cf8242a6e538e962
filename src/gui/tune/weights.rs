//! The Q/R editor: one row a weight, with the deviation that it makes count as 1.

use std::ops::RangeInclusive;

use egui::{Button, Ui};
use flqr_core::model::Weights;

use super::matrices::matrices_ui;
use crate::command::Command;
use crate::context::ViewContext;
use crate::log_slider::{HELP, log_slider_ui, rounded};
use crate::plot::{Unit, UnitChoice};
use crate::quantity::STATES;
use crate::widgets::{choice_ui, hint_ui, number_ui, section_ui};

/// Description of one weight.
struct Row {
    name: &'static str,
    /// Unit of the deviation.
    unit: Unit,
    help: &'static str,
}

/// Range of the sliders; fields take any number.
const SLIDERS: RangeInclusive<f64> = 1e-4..=1e4;

const Q_ROWS: [Row; 4] = [
    Row { name: STATES[0], unit: Unit::Plain("m"), help: "Q₁₁, 1/m²" },
    Row { name: STATES[1], unit: Unit::Plain("m/s"), help: "Q₂₂, s²/m²" },
    Row { name: STATES[2], unit: Unit::Angle, help: "Q₃₃, 1/rad²" },
    Row { name: STATES[3], unit: Unit::AngularSpeed, help: "Q₄₄, s²/rad²" },
];

const R_ROWS: [Row; 2] = [
    Row { name: "left torque", unit: Unit::Torque(None), help: "R₁₁, 1/(N m)²" },
    Row { name: "right torque", unit: Unit::Torque(None), help: "R₂₂, 1/(N m)²" },
];

/// Steps that are offered, from the right to the left as they are drawn.
const STEPS: [(f64, &str, &str); 3] = [
    (0.25, "25 %", "The buttons − and + change a weight by 25 %"),
    (0.10, "10 %", "The buttons − and + change a weight by 10 %"),
    (0.05, "5 %", "The buttons − and + change a weight by 5 %"),
];

/// State of the editor.
pub(super) struct WeightEditor {
    full_matrices: bool,
    link_motors: bool,
    step: f64,
    pub(super) focus_first: bool,
}

impl Default for WeightEditor {
    fn default() -> Self {
        Self { full_matrices: false, link_motors: true, step: 0.10, focus_first: false }
    }
}

impl WeightEditor {
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        section_ui(ui, "Weights", |ui| {
            let help = "Reset all weights to the loaded model";
            let changed = context.session.weights() != context.saved.weights();
            let reset = ui.add_enabled(changed, Button::new("Reset").small());
            if reset.accessible_name("Reset weights").on_hover_text(help).clicked() {
                context.commands.send(Command::ResetWeights);
            }
            ui.separator();
            ui.scope(|ui| choice_ui(ui, &mut self.step, &STEPS));
            hint_ui(ui, "± step");
        });
        let before = context.session.weights();
        let mut weights = before;
        self.rows_ui(context, ui, &mut weights);
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.link_motors, "Same weight for both motors")
                .on_hover_text("The same weight for both torques; both rows of K are equal");
            ui.checkbox(&mut self.full_matrices, "Full matrices")
                .on_hover_text("Also edit off-diagonal entries");
        });
        if !self.full_matrices && !before.is_diagonal() {
            hint_ui(ui, "Off-diagonal entries scale with these weights, see “Full matrices”.");
        }
        if self.full_matrices {
            matrices_ui(ui, &mut weights);
        }
        if weights != before {
            context.commands.send(Command::SetWeights(weights));
        }
    }

    fn rows_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui, weights: &mut Weights) {
        let saved = context.saved.weights();
        egui::Grid::new("weights").num_columns(6).spacing([6.0, 4.0]).show(ui, |ui| {
            ui.label("");
            ui.label("");
            hint_ui(ui, "weight");
            hint_ui(ui, "max. deviation").on_hover_text(
                "Bryson's rule: weight = 1 / (max. deviation)². Set the largest acceptable deviation.",
            );
            ui.end_row();
            for (index, row) in Q_ROWS.iter().enumerate() {
                let focus = index == 0 && std::mem::take(&mut self.focus_first);
                let before = weights.q[(index, index)];
                let mut weight = before;
                self.row_ui(ui, row, (&mut weight, saved.q[(index, index)]), focus);
                if weight != before {
                    weights.set_state_weight(index, weight);
                }
            }
            let old = [weights.r[(0, 0)], weights.r[(1, 1)]];
            for (index, row) in R_ROWS.iter().enumerate() {
                let entry = (index, index);
                self.row_ui(ui, row, (&mut weights.r[entry], saved.r[entry]), false);
            }
            if self.link_motors {
                link(weights, old);
            }
        });
    }

    fn row_ui(&self, ui: &mut Ui, row: &Row, (weight, saved): (&mut f64, f64), focus: bool) {
        ui.label(row.name).on_hover_text(row.help);
        ui.spacing_mut().slider_width = 52.0;
        let slider = log_slider_ui(ui, weight, &SLIDERS, &format!("{} weight slider", row.name));
        slider.on_hover_text(format!("{}\n{HELP}", row.help));
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            self.step_ui(ui, row, weight, Step::Down);
            let field = number_ui(ui, weight, &format!("{} weight", row.name), 76.0);
            if focus {
                field.request_focus();
            }
            field.on_hover_text(row.help);
            self.step_ui(ui, row, weight, Step::Up);
        });
        deviation_ui(ui, row, weight);
        let changed = *weight != saved;
        let reset = ui.add_enabled(changed, Button::new("↺").small().frame(false));
        let reset = reset.accessible_name(format!("reset {} weight", row.name));
        if reset
            .on_hover_text(format!("Reset to {} (loaded value)", crate::widgets::plain(saved, 4)))
            .clicked()
        {
            *weight = saved;
        }
        ui.end_row();
    }

    fn step_ui(&self, ui: &mut Ui, row: &Row, weight: &mut f64, step: Step) {
        let (sign, word, factor) = match step {
            Step::Down => ("−", "less", 1.0 / (1.0 + self.step)),
            Step::Up => ("+", "more", 1.0 + self.step),
        };
        let button = Button::new(sign).small().min_size(egui::vec2(18.0, 20.0));
        let button = ui.add(button).accessible_name(format!("{word} {} weight", row.name));
        if button.on_hover_text(format!("{:.0} % {word} weight on {}", 100.0 * self.step, row.name)).clicked()
        {
            *weight = rounded(*weight * factor);
        }
    }
}

/// Which way a step goes.
#[derive(Clone, Copy)]
enum Step {
    Down,
    Up,
}

/// The motor that was not changed follows the one that was.
fn link(weights: &mut Weights, old: [f64; 2]) {
    let changed = usize::from(weights.r[(0, 0)] == old[0]);
    if weights.r[(changed, changed)] != old[changed] {
        let value = weights.r[(changed, changed)];
        weights.r[(1 - changed, 1 - changed)] = value;
    }
}

/// The deviation that max. deviation, as another way to say the weight.
fn deviation_ui(ui: &mut Ui, row: &Row, weight: &mut f64) {
    let (unit, scale) = row.unit.shown(UnitChoice::of(ui.ctx()));
    let before = scale / weight.sqrt();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        if !before.is_finite() {
            ui.weak("–").on_hover_text("No max. deviation for a weight of 0 or below");
            return;
        }
        let mut deviation = before;
        let field = number_ui(ui, &mut deviation, &format!("{} deviation", row.name), 52.0);
        field.on_hover_text(format!(
            "Max. deviation of {} (Bryson's rule): weight = 1/deviation², in SI units",
            row.name
        ));
        ui.label(egui::RichText::new(unit).small());
        if deviation != before && deviation > 0.0 {
            *weight = (scale / deviation).powi(2);
        }
    });
}
