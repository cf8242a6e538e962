//! The plots of a stack below each other: what each shows, and what the pointer does in it.

use egui::{Color32, EventFilter, Ui, vec2};
use egui_plot::{PlotPoint, PlotResponse};

use super::{Around, Panel, Stack, cache, cache_key, indexed, plot_id};
use crate::plot::axes::{Extras, Right, SecondAxis, X_AXIS_HEIGHT};
use crate::plot::decimate::RangeStatistics;
use crate::plot::unit::label;
use crate::plot::view::{Drawing, TimePlot, columns, interact, y_range};

/// Room for the statistics at the right of each plot.
const STATISTICS_WIDTH: f32 = 118.0;
/// The plots alone get a page that is narrower.
const LEAST_WIDTH_WITH_STATISTICS: f32 = 400.0;
/// Plots are at least this high; more of them scroll.
const LEAST_HEIGHT: f32 = 30.0;

/// The room of one plot.
struct Frame {
    height: f32,
    /// True if the horizontal axis is below it.
    last: bool,
    room: Right,
}

/// A plot and its curves as they are drawn.
pub(super) struct Row<'p, 'a> {
    pub(super) panel: &'p Panel<'a>,
    pub(super) unit: &'static str,
    pub(super) scale: f64,
    pub(super) statistics: Vec<Option<RangeStatistics>>,
    y_range: [f64; 2],
    second: Option<SecondLine>,
}

struct SecondLine {
    axis: SecondAxis,
    color: Color32,
    pieces: Vec<Vec<PlotPoint>>,
    /// Number of the curve, where it is one of the plot's own.
    own: Option<usize>,
}

impl Stack {
    pub(super) fn time_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>], around: &mut Around<'_, '_>) {
        let has_statistics = ui.available_width() >= LEAST_WIDTH_WITH_STATISTICS;
        let beside = if has_statistics { STATISTICS_WIDTH } else { 0.0 };
        let room = self.room(shown);
        let readout = if self.cursors.is_some() { self.readout_height } else { 0.0 };
        let heights = heights(ui, shown.len(), readout);
        for (number, panel) in shown.iter().enumerate() {
            let last = number + 1 == shown.len();
            let height = if last { heights + X_AXIS_HEIGHT } else { heights };
            ui.horizontal_top(|ui| {
                let width = (ui.available_width() - beside).max(1.0);
                let row = ui.allocate_ui(vec2(width, height), |ui| {
                    let columns = columns(ui);
                    let row = self.row(panel, around.all, columns, heights);
                    self.plot_ui(ui, &row, Frame { height, last, room: room.clone() }, around);
                    row
                });
                if has_statistics {
                    let cursor = around.marks.as_ref().map(|marks| marks.cursor);
                    ui.vertical(|ui| self.statistics_ui(ui, &row.inner, cursor, heights));
                }
            });
        }
        if self.cursors.is_some() {
            let top = ui.next_widget_position().y;
            self.readout_ui(ui, shown);
            self.readout_height = ui.next_widget_position().y - top;
        }
    }

    /// Right margin of every plot, so that all have the same width.
    fn room(&self, shown: &[&Panel<'_>]) -> Right {
        let any = shown.iter().any(|panel| self.second.contains_key(&*panel.name));
        if any { Right::Room } else { Right::Nothing }
    }

    /// Puts together what a plot shows.
    fn row<'p, 'a>(
        &mut self,
        panel: &'p Panel<'a>,
        all: &[Panel<'_>],
        columns: usize,
        height: f32,
    ) -> Row<'p, 'a> {
        let (range, units) = (self.view.range(), self.units);
        let (unit, scale) = panel.shown_unit(units);
        let key = self.second.get(&*panel.name).cloned();
        let own = key.as_ref().and_then(|key| panel.curves.iter().position(|curve| *curve.key == **key));
        let mut statistics = Vec::new();
        for curve in &panel.curves {
            let cache = cache(&mut self.caches, panel, curve);
            let visible = cache.visible_of(curve.data, [scale, curve.gap], curve.generation, range, columns);
            statistics.push(visible.statistics);
        }
        let of_left = |(number, found): (usize, &Option<RangeStatistics>)| {
            found.filter(|_| own != Some(number)).map(|found| [found.min, found.max])
        };
        let ends = statistics.iter().enumerate().filter_map(of_left).collect::<Vec<_>>();
        let largest = ends.iter().flatten().fold(0.0_f64, |largest, end| largest.max(end.abs()));
        // A limit far away must not press the curve flat.
        let near = |(_, limit): &&(&str, f64)| limit.abs() * scale <= 2.0 * largest;
        let limits =
            panel.limits.iter().filter(near).map(|(_, limit)| [-limit.abs() * scale, limit.abs() * scale]);
        let y_range = y_range(ends.iter().copied().chain(limits), panel.min_span * scale);
        let second = key.and_then(|key| self.second_line(&key, all, own, columns, y_range, height));
        Row { panel, unit, scale, statistics, y_range, second }
    }

    fn second_line(
        &mut self,
        key: &str,
        all: &[Panel<'_>],
        own: Option<usize>,
        columns: usize,
        left: [f64; 2],
        height: f32,
    ) -> Option<SecondLine> {
        let (range, units) = (self.view.range(), self.units);
        let curves = all.iter().flat_map(|panel| panel.curves.iter().map(move |curve| (panel, curve)));
        let (panel, curve) = curves.into_iter().find(|(_, curve)| curve.key == key)?;
        let (unit, scale) = panel.shown_unit(units);
        let cache = cache(&mut self.caches, panel, curve);
        let visible = cache.visible_of(curve.data, [scale, curve.gap], curve.generation, range, columns);
        let ends = visible.statistics.map(|found| [found.min, found.max]);
        let own_range = y_range(ends.into_iter(), panel.min_span * scale);
        let text = label(&panel.curve_name(curve), unit);
        let lines = (f64::from(height) / 40.0).max(4.0);
        let axis = SecondAxis::new(text, curve.color, own_range, left, lines);
        let place = |point: &PlotPoint| PlotPoint::new(point.x, axis.place(point.y));
        let pieces = visible.pieces.iter().map(|piece| piece.iter().map(place).collect()).collect();
        Some(SecondLine { axis, color: curve.color, pieces, own })
    }

    fn plot_ui(&mut self, ui: &mut Ui, row: &Row<'_, '_>, frame: Frame, around: &mut Around<'_, '_>) {
        let (panel, Frame { height, last, room }) = (row.panel, frame);
        let id = plot_id(self.name, panel);
        let y_label = label(&panel.name, row.unit);
        let plot = TimePlot { id: &id, label: &y_label, height, x_label: last.then_some(self.x[0]) };
        let own = row.second.as_ref().and_then(|second| second.own);
        let curves = panel.curves.iter().enumerate().filter(|(number, _)| own != Some(*number));
        let mut lines: Vec<(Color32, &[Vec<PlotPoint>])> = curves
            .filter_map(|(_, curve)| {
                let cache = self.caches.get(&cache_key(panel, curve))?;
                Some((curve.color, cache.last_visible().pieces.as_slice()))
            })
            .collect();
        if let Some(second) = &row.second {
            lines.push((second.color, second.pieces.as_slice()));
        }
        let limits = panel.limits.iter().flat_map(|(name, limit)| {
            [limit.abs(), -limit.abs()].map(|limit| ((*name).to_owned(), limit * row.scale))
        });
        let right = row.second.as_ref().map_or(room, |second| Right::Axis(second.axis.clone()));
        let extras = Extras { right, logarithmic: false };
        let drawing = Drawing { lines, y_range: row.y_range, limits: limits.collect(), extras };
        let color = ui.visuals().strong_text_color();
        let (cursors, range) = (self.cursors, self.view.range());
        let shown = plot.draw(ui, range, &drawing, |plot_ui| {
            if let Some(marks) = &around.marks {
                marks.draw(plot_ui, color);
            }
            if let Some(cursors) = &cursors {
                cursors.draw(plot_ui, color);
            }
        });
        self.react(ui, &shown, around);
        shown.response.context_menu(|ui| self.menu_ui(ui, panel, around));
        shown.response.accessible_name(self.summary(row));
    }

    /// Pointer actions in a plot.
    fn react(&mut self, ui: &Ui, shown: &PlotResponse<()>, around: &mut Around<'_, '_>) {
        let (response, transform) = (&shown.response, &shown.transform);
        let held = self.cursors.as_mut().is_some_and(|cursors| cursors.interact(ui, response, transform));
        let mut marked = false;
        if let (Some(marks), false) = (around.marks.as_mut(), held) {
            let moved = marks.interact(ui, response, transform);
            around.wishes.moved.cursor |= moved.cursor;
            around.wishes.moved.range |= moved.range;
            marked = marks.held();
        }
        let may_pan = !held && !marked;
        if may_pan && self.drag_moves_curve && response.dragged() {
            let per_point = self.view.span / f64::from(transform.frame().width().max(1.0));
            around.wishes.shift += f64::from(response.drag_delta().x) * per_point;
        }
        interact(ui, shown, &mut self.view, may_pan && !self.drag_moves_curve);
        if !self.is_live && self.view.follow {
            self.view.show_all(self.limits);
        }
        if response.has_focus() {
            self.focus = Some(response.id);
            let arrows = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        }
    }

    /// The spectra in place of the courses.
    pub(super) fn spectra_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>]) {
        let Some(mut spectra) = self.spectra.take() else { return };
        let (range, units) = (self.view.range(), self.units);
        let wanted: Vec<_> =
            shown.iter().flat_map(|panel| panel.curves.iter().map(move |curve| (*panel, curve))).collect();
        let names: Vec<_> =
            wanted.iter().map(|(panel, curve)| (cache_key(panel, curve), curve.generation)).collect();
        spectra.update(ui, range, &names, |index| {
            let (panel, curve) = wanted[index];
            let curve = indexed(&mut self.caches, panel, curve, units);
            curve.snapshot(curve.longest_run(curve.inside(range)))
        });
        spectra.begin(ui);
        let heights = heights(ui, shown.len(), 0.0);
        for (number, panel) in shown.iter().enumerate() {
            let last = number + 1 == shown.len();
            let height = if last { heights + X_AXIS_HEIGHT } else { heights };
            let curves: Vec<_> = panel
                .curves
                .iter()
                .map(|curve| (cache_key(panel, curve), panel.curve_name(curve), curve.color))
                .collect();
            let id = format!("{}/spectrum", plot_id(self.name, panel));
            let unit = panel.shown_unit(units).0;
            spectra.plot_ui(ui, &id, (&panel.name, unit), (height, last), &curves);
        }
        self.spectra = Some(spectra);
    }
}

/// Height of each plot, without the horizontal axis.
fn heights(ui: &Ui, count: usize, below: f32) -> f32 {
    let count = count as f32;
    let spacing = ui.spacing().item_spacing.y;
    ((ui.available_height() - X_AXIS_HEIGHT - below - count * spacing) / count).max(LEAST_HEIGHT)
}
