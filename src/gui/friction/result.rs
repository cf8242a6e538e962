//! The result: parameters with intervals, warnings, and the way into the model.

use egui::{Grid, RichText, Ui};
use flqr_core::identify::{Estimate, FitReport, StopReason};
use flqr_core::model::PARAMETERS;
use flqr_core::record::Severity;

use super::fit::FitRun;
use super::fitted::Fitted;
use crate::command::{Command, Target};
use crate::context::ViewContext;
use crate::widgets::{hint_ui, mono, section_ui, shown, warning_ui};

pub(super) fn ui(context: &ViewContext<'_>, fit: &FitRun, ui: &mut Ui) {
    section_ui(ui, "Result", |_| {});
    let Some(report) = &fit.report else {
        hint_ui(ui, "The parameters with their 95 % intervals appear here after a fit.");
        return;
    };
    parameters_ui(report, fit.held, ui);
    ui.add_space(4.0);
    hint_ui(ui, summary(report));
    for warning in &report.warnings {
        warning_ui(ui, warning);
    }
    findings_ui(report, ui);
    use_ui(context, fit, ui);
}

fn summary(report: &FitReport) -> String {
    let error = format!(
        "error {} {} ({} % of the signal)",
        shown(report.rmse, 4),
        report.rmse_unit,
        shown(100.0 * report.relative_error, 3)
    );
    if report.pairs.is_empty() {
        return error;
    }
    format!(
        "{error}, {} pairs, {} iterations, {}",
        report.pairs.len(),
        report.iterations,
        stop_text(report.stop)
    )
}

/// Findings of the fit on the log, without duplicates of the data health.
fn findings_ui(report: &FitReport, ui: &mut Ui) {
    for (index, finding) in report.data_health.iter().enumerate() {
        if report.data_health[..index].contains(finding) || report.warnings.contains(&finding.problem) {
            continue;
        }
        let column = if finding.column.is_empty() { String::new() } else { format!("{}: ", finding.column) };
        let remedy =
            if finding.remedy.is_empty() { String::new() } else { format!(" → {}", finding.remedy) };
        let text = format!("{column}{}{remedy}", finding.problem);
        match finding.severity {
            Severity::Info => hint_ui(ui, text),
            Severity::Warning | Severity::Error => warning_ui(ui, text),
        };
    }
}

fn stop_text(stop: StopReason) -> &'static str {
    match stop {
        StopReason::Converged => "converged",
        StopReason::MaxIterations => "stopped at the last iteration",
        StopReason::ErrorThreshold => "stopped below the error threshold",
    }
}

/// Key, name, unit and estimate of each parameter, in the order of Eq. 28.
fn in_order(report: &FitReport) -> Vec<(&'static str, &'static str, &'static str, Estimate)> {
    let mut rows: Vec<_> = report
        .parameters
        .iter()
        .map(|(key, estimate)| {
            let place = PARAMETERS.iter().position(|parameter| parameter.key == *key);
            let (name, unit) = place.map_or((*key, ""), |at| (PARAMETERS[at].name, PARAMETERS[at].unit));
            (place.unwrap_or(PARAMETERS.len()), (*key, name, unit, *estimate))
        })
        .collect();
    rows.sort_by_key(|(place, _)| *place);
    rows.into_iter().map(|(_, row)| row).collect()
}

fn parameters_ui(report: &FitReport, held: bool, ui: &mut Ui) {
    let without_interval = if held { "held" } else { "none" };
    Grid::new("parameters").num_columns(3).striped(true).spacing([14.0, 5.0]).show(ui, |ui| {
        hint_ui(ui, "parameter");
        hint_ui(ui, "value");
        hint_ui(ui, "95 % interval");
        ui.end_row();
        for (key, name, unit, estimate) in in_order(report) {
            let text = if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
            ui.add(egui::Label::new(RichText::new(text).small()).extend()).on_hover_text(key);
            ui.label(mono(shown(estimate.value, 4)));
            let interval = estimate.ci95.map_or_else(
                || without_interval.to_owned(),
                |[low, high]| format!("{}\n{}", shown(low, 4), shown(high, 4)),
            );
            ui.label(mono(interval).small());
            ui.end_row();
        }
    });
}

fn use_ui(context: &ViewContext<'_>, fit: &FitRun, ui: &mut Ui) {
    section_ui(ui, "Use in the model", |_| {});
    let problem = fit.fitted().and_then(|fitted| fitted.check(&context.session.rig)).err();
    let linear = matches!(fit.fitted(), Ok(Fitted::Linear { .. }));
    let targets: &[(Target, &str)] = if context.session.robot().is_some() && !linear {
        &[(Target::Left, "Left motor"), (Target::Right, "Right motor"), (Target::Both, "Both motors")]
    } else {
        &[(Target::Both, "Axis")]
    };
    ui.horizontal(|ui| {
        for (target, name) in targets {
            let button = ui.add_enabled(problem.is_none(), egui::Button::new(*name));
            let help = "Use the fitted values in the model; the simulated robot uses them immediately";
            if button.on_hover_text(help).clicked() {
                context.commands.send(Command::UseFit(*target));
            }
        }
    });
    if let Some(problem) = problem {
        warning_ui(ui, problem);
    }
}
