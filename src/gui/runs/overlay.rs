//! Ticked rows over each other, each shifted in time by hand, by an event or by correlation.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use egui::{Button, Color32, ComboBox, Grid, Sense, Stroke, Ui, vec2};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};
use flqr_core::record::{Signal, best_alignment, first_crossing_s};

use super::run::{Ledger, Run, Series};
use crate::job::{Job, Outcome, Waker};
use crate::plot::Axes;
use crate::theme::palette;
use crate::widgets::{choice_ui, hint_ui, mono, number_ui, section_ui, shown, warning_ui};

/// Why a row cannot be drawn.
pub(super) const NO_SERIES: &str = "This row has no curves in memory: it is compared by its values alone";
/// Points of a drawn curve, about.
const POINTS: usize = 2400;
/// Height of the table below the plot, of one row.
const ROW_HEIGHT: f32 = 24.0;

/// Number of a row and what to add to its times, s; none where it has no shape.
type Found = Vec<(u64, Option<f64>)>;

/// How the rows are drawn.
#[derive(Default)]
pub(super) struct Overlay {
    channel: String,
    shifts_s: BTreeMap<u64, f64>,
    /// The row that a drag moves; none: the view.
    dragged: Option<u64>,
    /// Level of the event, in the channel's unit.
    level: f64,
    job: Option<Job<(), Found>>,
    problem: Option<String>,
}

/// A row that is drawn.
struct Drawn<'a> {
    run: &'a Run,
    series: &'a Arc<Series>,
    channel: usize,
    color: Color32,
}

impl Drawn<'_> {
    fn signal(&self) -> Signal<'_> {
        Signal { time_s: &self.series.time_s, values: &self.series.channels[self.channel].values }
    }
}

impl Overlay {
    pub(super) fn shifts_s(&self) -> &BTreeMap<u64, f64> {
        &self.shifts_s
    }

    pub(super) fn ui(&mut self, ledger: &Ledger, ticked: &BTreeSet<u64>, ui: &mut Ui) {
        self.drain();
        let names = channels(ledger, ticked);
        if !names.contains(&self.channel) {
            self.channel = names.first().cloned().unwrap_or_default();
        }
        let drawn = self.drawn(ledger, ticked, ui);
        section_ui(ui, "Ticked runs", |ui| self.head_ui(&drawn, &names, ui));
        if drawn.is_empty() {
            let text = if ticked.is_empty() { "Tick rows to see them over each other." } else { NO_SERIES };
            hint_ui(ui, text);
            return;
        }
        if let Some(problem) = &self.problem {
            warning_ui(ui, problem);
        }
        let table = ROW_HEIGHT * (1 + drawn.len().min(5)) as f32;
        let height = (ui.available_height() - table - 12.0).max(80.0);
        self.plot_ui(&drawn, height, ui);
        egui::ScrollArea::vertical().id_salt("drawn").show(ui, |ui| self.rows_ui(&drawn, ui));
    }

    fn drawn<'a>(&self, ledger: &'a Ledger, ticked: &BTreeSet<u64>, ui: &Ui) -> Vec<Drawn<'a>> {
        let rows = ticked.iter().filter_map(|number| ledger.row(*number));
        rows.filter_map(|run| {
            let series = run.series.as_ref().filter(|series| !series.time_s.is_empty())?;
            let channel = series.channels.iter().position(|channel| label(channel) == self.channel)?;
            Some(Drawn { run, series, channel, color: color(ui, ticked, run.number) })
        })
        .collect()
    }

    /// From the right to the left.
    fn head_ui(&mut self, drawn: &[Drawn<'_>], names: &[String], ui: &mut Ui) {
        let several = drawn.len() > 1 && self.job.is_none();
        let reset = ui.add_enabled(!self.shifts_s.is_empty(), Button::new("No shift"));
        if reset.on_hover_text("Every run at its own times again").clicked() {
            self.shifts_s.clear();
        }
        let event = ui.add_enabled(several, Button::new("At an event"));
        if event
            .on_hover_text("Shift so that all first pass the level at the time at which the first row does")
            .clicked()
        {
            self.align_at_event(drawn);
        }
        number_ui(ui, &mut self.level, "event level", 46.0)
            .on_hover_text("Level of the event, in the unit of the curve");
        let correlation = ui.add_enabled(several, Button::new("By shape"));
        let help = "Shift so that each correlates most with the first row";
        if correlation.on_hover_text(help).clicked() {
            self.align_by_correlation(drawn, ui);
        }
        ui.label("align");
        ui.separator();
        let combo = ComboBox::from_id_salt("channel").selected_text(&self.channel).width(140.0);
        let combo = combo.show_ui(ui, |ui| {
            for name in names {
                ui.selectable_value(&mut self.channel, name.clone(), name);
            }
        });
        combo.response.accessible_name("curve to compare").on_hover_text("What is drawn of the ticked rows");
    }

    fn align_at_event(&mut self, drawn: &[Drawn<'_>]) {
        let times: Found =
            drawn.iter().map(|row| (row.run.number, first_crossing_s(row.signal(), self.level))).collect();
        let Some((first, Some(time_s))) = times.first().copied() else {
            self.problem = Some("The first row never passes this level: choose another one.".to_owned());
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
            let signal = |(_, series, channel): &(u64, Arc<Series>, usize)| (Arc::clone(series), *channel);
            let (fixed, fixed_channel) = signal(&rows[0]);
            let of = |series: &'_ Series, channel: usize| -> (Vec<f64>, Vec<f64>) {
                (series.time_s.clone(), series.channels[channel].values.clone())
            };
            let (fixed_s, fixed_values) = of(&fixed, fixed_channel);
            let mut found = vec![(rows[0].0, Some(start_s))];
            for row in &rows[1..] {
                let fixed = Signal { time_s: &fixed_s, values: &fixed_values };
                let moved = Signal { time_s: &row.1.time_s, values: &row.1.channels[row.2].values };
                let best = best_alignment(fixed, moved).map(|best| best.shift_s + start_s);
                found.push((row.0, best));
            }
            found
        };
        match Job::start("align-runs", &waker, work) {
            Ok(job) => self.job = Some(job),
            Err(error) => self.problem = Some(format!("No thread to align the runs: {error}.")),
        }
    }

    fn drain(&mut self) {
        let Some(job) = &mut self.job else { return };
        match job.poll().1 {
            Outcome::Running => return,
            Outcome::Done(found) => self.take(found),
            Outcome::Broken => self.problem = Some("Aligning failed: this is a defect of flqr.".to_owned()),
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
            self.problem = Some(format!("Run {rows} has nothing to align by and stays where it is."));
        }
    }

    fn plot_ui(&mut self, drawn: &[Drawn<'_>], height: f32, ui: &mut Ui) {
        let moves_view = self.dragged.is_none();
        let axes = Axes { x_label: Some("time [s]"), y_label: &self.channel, x_lines: 8.0, y_lines: 5.0 };
        let plot = Plot::new("run overlay")
            .height(height)
            .allow_drag([moves_view, false])
            .allow_zoom([true, false])
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false);
        let shown = axes.on(plot, ui.visuals()).show(ui, |plot_ui| {
            let bounds = plot_ui.plot_bounds();
            let visible = [bounds.min()[0], bounds.max()[0]];
            for row in drawn {
                let shift_s = self.shifts_s.get(&row.run.number).copied().unwrap_or(0.0);
                let points = thinned(row.signal(), shift_s, visible);
                let line = Line::new(format!("run {}", row.run.number), PlotPoints::Owned(points));
                plot_ui.line(line.color(row.color).width(1.6).allow_hover(false));
            }
            f64::from(plot_ui.pointer_coordinate_drag_delta().x)
        });
        if let Some(number) = self.dragged.filter(|_| shown.response.dragged() && shown.inner != 0.0) {
            *self.shifts_s.entry(number).or_default() += shown.inner;
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
            hint_ui(ui, "A drag in the plot moves");
            let choices = [(
                true,
                "the view",
                "Drag moves the visible time, the wheel zooms, a double click shows all",
            )];
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
        if choice.on_hover_text("A drag in the plot shifts this run in time").clicked() {
            self.dragged = (!moved).then_some(number);
        }
        let before = self.shifts_s.get(&number).copied().unwrap_or(0.0);
        let mut shift_s = before;
        number_ui(ui, &mut shift_s, &format!("shift of run {number}"), 64.0)
            .on_hover_text("Added to the times of this run");
        if shift_s != before {
            self.shifts_s.insert(number, shift_s);
        }
        for value in statistics(row.signal().values) {
            ui.label(mono(shown(value, 4)));
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

fn label(channel: &super::Channel) -> String {
    format!("{} [{}]", channel.name, channel.unit)
}

/// Names of all curves of the ticked rows, in their order.
fn channels(ledger: &Ledger, ticked: &BTreeSet<u64>) -> Vec<String> {
    let mut names = Vec::new();
    let series = ticked.iter().filter_map(|number| ledger.row(*number)?.series.as_ref());
    for name in series.flat_map(|series| series.channels.iter().map(label)) {
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

/// What is visible of a signal, with the smallest and largest value of each of its parts.
fn thinned(signal: Signal<'_>, shift_s: f64, visible: [f64; 2]) -> Vec<PlotPoint> {
    let time_s = signal.time_s;
    let all = [time_s.first(), time_s.last()].map(|time| time.copied().unwrap_or(0.0) + shift_s);
    // Before the first frame, and after a double click, the plot takes its range from the points.
    let inside = visible[0] < all[1] && visible[1] > all[0];
    let range = if inside {
        let from = time_s.partition_point(|time| time + shift_s < visible[0]).saturating_sub(1);
        let to = (time_s.partition_point(|time| time + shift_s <= visible[1]) + 1).min(time_s.len());
        from..to
    } else {
        0..time_s.len()
    };
    let part = range.len().div_ceil(POINTS / 2).max(1);
    let mut points = Vec::with_capacity(POINTS + 4);
    let mut add = |index: usize| {
        let (time, value) = (time_s[index] + shift_s, signal.values[index]);
        if time.is_finite() && value.is_finite() {
            points.push(PlotPoint::new(time, value));
        }
    };
    // The ends keep the range that a double click shows.
    add(0);
    for start in range.clone().step_by(part) {
        let indices = start..(start + part).min(range.end);
        let by_value = |a: &usize, b: &usize| signal.values[*a].total_cmp(&signal.values[*b]);
        let (Some(low), Some(high)) = (indices.clone().min_by(by_value), indices.max_by(by_value)) else {
            continue;
        };
        add(low.min(high));
        if low != high {
            add(low.max(high));
        }
    }
    add(time_s.len() - 1);
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_curve_keeps_its_peaks_and_its_ends() {
        let time_s: Vec<f64> = (0..60_000).map(|index| f64::from(index) * 1e-3).collect();
        let mut values = vec![0.0; 60_000];
        (values[12_345], values[44_444]) = (7.0, -3.0);
        values[20_000] = f64::NAN;
        let points = thinned(Signal { time_s: &time_s, values: &values }, 5.0, [0.0, 100.0]);
        assert!(points.len() < 2 * POINTS);
        let extreme = |pick: fn(f64, f64) -> f64| points.iter().map(|point| point.y).fold(0.0, pick);
        assert_eq!((extreme(f64::max), extreme(f64::min)), (7.0, -3.0));
        assert_eq!((points[0].x, points[points.len() - 1].x), (5.0, 64.999));
        assert!(points.windows(2).all(|pair| pair[0].x <= pair[1].x));
        let part = thinned(Signal { time_s: &time_s, values: &values }, 0.0, [12.0, 12.5]);
        assert!(part.iter().filter(|point| (12.0..=12.5).contains(&point.x)).count() >= 500);
    }

    #[test]
    fn statistics_leave_out_what_is_no_number() {
        assert_eq!(statistics(&[1.0, f64::NAN, 3.0]), [1.0, 3.0, 2.0, 1.0]);
        assert!(statistics(&[]).iter().all(|value| value.is_nan()));
    }
}
