//! Q and R in full, for those who want entries off the diagonal.

use egui::Ui;
use flqr_core::model::Weights;
use nalgebra::SMatrix;

use crate::quantity::{MOTORS, STATES};
use crate::widgets::{hint_ui, number_ui};

/// Edits both matrices; they stay symmetric by construction.
pub(super) fn matrices_ui(ui: &mut Ui, weights: &mut Weights) {
    hint_ui(ui, "Q in SI units, symmetric: one entry changes its mirror image too");
    symmetric_ui(ui, "Q", STATES, &mut weights.q);
    hint_ui(ui, "R, 1/(N m)²");
    symmetric_ui(ui, "R", MOTORS, &mut weights.r);
}

fn symmetric_ui<const N: usize>(
    ui: &mut Ui,
    letter: &str,
    names: [&str; N],
    matrix: &mut SMatrix<f64, N, N>,
) {
    egui::Grid::new(letter).spacing([4.0, 4.0]).show(ui, |ui| {
        ui.label("");
        for name in names {
            hint_ui(ui, name);
        }
        ui.end_row();
        for (row, row_name) in names.iter().enumerate() {
            hint_ui(ui, *row_name);
            for (column, column_name) in names.iter().enumerate() {
                let mut value = matrix[(row, column)];
                if entry_ui(ui, &mut value, &format!("{letter} {row_name}, {column_name}")) {
                    matrix[(row, column)] = value;
                    matrix[(column, row)] = value;
                }
            }
            ui.end_row();
        }
    });
}

fn entry_ui(ui: &mut Ui, value: &mut f64, name: &str) -> bool {
    let before = *value;
    number_ui(ui, value, name, 46.0).on_hover_text(name);
    *value != before
}
