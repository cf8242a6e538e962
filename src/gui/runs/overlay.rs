//! Ticked rows over each other, each shifted in time by hand, by an event or by correlation.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use egui::{Button, Color32, ComboBox, Grid, Sense, Stroke, Ui, vec2};
use flqr_core::record::{Signal, best_alignment, first_crossing_s};

use super::ledger::Ledger;
use super::run::{Run, RunKind, Series};
use crate::command::Commands;
use crate::job::{Job, Outcome, Waker};
use crate::plot::{Data, Panel, PanelCurve, Stack, Unit, UnitChoice};
use crate::theme::palette;
use crate::widgets::{choice_ui, hint_ui, mono, number_ui, section_ui, shown, warning_ui};

/// Reason why the selected rows are not drawn.
const NO_SERIES: &str = "The selected rows have no curves in memory.";
/// A step in time this many times longer than the usual one is drawn as a gap.
const GAP: f64 = 10.0;
/// The plot is at least this high, with its axis.
const LEAST_HEIGHT: f32 = 130.0;
/// Height of the table below the plot, of one row.
const ROW_HEIGHT: f32 = 24.0;

/// Number of a row and what to add to its times, s; `None` if it has no shape.
type Found = Vec<(u64, Option<f64>)>;

/// Name of a channel and the core's unit of it.
type Named = (&'static str, &'static str);

/// Style of the rows.
pub(super) struct Overlay {
    stack: Stack,
    /// Drawn curves by row number, updated on changes only.
    curves: BTreeMap<u64, Curve>,
    /// Curves that were made.
    made: u64,
    /// Name and unit of what is drawn.
    channel: Named,
    shifts_s: BTreeMap<u64, f64>,
    /// The row that a drag moves; none: the view.
    dragged: Option<u64>,
    /// Level of the event, in the core's unit.
    level: f64,
    job: Option<Job<(), Found>>,
    problem: Option<String>,
}

impl Default for Overlay {
    fn default() -> Self {
        Self {
            stack: Stack::new("overlay", 60.0),
            curves: BTreeMap::new(),
            made: 0,
            channel: Named::default(),
            shifts_s: BTreeMap::new(),
            dragged: None,
            level: 0.0,
            job: None,
            problem: None,
        }
    }
}

/// A signal of a row at its shifted times.
struct Curve {
    series: Arc<Series>,
    channel: usize,
    shift_s: f64,
    time_s: Vec<f64>,
    /// Smallest, largest, mean and standard deviation of what is finite.
    statistics: [f64; 4],
    generation: u64,
}

impl Curve {
    fn new(row: &Drawn<'_>, shift_s: f64, generation: u64) -> Self {
        let Signal { time_s, values } = row.signal();
        Self {
            series: Arc::clone(row.series),
            channel: row.channel,
            shift_s,
            time_s: time_s.iter().map(|time| time + shift_s).collect(),
            statistics: statistics(values),
            generation,
        }
    }

    fn is_of(&self, row: &Drawn<'_>, shift_s: f64) -> bool {
        Arc::ptr_eq(&self.series, row.series) && (self.channel, self.shift_s) == (row.channel, shift_s)
    }

    fn values(&self) -> &[f64] {
        &self.series.channels[self.channel].values
    }

    /// First and last time.
    fn ends(&self) -> [f64; 2] {
        [self.time_s.first(), self.time_s.last()].map(|time| time.copied().unwrap_or(0.0))
    }

    /// A longer step is a gap.
    fn gap_s(&self) -> f64 {
        let [start, end] = self.ends();
        GAP * (end - start) / self.time_s.len().max(2) as f64
    }
}

/// A row that is drawn.
struct Drawn<'a> {
    run: &'a Run,
    series: &'a Arc<Series>,
    channel: usize,
    color: Color32,
}

impl Drawn<'_> {
    fn channel(&self) -> &super::Channel {
        &self.series.channels[self.channel]
    }

    /// Column of an export.
    fn key(&self) -> String {
        let channel = self.channel();
        let unit = channel.unit.replace([' ', '/', '²', '°'], "_");
        format!("run_{}_{}_{unit}", self.run.number, channel.name.replace(' ', "_"))
    }

    fn signal(&self) -> Signal<'_> {
        signal(self.series, self.channel)
    }
}

fn signal(series: &Series, channel: usize) -> Signal<'_> {
    Signal { time_s: &series.time_s, values: &series.channels[channel].values }
}

/// Reason why a row of an earlier session cannot be selected.
const NOT_KEPT: &str = "cannot be shown: a session file stores the settings and results of a run, not its \
    curves. Right-click the row to copy the command that repeats it; “Changes” compares its values.";

fn listed_rows(count: usize) -> String {
    format!("{count} experiment{}", if count == 1 { "" } else { "s" })
}

impl Overlay {
    pub(super) fn shifts_s(&self) -> &BTreeMap<u64, f64> {
        &self.shifts_s
    }

    pub(super) fn ui(&mut self, ledger: &Ledger, ticked: &BTreeSet<u64>, commands: &Commands, ui: &mut Ui) {
        self.drain();
        let names = channels(ledger, ticked);
        if !names.contains(&self.channel) {
            self.channel = names.first().copied().unwrap_or_default();
        }
        let drawn = self.drawn(ledger, ticked, ui);
        section_ui(ui, "Selected runs", |ui| self.head_ui(&drawn, &names, ui));
        if drawn.is_empty() {
            let text = if ticked.is_empty() { "Select rows to overlay them." } else { NO_SERIES };
            hint_ui(ui, text);
            let is_lost = |run: &Run| run.kind == RunKind::Experiment && run.series.is_none();
            let lost = ledger.rows().iter().filter(|run| is_lost(run)).count();
            if lost > 0 {
                hint_ui(ui, format!("{} {NOT_KEPT}", listed_rows(lost)));
            }
            return;
        }
        if let Some(problem) = &self.problem {
            warning_ui(ui, problem);
        }
        let table = ROW_HEIGHT * (2 + drawn.len().min(5)) as f32;
        self.make_curves(&drawn);
        self.plot_ui(&drawn, table + 12.0, commands, ui);
        egui::ScrollArea::vertical().id_salt("drawn").show(ui, |ui| self.rows_ui(&drawn, ui));
    }

    fn drawn<'a>(&self, ledger: &'a Ledger, ticked: &BTreeSet<u64>, ui: &Ui) -> Vec<Drawn<'a>> {
        let rows = ticked.iter().filter_map(|number| ledger.row(*number));
        rows.filter_map(|run| {
            let series = run.series.as_ref().filter(|series| !series.time_s.is_empty())?;
            let channel = series.channels.iter().position(|channel| named(channel) == self.channel)?;
            Some(Drawn { run, series, channel, color: color(ui, ticked, run.number) })
        })
        .collect()
    }

    /// From the right to the left.
    fn head_ui(&mut self, drawn: &[Drawn<'_>], names: &[Named], ui: &mut Ui) {
        let several = drawn.len() > 1 && self.job.is_none();
        let reset = ui.add_enabled(!self.shifts_s.is_empty(), Button::new("No shift"));
        if reset.on_hover_text("Reset all time shifts").clicked() {
            self.shifts_s.clear();
        }
        let event = ui.add_enabled(several, Button::new("At an event"));
        if event.on_hover_text("Align the first crossing of this value with that of the first row").clicked()
        {
            self.align_at_event(drawn);
        }
        let (_, scale) = shown_unit(self.channel, ui);
        let mut level = scale * self.level;
        number_ui(ui, &mut level, "event threshold", 46.0)
            .on_hover_text(format!("Threshold of {}", label(self.channel, ui)));
        if level != scale * self.level {
            self.level = level / scale;
        }
        let correlation = ui.add_enabled(several, Button::new("By shape"));
        let help = "Align by maximum cross-correlation with the first row";
        if correlation.on_hover_text(help).clicked() {
            self.align_by_correlation(drawn, ui);
        }
        ui.label("align");
        ui.separator();
        let combo = ComboBox::from_id_salt("channel").selected_text(label(self.channel, ui)).width(140.0);
        let combo = combo.show_ui(ui, |ui| {
            for name in names {
                ui.selectable_value(&mut self.channel, *name, label(*name, ui));
            }
        });
        combo
            .response
            .accessible_name("curve to compare")
            .on_hover_text("Signal shown for the selected rows");
    }

    fn align_at_event(&mut self, drawn: &[Drawn<'_>]) {
        let times: Found =
            drawn.iter().map(|row| (row.run.number, first_crossing_s(row.signal(), self.level))).collect();
        let Some((first, Some(time_s))) = times.first().copied() else {
            self.problem = Some("The first row never crosses this value. Choose another one.".to_owned());
            return;
        };
        let start_s = time_s + self.shifts_s.get(&first).copied().unwrap_or(0.0);
        self.take(
            times.into_iter().map(|(number, time)| (number, time.map(|time| start_s - time))).collect(),
        );
    }

    fn align_by_correlation(&mut self, drawn: &[Drawn<'_>], ui: &Ui) {
        let rows: Vec<_> =
            drawn.iter().map(|row| (row.run.number, Arc::clone(row.series), row.channel)).collect();
        let ctx = ui.ctx().clone();
        let waker: Waker = Arc::new(move || ctx.request_repaint());
        let start_s =
            drawn.first().and_then(|row| self.shifts_s.get(&row.run.number)).copied().unwrap_or(0.0);
        let work = move |_: &_| {
            let mut signals =
                rows.iter().map(|(number, series, channel)| (*number, signal(series, *channel)));
            let Some((first, fixed)) = signals.next() else { return Vec::new() };
            let best = |moved| best_alignment(fixed, moved).map(|best| best.shift_s + start_s);
            let others = signals.map(|(number, moved)| (number, best(moved)));
            std::iter::once((first, Some(start_s))).chain(others).collect()
        };
        match Job::start("align-runs", &waker, work) {
            Ok(job) => self.job = Some(job),
            Err(error) => self.problem = Some(format!("Cannot start aligning the runs: {error}.")),
        }
    }

    fn drain(&mut self) {
        let Some(job) = &mut self.job else { return };
        match job.poll().1 {
            Outcome::Running => return,
            Outcome::Done(found) => self.take(found),
            Outcome::Broken => self.problem = Some("Aligning failed: this is an internal error.".to_owned()),
        }
        self.job = None;
    }

    fn take(&mut self, found: Found) {
        self.problem = None;
        let mut without = Vec::new();
        for (number, shift_s) in found {
            match shift_s {
                Some(shift_s) => {
                    self.shifts_s.insert(number, shift_s);
                }
                None => without.push(number.to_string()),
            }
        }
        if !without.is_empty() {
            let rows = without.join(", ");
            self.problem = Some(format!("Run {rows} cannot be aligned and is unchanged."));
        }
    }

    fn make_curves(&mut self, drawn: &[Drawn<'_>]) {
        self.curves.retain(|number, _| drawn.iter().any(|row| row.run.number == *number));
        for row in drawn {
            let number = row.run.number;
            let shift_s = self.shifts_s.get(&number).copied().unwrap_or(0.0);
            if self.curves.get(&number).is_none_or(|curve| !curve.is_of(row, shift_s)) {
                self.made += 1;
                self.curves.insert(number, Curve::new(row, shift_s, self.made));
            }
        }
    }

    /// `below` is the room for what comes after the plot.
    fn plot_ui(&mut self, drawn: &[Drawn<'_>], below: f32, commands: &Commands, ui: &mut Ui) {
        let Self { stack, curves, dragged, .. } = self;
        let panel_curve = |row: &Drawn<'_>| {
            let number = row.run.number;
            let curve = curves.get(&number)?;
            let data = Data::Fixed(&curve.time_s, curve.values());
            let (name, key) = (format!("run {number}").into(), row.key().into());
            let (generation, gap) = (curve.generation, curve.gap_s());
            Some(PanelCurve { name, key, color: row.color, data, generation, gap })
        };
        let Some(channel) = drawn.first().map(Drawn::channel) else { return };
        let panel = Panel {
            name: channel.name.into(),
            unit: Unit::named(channel.unit),
            min_span: 1e-6,
            shown: true,
            curves: drawn.iter().filter_map(panel_curve).collect(),
            limits: Vec::new(),
        };
        let ends = curves.values().map(Curve::ends);
        let limits = ends.reduce(|all, one| [all[0].min(one[0]), all[1].max(one[1])]);
        stack.update(limits.unwrap_or([0.0, 1.0]));
        stack.drag_moves_curve = dragged.is_some();
        stack.sources = drawn.iter().map(|row| provenance(row.run, curves)).collect();
        ui.horizontal_wrapped(|ui| stack.tools_ui(ui, std::slice::from_ref(&panel)));
        let size = vec2(ui.available_width(), (ui.available_height() - below).max(LEAST_HEIGHT));
        let wishes = ui.allocate_ui(size, |ui| {
            ui.set_min_height(size.y);
            stack.show(ui, &[panel])
        });
        let shift_s = wishes.inner.shift;
        wishes.inner.send(commands);
        if let Some(number) = dragged.filter(|_| shift_s != 0.0) {
            *self.shifts_s.entry(number).or_default() += shift_s;
        }
    }

    fn rows_ui(&mut self, drawn: &[Drawn<'_>], ui: &mut Ui) {
        Grid::new("drawn rows").num_columns(9).spacing([14.0, 3.0]).show(ui, |ui| {
            for head in ["", "drag moves", "shift, s", "smallest", "largest", "mean", "std", "to, s"] {
                hint_ui(ui, head);
            }
            ui.end_row();
            for row in drawn {
                self.row_ui(row, ui);
                ui.end_row();
            }
        });
        ui.horizontal(|ui| {
            hint_ui(ui, "Dragging in the plot moves");
            let choices = [(true, "the view", "Drag to pan, scroll to zoom, double-click to show all")];
            let mut view = self.dragged.is_none();
            if choice_ui(ui, &mut view, &choices) {
                self.dragged = None;
            }
        });
    }

    fn row_ui(&mut self, row: &Drawn<'_>, ui: &mut Ui) {
        let number = row.run.number;
        ui.horizontal(|ui| {
            key(ui, row.color);
            ui.label(mono(format!("{number}")).strong());
            ui.label(&row.run.title);
        });
        let moved = self.dragged == Some(number);
        let choice =
            ui.selectable_label(moved, "this run").accessible_name(format!("drag moves run {number}"));
        if choice.on_hover_text("Dragging in the plot shifts this run in time").clicked() {
            self.dragged = (!moved).then_some(number);
        }
        let before = self.shifts_s.get(&number).copied().unwrap_or(0.0);
        let mut shift_s = before;
        number_ui(ui, &mut shift_s, &format!("shift of run {number}"), 64.0)
            .on_hover_text("Time shift of this run");
        if shift_s != before {
            self.shifts_s.insert(number, shift_s);
        }
        let (_, scale) = shown_unit(self.channel, ui);
        for value in self.curves.get(&number).map_or([f64::NAN; 4], |curve| curve.statistics) {
            ui.label(mono(shown(scale * value, 4)));
        }
        ui.label(mono(shown(row.series.time_s.last().copied().unwrap_or(f64::NAN), 4)));
    }
}

/// Smallest, largest, mean and standard deviation of what is finite.
fn statistics(values: &[f64]) -> [f64; 4] {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let count = finite().count() as f64;
    let mean = finite().sum::<f64>() / count;
    let square = finite().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    let none_is_nan = |value: f64| if value.is_finite() { value } else { f64::NAN };
    let smallest = none_is_nan(finite().fold(f64::INFINITY, f64::min));
    [smallest, none_is_nan(finite().fold(f64::NEG_INFINITY, f64::max)), mean, square.sqrt()]
}

fn named(channel: &super::Channel) -> Named {
    (channel.name, channel.unit)
}

/// The shown unit of a channel, and the factor from the core's unit to it.
fn shown_unit((_, unit): Named, ui: &Ui) -> (&'static str, f64) {
    Unit::named(unit).shown(UnitChoice::of(ui.ctx()))
}

fn label(channel: Named, ui: &Ui) -> String {
    match (channel.0, shown_unit(channel, ui).0) {
        (name, "") => name.to_owned(),
        (name, unit) => format!("{name} [{unit}]"),
    }
}

/// Names of all curves of the ticked rows, in their order.
fn channels(ledger: &Ledger, ticked: &BTreeSet<u64>) -> Vec<Named> {
    let mut names = Vec::new();
    let series = ticked.iter().filter_map(|number| ledger.row(*number)?.series.as_ref());
    for name in series.flat_map(|series| series.channels.iter().map(named)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Colour of a ticked row: the same here and in the table.
fn color(ui: &Ui, ticked: &BTreeSet<u64>, number: u64) -> Color32 {
    let colors = palette(ui.visuals());
    let [blue, orange] = colors.runs;
    let all = [blue, orange, colors.channels[1], colors.error, colors.reference, colors.channels[2]];
    let place = ticked.iter().position(|ticked| *ticked == number).unwrap_or(0);
    all[place % all.len()]
}

/// The colour of a row, for the table.
pub(super) fn key_ui(ui: &mut Ui, ticked: &BTreeSet<u64>, number: u64) {
    let color = color(ui, ticked, number);
    key(ui, color);
}

fn key(ui: &mut Ui, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 12.0), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.5, color));
}

/// Description of a row in exports.
fn provenance(run: &Run, curves: &BTreeMap<u64, Curve>) -> String {
    let shift_s = curves.get(&run.number).map_or(0.0, |curve| curve.shift_s);
    let shifted = if shift_s == 0.0 { String::new() } else { format!(", shifted by {shift_s} s") };
    run.provenance() + &shifted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_leave_out_what_is_no_number() {
        assert_eq!(statistics(&[1.0, f64::NAN, 3.0]), [1.0, 3.0, 2.0, 1.0]);
        assert!(statistics(&[]).iter().all(|value| value.is_nan()));
    }
}
