//! Whether the logs can answer.

use egui::Ui;
use flqr_core::record::{HealthFinding, Severity};

use super::run::Run;
use super::sources::Sources;
use super::strip::{StepState, Tone};
use crate::health_card::{findings_ui, log_ui};
use crate::widgets::{empty_page_ui, error_ui, section_ui};

/// Findings of the last result in addition to those of loading.
fn of_answer<'a>(run: &'a Run, sources: &Sources) -> Vec<&'a HealthFinding> {
    let findings = match (&run.refined, &run.residual) {
        (Some(refined), Some(residual)) if residual.generation > refined.generation => {
            &residual.answer.data_health
        }
        (Some(refined), _) => &refined.answer.data_health,
        (None, Some(residual)) => &residual.answer.data_health,
        (None, None) => return Vec::new(),
    };
    let known =
        |finding: &&HealthFinding| !sources.loaded().any(|(_, loaded)| loaded.health.contains(finding));
    findings.iter().filter(known).collect()
}

/// State of this step.
pub(super) fn state(run: &Run, sources: &Sources) -> StepState {
    if sources.list.is_empty() {
        return StepState::new("no log yet", Tone::Open);
    }
    if sources.is_loading() {
        return StepState::new("loading", Tone::Busy);
    }
    let of_answer = of_answer(run, sources);
    let findings = || {
        let of_logs = sources.loaded().flat_map(|(_, loaded)| &loaded.health);
        of_logs.chain(of_answer.iter().copied())
    };
    let count = |severity| findings().filter(|finding| finding.severity == severity).count();
    let failed = sources.list.iter().filter(|source| source.loader.problem.is_some()).count();
    let unknown = sources.loaded().filter(|(_, loaded)| loaded.kind.is_err()).count();
    let damaged = sources.loaded().filter(|(_, loaded)| loaded.log.problem_count > 0).count();
    let errors = count(Severity::Error) + failed + unknown;
    let warnings = count(Severity::Warning) + damaged;
    let counted = |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
    match (errors, warnings) {
        (0, 0) => StepState::new("no problems", Tone::Good),
        (0, _) => StepState::new(counted(warnings, "warning"), Tone::Warning),
        (_, 0) => StepState::new(counted(errors, "error"), Tone::Error),
        _ => StepState::new(
            format!("{}, {}", counted(errors, "error"), counted(warnings, "warning")),
            Tone::Error,
        ),
    }
}

pub(super) fn ui(run: &Run, sources: &Sources, ui: &mut Ui) {
    if sources.list.is_empty() {
        let hint = "Add logs of the machine that the open model describes. The search identifies missing effects and compares the errors before and after.";
        return empty_page_ui(ui, "No log yet.", hint, |_| {});
    }
    let of_answer = of_answer(run, sources);
    if !of_answer.is_empty() {
        section_ui(ui, "Data health of the search", |_| {});
        findings_ui(of_answer, ui);
    }
    for source in &sources.list {
        let name = source.path.file_name().unwrap_or(source.path.as_os_str()).to_string_lossy();
        section_ui(ui, &name, |_| {});
        if let Some(problem) = &source.loader.problem {
            error_ui(ui, problem);
        }
        let Some(loaded) = source.loader.log() else { continue };
        log_ui(loaded, ui);
    }
}
