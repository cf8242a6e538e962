//! Table of the curves at two cursors and between them.

use egui::{Color32, Grid, RichText, ScrollArea, Ui};

use super::cursors::{Cursors, NAMES};
use super::decimate::{Indexed, RangeStatistics};
use super::response::step_response;
use crate::quantity::to_scale;
use crate::widgets::{mono, shown};

/// Columns of the table with what they mean.
const COLUMNS: [(&str, &str); 10] = [
    ("A", "Value at cursor A (last sample)"),
    ("B", "Value at cursor B (last sample)"),
    ("Δy", "Difference B − A"),
    ("mean", "Mean of the samples between the cursors"),
    ("RMS", "RMS between the cursors"),
    ("min", "Smallest value between the cursors"),
    ("max", "Largest value between the cursors"),
    ("std", "Standard deviation between the cursors"),
    (
        "overshoot",
        "Overshoot in percent of the change from the earlier cursor to the \
         final value (mean of the last 10 % before the later cursor)",
    ),
    (
        "settling",
        "Settling time after the earlier cursor (2 % band around \
         the final value)",
    ),
];

/// One row of the table.
pub(super) struct Reading {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) color: Color32,
    /// As many as there are columns; NaN for none.
    values: [f64; COLUMNS.len()],
    /// Largest size of the values, which the digits follow.
    scale: f64,
}

impl Reading {
    pub(super) fn new(
        name: String,
        unit: &'static str,
        color: Color32,
        curve: &Indexed<'_>,
        cursors: &Cursors,
    ) -> Self {
        let value = |at: f64| curve.held_at(at).map_or(f64::NAN, |index| curve.y(index));
        let [a, b] = cursors.at.map(value);
        let inside = curve.inside(cursors.range());
        let none = RangeStatistics { count: 0, min: f64::NAN, max: f64::NAN, mean: f64::NAN, std: f64::NAN };
        let found = curve.statistics(inside.clone()).unwrap_or(none);
        let step = step_response(curve, inside);
        let [overshoot, settling] = [step.overshoot_percent, step.settling_s].map(|v| v.unwrap_or(f64::NAN));
        let values =
            [a, b, b - a, found.mean, found.rms(), found.min, found.max, found.std, overshoot, settling];
        let scale = found.min.abs().max(found.max.abs());
        Self { name, unit, color, values, scale: if scale.is_finite() { 0.1 * scale } else { 0.0 } }
    }

    fn text(&self, column: usize) -> String {
        let value = self.values[column];
        match COLUMNS[column].0 {
            _ if value.is_nan() => "–".to_owned(),
            "overshoot" => format!("{value:.1} %"),
            "settling" => format!("{value:.3} s"),
            _ => to_scale(value, self.scale),
        }
    }
}

/// The table; which cursor the keyboard moves can be chosen in it.
pub(super) fn readout_ui(ui: &mut Ui, cursors: &mut Cursors, readings: &[Reading], height: f32) {
    ui.horizontal(|ui| head_ui(ui, cursors, readings));
    ScrollArea::both().id_salt("readout").max_height(height).auto_shrink([false, true]).show(ui, |ui| {
        Grid::new("readout").spacing([14.0, 2.0]).striped(true).show(ui, |ui| {
            ui.label("");
            for (name, help) in COLUMNS {
                ui.label(RichText::new(name).small().weak()).on_hover_text(help);
            }
            ui.end_row();
            for reading in readings {
                let name = super::unit::label(&reading.name, reading.unit);
                ui.label(RichText::new(name).small().color(reading.color));
                for (column, (title, help)) in COLUMNS.into_iter().enumerate() {
                    let cell = ui.label(mono(reading.text(column))).on_hover_text(help);
                    let said = format!("{} {title}: {}", reading.name, reading.text(column));
                    cell.ctx.accesskit_node_builder(cell.id, |node| node.set_value(said));
                }
                ui.end_row();
            }
        });
    });
}

fn head_ui(ui: &mut Ui, cursors: &mut Cursors, readings: &[Reading]) {
    for (number, name) in NAMES.into_iter().enumerate() {
        let text = format!("{name} {:.4} s", cursors.at[number]);
        let help = "Drag, or move the selected cursor with the arrow keys by one sample (ten with Shift)";
        let chosen = ui.selectable_label(cursors.active == number, mono(text)).on_hover_text(help);
        if chosen.accessible_name(format!("cursor {name}")).clicked() {
            cursors.active = number;
        }
    }
    let span = cursors.at[1] - cursors.at[0];
    let rate = if span == 0.0 { "–".to_owned() } else { format!("{} Hz", shown(1.0 / span.abs(), 4)) };
    let times = format!("Δt {} s   1/Δt {rate}", format!("{span:.4}").replace('-', "−"));
    ui.label(mono(times));
    if ui.button("Copy table").on_hover_text("Copy the table for a spreadsheet").clicked() {
        ui.ctx().copy_text(table(cursors, readings));
    }
}

/// The table as text with tabs; numbers as they are.
fn table(cursors: &Cursors, readings: &[Reading]) -> String {
    let mut text = format!("A_s\t{}\nB_s\t{}\n", cursors.at[0], cursors.at[1]);
    text += "curve\tunit";
    for (name, _) in COLUMNS {
        text += &format!("\t{name}");
    }
    for reading in readings {
        text += &format!("\n{}\t{}", reading.name, reading.unit);
        for value in reading.values {
            text += &if value.is_nan() { "\t".to_owned() } else { format!("\t{value}") };
        }
    }
    text + "\n"
}
