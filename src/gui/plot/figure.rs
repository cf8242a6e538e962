//! The visible range of a stack as samples and as a chart.

use egui_plot::PlotPoint;
use flqr_core::report::{Axis, Chart, Limit, Mark, Panel, Series};

use crate::widgets::plain;

/// Number of columns of a figure, with two points each.
pub(super) const COLUMNS: usize = 2000;

/// A plot as a panel of a chart; curves with their names, in the shown unit.
pub(super) fn panel(
    name: &str,
    (unit, scale): (&'static str, f64),
    curves: Vec<(String, Vec<Vec<PlotPoint>>)>,
    limits: &[(&'static str, f64)],
) -> Panel {
    let values = curves.iter().flat_map(|(_, pieces)| pieces.iter().flatten());
    let largest = values.fold(0.0_f64, |largest, point| largest.max(point.y.abs()));
    // As on the screen: a limit far away must not press the curve flat.
    let limits =
        limits.iter().filter(|(_, limit)| limit.abs() * scale <= 2.0 * largest).flat_map(|(name, limit)| {
            [-limit * scale, limit * scale].map(|y| Limit { name: (*name).to_owned(), y })
        });
    let series = curves.into_iter().map(|(name, pieces)| Series::new(name, Mark::Line, points(&pieces)));
    let mut panel = Panel::new(Axis::new(name, unit), series.collect());
    panel.limits = limits.collect();
    panel
}

/// Pieces one after the other, a point that is none between them.
fn points(pieces: &[Vec<PlotPoint>]) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for piece in pieces {
        points.extend(piece.iter().map(|point| [point.x, point.y]));
        points.push([piece.last().map_or(0.0, |point| point.x), f64::NAN]);
    }
    points
}

/// The panels over the visible range; `sources` say where the curves come from.
pub(super) fn chart(
    name: &str,
    x_label: &str,
    range: [f64; 2],
    panels: Vec<Panel>,
    sources: &[String],
) -> Chart {
    let (title, unit) = match x_label {
        "time [s]" => ("Time", "s"),
        _ => ("Row", ""),
    };
    let shown: Vec<_> = panels.iter().map(|panel| panel.y.label()).collect();
    let of: String = sources.iter().map(|source| format!(" Of {source}.")).collect();
    let mut x = Axis::new(title, unit);
    x.range = Some(range);
    let [from, to] = range.map(|end| plain(end, 6));
    Chart {
        title: format!("{name}: {}", shown.join("; ")),
        description: format!("{} from {from} to {to} {unit}.{of}", shown.join("; ")),
        x,
        panels,
    }
}
