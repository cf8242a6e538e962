//! The tools of a stack: the row above the plots, and the menu of a right click.

use std::collections::BTreeMap;

use egui::Ui;

use super::{Around, Panel, Stack};
use crate::plot::cursors::Cursors;
use crate::plot::export::FigureKind;
use crate::plot::spectra::{Measure, Spectra};
use crate::plot::unit::{Unit, degrees, set_degrees};
use crate::widgets::choice_ui;

impl Stack {
    /// The tools, for a row above the plots.
    pub fn tools_ui(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) {
        if self.is_live {
            ui.toggle_value(&mut self.view.follow, "Follow")
                .on_hover_text("Follow the newest sample (End). Dragging a plot stops following.");
        }
        let mut on = self.cursors.is_some();
        let help = "Two cursors on all plots: difference, mean, RMS, peaks, overshoot and settling time";
        if ui.toggle_value(&mut on, "Cursors").on_hover_text(help).clicked() {
            self.cursors = on.then(|| Cursors::within(self.view.range()));
        }
        let mut on = self.spectra.is_some();
        let help = "Show the amplitude spectrum or power spectral density of the visible range";
        if ui.toggle_value(&mut on, "Spectrum").on_hover_text(help).clicked() {
            self.spectra = on.then(Spectra::default);
        }
        if let Some(spectra) = &mut self.spectra {
            ui.scope(|ui| choice_ui(ui, &mut spectra.measure, &Measure::ALL));
        }
        if panels.len() > 1 {
            ui.menu_button("Signals", |ui| self.signals_ui(ui, panels))
                .response
                .on_hover_text("Choose the plotted signals and the second axis");
        }
        self.units_ui(ui, panels);
        ui.toggle_value(&mut self.export.open, "Export")
            .on_hover_text("Save the visible range as CSV, or the figure as SVG or PNG");
    }

    fn signals_ui(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) {
        for panel in panels {
            let mut shown = self.is_shown(panel);
            if ui.checkbox(&mut shown, panel.name.as_ref()).changed() {
                self.chosen.insert(panel.name.to_string(), shown);
            }
        }
        ui.separator();
        for panel in panels {
            if !self.is_shown(panel) {
                continue;
            }
            ui.menu_button(format!("Second axis of {}", panel.name), |ui| {
                second_axis_ui(ui, &mut self.second, panel, panels);
            });
        }
    }

    fn units_ui(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) {
        let has = |units: fn(&Unit) -> bool| panels.iter().any(|panel| units(&panel.unit));
        if has(|unit| matches!(unit, Unit::Angle | Unit::AngularSpeed)) {
            ui.scope(|ui| {
                let choices = [
                    (true, "deg", "Angles in degrees, on all pages"),
                    (false, "rad", "Angles in radians, on all pages"),
                ];
                let mut shown = degrees(ui.ctx());
                if choice_ui(ui, &mut shown, &choices) {
                    set_degrees(ui.ctx(), shown);
                }
            });
        }
        if has(|unit| matches!(unit, Unit::Torque(Some(_)))) {
            ui.scope(|ui| {
                let choices = [
                    (false, "N m", "Torques"),
                    (true, "A", "Motor currents, from the torque constant in [link] of the model"),
                ];
                choice_ui(ui, &mut self.units.amperes, &choices);
            });
        }
    }

    /// The menu of a right click.
    pub(super) fn menu_ui(&mut self, ui: &mut Ui, panel: &Panel<'_>, around: &mut Around<'_, '_>) {
        if ui.button(if self.is_live { "Follow the newest sample" } else { "Show everything" }).clicked() {
            if self.is_live {
                self.view.follow = true;
            } else {
                self.view.show_all(self.limits);
            }
        }
        let text = if self.cursors.is_some() { "Hide the cursors" } else { "Cursors A and B" };
        if ui.button(text).clicked() {
            self.cursors = match self.cursors {
                Some(_) => None,
                None => Some(Cursors::within(self.view.range())),
            };
        }
        if ui.button("Spectrum of the visible range").clicked() {
            self.spectra = Some(Spectra::default());
        }
        ui.menu_button("Second axis", |ui| second_axis_ui(ui, &mut self.second, panel, around.all));
        if ui.button(format!("Hide {}", panel.name)).clicked() {
            self.chosen.insert(panel.name.to_string(), false);
        }
        ui.separator();
        for (kind, text) in [
            (FigureKind::Csv, "Visible range as CSV…"),
            (FigureKind::Svg, "Figure as SVG…"),
            (FigureKind::Png, "Picture as PNG…"),
        ] {
            if ui.button(text).clicked() {
                self.export.open_as(kind);
                around.dialog = Some(kind);
            }
        }
    }
}

/// Names the second axis of a plot.
fn second_axis_ui(ui: &mut Ui, second: &mut BTreeMap<String, String>, panel: &Panel<'_>, all: &[Panel<'_>]) {
    let present = second.get(&*panel.name).cloned();
    if ui.radio(present.is_none(), "none").clicked() {
        second.remove(&*panel.name);
    }
    for other in all {
        for curve in &other.curves {
            let chosen = present.as_deref() == Some(&*curve.key);
            if ui.radio(chosen, other.curve_name(curve)).clicked() {
                second.insert(panel.name.to_string(), curve.key.to_string());
            }
        }
    }
}
