//! Q and R in full, for those who want entries off the diagonal.

use egui::Ui;
use flqr_core::lqr::Weights;

use crate::command::Command;
use crate::context::ViewContext;
use crate::widgets::{hint_ui, number_ui};

const STATES: [&str; 4] = ["displacement", "velocity", "pitch", "pitch rate"];
const MOTORS: [&str; 2] = ["left", "right"];

/// Edits both matrices; they stay symmetric by construction.
pub(super) fn matrices_ui(context: &ViewContext<'_>, ui: &mut Ui, weights: &mut Weights) {
    hint_ui(ui, "Q in SI units, symmetric: one entry changes its mirror image too");
    egui::Grid::new("q").spacing([4.0, 4.0]).show(ui, |ui| {
        for row in 0..4 {
            for column in 0..4 {
                let name = format!("Q {}, {}", STATES[row], STATES[column]);
                let mut value = weights.q[(row, column)];
                if entry_ui(context, ui, &mut value, &name) {
                    weights.q[(row, column)] = value;
                    weights.q[(column, row)] = value;
                }
            }
            ui.end_row();
        }
    });
    hint_ui(ui, "R, 1/(N m)²");
    egui::Grid::new("r").spacing([4.0, 4.0]).show(ui, |ui| {
        for row in 0..2 {
            for column in 0..2 {
                let name = format!("R {}, {}", MOTORS[row], MOTORS[column]);
                let mut value = weights.r[(row, column)];
                if entry_ui(context, ui, &mut value, &name) {
                    weights.r[(row, column)] = value;
                    weights.r[(column, row)] = value;
                }
            }
            ui.end_row();
        }
    });
}

fn entry_ui(context: &ViewContext<'_>, ui: &mut Ui, value: &mut f64, name: &str) -> bool {
    let before = *value;
    let field = number_ui(ui, value, name, 62.0).on_hover_text(name);
    if field.drag_started() || field.gained_focus() {
        context.commands.send(Command::BeginWeightDrag);
    }
    *value != before
}
