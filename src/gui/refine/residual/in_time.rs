//! Measured against both models, and their residuals below, over one time axis.

use egui::{Color32, RichText, Ui, vec2};
use flqr_core::refine::Explorer;

use crate::plot::{Curve, DecimationCache, Marks, TimeCurve, TimePlot, TimeView};
use crate::theme::palette;
use crate::widgets::{hint_ui, mono, shown};

/// Height of the time axis with its label.
const TIME_AXIS_HEIGHT: f32 = 36.0;
/// Room for the readings at the right of each plot.
const READING_WIDTH: f32 = 150.0;
const LEAST_WIDTH_WITH_READINGS: f32 = 480.0;

/// Curves in time; logs stand one after another.
pub(super) struct InTime {
    time_s: Vec<f64>,
    /// A longer step is a gap.
    gap_s: f64,
    /// Whether time starts anew within the rows.
    several: bool,
    /// Measured, and as the models have it: before, after.
    effort: [Vec<f64>; 3],
    /// Before, after.
    residual: [Vec<f64>; 2],
    view: TimeView,
    marks: Marks,
    caches: [[DecimationCache; 3]; 2],
    generation: u64,
}

impl InTime {
    pub(super) fn new(explorer: &Explorer, generation: u64) -> Self {
        let time = explorer.variable("time_s").map_or(&[][..], |time| &time.values);
        let (time_s, gap_s, several) = one_after_another(time);
        let model = |residual: &[f64]| {
            explorer.measured.iter().zip(residual).map(|(measured, left)| measured - left).collect()
        };
        let limits = [time_s.first().copied().unwrap_or(0.0), time_s.last().copied().unwrap_or(1.0)];
        let mut view = TimeView::following(1.0);
        view.show_all(limits);
        Self {
            gap_s,
            several,
            effort: [explorer.measured.clone(), model(&explorer.before), model(&explorer.after)],
            residual: [explorer.before.clone(), explorer.after.clone()],
            view,
            marks: Marks::new(limits),
            caches: Default::default(),
            generation,
            time_s,
        }
    }

    pub(super) fn show_all(&mut self) {
        self.view.show_all(self.marks.limits);
    }

    pub(super) fn ui(&mut self, explorer: &Explorer, height: f32, ui: &mut Ui) {
        // A double click asks to follow the newest sample; here it shows everything.
        if self.view.follow {
            self.show_all();
        }
        self.view.update(self.marks.limits);
        let room = (height - TIME_AXIS_HEIGHT - 2.0 * ui.spacing().item_spacing.y).max(60.0);
        let effort = format!("{} [{}]", explorer.channel, explorer.unit);
        let residual = format!("residual [{}]", explorer.unit);
        let label = if self.several { "time, log after log [s]" } else { "time [s]" };
        self.plot_ui(0, ("measured and model", &effort, 0.5 * room, None), ui);
        self.plot_ui(1, ("residual in time", &residual, 0.5 * room + TIME_AXIS_HEIGHT, Some(label)), ui);
    }

    fn plot_ui(
        &mut self,
        index: usize,
        (id, label, height, x_label): (&str, &str, f32, Option<&str>),
        ui: &mut Ui,
    ) {
        let plot = TimePlot { id, label, height, x_label, min_y_span: 1e-6 };
        let colors = palette(ui.visuals());
        let names: &[(&str, Color32, &[f64])] = if index == 0 {
            &[
                ("measured", colors.measured, &self.effort[0]),
                ("model before", colors.runs[0], &self.effort[1]),
                ("model after", colors.runs[1], &self.effort[2]),
            ]
        } else {
            &[("before", colors.runs[0], &self.residual[0]), ("after", colors.runs[1], &self.residual[1])]
        };
        let has_readings = ui.available_width() >= LEAST_WIDTH_WITH_READINGS;
        let beside = if has_readings { READING_WIDTH } else { 0.0 };
        ui.horizontal_top(|ui| {
            let size = vec2((ui.available_width() - beside).max(1.0), height);
            ui.allocate_ui(size, |ui| {
                let mut curves: Vec<TimeCurve<'_>> = names
                    .iter()
                    .zip(&mut self.caches[index])
                    .map(|((_, color, values), cache)| {
                        let curve = Curve { x: &self.time_s, y: values, scale: 1.0, gap: self.gap_s };
                        TimeCurve { color: *color, curve, generation: self.generation, cache }
                    })
                    .collect();
                plot.show_marked(ui, &mut self.view, &mut curves, &mut self.marks);
            });
            if has_readings {
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 2.0;
                    hint_ui(ui, label);
                    let after = self.time_s.partition_point(|time| *time <= self.marks.cursor);
                    for (name, color, values) in names {
                        let value = values.get(after.saturating_sub(1)).copied().unwrap_or(f64::NAN);
                        ui.label(RichText::new(*name).small().strong().color(*color));
                        ui.label(mono(shown(value, 4)).color(*color)).on_hover_text("Value at the cursor");
                    }
                });
            }
        });
    }
}

/// Times that never run back: where they do, another log begins, a little after the one before. Also the longest step
/// that is no gap, and whether there are several logs.
fn one_after_another(time: &[f64]) -> (Vec<f64>, f64, bool) {
    let mut steps: Vec<f64> =
        time.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
    let gap = 10.0 * usual;
    let (mut shift, mut several) = (0.0, false);
    let mut running = Vec::with_capacity(time.len());
    for (index, value) in time.iter().enumerate() {
        if index > 0 && *value < time[index - 1] {
            several = true;
            shift += time[index - 1] - value + 2.0 * gap;
        }
        running.push(value + shift);
    }
    (running, gap, several)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_log_stands_after_the_first_with_a_gap() {
        let (time, gap, several) = one_after_another(&[0.0, 1.0, 2.0, 0.5, 1.5]);
        assert!(several && gap == 10.0);
        assert_eq!(time, [0.0, 1.0, 2.0, 22.0, 23.0]);
        assert!(one_after_another(&[]).0.is_empty());
    }
}
