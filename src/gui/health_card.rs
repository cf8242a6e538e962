//! Data-health findings with their remedies.

use egui::{ProgressBar, RichText, Ui};
use flqr_core::record::{HealthFinding, Severity};

use crate::load::{LoadedLog, Loader};
use crate::theme::palette;
use crate::widgets::{error_ui, warning_ui};

/// Line problems that are shown one by one.
const SHOWN_PROBLEMS: usize = 3;

/// Progress of loading; empty while nothing is loaded.
pub(crate) fn progress_ui(loader: &Loader, ui: &mut Ui) {
    if !loader.is_running() {
        return;
    }
    let text = loader.progress.map_or_else(
        || "opening".to_owned(),
        |p| format!("{} rows, {:.1} of {:.1} MB", p.rows, p.bytes as f64 / 1e6, p.total_bytes as f64 / 1e6),
    );
    let share = loader.progress.map_or(0.0, |p| p.bytes as f32 / p.total_bytes.max(1) as f32);
    ui.add(ProgressBar::new(share).text(RichText::new(text).small()));
}

/// Problems of a loaded log, or their absence.
pub(crate) fn log_ui(loaded: &LoadedLog, ui: &mut Ui) {
    if let Err(problem) = &loaded.kind {
        error_ui(ui, problem);
    }
    let harmless = loaded.health.iter().all(|finding| finding.severity == Severity::Info);
    if harmless && loaded.kind.is_ok() && loaded.log.problem_count == 0 {
        let color = palette(ui.visuals()).good;
        ui.label(RichText::new("no problems found").small().color(color));
    }
    line_problems_ui(loaded, ui);
    findings_ui(&loaded.health, ui);
}

/// One line for each finding.
pub(crate) fn findings_ui<'a>(findings: impl IntoIterator<Item = &'a HealthFinding>, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    for finding in findings {
        let (mark, color) = match finding.severity {
            Severity::Info => ("note", colors.reference),
            Severity::Warning => ("warning", colors.warning),
            Severity::Error => ("error", colors.error),
        };
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(RichText::new(mark).small().strong().color(color));
            if !finding.column.is_empty() {
                ui.label(RichText::new(&finding.column).small().monospace());
            }
            let text = RichText::new(&finding.problem).small();
            ui.label(if finding.severity == Severity::Info { text } else { text.color(color) });
            if !finding.remedy.is_empty() {
                ui.label(RichText::new(format!("→ {}", finding.remedy)).small().weak());
            }
        });
    }
}

/// The first rows and cells that could not be used, where they are in the file.
fn line_problems_ui(loaded: &LoadedLog, ui: &mut Ui) {
    let log = &loaded.log;
    if log.problem_count == 0 {
        return;
    }
    let many = |count: usize| if count == 1 { "" } else { "s" };
    let (rows, problems) = (log.dropped_rows, log.problem_count);
    let count = format!("{rows} row{} skipped, {problems} problem{} in lines", many(rows), many(problems));
    warning_ui(ui, count);
    for problem in log.problems.iter().take(SHOWN_PROBLEMS) {
        ui.label(RichText::new(problem.to_string()).small().weak());
    }
}
