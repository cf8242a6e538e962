//! Range, mean and standard deviation of both runs and the factor between them, as in the paper's Tables 5 to 7.

use egui::{Grid, Response, RichText, Ui};
use flqr_core::simulate::{StepResponse, Summary};

use super::run::Variant;
use super::runs::Comparison;
use crate::plot::{Marks, Unit, UnitChoice, degrees};
use crate::quantity::{MOTORS, Quantity, to_scale};
use crate::theme::palette;
use crate::widgets::{choice_ui, hint_ui, mono, number_ui, section_ui, shown};

/// Which samples count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Choice {
    /// Those that the command counts: after 15 s, in the air all.
    #[default]
    Usual,
    /// Range shown in the plots.
    Visible,
    /// From one time to another, s.
    Chosen([f64; 2]),
}

/// Statistics of both runs over one range, kept until the range or the runs change.
#[derive(Default)]
pub(super) struct StatisticsTable {
    pub(super) choice: Choice,
    key: Option<(u64, [u64; 2])>,
    found: [Option<Vec<Summary>>; 2],
}

impl StatisticsTable {
    /// The range that counts, s.
    pub(super) fn range(&self, comparison: &Comparison, visible: [f64; 2]) -> [f64; 2] {
        let end = comparison.end_s();
        match self.choice {
            Choice::Usual => [comparison.statistics_from_s(), end],
            Choice::Visible => visible.map(|time| time.clamp(0.0, end)),
            Choice::Chosen(range) => range,
        }
    }

    /// Statistics of both runs over `range`, one for each signal.
    pub(super) fn statistics(
        &mut self,
        comparison: &Comparison,
        range: [f64; 2],
    ) -> &[Option<Vec<Summary>>; 2] {
        let key = Some((comparison.generation, range.map(f64::to_bits)));
        if self.key != key {
            self.key = key;
            self.found = comparison.statistics_between(range);
        }
        &self.found
    }

    pub(super) fn ui(&mut self, ui: &mut Ui, comparison: &Comparison, marks: &Marks) {
        section_ui(ui, "Statistics", |_| {});
        self.choice_ui(ui, comparison, marks);
        let statistics = self.statistics(comparison, marks.range);
        if statistics.iter().all(Option::is_none) {
            hint_ui(ui, "No sample in this range.");
        }
        let grid = Grid::new("statistics").num_columns(4).striped(true).min_row_height(15.0);
        grid.spacing([13.0, 2.0]).show(ui, |ui| {
            head_ui(ui, comparison);
            verdict_ui(ui, comparison);
            if statistics.iter().all(Option::is_none) {
                return;
            }
            for (index, signal) in comparison.signals(degrees(ui.ctx())).iter().enumerate() {
                let pair = [0, 1].map(|run: usize| statistics[run].as_ref().map(|found| found[index]));
                rows_ui(ui, &signal.quantity, pair);
            }
        });
    }

    fn choice_ui(&mut self, ui: &mut Ui, comparison: &Comparison, marks: &Marks) {
        ui.horizontal(|ui| {
            let mut choice = match self.choice {
                Choice::Chosen(_) => Choice::Chosen(marks.range),
                other => other,
            };
            let from = comparison.statistics_from_s();
            let usual = if from > 0.0 { format!("after {from} s") } else { "whole run".to_owned() };
            ui.scope(|ui| {
                let choices = [
                    (Choice::Usual, &*usual, "Same range as the command line and the paper's tables"),
                    (Choice::Visible, "visible", "Range shown in the plots"),
                    (
                        Choice::Chosen(marks.range),
                        "chosen",
                        "Start and end; also set by dragging with Shift on a plot",
                    ),
                ];
                if choice_ui(ui, &mut choice, &choices) {
                    self.choice = choice;
                }
            });
            let [mut from, mut to] = marks.range;
            number_ui(ui, &mut from, "statistics from", 44.0).on_hover_text("Start of the range, s");
            ui.label("to");
            number_ui(ui, &mut to, "statistics to", 44.0).on_hover_text("End of the range, s");
            ui.label("s");
            if [from, to] != marks.range {
                self.choice = Choice::Chosen([from.min(to), to.max(from)]);
            }
        });
    }
}

/// Step responses of the motors, as in Figures 6 and 7 of the paper.
pub(super) fn tracking_ui(ui: &mut Ui, comparison: &Comparison) {
    let responses = [0, 1].map(|run: usize| comparison.runs[run].as_ref().ok()?.tracking());
    let motors = responses.iter().flatten().map(|motors| motors.len()).max().unwrap_or(0);
    if motors == 0 {
        return;
    }
    section_ui(ui, "Step of the target", |_| {});
    let grid = Grid::new("tracking").num_columns(4).striped(true).min_row_height(15.0);
    grid.spacing([13.0, 2.0]).show(ui, |ui| {
        head_ui(ui, comparison);
        for (motor, side) in MOTORS.into_iter().enumerate().take(motors) {
            let name = if motors == 1 { "shaft".to_owned() } else { format!("{side} motor") };
            ui.label(RichText::new(name).small().strong());
            ui.end_row();
            for (name, unit, value) in TRACKING {
                let (unit, scale) = unit.shown(UnitChoice::of(ui.ctx()));
                let pair = responses.map(|motors| value(motors?.get(motor)?));
                let factor = pair[0].zip(pair[1]).and_then(|(plain, compensated)| {
                    (compensated != 0.0).then(|| (plain / compensated).abs())
                });
                let text = |value: Option<f64>| {
                    Some(value.map_or_else(|| "never".to_owned(), |v| shown(scale * v, 3)))
                };
                row_ui(ui, &format!("{name} [{unit}]"), pair.map(text), factor);
            }
        }
    });
}

type Measure = (&'static str, Unit, fn(&StepResponse) -> Option<f64>);

const TRACKING: [Measure; 3] = [
    ("rise time", Unit::Plain("s"), |response| response.rise_time_s),
    ("overshoot", Unit::AngularSpeed, |response| Some(response.overshoot_rad_s)),
    ("steady error", Unit::AngularSpeed, |response| Some(response.steady_error_rad_s)),
];

fn head_ui(ui: &mut Ui, comparison: &Comparison) {
    let colors = palette(ui.visuals()).runs;
    ui.label("");
    for variant in Variant::ALL {
        let title = variant.title(comparison.settings.scenario);
        ui.label(RichText::new(title).small().strong().color(colors[variant as usize]));
    }
    hint_ui(ui, "factor")
        .on_hover_text("Ratio of the first run to the second; above 1, the second is better");
    ui.end_row();
}

/// Returns whether each run settled, on the ground; said of the whole run, whatever the range.
fn verdict_ui(ui: &mut Ui, comparison: &Comparison) {
    let verdicts = [0, 1].map(|run: usize| {
        let run = comparison.runs[run].as_ref().ok()?;
        Some(match (run.settled()?, run.fell()?) {
            (true, _) => "yes",
            (false, false) => "no",
            (false, true) => "no, fell",
        })
    });
    if verdicts.iter().all(Option::is_none) {
        return;
    }
    row_ui(ui, "settled", verdicts.map(|verdict| verdict.map(str::to_owned)), None)
        .on_hover_text("Settled: peak to peak of x below 0.05 m over the last 10 s of the run");
}

fn rows_ui(ui: &mut Ui, quantity: &Quantity, pair: [Option<Summary>; 2]) {
    let scale = quantity.scale;
    // The smaller run has three digits.
    let finest = |value: fn(&Summary) -> f64| {
        let values = pair.iter().flatten().map(|s| value(s).abs() * scale);
        values.filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min)
    };
    let (span, std) = (finest(|s| s.max - s.min), finest(|s| s.std));
    let range = |s: Summary| format!("{} … {}", to_scale(s.min * scale, span), to_scale(s.max * scale, span));
    ui.label(RichText::new(quantity.label()).small().strong());
    ui.end_row();
    row_ui(ui, "range", pair.map(|s| s.map(range)), factor(pair, |s| s.max - s.min));
    row_ui(ui, "mean", pair.map(|s| s.map(|s| to_scale(s.mean * scale, std))), None);
    row_ui(ui, "std", pair.map(|s| s.map(|s| to_scale(s.std * scale, std))), factor(pair, |s| s.std));
}

fn row_ui(ui: &mut Ui, name: &str, values: [Option<String>; 2], factor: Option<f64>) -> Response {
    let name = ui.add(egui::Label::new(RichText::new(name).small().weak()).extend());
    for value in values {
        ui.label(mono(value.unwrap_or_else(|| "–".to_owned())));
    }
    ui.label(mono(factor.map(factor_text).unwrap_or_default()));
    ui.end_row();
    name
}

/// Ratio of a value in the first run to the second.
pub(super) fn factor(pair: [Option<Summary>; 2], value: fn(&Summary) -> f64) -> Option<f64> {
    let [plain, compensated] = [pair[0]?, pair[1]?].map(|summary| value(&summary));
    (compensated > 0.0).then_some(plain / compensated)
}

/// A factor with three digits.
fn factor_text(factor: f64) -> String {
    if factor >= 100.0 { format!("{factor:.0}") } else { to_scale(factor, factor) }
}
