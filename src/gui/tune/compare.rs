//! Two designs, A and B: which one is active, and in what they differ.

use egui::{CollapsingHeader, Grid, RichText, Ui};

use crate::command::Command;
use crate::context::ViewContext;
use crate::design::{Designed, Slot};
use crate::quantity::{MOTORS, STATES};
use crate::theme::palette;
use crate::widgets::{change, hint_ui, mono, section_ui, shown};

/// Relative difference below which numbers count as the same.
const SAME: f64 = 1e-9;

/// Chooses which of the two designs is active.
pub(super) fn slots_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let designer = context.designer;
    let other = designer.active.other().name();
    section_ui(ui, "Design", |ui| {
        let copy =
            ui.add_enabled(designer.different().is_some(), egui::Button::new(format!("Copy to {other}")));
        let help = format!("Copy the active design to {other}, for comparison");
        if copy.on_hover_text(help).clicked() {
            context.commands.send(Command::KeepReference);
        }
        let back =
            ui.add_enabled(designer.different().is_some(), egui::Button::new(format!("Revert to {other}")));
        let help = format!("Copy the weights of {other} to {}", designer.active.name());
        if back.on_hover_text(help).clicked() {
            context.commands.send(Command::RestoreReference);
        }
        ui.separator();
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 10.0;
        for slot in [Slot::B, Slot::A] {
            let active = slot == designer.active;
            let help = if active {
                format!("{} is active: the robot uses it, and edits change it", slot.name())
            } else {
                format!("Make {} active; {} is unchanged", slot.name(), designer.active.name())
            };
            let choice = ui.selectable_label(active, RichText::new(slot.name()).strong());
            if choice.accessible_name(format!("design {}", slot.name())).on_hover_text(help).clicked()
                && !active
            {
                context.commands.send(Command::SwapReference);
            }
        }
    });
}

/// Differences between both designs.
pub(super) fn differences_ui(context: &ViewContext<'_>, peaks_nm: [f64; 2], ui: &mut Ui) {
    let designer = context.designer;
    let (Some(now), Some(other)) = (designer.in_force, designer.different()) else { return };
    let (a, b) = match designer.active {
        Slot::A => (now, other),
        Slot::B => (other, now),
    };
    let [peak_now, peak_other] = peaks_nm;
    let peaks = if designer.active == Slot::A { [peak_now, peak_other] } else { [peak_other, peak_now] };
    let rows = differences(&a, &b, peaks);
    let title = format!("A → B: {} differences", rows.len());
    CollapsingHeader::new(title).id_salt("differences").show(ui, |ui| {
        Grid::new("difference table").num_columns(4).spacing([10.0, 2.0]).show(ui, |ui| {
            for head in ["", "A", "B", "change"] {
                hint_ui(ui, head);
            }
            ui.end_row();
            for row in rows {
                ui.label(RichText::new(row.name).small());
                ui.label(mono(shown(row.a, 4)).color(color(ui, designer.active == Slot::A)));
                ui.label(mono(shown(row.b, 4)).color(color(ui, designer.active == Slot::B)));
                ui.label(mono(change(row.a, row.b)).weak());
                ui.end_row();
            }
        });
    });
}

fn color(ui: &Ui, in_force: bool) -> egui::Color32 {
    let colors = palette(ui.visuals());
    if in_force { colors.accent } else { colors.reference }
}

struct Difference {
    name: String,
    a: f64,
    b: f64,
}

fn differences(a: &Designed, b: &Designed, peaks: [f64; 2]) -> Vec<Difference> {
    let mut all = Vec::new();
    let mut add = |name: String, a: f64, b: f64| {
        if (a - b).abs() > SAME * a.abs().max(b.abs()) {
            all.push(Difference { name, a, b });
        }
    };
    for (row, state) in STATES.into_iter().enumerate() {
        for (column, other) in STATES.into_iter().enumerate().skip(row) {
            let name = if row == column { format!("Q {state}") } else { format!("Q {state}, {other}") };
            add(name, a.weights.q[(row, column)], b.weights.q[(row, column)]);
        }
    }
    for (row, motor) in MOTORS.into_iter().enumerate() {
        for column in row..MOTORS.len() {
            let name = if row == column { format!("R {motor}") } else { "R left, right".to_owned() };
            add(name, a.weights.r[(row, column)], b.weights.r[(row, column)]);
        }
    }
    for (motor, side) in MOTORS.into_iter().enumerate() {
        for (state, name) in STATES.into_iter().enumerate() {
            add(format!("K {side}, {name}"), a.design.gain[(motor, state)], b.design.gain[(motor, state)]);
        }
    }
    let slowest =
        |designed: &Designed| designed.design.poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
    add("slowest decay, 1/s".to_owned(), slowest(a), slowest(b));
    let margins = [&a.margins, &b.margins];
    add("gain margin up".to_owned(), margins[0].gain_up, margins[1].gain_up);
    add("gain margin down".to_owned(), margins[0].gain_down, margins[1].gain_down);
    add("phase margin, °".to_owned(), margins[0].phase_rad.to_degrees(), margins[1].phase_rad.to_degrees());
    add("delay margin, ms".to_owned(), 1e3 * margins[0].delay_s, 1e3 * margins[1].delay_s);
    add("peak torque, N m".to_owned(), peaks[0], peaks[1]);
    all
}
