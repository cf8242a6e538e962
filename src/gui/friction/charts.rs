//! The fitted curve over the measured pairs, and the convergence of the fit.

use egui::{Ui, vec2};
use egui_plot::{Legend, Line, LineStyle, MarkerShape, Plot, PlotPoints, Points};
use flqr_core::friction::Stribeck;
use flqr_core::record::LogKind;

use super::fit::FitRun;
use crate::context::ViewContext;
use crate::plot::Axes;
use crate::theme::palette;
use crate::widgets::{hint_ui, section_ui};

/// The curve is drawn over ± this where there are no pairs, rad/s.
const DEFAULT_SPEED_RAD_S: f64 = 50.0;
const POINTS_PER_SIDE: usize = 300;

pub(super) fn ui(context: &ViewContext<'_>, fit: &FitRun, kind: Option<LogKind>, ui: &mut Ui) {
    section_ui(ui, "Fitted", |_| {});
    if fit.report.is_none() && kind == Some(LogKind::LinearAxis) {
        hint_ui(ui, "A linear axis is fitted from its motion. Start the fit to compare.");
        return;
    }
    let height = ui.available_height();
    let width = ui.available_width() - ui.spacing().item_spacing.x;
    ui.horizontal_top(|ui| {
        curve_plot(context, fit, ui, vec2(0.62 * width, height));
        convergence_plot(fit, ui, vec2(0.38 * width, height));
    });
}

/// A chart with the look of this page.
pub(super) fn chart<'a>(ui: &Ui, size: egui::Vec2, x_label: &'a str, y_label: &'a str) -> Plot<'a> {
    let plot =
        Plot::new(("chart", x_label)).width(size.x.max(1.0)).height(size.y.max(1.0)).allow_scroll(false);
    let x_lines = 0.016 * f64::from(size.x);
    Axes { x_label: Some(x_label), y_label, height: size.y, x_lines, y_lines: 5.0 }.on(plot, ui.visuals())
}

fn curve_plot(context: &ViewContext<'_>, fit: &FitRun, ui: &mut Ui, size: egui::Vec2) {
    let in_model = context.session.friction(fit.motor_index());
    let colors = palette(ui.visuals());
    let pairs: Vec<[f64; 2]> = fit
        .report
        .iter()
        .flat_map(|report| &report.pairs)
        .map(|pair| [pair.speed_rad_s, pair.torque_nm])
        .filter(|pair| pair[0].is_finite() && pair[1].is_finite())
        .collect();
    let reach = pairs.iter().map(|pair| pair[0].abs()).fold(0.0, f64::max);
    let reach = if reach > 0.0 { reach } else { DEFAULT_SPEED_RAD_S };
    let plot = chart(ui, size, "motor speed [rad/s]", "friction torque [N m]")
        .legend(
            Legend::default()
                .position(egui_plot::Corner::LeftTop)
                .follow_insertion_order(true)
                .background_alpha(0.6),
        )
        .label_formatter(|position| match position {
            egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\n{:.3} rad/s\n{:.4} N m", position.x, position.y))
            }
            egui_plot::HoverPosition::Elsewhere { .. } => None,
        });
    plot.show(ui, |plot_ui| {
        if !pairs.is_empty() {
            let points = Points::new("measured pairs", PlotPoints::from(pairs));
            plot_ui.points(points.color(colors.measured).shape(MarkerShape::Circle).radius(1.8));
        }
        if let Some(curve) = in_model {
            for (side, points) in sides(&curve, reach).into_iter().enumerate() {
                let line = Line::new("in the model", points).id(("model", side)).color(colors.reference);
                plot_ui.line(line.style(LineStyle::dashed_loose()).width(1.4));
            }
        }
        if let Some(curve) = fit.curve() {
            for (side, points) in sides(&curve, reach).into_iter().enumerate() {
                let name = if fit.report.is_some() { "fitted" } else { "best so far" };
                plot_ui.line(Line::new(name, points).id(("fitted", side)).color(colors.accent).width(2.0));
            }
        }
    });
}

/// The curve left and right of rest, where it jumps; denser near rest, where it bends.
fn sides(curve: &Stribeck, reach: f64) -> [PlotPoints<'static>; 2] {
    [-1.0, 1.0].map(|direction| {
        let points = (0..=POINTS_PER_SIDE).map(|index| {
            let share = index as f64 / POINTS_PER_SIDE as f64;
            let speed = direction * reach * (share * share * share).max(1e-6);
            [speed, curve.torque_nm(speed)]
        });
        points.filter(|point| point[1].is_finite()).collect()
    })
}

fn convergence_plot(fit: &FitRun, ui: &mut Ui, size: egui::Vec2) {
    let color = palette(ui.visuals()).accent;
    let unit = fit.report.as_ref().map_or("N m", |report| report.rmse_unit);
    let label = format!("log₁₀ of the error [{unit}]");
    let plot = chart(ui, size, "iteration", &label).label_formatter(|position| match position {
        egui_plot::HoverPosition::NearDataPoint { position, .. } => {
            Some(format!("iteration {:.0}\nerror {:.4e}", position.x, 10.0_f64.powf(position.y)))
        }
        egui_plot::HoverPosition::Elsewhere { .. } => None,
    });
    plot.show(ui, |plot_ui| {
        let points = PlotPoints::from(fit.convergence.clone());
        plot_ui.line(Line::new("best error", points).color(color).width(1.8).allow_band(false));
    });
}
