//! Both runs in the same plots over one time axis, with cursor and range.

use egui::{Color32, RichText, Ui, vec2};

use super::run::Recorded;
use super::runs::Comparison;
use super::signals::Signal;
use crate::plot::{Curve, DecimationCache, Marks, Moved, TimeCurve, TimePlot, TimeView};
use crate::quantity::{Quantity, to_scale};
use crate::theme::palette;
use crate::widgets::mono;

/// Longer steps in time are drawn as gaps, s.
const GAP_S: f64 = 0.05;
/// Room for the readings at the right of each plot.
const READING_WIDTH: f32 = 108.0;
/// The plots alone get a page that is narrower.
const LEAST_WIDTH_WITH_READINGS: f32 = 400.0;
/// Height of the time axis with its label.
const TIME_AXIS_HEIGHT: f32 = 36.0;

/// State of the plots.
pub(super) struct Plots {
    pub(super) view: TimeView,
    /// Of each plot: both runs, and the target.
    caches: Vec<[DecimationCache; 3]>,
}

impl Default for Plots {
    fn default() -> Self {
        Self { view: TimeView::following(60.0), caches: Vec::new() }
    }
}

impl Plots {
    pub(super) fn ui(
        &mut self,
        ui: &mut Ui,
        comparison: &Comparison,
        degrees: bool,
        marks: &mut Marks,
    ) -> Moved {
        // A double click asks to follow the newest sample; here it shows the whole run.
        if self.view.follow {
            self.view.show_all(marks.limits);
        }
        self.view.update(marks.limits);
        let signals = comparison.signals(degrees);
        self.caches.resize_with(signals.len(), Default::default);
        let count = signals.len() as f32;
        let spacing = ui.spacing().item_spacing.y;
        let room = ui.available_height() - TIME_AXIS_HEIGHT - count * spacing;
        let height = (room / count).max(30.0);
        let mut moved = Moved::default();
        let has_readings = ui.available_width() >= LEAST_WIDTH_WITH_READINGS;
        let beside = if has_readings { READING_WIDTH } else { 0.0 };
        for (index, signal) in signals.iter().enumerate() {
            let quantity = &signal.quantity;
            let last = index + 1 == signals.len();
            let plot = TimePlot {
                id: quantity.name,
                label: &quantity.label(),
                height: if last { height + TIME_AXIS_HEIGHT } else { height },
                x_label: last.then_some("time [s]"),
                min_y_span: quantity.min_span,
            };
            ui.horizontal_top(|ui| {
                let size = vec2((ui.available_width() - beside).max(1.0), plot.height);
                let one = ui.allocate_ui(size, |ui| {
                    let mut curves = curves(ui, comparison, &mut self.caches[index], index, signal);
                    plot.show_marked(ui, &mut self.view, &mut curves, marks)
                });
                moved.cursor |= one.inner.cursor;
                moved.range |= one.inner.range;
                if has_readings {
                    ui.vertical(|ui| reading_ui(ui, comparison, index, quantity, marks.cursor));
                }
            });
        }
        moved
    }
}

fn curves<'a>(
    ui: &Ui,
    comparison: &'a Comparison,
    [target, caches @ ..]: &'a mut [DecimationCache; 3],
    column: usize,
    signal: &Signal,
) -> Vec<TimeCurve<'a>> {
    let colors = palette(ui.visuals());
    let scale = signal.quantity.scale;
    let curve = |color, run: &'a Recorded, values, cache| {
        let curve = Curve { x: &run.time_s, y: values, scale, gap: GAP_S };
        TimeCurve { color, curve, generation: comparison.generation, cache }
    };
    let mut curves = Vec::new();
    if signal.has_target
        && let Some((_, run)) = comparison.recorded().next()
        && let Some(values) = &run.target_rad_s
    {
        curves.push(curve(colors.reference, run, values, target));
    }
    for ((run, cache), color) in comparison.runs.iter().zip(caches).zip(colors.runs) {
        if let Ok(run) = run {
            curves.push(curve(color, run, &run.columns[column], cache));
        }
    }
    curves
}

/// What both curves are at the cursor, as text.
fn reading_ui(ui: &mut Ui, comparison: &Comparison, column: usize, quantity: &Quantity, time_s: f64) {
    ui.spacing_mut().item_spacing.y = 2.0;
    ui.add_space(6.0);
    ui.label(RichText::new(quantity.label()).small().weak());
    let colors: [Color32; 2] = palette(ui.visuals()).runs;
    for (variant, run) in comparison.recorded() {
        let value = value_at(run, column, time_s).map_or(f64::NAN, |value| value * quantity.scale);
        let name = variant.title(comparison.settings.scenario);
        let text = format!("{name:<5}{:>8}", to_scale(value, quantity.min_span));
        ui.label(mono(text).color(colors[variant as usize])).on_hover_text("Value at the cursor");
    }
}

/// The last sample not later than `time_s`; none after the run's end.
fn value_at(run: &Recorded, column: usize, time_s: f64) -> Option<f64> {
    let after = run.time_s.partition_point(|time| *time <= time_s);
    let ended = after == run.time_s.len() && time_s > run.end_s() + GAP_S;
    (!ended).then(|| run.columns[column].get(after.saturating_sub(1)).copied())?
}
