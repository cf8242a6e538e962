//! Gains, poles and residual of the design in force, and the friction feedforward.

use egui::{Grid, RichText, Slider, SliderClamping, Ui};
use flqr_core::control::ControllerKind;
use flqr_core::lqr::LqrDesign;

use crate::command::Command;
use crate::context::ViewContext;
use crate::design::Designed;
use crate::theme::palette;
use crate::widgets::{choice_ui, error_ui, hint_ui, mono, number_ui, plain, section_ui, shown, warning_ui};

/// Gains of the states, with their units.
const COLUMNS: [(&str, &str); 4] = [
    ("displ.", "N m per m of displacement"),
    ("veloc.", "N m per m/s of velocity"),
    ("pitch", "N m per rad of pitch"),
    ("rate", "N m per rad/s of pitch rate"),
];

/// What follows from the weights.
pub(super) fn ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let designer = context.designer;
    section_ui(ui, "Gains", |ui| comparison_buttons_ui(context, ui));
    if let Some(problem) = &designer.problem {
        error_ui(ui, format!("No design: {problem}."));
        if designer.in_force.is_some() {
            warning_ui(ui, "The last good gains stay in force; they are shown here.");
        }
    }
    let Some(designed) = &designer.in_force else { return };
    gain_table_ui(context, ui, designed);
    poles_ui(ui, &designed.design);
    margins_ui(ui, designed);
    ui.horizontal(|ui| {
        hint_ui(ui, format!("Riccati residual {}", shown(designed.design.riccati_residual, 2)))
            .on_hover_text(
                "Norm of AᵀP + PA − PBR⁻¹BᵀP + Q relative to that of P: how exact the solution is",
            );
        hint_ui(ui, format!("solved in {:.1} µs", 1e6 * designer.solve_s))
            .on_hover_text("Duration of the last design, from the weights to gains, poles and residual");
    });
}

fn comparison_buttons_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let designer = context.designer;
    let back = ui.add_enabled(designer.reference.is_some(), egui::Button::new("Back to A").small());
    if back.on_hover_text("Take the weights of A again").clicked() {
        context.commands.send(Command::RestoreReference);
    }
    let mut kept = designer.reference_is_kept;
    let help = "Keep the present gains as A. Otherwise A is what was in force when the last drag began.";
    if ui.toggle_value(&mut kept, "Keep as A").on_hover_text(help).changed() {
        context.commands.send(if kept { Command::KeepReference } else { Command::ReleaseReference });
    }
}

fn gain_table_ui(context: &ViewContext<'_>, ui: &mut Ui, designed: &Designed) {
    let reference = context.designer.reference.filter(|reference| reference.design != designed.design);
    Grid::new("gains").num_columns(5).spacing([10.0, 3.0]).min_col_width(48.0).show(ui, |ui| {
        hint_ui(ui, "motor");
        for (name, unit) in COLUMNS {
            hint_ui(ui, name).on_hover_text(unit);
        }
        ui.end_row();
        gain_rows_ui(ui, &designed.design, "", palette(ui.visuals()).accent);
        if let Some(reference) = reference {
            gain_rows_ui(ui, &reference.design, "A ", palette(ui.visuals()).reference);
        }
    });
}

fn gain_rows_ui(ui: &mut Ui, design: &LqrDesign, prefix: &str, color: egui::Color32) {
    let equal = rows_are_equal(design);
    let rows: &[(usize, &str)] = if equal { &[(0, "each")] } else { &[(0, "left"), (1, "right")] };
    for (row, name) in rows {
        ui.label(RichText::new(format!("{prefix}{name}")).small().weak());
        for column in 0..4 {
            ui.label(mono(shown(design.gain[(*row, column)], 4)).color(color));
        }
        ui.end_row();
    }
}

/// Whether both motors get the same torque, to the precision of the design.
fn rows_are_equal(design: &LqrDesign) -> bool {
    (0..4).all(|column| {
        let (left, right) = (design.gain[(0, column)], design.gain[(1, column)]);
        (left - right).abs() <= 1e-9 * left.abs().max(right.abs())
    })
}

fn poles_ui(ui: &mut Ui, design: &LqrDesign) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 12.0;
        hint_ui(ui, "poles, 1/s").on_hover_text("Of the closed loop A − BK, without delay and friction");
        for text in pole_texts(design) {
            ui.label(mono(text));
        }
    });
}

/// What the loop bears as it runs: red where that is nothing, or less than the delay it has.
fn margins_ui(ui: &mut Ui, designed: &Designed) {
    let Designed { timing, margins, .. } = designed;
    let runs = format!(
        "1 kHz, {} ms of delay, IMU at {} Hz",
        plain(1e3 * timing.delay_s, 3),
        plain(1.0 / timing.imu_period_s, 3)
    );
    if !margins.stable {
        error_ui(
            ui,
            format!("Unstable as it runs ({runs}): less weight on the states, or more on the torques."),
        );
        return;
    }
    let error = palette(ui.visuals()).error;
    let tight = margins.delay_s < timing.delay_s;
    let up = if margins.gain_up.is_finite() { shown(margins.gain_up, 3) } else { "∞".to_owned() };
    let columns = [
        (
            "gain margin",
            format!("×{}…{up}", shown(margins.gain_down, 2)),
            "Factors on all gains, down and up",
        ),
        (
            "phase",
            format!("{}°", shown(margins.phase_rad.to_degrees(), 3)),
            "Lag or lead between command and torque",
        ),
        (
            "delay",
            format!("+{} ms", shown(1e3 * margins.delay_s, 3)),
            "On top of the loop's own; red where that is less than it has",
        ),
        (
            "crossover",
            format!("{} rad/s", shown(margins.crossover_rad_s, 3)),
            "Where the loop's gain passes 1",
        ),
    ];
    Grid::new("margins").num_columns(4).spacing([14.0, 3.0]).show(ui, |ui| {
        for (name, _, help) in &columns {
            hint_ui(ui, *name).on_hover_text(format!("{help}; the loop as it runs: {runs}"));
        }
        ui.end_row();
        for (name, value, _) in columns {
            let text = mono(value);
            ui.label(if tight && name == "delay" { text.color(error) } else { text });
        }
    });
}

/// The poles, slowest first, conjugate pairs as one.
pub(super) fn pole_texts(design: &LqrDesign) -> Vec<String> {
    let mut poles = design.poles.to_vec();
    poles.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let is_real = |im: f64, re: f64| im.abs() < 1e-9 * re.abs().max(1.0);
    poles
        .iter()
        .filter(|pole| pole.im >= 0.0 || is_real(pole.im, pole.re))
        .map(|pole| {
            if is_real(pole.im, pole.re) {
                shown(pole.re, 4)
            } else {
                format!("{} ± {}i", shown(pole.re, 4), shown(pole.im, 4))
            }
        })
        .collect()
}

/// LQR or FLQR, and how much friction is fed forward.
pub(super) fn feedforward_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    section_ui(ui, "Friction feedforward", |ui| {
        let mut kind = context.session.controller;
        // Drawn from the right, so the last comes first.
        let choices = [
            (ControllerKind::Flqr, "FLQR", "Gains plus friction feedforward"),
            (ControllerKind::Lqr, "LQR", "Gains alone"),
        ];
        ui.scope(|ui| {
            if choice_ui(ui, &mut kind, &choices) {
                context.commands.send(Command::SetController(kind));
            }
        });
    });
    let before = context.session.compensation();
    let mut compensation = before;
    let active = context.session.controller == ControllerKind::Flqr;
    ui.add_enabled_ui(active, |ui| {
        Grid::new("compensation").num_columns(4).spacing([8.0, 4.0]).show(ui, |ui| {
            ui.label("ratio").on_hover_text("Share of the friction that is compensated");
            ui.add(Slider::new(&mut compensation.ratio, 0.0..=1.5).show_value(false))
                .accessible_name("compensation ratio slider");
            number_ui(ui, &mut compensation.ratio, "compensation ratio", 58.0);
            ui.label("");
            ui.end_row();
            ui.label("smoothing").on_hover_text(
                "Speed over which the direction turns from −1 to 1, so that the feedforward does not chatter at rest",
            );
            let slider = Slider::new(&mut compensation.smoothing_speed_rad_s, 1e-3..=1.0)
                .logarithmic(true)
                .clamping(SliderClamping::Never)
                .show_value(false);
            ui.add(slider).accessible_name("smoothing speed slider");
            number_ui(ui, &mut compensation.smoothing_speed_rad_s, "smoothing speed", 58.0);
            ui.label(RichText::new("rad/s").monospace());
            ui.end_row();
        });
    });
    if compensation != before {
        match compensation.validate() {
            Ok(()) => context.commands.send(Command::SetCompensation(compensation)),
            Err(problem) => context.commands.send(Command::Say(format!("Not taken: {problem}."))),
        }
    }
    if let Some(problem) = context.session.feedforward_problem().filter(|_| active) {
        warning_ui(ui, problem);
    }
}
