//! A refinement as a row of the ledger.

use super::{Question, RefineTab};
use crate::runs::{Run, RunKind, RunsTab, Value};
use crate::widgets::shown;

impl RefineTab {
    /// Gives a refinement that has just ended its row.
    pub(crate) fn note_run(&mut self, ledger: &mut RunsTab) {
        if let Some(row) = self.finished() {
            self.row = Some(Run { number: ledger.note(row.clone()), ..row });
        }
    }

    fn finished(&mut self) -> Option<Run> {
        let refined = self.run.refined.as_ref().filter(|refined| self.noted != Some(refined.generation))?;
        self.noted = Some(refined.generation);
        let (made, found) = (&refined.made, &refined.answer);
        let name =
            |path: &std::path::Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let names: Vec<String> = made.inputs.iter().map(|input| name(&input.path)).collect();
        let mut row =
            Run::new(RunKind::Refinement, names.join(", "), Some(&made.model), refined.sources.clone())
                .with("refine.seed", Value::Number(made.settings.seed as f64))
                .with("refine.estimate", Value::Text(made.settings.estimate.clone()));
        let verdict = serde_json::json!(found.verdict);
        let mut result = verdict.as_str().unwrap_or_default().replace('_', " ");
        for effect in &found.effects {
            let (id, drop) = (effect.effect.id(), effect.error_drop_percent);
            result += &format!(", {id} −{} %", shown(drop, 2));
            row = row.with(&format!("result.{id}.error_drop_percent"), Value::Number(drop));
        }
        let command = made.command_line(Question::Refine, refined.model_path.as_deref());
        Some(Run { seed: Some(made.settings.seed), command: Some(command), result, ..row })
    }
}
