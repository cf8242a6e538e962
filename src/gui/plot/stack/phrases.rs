//! Text description of a stack.

use egui::{RichText, Ui};

use super::rows::Row;
use super::{Panel, Stack, indexed};
use crate::plot::readout::{Reading, readout_ui};
use crate::plot::unit::label;
use crate::quantity::to_scale;
use crate::widgets::mono;

/// Height of a line of numbers next to a plot.
const LINE: f32 = 14.0;

impl Stack {
    /// Text description of a plot.
    pub(super) fn summary(&self, row: &Row<'_, '_>) -> String {
        let [from, to] = self.view.range();
        let mut text = format!("plot of {}, {from:.2} to {to:.2}", label(&row.panel.name, row.unit));
        for (curve, found) in row.panel.curves.iter().zip(&row.statistics) {
            let name = row.panel.curve_name(curve);
            match found {
                None => text += &format!("; {name}: nothing visible"),
                Some(found) => {
                    let shown = |value: f64| to_scale(value, found.peak_to_peak());
                    text += &format!(
                        "; {name}: mean {}, from {} to {}, standard deviation {}, {} samples",
                        shown(found.mean),
                        shown(found.min),
                        shown(found.max),
                        shown(found.std),
                        found.count
                    );
                }
            }
        }
        text
    }

    /// Values of the plot as text: at a cursor of the page, or of the visible range.
    /// Lines for which a plot of this `height` has no room are left out.
    pub(super) fn statistics_ui(&mut self, ui: &mut Ui, row: &Row<'_, '_>, cursor: Option<f64>, height: f32) {
        ui.spacing_mut().item_spacing.y = 2.0;
        let bottom = ui.next_widget_position().y + height;
        let has_room = |ui: &Ui| ui.next_widget_position().y + LINE <= bottom;
        ui.add_space(6.0);
        ui.label(RichText::new(label(&row.panel.name, row.unit)).small().weak());
        let several = row.panel.curves.len() > 1;
        let told = match cursor {
            Some(at) => Some((format!("at {} s", to_scale(at, 1.0)), "Values at the displayed time")),
            None if several => Some(("mean".to_owned(), "Means of the visible samples")),
            None => None,
        };
        if let Some((told, help)) = told.filter(|_| has_room(ui)) {
            ui.label(RichText::new(told).small().weak()).on_hover_text(help);
        }
        for (curve, found) in row.panel.curves.iter().zip(&row.statistics) {
            if !has_room(ui) {
                break;
            }
            let name = if several { curve.name.as_ref() } else { "value" };
            if let Some(cursor) = cursor {
                let indexed = indexed(&mut self.caches, row.panel, curve, self.units);
                let value = indexed.held_at(cursor).map_or(f64::NAN, |index| indexed.y(index));
                // As many digits as can be distinguished in the plot, and one more.
                let peak = found.map_or(0.0, |found| found.peak_to_peak());
                let scale = (row.panel.min_span * row.scale).max(0.1 * peak);
                let text = format!("{name:<6.6}{:>9}", to_scale(value, scale));
                let said = format!("{} at the displayed time, {}", row.panel.curve_name(curve), row.unit);
                ui.label(mono(text).color(curve.color)).on_hover_text(said);
                continue;
            }
            let [mean, std, peak] =
                found.map_or([f64::NAN; 3], |found| [found.mean, found.std, found.peak_to_peak()]);
            let scale = if peak.is_nan() { 0.0 } else { peak };
            if several {
                let text = format!("{name:<6.6}{:>9}", to_scale(mean, scale));
                let said = format!("Mean of {}, {}", row.panel.curve_name(curve), row.unit);
                ui.label(mono(text).color(curve.color)).on_hover_text(said);
                continue;
            }
            for (name, value, help) in [
                ("mean", mean, "Mean of the visible samples"),
                ("std", std, "Standard deviation of the visible samples"),
                ("p-p", peak, "Peak to peak: largest minus smallest visible sample"),
            ] {
                if !has_room(ui) {
                    break;
                }
                ui.label(mono(format!("{name:<4}{:>10}", to_scale(value, scale)))).on_hover_text(help);
            }
        }
    }

    pub(super) fn readout_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>]) {
        let Some(mut cursors) = self.cursors else { return };
        let (units, caches) = (self.units, &mut self.caches);
        let mut readings = Vec::new();
        for panel in shown {
            for curve in &panel.curves {
                let name = panel.curve_name(curve);
                let found = indexed(caches, panel, curve, units);
                readings.push(Reading::new(name, panel.shown_unit(units).0, curve.color, &found, &cursors));
            }
        }
        readout_ui(ui, &mut cursors, &readings, 160.0);
        self.cursors = Some(cursors);
    }
}
