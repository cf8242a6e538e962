//! Plots below each other over one time axis, with all their tools: a page hands over what there is to plot, and gets
//! cursors, readings, statistics, spectra, a second axis, units, limits and exports by one call.

use std::borrow::Cow;
use std::collections::BTreeMap;

use egui::{Color32, EventFilter, Key, Modifiers, Rect, RichText, Ui, vec2};
use egui_plot::{PlotPoint, PlotResponse};

use super::axes::{Extras, Right, SecondAxis};
use super::cursors::{Cursors, steps};
use super::decimate::{Data, DecimationCache, Indexed, RangeStatistics};
use super::export::{Content, Export, FigureFile, FigureKind};
use super::figure;
use super::marks::{Marks, Moved};
use super::readout::{Reading, readout_ui};
use super::spectra::{Measure, Spectra};
use super::unit::{Unit, UnitChoice, label};
use super::view::{Drawing, TimePlot, TimeView, columns, interact, y_range};
use crate::command::{Command, Commands, FilePurpose};
use crate::quantity::to_scale;
use crate::widgets::{choice_ui, mono};

/// Room for the statistics at the right of each plot.
const STATISTICS_WIDTH: f32 = 118.0;
/// The plots alone get a page that is narrower.
const LEAST_WIDTH_WITH_STATISTICS: f32 = 400.0;
/// Height of the horizontal axis with its label.
const X_AXIS_HEIGHT: f32 = 36.0;
/// Plots are at least this high; more of them scroll.
const LEAST_HEIGHT: f32 = 30.0;

/// One plot: what it shows, and of which quantity.
pub struct Panel<'a> {
    /// Name of the quantity; differs from that of any other plot of the stack.
    pub name: Cow<'a, str>,
    /// Its unit.
    pub unit: Unit,
    /// The vertical range is at least this long, in the core's unit.
    pub min_span: f64,
    /// Whether it is shown until the user chooses.
    pub shown: bool,
    /// Curves, the later ones drawn over the earlier ones.
    pub curves: Vec<PanelCurve<'a>>,
    /// Limits, drawn at both signs: name and size in the core's unit.
    pub limits: Vec<(&'static str, f64)>,
}

/// One curve of a plot.
pub struct PanelCurve<'a> {
    /// Name where a plot has several; may be empty.
    pub name: Cow<'a, str>,
    /// Column in an exported log, with the core's unit; differs from that of any other curve of the stack.
    pub key: Cow<'a, str>,
    /// Colour of the line.
    pub color: Color32,
    /// Its data, in the core's unit.
    pub data: Data<'a>,
    /// Changes whenever the data do.
    pub generation: u64,
    /// A larger step in time is drawn as a gap.
    pub gap: f64,
}

impl Panel<'_> {
    /// Shown unit and factor.
    pub(super) fn shown_unit(&self, units: UnitChoice) -> (&'static str, f64) {
        self.unit.shown(units)
    }

    /// Name of a curve for people.
    pub(super) fn curve_name(&self, curve: &PanelCurve<'_>) -> String {
        if curve.name.is_empty() { self.name.to_string() } else { format!("{} {}", self.name, curve.name) }
    }
}

/// What the page has to do for a stack.
#[derive(Debug, Default, PartialEq)]
#[must_use]
pub struct Wishes {
    /// Ask for a path with a dialog.
    pub dialog: Option<FigureFile>,
    /// Say this.
    pub said: Option<String>,
    /// What the user did to marks.
    pub moved: Moved,
}

impl Wishes {
    /// Passes on what the page cannot do itself; what the user did to marks.
    pub(crate) fn send(self, commands: &Commands) -> Moved {
        if let Some(file) = self.dialog {
            commands.send(Command::ShowDialog(FilePurpose::SaveFigure(file)));
        }
        if let Some(text) = self.said {
            commands.send(Command::Say(text));
        }
        self.moved
    }
}

/// State of a stack of plots.
pub struct Stack {
    /// Name of the stack: of its files, and apart from all other stacks.
    name: &'static str,
    /// The visible range.
    pub view: TimeView,
    /// The units that are shown.
    pub units: UnitChoice,
    /// Whether there is a newest sample to follow.
    is_live: bool,
    /// Label of the horizontal axis, and the column of it in an exported log.
    pub x: [&'static str; 2],
    cursors: Option<Cursors>,
    spectra: Option<Spectra>,
    /// Of plots by name: the curve at their right axis, by its key.
    second: BTreeMap<String, String>,
    /// Plots that the user has shown or hidden.
    chosen: BTreeMap<String, bool>,
    caches: BTreeMap<String, DecimationCache>,
    export: Export,
    readout_height: f32,
    page: Rect,
    limits: [f64; 2],
    /// The plot that had the keyboard last.
    focus: Option<egui::Id>,
}

/// What the plots of a stack share while they are drawn.
struct Around<'m, 'p> {
    marks: Option<&'m mut Marks>,
    all: &'p [Panel<'p>],
    wishes: Wishes,
    dialog: bool,
}

/// The room of one plot.
struct Frame {
    height: f32,
    /// Whether the horizontal axis is below it.
    last: bool,
    room: Right,
}

/// A plot and its curves as they are drawn.
struct Row<'p, 'a> {
    panel: &'p Panel<'a>,
    unit: &'static str,
    scale: f64,
    statistics: Vec<Option<RangeStatistics>>,
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
    /// A stack called `name` over time, `span` seconds long.
    pub fn new(name: &'static str, span: f64) -> Self {
        Self {
            name,
            view: TimeView::following(span),
            units: UnitChoice::default(),
            is_live: false,
            x: ["time [s]", "time_s"],
            cursors: None,
            spectra: None,
            second: BTreeMap::new(),
            chosen: BTreeMap::new(),
            caches: BTreeMap::new(),
            export: Export::default(),
            readout_height: 0.0,
            page: Rect::NOTHING,
            limits: [0.0, 1.0],
            focus: None,
        }
    }

    /// A stack that follows the newest sample.
    pub fn live(name: &'static str, span: f64) -> Self {
        Self { is_live: true, ..Self::new(name, span) }
    }

    /// Whether the arrow keys belong to the cursors.
    pub fn has_cursors(&self) -> bool {
        self.cursors.is_some() && self.spectra.is_none()
    }

    /// Takes note of the range of the data; call it once a frame, before the plots.
    pub fn update(&mut self, limits: [f64; 2]) {
        self.limits = limits;
        if self.is_live || !self.view.follow {
            self.view.update(limits);
        } else {
            self.view.show_all(limits);
        }
    }

    /// Shows all of the data and holds it.
    pub fn show_all(&mut self, limits: [f64; 2]) {
        self.limits = limits;
        self.view.show_all(limits);
    }

    /// What the stack shows, for scripts.
    pub fn snapshot(&self) -> serde_json::Value {
        serde_json::json!({
            "range": self.view.range(),
            "follow": self.view.follow,
            "cursors": self.cursors.map(|cursors| cursors.at),
            "spectrum": self.spectra.is_some(),
            "degrees": self.units.degrees,
            "amperes": self.units.amperes,
            "second_axis": self.second,
        })
    }

    fn is_shown(&self, panel: &Panel<'_>) -> bool {
        self.chosen.get(&*panel.name).copied().unwrap_or(panel.shown)
    }

    /// The tools, for a row above the plots.
    pub fn tools_ui(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) {
        if self.is_live {
            ui.toggle_value(&mut self.view.follow, "Follow").on_hover_text(
                "Keep the newest sample in view (End). Dragging a plot holds it, while recording goes on.",
            );
        }
        let mut on = self.cursors.is_some();
        let help =
            "Two cursors on all plots: differences, mean, RMS, peaks, overshoot and settling between them";
        if ui.toggle_value(&mut on, "Cursors").on_hover_text(help).clicked() {
            self.cursors = on.then(|| Cursors::within(self.view.range()));
        }
        let mut on = self.spectra.is_some();
        let help = "Amplitude spectrum or spectral density of the visible range, in place of its course";
        if ui.toggle_value(&mut on, "Spectrum").on_hover_text(help).clicked() {
            self.spectra = on.then(Spectra::default);
        }
        if let Some(spectra) = &mut self.spectra {
            ui.scope(|ui| choice_ui(ui, &mut spectra.measure, &Measure::ALL));
        }
        if panels.len() > 1 {
            ui.menu_button("Signals", |ui| self.signals_ui(ui, panels))
                .response
                .on_hover_text("Choose what is plotted, and what has a second axis");
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
        for panel in
            panels.iter().filter(|panel| self.chosen.get(&*panel.name).copied().unwrap_or(panel.shown))
        {
            ui.menu_button(format!("Second axis of {}", panel.name), |ui| {
                second_axis_ui(ui, &mut self.second, panel, panels);
            });
        }
    }

    fn units_ui(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) {
        let has = |units: fn(&Unit) -> bool| panels.iter().any(|panel| units(&panel.unit));
        if has(|unit| matches!(unit, Unit::Angle | Unit::AngularSpeed)) {
            ui.scope(|ui| {
                let choices = [(true, "deg", "Angles in degrees"), (false, "rad", "Angles in radians")];
                choice_ui(ui, &mut self.units.degrees, &choices);
            });
        }
        if has(|unit| matches!(unit, Unit::Torque(Some(_)))) {
            ui.scope(|ui| {
                let choices = [
                    (false, "N m", "Torques"),
                    (true, "A", "Motor currents, by the torque constant of the model's [link]"),
                ];
                choice_ui(ui, &mut self.units.amperes, &choices);
            });
        }
    }

    /// The plots over the available room.
    pub fn show(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) -> Wishes {
        self.show_marked(ui, panels, None)
    }

    /// The same with marks of the page, which the stack's own cursors come before.
    pub fn show_marked(&mut self, ui: &mut Ui, panels: &[Panel<'_>], marks: Option<&mut Marks>) -> Wishes {
        let asked = self.export.ui(ui, self.name);
        let said = self.export.drain(ui);
        let mut around =
            Around { marks, all: panels, wishes: Wishes { said, ..Wishes::default() }, dialog: asked.dialog };
        let shown: Vec<&Panel<'_>> = panels.iter().filter(|panel| self.is_shown(panel)).collect();
        self.keys(ui, &shown);
        let top = ui.next_widget_position();
        if shown.is_empty() {
            ui.weak("No signal is chosen: see Signals.");
        } else if self.spectra.is_some() {
            self.spectra_ui(ui, &shown);
        } else {
            self.time_ui(ui, &shown, &mut around);
        }
        let right = ui.max_rect().right();
        self.page = Rect::from_min_max(top, egui::pos2(right, ui.next_widget_position().y));
        let Around { mut wishes, dialog, .. } = around;
        wishes.dialog = dialog.then_some(FigureFile { stack: self.name, kind: self.export.kind });
        if let Some(save) = asked.save {
            let content = self.content(&shown);
            self.export.start(ui, save, content, self.page);
        }
        wishes
    }

    /// End follows the newest sample; the arrows move a cursor.
    fn keys(&mut self, ui: &Ui, shown: &[&Panel<'_>]) {
        let focused = ui.memory(|memory| memory.focused());
        if focused.is_some() && focused != self.focus {
            return;
        }
        if self.is_live && ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, Key::End)) > 0 {
            self.view.follow = true;
        }
        if !self.has_cursors() {
            return;
        }
        let steps = steps(ui);
        let first = shown.first().and_then(|panel| panel.curves.first().map(|curve| (panel, curve)));
        if let (Some(mut cursors), Some((panel, curve))) = (self.cursors, first) {
            let units = self.units;
            cursors.follow_samples(&indexed(&mut self.caches, panel, curve, units), steps);
            self.cursors = Some(cursors);
        }
    }

    fn time_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>], around: &mut Around<'_, '_>) {
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
                    ui.vertical(|ui| self.statistics_ui(ui, &row.inner, cursor));
                }
            });
        }
        if self.cursors.is_some() {
            let top = ui.next_widget_position().y;
            self.readout_ui(ui, shown);
            self.readout_height = ui.next_widget_position().y - top;
        }
    }

    /// What every plot has at its right, so that all are equally wide.
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
        let plot = TimePlot {
            id: &id,
            label: &y_label,
            height,
            x_label: last.then_some(self.x[0]),
            min_y_span: panel.min_span,
        };
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

    /// What the pointer does in a plot.
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
        interact(ui, shown, &mut self.view, !held && !marked);
        if !self.is_live && self.view.follow {
            self.view.show_all(self.limits);
        }
        if response.has_focus() {
            self.focus = Some(response.id);
            let arrows = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        }
    }

    /// The menu of a right click.
    fn menu_ui(&mut self, ui: &mut Ui, panel: &Panel<'_>, around: &mut Around<'_, '_>) {
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
                (self.export.open, self.export.kind, around.dialog) = (true, kind, true);
            }
        }
    }

    /// What a plot shows, in words.
    fn summary(&self, row: &Row<'_, '_>) -> String {
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

    /// What a reader of the plot would measure, as text: at a cursor of the page, or of the visible range.
    fn statistics_ui(&mut self, ui: &mut Ui, row: &Row<'_, '_>, cursor: Option<f64>) {
        ui.spacing_mut().item_spacing.y = 2.0;
        ui.add_space(6.0);
        ui.label(RichText::new(label(&row.panel.name, row.unit)).small().weak());
        let several = row.panel.curves.len() > 1;
        for (curve, found) in row.panel.curves.iter().zip(&row.statistics) {
            let name = if several { curve.name.as_ref() } else { "value" };
            if let Some(cursor) = cursor {
                let indexed = indexed(&mut self.caches, row.panel, curve, self.units);
                let value = indexed.held_at(cursor).map_or(f64::NAN, |index| indexed.y(index));
                let text = format!("{name:<5}{:>8}", to_scale(value, row.panel.min_span * row.scale));
                ui.label(mono(text).color(curve.color)).on_hover_text("Value at the time that is shown");
                continue;
            }
            let [mean, std, peak] =
                found.map_or([f64::NAN; 3], |found| [found.mean, found.std, found.peak_to_peak()]);
            let scale = if peak.is_nan() { 0.0 } else { peak };
            if several {
                let text = format!("{name:<6.6}{:>9}", to_scale(mean, scale));
                ui.label(mono(text).color(curve.color)).on_hover_text("Mean of the visible samples");
                continue;
            }
            for (name, value, help) in [
                ("mean", mean, "Mean of the visible samples"),
                ("std", std, "Standard deviation of the visible samples"),
                ("p-p", peak, "Peak to peak: largest minus smallest visible sample"),
            ] {
                ui.label(mono(format!("{name:<4}{:>10}", to_scale(value, scale)))).on_hover_text(help);
            }
        }
    }

    fn readout_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>]) {
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

    fn spectra_ui(&mut self, ui: &mut Ui, shown: &[&Panel<'_>]) {
        let Some(mut spectra) = self.spectra.take() else { return };
        let (range, units) = (self.view.range(), self.units);
        for panel in shown {
            for curve in &panel.curves {
                let key = cache_key(panel, curve);
                spectra.update(ui, key, curve.generation, range, || {
                    indexed(&mut self.caches, panel, curve, units)
                });
            }
        }
        spectra.begin();
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

    /// What is to be written of the visible range.
    fn content(&mut self, shown: &[&Panel<'_>]) -> Content {
        let (range, units) = (self.view.range(), self.units);
        match self.export.kind {
            FigureKind::Png => Content::Picture,
            FigureKind::Csv => {
                let caches = &mut self.caches;
                let curves =
                    shown.iter().flat_map(|panel| panel.curves.iter().map(move |curve| (panel, curve)));
                let curves = curves.map(|(panel, curve)| {
                    let data =
                        cache(caches, panel, curve).indexed(curve.data, [1.0, curve.gap], curve.generation);
                    figure::samples(&curve.key, &data, range)
                });
                Content::Log { x_key: self.x[1], curves: curves.collect() }
            }
            FigureKind::Svg => {
                let mut drawn = Vec::new();
                for panel in shown {
                    let curves = panel.curves.iter().map(|curve| {
                        let visible =
                            indexed(&mut self.caches, panel, curve, units).visible(range, figure::COLUMNS);
                        (panel.curve_name(curve), visible.pieces)
                    });
                    let curves = curves.collect();
                    drawn.push(figure::panel(&panel.name, panel.shown_unit(units), curves, &panel.limits));
                }
                Content::Chart(
                    Box::new(figure::chart(self.name, self.x[0], range, drawn)),
                    self.export.size(),
                )
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

fn plot_id(stack: &str, panel: &Panel<'_>) -> String {
    format!("{stack}/{}", panel.name)
}

fn cache_key(panel: &Panel<'_>, curve: &PanelCurve<'_>) -> String {
    format!("{}/{}", panel.name, curve.key)
}

fn cache<'c>(
    caches: &'c mut BTreeMap<String, DecimationCache>,
    panel: &Panel<'_>,
    curve: &PanelCurve<'_>,
) -> &'c mut DecimationCache {
    caches.entry(cache_key(panel, curve)).or_default()
}

/// A curve with its pyramids, in the shown unit.
fn indexed<'c>(
    caches: &'c mut BTreeMap<String, DecimationCache>,
    panel: &Panel<'_>,
    curve: &'c PanelCurve<'_>,
    units: UnitChoice,
) -> Indexed<'c> {
    let look = [panel.shown_unit(units).1, curve.gap];
    cache(caches, panel, curve).indexed(curve.data, look, curve.generation)
}

/// Height of each plot, without the horizontal axis.
fn heights(ui: &Ui, count: usize, below: f32) -> f32 {
    let count = count as f32;
    let spacing = ui.spacing().item_spacing.y;
    ((ui.available_height() - X_AXIS_HEIGHT - below - count * spacing) / count).max(LEAST_HEIGHT)
}
