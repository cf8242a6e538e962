//! Gains of the active design, and the controller that they are part of.

use egui::{Grid, RichText, Ui};
use flqr_core::control::ControllerKind;
use flqr_core::lqr::LqrDesign;

use crate::command::Command;
use crate::context::ViewContext;
use crate::design::Designed;
use crate::theme::palette;
use crate::widgets::{choice_ui, error_ui, hint_ui, mono, number_ui, section_ui, shown, warning_ui};

/// Gains of the states, with their units.
const COLUMNS: [(&str, &str); 4] = [
    ("displ.", "N m per m of displacement"),
    ("veloc.", "N m per m/s of velocity"),
    ("pitch", "N m per rad of pitch"),
    ("rate", "N m per rad/s of pitch rate"),
];

/// Results of the weights.
pub(super) fn ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let designer = context.designer;
    section_ui(ui, "Gains", |ui| {
        hint_ui(ui, format!("{:.1} µs", 1e6 * designer.solve_s))
            .on_hover_text("Computing time of the last design");
        if let Some(designed) = &designer.in_force {
            hint_ui(ui, format!("residual {}", shown(designed.design.riccati_residual, 2)))
                .on_hover_text("Riccati residual: norm of AᵀP + PA − PBR⁻¹BᵀP + Q relative to the norm of P");
        }
    });
    if let Some(problem) = &designer.problem {
        error_ui(ui, format!("No design: {problem}."));
        if designer.in_force.is_some() {
            warning_ui(ui, "The last valid gains remain active and are shown here.");
        }
    }
    if let Some(designed) = &designer.in_force {
        gain_table_ui(context, ui, designed);
    }
}

fn gain_table_ui(context: &ViewContext<'_>, ui: &mut Ui, designed: &Designed) {
    let reference = context.designer.different();
    let active = context.designer.active;
    Grid::new("gains").num_columns(5).spacing([16.0, 3.0]).min_col_width(48.0).show(ui, |ui| {
        hint_ui(ui, "motor");
        for (name, unit) in COLUMNS {
            hint_ui(ui, name).on_hover_text(unit);
        }
        ui.end_row();
        let name = if reference.is_some() { active.name() } else { "" };
        gain_rows_ui(ui, &designed.design, name, palette(ui.visuals()).accent);
        if let Some(reference) = reference {
            gain_rows_ui(ui, &reference.design, active.other().name(), palette(ui.visuals()).reference);
        }
    });
}

fn gain_rows_ui(ui: &mut Ui, design: &LqrDesign, prefix: &str, color: egui::Color32) {
    let equal = rows_are_equal(design);
    let rows: &[(usize, &str)] = if equal { &[(0, "each")] } else { &[(0, "left"), (1, "right")] };
    for (row, name) in rows {
        let name = if prefix.is_empty() { (*name).to_owned() } else { format!("{prefix} {name}") };
        ui.label(RichText::new(name).small().weak());
        for column in 0..4 {
            ui.label(mono(shown(design.gain[(*row, column)], 4)).color(color));
        }
        ui.end_row();
    }
}

/// Returns whether both motors get the same torque, to the precision of the design.
fn rows_are_equal(design: &LqrDesign) -> bool {
    (0..4).all(|column| {
        let (left, right) = (design.gain[(0, column)], design.gain[(1, column)]);
        (left - right).abs() <= 1e-9 * left.abs().max(right.abs())
    })
}

/// LQR or FLQR, and how much friction is fed forward, in one row.
pub(super) fn controller_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let before = context.session.compensation();
    let mut compensation = before;
    let active = context.session.controller == ControllerKind::Flqr;
    ui.horizontal(|ui| {
        let mut kind = context.session.controller;
        let choices = [
            (ControllerKind::Lqr, "LQR", "State feedback only"),
            (ControllerKind::Flqr, "FLQR", "State feedback plus friction feedforward"),
        ];
        ui.scope(|ui| {
            if choice_ui(ui, &mut kind, &choices) {
                context.commands.send(Command::SetController(kind));
            }
        });
        ui.add_enabled_ui(active, |ui| {
            ui.spacing_mut().item_spacing.x = 5.0;
            ui.label("ratio");
            number_ui(ui, &mut compensation.ratio, "compensation ratio", 44.0)
                .on_hover_text("Fraction of the friction compensated by feedforward");
            ui.label("smoothing");
            number_ui(ui, &mut compensation.smoothing_speed_rad_s, "smoothing speed", 44.0)
                .on_hover_text("Smoothing speed of the friction direction, to avoid chatter at standstill");
            ui.label(RichText::new("rad/s").small());
        });
    });
    if compensation != before {
        match compensation.validate() {
            Ok(()) => context.commands.send(Command::SetCompensation(compensation)),
            Err(problem) => context.commands.send(Command::Say(format!("Not accepted: {problem}."))),
        }
    }
    if let Some(problem) = context.session.feedforward_problem().filter(|_| active) {
        warning_ui(ui, problem);
    }
}
