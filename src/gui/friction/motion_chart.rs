//! A fit from motion: measured against fitted in time, and what is left over the speed.

use egui::{Ui, Vec2, vec2};
use egui_plot::{FilledArea, HLine, Line, MarkerShape, PlotPoint, PlotPoints, Points};
use flqr_core::identify::FitReport;
use flqr_core::identify::motion::MotionSeries;
use flqr_core::signal::{Band, Bin, binned};

use super::charts::chart;
use crate::context::ViewContext;
use crate::plot::{Data, Panel, PanelCurve, Stack, Unit, one_after_another};
use crate::theme::palette;
use crate::widgets::{hint_ui, legend_ui, section_ui, shown};

/// Most points that are drawn of the residual.
const MOST_POINTS: usize = 1500;
const MOST_BINS: usize = 60;
/// Height of the line of text under the picture over the speed.
const SUMMARY_HEIGHT: f32 = 20.0;

/// The rows of one fit, and how they are looked at.
pub(super) struct MotionChart {
    time_s: Vec<f64>,
    /// A longer step is a gap.
    gap_s: f64,
    measured: Vec<f64>,
    fitted: Vec<f64>,
    residual: Vec<f64>,
    points: Vec<PlotPoint>,
    bins: Vec<Bin>,
    unit: &'static str,
    stack: Stack,
}

impl MotionChart {
    /// `None` for a fit of pairs.
    pub(super) fn new(report: &FitReport) -> Option<Self> {
        let MotionSeries { time_s, speed, measured, fitted } = report.series.as_ref()?;
        let (time_s, gap_s, _) = one_after_another(time_s);
        let residual: Vec<f64> = measured.iter().zip(fitted).map(|(is, model)| is - model).collect();
        let step = speed.len().div_ceil(MOST_POINTS).max(1);
        let points = speed.iter().zip(&residual).step_by(step);
        let points = points.filter(|(speed, left)| speed.is_finite() && left.is_finite());
        let mut stack = Stack::new("fit", 1.0);
        stack.show_all(ends(&time_s));
        Some(Self {
            points: points.map(|(speed, left)| PlotPoint::new(*speed, *left)).collect(),
            bins: binned(speed, &residual, MOST_BINS, Band::Quartiles),
            unit: report.rmse_unit,
            measured: measured.clone(),
            fitted: fitted.clone(),
            time_s,
            gap_s,
            residual,
            stack,
        })
    }

    /// `sources` say where the curves come from.
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, sources: Vec<String>, ui: &mut Ui) {
        section_ui(ui, "Fitted", |ui| {
            if ui.button("Whole fit").on_hover_text("Show all rows of the fit (double click)").clicked() {
                self.stack.show_all(ends(&self.time_s));
            }
            let colors = palette(ui.visuals());
            legend_ui(ui, "fitted", colors.accent);
            legend_ui(ui, "measured", colors.measured);
        });
        let room = vec2(ui.available_width() - ui.spacing().item_spacing.x, ui.available_height());
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| {
                ui.set_width(0.6 * room.x);
                self.in_time_ui(context, sources, ui);
            });
            ui.vertical(|ui| {
                ui.set_width(0.4 * room.x);
                self.over_speed_ui(vec2(0.4 * room.x, room.y - SUMMARY_HEIGHT), ui);
                hint_ui(ui, self.summary())
                    .on_hover_text("Line: mean over rows of similar speed; band: interquartile range");
            });
        });
    }

    fn in_time_ui(&mut self, context: &ViewContext<'_>, sources: Vec<String>, ui: &mut Ui) {
        let Self { time_s, gap_s, measured, fitted, residual, unit, stack, .. } = self;
        let colors = palette(ui.visuals());
        let (effort, suffix) = if *unit == "N" { ("force", "n") } else { ("torque", "nm") };
        let curve = |name: &'static str, key: &str, color, values| PanelCurve {
            name: name.into(),
            key: format!("{key}_{suffix}").into(),
            color,
            data: Data::Fixed(time_s, values),
            // Another fit has another stack.
            generation: 0,
            gap: *gap_s,
        };
        let panel = |name: &'static str, shown, curves| Panel {
            name: name.into(),
            unit: Unit::Plain(unit),
            min_span: 1e-6,
            shown,
            curves,
            limits: Vec::new(),
        };
        let both = vec![
            curve("measured", "measured", colors.measured, &*measured),
            curve("fitted", "fitted", colors.accent, &*fitted),
        ];
        let left = vec![curve("", "residual", colors.accent, &*residual)];
        let panels = [panel(effort, true, both), panel("residual", false, left)];
        stack.sources = sources;
        stack.update(ends(time_s));
        ui.horizontal_wrapped(|ui| stack.tools_ui(ui, &panels));
        stack.show(ui, &panels).send(context.commands);
    }

    fn over_speed_ui(&self, size: Vec2, ui: &mut Ui) {
        let colors = palette(ui.visuals());
        let x_label = if self.unit == "N" { "speed [m/s]" } else { "motor speed [rad/s]" };
        let y_label = format!("measured − fitted [{}]", self.unit);
        let column = |of: fn(&Bin) -> f64| self.bins.iter().map(of).collect::<Vec<f64>>();
        let (speeds, low, high) = (column(|b| b.x), column(|b| b.low), column(|b| b.high));
        let mean: PlotPoints<'_> = self.bins.iter().map(|bin| [bin.x, bin.mean]).collect();
        let plot = chart(ui, size, x_label, &y_label).label_formatter(|_| None);
        plot.show(ui, |plot| {
            plot.hline(HLine::new("no residual", 0.0).color(colors.reference).width(1.0).allow_hover(false));
            let rows = Points::new("rows", PlotPoints::Borrowed(&self.points)).shape(MarkerShape::Circle);
            plot.points(rows.color(colors.measured.gamma_multiply(0.45)).radius(1.2).allow_hover(false));
            let band = FilledArea::new("quartiles", &speeds, &low, &high);
            plot.add(band.fill_color(colors.accent.gamma_multiply(0.28)).allow_hover(false));
            let mean = Line::new("mean", mean).color(colors.accent).width(1.8);
            plot.line(mean.allow_band(false).allow_hover(false));
        });
    }

    /// Spread of the means, as text next to the plot.
    fn summary(&self) -> String {
        let means = self.bins.iter().map(|bin| bin.mean);
        let (low, high) = means
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mean| (low.min(mean), high.max(mean)));
        let span = shown(high - low, 3);
        format!("peak-to-peak of the means: {span} {}", self.unit)
    }
}

fn ends(time_s: &[f64]) -> [f64; 2] {
    [time_s.first().copied().unwrap_or(0.0), time_s.last().copied().unwrap_or(1.0)]
}
