//! Errors before and after, on rows that took no part in the estimates.

use egui::{Grid, RichText, Ui};
use flqr_core::refine::{Channels, ClosedLoop, Errors, LoopRun, Prediction, Quantity, Refinement, Residual};

use super::strip::{StepState, Tone};
use crate::widgets::{hint_ui, mono, plain, section_ui, shown};

/// One row: what is measured, before, after, unit.
struct Row {
    name: String,
    values: [Option<f64>; 2],
    unit: &'static str,
}

impl Row {
    /// Change from the first value to the second, in percent of the first.
    fn change_percent(&self) -> Option<f64> {
        let [before, after] = [self.values[0]?, self.values[1]?];
        (before > 0.0).then(|| 100.0 * (after / before - 1.0))
    }
}

/// State of this step.
pub(super) fn state(found: Option<&Refinement>) -> StepState {
    let Some(found) = found else { return StepState::new("nothing yet", Tone::Open) };
    let [before, after] = [&found.before, &found.after].map(|errors| errors.rmse.main());
    if !(before.is_finite() && after.is_finite() && before > 0.0) {
        return StepState::new("no errors", Tone::Open);
    }
    let change = 100.0 * (after / before - 1.0);
    if found.effects.is_empty() {
        return StepState::new("as before", Tone::Plain);
    }
    let text = format!("{change:+.1} %").replace('-', "−");
    StepState::new(text, if change < 0.0 { Tone::Good } else { Tone::Warning })
}

/// Rows of one or two sets of errors.
fn rows(first: &Errors, second: Option<&Errors>) -> Vec<Row> {
    let channels = |what: &str, of: fn(&Errors) -> &Channels| -> Vec<Row> {
        let row = |(index, (channel, quantity)): (usize, &(&'static str, Quantity))| {
            let after = second.and_then(|second| of(second).0.get(index)).map(|(_, q)| q.value);
            Row {
                name: format!("{what}, {channel}"),
                values: [Some(quantity.value), after],
                unit: quantity.unit,
            }
        };
        of(first).0.iter().enumerate().map(row).collect()
    };
    let mut rows = channels("residual", |errors| &errors.rmse);
    rows.extend(channels("noise floor of the residual", |errors| &errors.noise_floor));
    rows.extend(channels("residual relative to the torque or force", |errors| &errors.nrmse));
    for (index, prediction) in first.prediction.iter().enumerate() {
        let shown_of = |own: &Prediction| own.informative.then_some(own.rmse.value);
        let after = second.and_then(|second| second.prediction.get(index)).and_then(shown_of);
        rows.push(Row {
            name: format!("{} after {} ms", prediction.variable, plain(1e3 * prediction.horizon_s, 3)),
            values: [shown_of(prediction), after],
            unit: prediction.rmse.unit,
        });
    }
    rows
}

/// Errors of both models.
pub(super) fn ui(found: &Refinement, ui: &mut Ui) {
    section_ui(ui, "On held-out rows", |_| {});
    table_ui("errors before and after", &rows(&found.before, Some(&found.after)), true, ui);
    hint_ui(
        ui,
        "The same rows and filters before and after; before: the declared model, its parameters estimated within their tolerances.",
    );
    if let Some(closed_loop) = &found.closed_loop {
        closed_loop_ui(closed_loop, ui);
    }
    if !found.parameters.is_empty() {
        section_ui(ui, "Declared parameters, estimated from the logs", |_| {});
        parameters_ui(found, ui);
    }
}

/// Name, unit and value of what is told of a run.
type Measure = (&'static str, &'static str, fn(&LoopRun) -> Option<f64>);

/// The refined model as the plant, under both controllers.
fn closed_loop_ui(closed_loop: &ClosedLoop, ui: &mut Ui) {
    section_ui(ui, "Closed loop, with the refined model as the plant", |_| {});
    let measures: [Measure; 5] = [
        ("displacement, std", "m", |run| Some(run.x_m.std)),
        ("displacement, peak to peak", "m", |run| Some(run.x_m.peak_to_peak)),
        ("pitch, std", "rad", |run| Some(run.pitch_rad.std)),
        ("limit cycle, amplitude", "m", |run| run.limit_cycle.map(|cycle| cycle.amplitude_m)),
        ("limit cycle, frequency", "Hz", |run| run.limit_cycle.map(|cycle| cycle.frequency_hz)),
    ];
    for pair in &closed_loop.scenarios {
        let fell = |run: &LoopRun| if run.fell { ", fell" } else { "" };
        let title = format!("{}: before{}, after{}", pair.scenario, fell(&pair.before), fell(&pair.after));
        ui.label(RichText::new(title).strong());
        let rows: Vec<Row> = measures
            .iter()
            .map(|(name, unit, of)| Row {
                name: (*name).to_owned(),
                values: [of(&pair.before), of(&pair.after)],
                unit,
            })
            .filter(|row| row.values.iter().any(Option::is_some))
            .collect();
        table_ui(&format!("closed loop {}", pair.scenario), &rows, true, ui);
    }
    hint_ui(ui, "Before: controller of the declared model; after: controller of the refined model.");
    for fed in &closed_loop.feedforward {
        let used = if fed.used { "with feedforward" } else { "without feedforward" };
        hint_ui(ui, format!("{}: {used}, {}", fed.effect.id, fed.reason));
    }
}

/// Errors of the nominal model.
pub(super) fn residual_ui(residual: &Residual, ui: &mut Ui) {
    table_ui("errors of the model", &rows(&residual.errors, None), false, ui);
    if residual.tests.is_empty() {
        return;
    }
    section_ui(ui, "What the residual depends on", |_| {});
    Grid::new("residual tests").num_columns(4).striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
        for title in ["test", "value", "threshold", "structure"] {
            hint_ui(ui, title);
        }
        ui.end_row();
        for test in &residual.tests {
            ui.label(&test.name);
            ui.label(mono(shown(test.value, 3)));
            ui.label(mono(shown(test.threshold, 3)));
            ui.label(if test.structure { "yes" } else { "no" });
            ui.end_row();
        }
    });
}

fn table_ui(id: &str, rows: &[Row], both: bool, ui: &mut Ui) {
    Grid::new(id).num_columns(if both { 5 } else { 3 }).striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
        hint_ui(ui, "");
        for title in if both { &["before", "after", "change", "unit"][..] } else { &["value", "unit"] } {
            hint_ui(ui, *title);
        }
        ui.end_row();
        for row in rows {
            ui.add(egui::Label::new(&row.name).extend());
            for value in &row.values[..if both { 2 } else { 1 }] {
                ui.label(mono(value.map_or_else(|| "–".to_owned(), |value| shown(value, 4))));
            }
            if both {
                let change = row.change_percent().filter(|change| change.is_finite());
                let text = change.map_or_else(String::new, |c| format!("{c:+.1} %").replace('-', "−"));
                ui.label(mono(text));
            }
            ui.label(if row.unit == "1" { "" } else { row.unit });
            ui.end_row();
        }
    });
}

fn parameters_ui(found: &Refinement, ui: &mut Ui) {
    Grid::new("corrected parameters").num_columns(5).striped(true).spacing([16.0, 3.0]).show(ui, |ui| {
        for title in ["number", "declared", "estimated", "95 % interval"] {
            hint_ui(ui, title);
        }
        ui.end_row();
        for parameter in &found.parameters {
            ui.add(egui::Label::new(RichText::new(parameter.key).monospace()).extend());
            ui.label(mono(shown(parameter.declared, 5)));
            ui.label(mono(shown(parameter.value, 5)));
            let interval = parameter.ci95.map_or_else(
                || "–".to_owned(),
                |[low, high]| format!("{} … {}", shown(low, 4), shown(high, 4)),
            );
            ui.add(egui::Label::new(mono(interval)).extend());
            ui.end_row();
        }
    });
}
